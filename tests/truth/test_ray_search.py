"""The searches along rays lose no hit, at centres and at samples: small, large, crowded and hidden triangles, at the borders of
cube faces, and through walls.
"""

from __future__ import annotations

import numpy as np
import pytest

from proven import equal
from truth_scenes import cast, cube, mesh_of, orbit_camera, placed, random_soup
from viewsphere.engines.raster.antialiasing.samples import OFFSETS, edge_samples
from viewsphere.model.sensors.camera import Camera
from viewsphere.recipe.world.scene import CameraEntry
from viewsphere.truth.raster.visibility import rasterize

LENSES = {
    "equirectangular": {"projection": "equirectangular"},
    "cylindrical": {"projection": "cylindrical", "span": {"horizontal": 200}},
    "fisheye": {"focal_px": 20, "distortion": {"model": "fisheye", "coefficients": [0.01, 0.0, 0.0, 0.0]}},
    "wide brown_conrady": {"fov_deg": 120, "distortion": {"model": "brown_conrady", "coefficients": [0.02, 0, 0, 0]}},
}
SIZES = {"equirectangular": [(2, 1), (6, 3), (96, 48)], "cylindrical": [(3, 2), (70, 33)]}
PLAIN_SIZES = [(1, 1), (3, 9), (67, 45)]


def crowd(rng):
    """Walls and many small triangles behind and in front of them, all around the origin."""
    far, near = random_soup(rng, 300, spread=1.5, size=0.05), random_soup(rng, 20, spread=0.8, size=0.5)
    towards = np.array(
        [[1, 1, 0], [1, 0, 1], [0, 1, 1], [1, 1, 1], [-1, 1, 0], [-1, 0, -1]], float
    )  # edges of the cube's faces
    along = towards[rng.integers(len(towards), size=200)] * rng.uniform(0.5, 3, (200, 1))
    corners = along[:, None] + rng.normal(size=(200, 3, 3)) * 0.03
    return placed(far, near, mesh_of(corners.reshape(-1, 3), np.arange(600)))


@pytest.mark.parametrize("name", LENSES)
@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_brute_force_sees_the_same(name, turn):
    rng = np.random.default_rng(int(10 * turn) + len(name))
    geometry, compared = crowd(rng), 0
    for size in SIZES.get(name, PLAIN_SIZES):
        camera = orbit_camera(CameraEntry.model_validate({**LENSES[name], "size": size}).intrinsics, turn, 0.3 * turn, 0.01)
        seen, (which, _, margin, gap) = rasterize(geometry, camera), cast(geometry, camera)
        certain = (margin > 1e-9) & (gap > 1e-6)
        equal("triangles", "float64 brute force", seen.triangle[certain], which[certain])
        compared += int((which[certain] >= 0).sum())
    assert compared > 200, "few rays meet anything"


def needles(rng):
    """A closed wall around the origin, and needles through it, that lead away from the origin: in front of it and behind."""
    towards = rng.normal(size=(3000, 3))
    towards /= np.abs(towards).max(axis=1, keepdims=True)
    corners = towards[:, None] * rng.uniform(0.6, 1.6, (3000, 3, 1)) + rng.normal(size=(3000, 3, 3)) * 0.05
    return placed(cube(1.0), mesh_of(corners.reshape(-1, 3), np.arange(9000)))


@pytest.mark.parametrize("name", LENSES)
@pytest.mark.slow
def test_needles_through_a_wall_are_seen_in_front_of_it(name):
    geometry = needles(np.random.default_rng(7))
    size = SIZES.get(name, PLAIN_SIZES)[-1]
    camera = orbit_camera(CameraEntry.model_validate({**LENSES[name], "size": size}).intrinsics, 0.2, 0.1, 0.01)
    seen, (which, _, margin, gap) = rasterize(geometry, camera), cast(geometry, camera)
    certain = (margin > 1e-9) & (gap > 1e-6)
    equal("triangles", "float64 brute force", seen.triangle[certain], which[certain])
    assert (which[certain] >= 12).sum() > 50, "few needles are seen"


@pytest.mark.parametrize("name", [*LENSES, "orthographic"])
def test_samples_are_the_centres_of_moved_pictures(name):
    """Each sample shows what truth sees in a picture that is moved by the sample's place in its pixel."""
    camera = {"projection": "orthographic", "width_m": 3.0} if name == "orthographic" else LENSES[name]
    size = SIZES.get(name, PLAIN_SIZES)[-1]
    intrinsics = CameraEntry.model_validate({**camera, "size": size}).intrinsics
    geometry, compared = needles(np.random.default_rng(8)), 0
    view = orbit_camera(intrinsics, 0.2, 0.1, 4.0 if name == "orthographic" else 0.01)
    samples = edge_samples(geometry, view, rasterize(geometry, view), np.arange(len(geometry.triangles), dtype=np.int32))
    assert samples is not None and len(samples.pixels) > 150
    for i, (x, y) in enumerate(OFFSETS):
        moved = intrinsics.model_copy(update={"cx": intrinsics.cx - (x - 0.5), "cy": intrinsics.cy - (y - 0.5)})
        there = rasterize(geometry, Camera(moved, view.R, view.t)).triangle.reshape(-1)[samples.pixels]
        equal("triangles", "truth of the moved picture", samples.triangle[i::4], there)
        compared += int((there >= 12).sum())
    assert compared > 100, "few needles are sampled"


@pytest.mark.parametrize("name", LENSES)
def test_a_window_is_a_part_of_the_picture_or_lies_beside_it(name):
    geometry = crowd(np.random.default_rng(5))
    width, height = SIZES.get(name, PLAIN_SIZES)[-1]
    camera = orbit_camera(CameraEntry.model_validate({**LENSES[name], "size": [width, height]}).intrinsics, 0.2, 0.1, 0.01)
    whole = rasterize(geometry, camera).triangle
    for x0, y0, x1, y1 in ((0, 0, 2, height), (5, 3, 6, 4), (width - 3, 7, width, 20), (10, 5, 41, 29)):
        part = rasterize(geometry, camera, window=(x0, y0, x1, y1)).triangle
        equal("triangles", "the whole picture", part, whole[y0:y1, x0:x1])
    if camera.lens.period is None:
        around = rasterize(geometry, camera, window=(-7, -5, width + 6, height + 4)).triangle
        equal("triangles", "the whole picture", around[5:-4, 7:-6], whole)
