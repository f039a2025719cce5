"""The default floor: a formula whose mean is the ground's colour, filtered, periodic, and the same as its picture."""

import numpy as np
import pytest

from viewsphere.codecs.srgb import linear
from viewsphere.engines.shared.blender.requests import TEXELS, laid_with_slabs
from viewsphere.model.scene import Ground
from viewsphere.rendering.ground.kernels_slabs import JOINT, shades
from viewsphere.rendering.ground.material import PERIOD, SLABS, ground_frame, ground_material


def tones(x, y, pixel):
    x, y = (np.ascontiguousarray(v, np.float32) for v in np.broadcast_arrays(x, y))
    out = np.empty(x.size, np.float32)
    shades(x.reshape(-1), y.reshape(-1), np.float32(pixel), out)
    return out.reshape(x.shape)


def grid(cells, slabs=PERIOD):
    at = (np.arange(cells) + 0.5) * (slabs / cells)
    return at, at[:, None]


@pytest.mark.parametrize("pixel", [0.0, 0.004, 0.03, 0.2, 1.0, 30.0])
def test_the_mean_is_the_grounds_colour_at_any_distance(pixel):
    assert tones(*grid(2048), pixel).mean() == pytest.approx(1, abs=0.004)


def test_what_a_pixel_covers_is_averaged():
    """The farther away, the less is seen of each wavelength, until a far floor has one colour, to a grey level."""
    deviations = [tones(*grid(1024), pixel).std() for pixel in (0.004, 0.03, 0.2, 1.0, 30.0)]
    assert deviations == sorted(deviations, reverse=True)
    assert deviations[0] > 0.05 and deviations[-1] < 4e-3


def test_it_repeats_and_has_no_seams():
    x, y = grid(512)
    assert np.allclose(tones(x + PERIOD, y - 3 * PERIOD, 0.01), tones(x, y, 0.01), atol=2e-3)
    fine = tones(np.linspace(-1, 1, 1 << 16), np.float32(0.3), 0.01)
    assert np.abs(np.diff(fine)).max() < 0.01


def test_joints_lie_on_the_slabs_edges():
    x, y = grid(2048, 1)
    rows = tones(x, y, 0.0).mean(axis=1)
    inside = (y[:, 0] > 2 * JOINT) & (y[:, 0] < 1 - 2 * JOINT)
    assert rows[[0, -1]].max() < 0.75
    assert rows[inside].min() > 0.85


@pytest.mark.parametrize("place", [0.0, 1e7, -1e12, np.inf, np.nan])
def test_it_is_a_number_everywhere(place):
    assert np.isfinite(tones(np.full(8, place), np.zeros(8), 1e9)).all()


def test_the_picture_shows_the_formula():
    ground = Ground()
    material, (picture,) = laid_with_slabs(ground_material(ground)[0])
    shown = linear(picture.pixels[..., :3] / 255) * material.base_color[:3]
    expected = tones(*grid(TEXELS), PERIOD / TEXELS)[..., None] * linear(ground.color)
    assert np.abs(shown - expected).max() < 0.004
    assert picture.pixels[..., :3].max() < 255  # nothing is cut off


def test_a_floor_stays_where_it_is_when_the_origin_moves():
    ground = Ground()
    material, _ = ground_material(ground)
    for x, y in ((0.0, 0.0), (7.3, -2.9), (-1234.5, 88.8)):
        per, u, v = ground_frame(ground, material, (x, y, 0), 1.0)
        place = np.array([[0.4, 1.7], [-3.2, 0.9], [2.0, 2.0], [0.1, -0.3]] * 2)
        here = tones(2 * (u + per * (place[:, 0] - x)), 2 * (v - per * (place[:, 1] - y)), 0.01)
        assert np.allclose(here, tones(place[:, 0] + 0.5, 0.5 - place[:, 1], 0.01), atol=1e-2)


def test_the_origin_is_in_the_middle_of_a_slab():
    ground = Ground()
    _, u, v = ground_frame(ground, ground_material(ground)[0], (0, 0, 0), 1.0)
    assert (SLABS * u % 1, SLABS * v % 1) == (0.5, 0.5)


@pytest.mark.parametrize("given", [{"image": "a.png"}, {"normal_image": "a.png"}, {"catcher": True}, {"pattern": "plain"}])
def test_other_grounds_have_no_slabs(given):
    assert not Ground(**given).has_slabs
    assert Ground().has_slabs
