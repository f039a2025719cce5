"""The border between targets and background."""

from __future__ import annotations

import numpy as np
import pytest

from viewsphere.model.scene import Smoother
from viewsphere.rendering.harmonic import harmonic
from viewsphere.rendering.smoother import smooth_border
from viewsphere.rendering.spread import box, gaussian, spread_both_ways

H, W = 90, 120
Y, X = np.mgrid[:H, :W]
DISC = (X - 55) ** 2 + (Y - 45) ** 2 < 25**2


def pasted(inside, outside, mask=DISC) -> np.ndarray:
    """A picture with one colour, or one field, on each side of a mask."""
    inside, outside = np.broadcast_to(inside, (H, W)), np.broadcast_to(outside, (H, W))
    return np.where(mask, inside, outside)[..., None].repeat(3, axis=2).astype(np.float32)


def kernels_reach(mask, pixels) -> np.ndarray:
    near = spread_both_ways(mask[..., None].astype(np.float32), np.ones(2 * pixels + 1, np.float32))[..., 0]
    return (near > 0) & (near < (2 * pixels + 1) ** 2)


def test_profiles_are_normalised_and_as_wide_as_said():
    for sigma in (1.0, 1.5, 7.0):
        weights = gaussian(sigma).astype(float)
        at = np.arange(len(weights)) - len(weights) // 2
        assert np.isclose(weights.sum(), 1, atol=1e-6)
        assert np.isclose((weights * at**2).sum(), sigma**2 + 1 / 12, rtol=0.02)
    assert np.allclose(box(1.5), np.array([0.5, 1, 1, 1, 0.5]) / 4)
    assert np.allclose(box(2), np.ones(5) / 5)


def test_none_and_empty_masks_change_nothing():
    picture = np.random.default_rng(0).random((H, W, 3), np.float32)
    assert smooth_border(picture, DISC, Smoother()) is picture
    for mask in (np.zeros_like(DISC), np.ones_like(DISC)):
        assert np.array_equal(smooth_border(picture, mask, Smoother(kind="poisson")), picture)


@pytest.mark.parametrize("kind", ["box", "gaussian"])
def test_the_border_becomes_the_blurred_mask_and_the_rest_stays(kind):
    picture = pasted(0.9, 0.1)
    out = smooth_border(picture, DISC, Smoother(kind=kind, size=2))
    profile = {"box": box, "gaussian": gaussian}[kind](2)
    opacity = spread_both_ways(DISC[..., None].astype(np.float32), profile)
    assert np.allclose(out, 0.1 + 0.8 * opacity, atol=1e-5)
    far = ~kernels_reach(DISC, len(profile) // 2)
    assert np.array_equal(out[far], picture[far])


@pytest.mark.parametrize("kind", ["box", "gaussian"])
def test_mixed_border_pixels_leave_no_fringe(kind):
    """White over black with a border pixel of any other colour: nothing of it is left."""
    picture = pasted(0.8, 0.2)
    rim = kernels_reach(DISC, 1)
    picture[rim] = (0.0, 1.0, 0.0)
    out = smooth_border(picture, DISC, Smoother(kind=kind, size=3))
    assert np.ptp(out, axis=2).max() < 1e-3
    assert out.min() > 0.2 - 1e-3
    assert out.max() < 0.8 + 1e-3


def test_a_wire_of_one_pixel_keeps_its_colour():
    wire = X == 40
    out = smooth_border(pasted(1.0, 0.0, wire), wire, Smoother(kind="box", size=1))
    assert np.allclose(out[:, 39:42], 1 / 3, atol=1e-3)


def test_transparent_pictures_melt_into_nothing():
    picture = np.zeros((H, W, 4), np.float32)
    picture[DISC] = (0.5, 0.25, 0.1, 1.0)
    out = smooth_border(picture, DISC, Smoother(kind="gaussian", size=2))
    soft = (out[..., 3] > 0.05) & (out[..., 3] < 0.95)
    assert soft.sum() > 200
    assert np.allclose(out[soft][:, :3] / out[soft][:, 3:], [0.5, 0.25, 0.1], atol=1e-3)
    assert smooth_border(picture, DISC, Smoother(kind="poisson")) is picture


@pytest.mark.slow
def test_poisson_takes_a_constant_off():
    """An object that is its background plus a constant (of the square roots) becomes its background."""
    behind = 0.3 + 0.3 * X / W + 0.1 * Y / H
    out = smooth_border(pasted((behind + 0.15) ** 2, behind**2), DISC, Smoother(kind="poisson"))
    assert np.abs(np.sqrt(out[..., 0]) - behind).max() < 0.01


def test_poisson_gives_a_plain_object_its_backgrounds_gradient():
    behind = 0.3 + 0.4 * X / W
    out = smooth_border(pasted(0.9, behind**2), DISC, Smoother(kind="poisson"))
    assert np.abs(np.sqrt(out[..., 0]) - behind).max() < 0.012


def test_poisson_keeps_the_objects_gradients_and_the_picture_around():
    texture = 0.5 + 0.1 * np.sin(X / 4) * np.sin(Y / 5)
    picture = pasted(texture**2, 0.09)
    out = smooth_border(picture, DISC, Smoother(kind="poisson"))
    inner = (X - 55) ** 2 + (Y - 45) ** 2 < 15**2
    change = np.sqrt(out[..., 0]) - np.sqrt(picture[..., 0])
    laplacian = 4 * change[1:-1, 1:-1] - change[:-2, 1:-1] - change[2:, 1:-1] - change[1:-1, :-2] - change[1:-1, 2:]
    assert np.abs(laplacian[inner[1:-1, 1:-1]]).max() < 2e-3
    assert np.array_equal(out[:15], picture[:15])


def test_poisson_is_stable_where_an_object_leaves_the_picture():
    corner = (X < 60) & (Y < 50)
    out = smooth_border(pasted(0.8, 0.2, corner), corner, Smoother(kind="poisson"))
    assert np.allclose(out, 0.2, atol=0.01)


def test_harmonic_against_a_direct_solution():
    scipy_sparse = pytest.importorskip("scipy.sparse")
    from scipy.sparse.linalg import spsolve

    free = DISC & ~((X - 50) ** 2 + (Y - 40) ** 2 < 6**2)
    fixed = ~free & (np.roll(free, 1, 0) | np.roll(free, -1, 0) | np.roll(free, 1, 1) | np.roll(free, -1, 1))
    values = np.random.default_rng(2).random((H, W, 1)).astype(np.float32)
    number = np.cumsum(free).reshape(H, W) - 1
    rows, columns, right = [], [], np.zeros(free.sum())
    for y, x in np.argwhere(free):
        for v, u in ((y - 1, x), (y + 1, x), (y, x - 1), (y, x + 1)):
            if free[v, u]:
                rows.append(number[y, x])
                columns.append(number[v, u])
            else:
                right[number[y, x]] += values[v, u, 0]
    n = len(right)
    matrix = 4 * scipy_sparse.identity(n) - scipy_sparse.coo_matrix((np.ones(len(rows)), (rows, columns)), (n, n))
    expected = spsolve(matrix.tocsc(), right)
    assert np.abs(harmonic(values, free, fixed)[free][:, 0] - expected).max() < 0.004


def test_the_same_twice():
    picture = np.random.default_rng(1).random((H, W, 3), np.float32)
    for kind in ("box", "gaussian", "poisson"):
        smoother = Smoother(kind=kind, size=1.7)
        assert np.array_equal(smooth_border(picture, DISC, smoother), smooth_border(picture, DISC, smoother))
