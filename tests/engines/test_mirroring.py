"""What mirrors need to know: what lies below them, where they are met, and blurs; against brute force."""

import numpy as np
import pytest

from truth_scenes import LENSES, cube, lens, orbit_camera, placed, random_soup
from viewsphere.engines.raster.reflections.mirroring import blurred, looked_at, lying
from viewsphere.geometry.camera import project
from viewsphere.truth.raster.visibility import rasterize


def raised(z):
    pose = np.eye(4)
    pose[2, 3] = z
    return pose


@pytest.mark.parametrize("ground", [False, True])
def test_what_lies_below_a_height_is_all_whose_corners_do(ground):
    rng = np.random.default_rng(4)
    soups = [random_soup(rng, 60), random_soup(rng, 60), cube(), cube()]
    geometry = placed(*soups, moves=[raised(z) for z in (0.0, 0.7, -4.0, 4.0)], ground=ground)
    for height in (-30.0, -1.0, 0.0, 0.4, 4.2, 30.0):
        found = lying(geometry, height)
        assert np.array_equal(found, (geometry.vertices[geometry.triangles][..., 2] < height).all(axis=1))
    starts = geometry.triangle_start
    found = lying(geometry, 0.4)
    assert 0 < found[: starts[1]].sum() < starts[1]
    assert found[starts[2] : starts[3]].all() and not found[starts[3] : starts[4]].any()


@pytest.mark.parametrize("name", LENSES)
def test_places_are_seen_in_their_pixels_at_their_depths(name):
    geometry = placed(cube(), ground=True)
    camera = orbit_camera(lens(64, 48, 1.2, LENSES[name], cx=30, cy=20, skew=1.5), 0.4, 0.5, 3.0)
    seen = rasterize(geometry, camera)
    at = np.flatnonzero(seen.triangle.reshape(-1) >= 0)
    cosine, place = looked_at(camera, seen, at)
    assert len(at) > 300
    pixels, in_front = project(camera.intrinsics, place @ camera.R.T + camera.t)
    assert in_front.all()
    np.testing.assert_allclose(pixels, np.stack([at % 64 + 0.5, at // 64 + 0.5], axis=1), atol=1e-5)
    ground = seen.triangle.reshape(-1)[at] >= geometry.triangle_start[-1]
    assert ground.any() and not ground.all()
    np.testing.assert_allclose(place[ground, 2], geometry.ground_z, atol=1e-5)
    away = camera.center - place
    np.testing.assert_allclose(cosine, np.clip(away[:, 2] / np.linalg.norm(away, axis=1), 0, 1), atol=1e-9)


@pytest.mark.parametrize("reach", [(1, 1), (4, 2), (40, 3)])
def test_a_blur_is_two_boxes_over_what_is_known(reach):
    rng = np.random.default_rng(2)
    camera = orbit_camera(lens(30, 24))
    at = np.flatnonzero(rng.uniform(size=(24, 30)).reshape(-1) < 0.6)
    at = at[(at // 30 > 2) & (at // 30 < 20)]
    image = rng.uniform(size=(len(at), 3)).astype(np.float32)
    known = np.zeros((24, 30, 4))
    known.reshape(-1, 4)[at] = np.column_stack([image, np.ones(len(at))])
    y, x = np.arange(24), np.arange(30)
    down, across = (np.abs(k[:, None] - k) <= r for k, r in ((y, reach[0]), (x, reach[1])))
    inside = (y >= at.min() // 30) & (y <= at.max() // 30)  # the second box begins from rows that have anything
    for _ in range(2):
        known = np.einsum("ij,kl,jlc->ikc", down.astype(float), across.astype(float), known) * inside[:, None, None]
    sums = known.reshape(-1, 4)[at]
    np.testing.assert_allclose(blurred(image, at, camera, reach), sums[:, :3] / sums[:, 3:], rtol=1e-4)
