"""Panoramas: labels against Embree's rays and float64 brute force, masks and boxes across the seam, flow the short way."""

from __future__ import annotations

import numpy as np
import pytest
from test_embree import MODELS, circle, real_models, turned

from proven import close, equal
from ray_proofs import embree, planes, right_by_float64, trace
from truth_scenes import cast, cube, orbit_camera, placed, random_soup, sphere
from viewsphere.geometry.camera import pixel_rays
from viewsphere.labels import observe
from viewsphere.model.sensors.camera import Camera
from viewsphere.recipe.world.scene import CameraEntry
from viewsphere.truth.raster.visibility import rasterize
from zoo_mesh import drawn

LENSES = {
    "equirectangular": {"projection": "equirectangular", "size": [128, 64]},
    "equirectangular part": {"projection": "equirectangular", "size": [100, 60], "span": {"horizontal": 250}},
    "cylindrical": {"projection": "cylindrical", "size": [128, 60]},
    "cylindrical part": {"projection": "cylindrical", "size": [90, 90], "span": {"horizontal": 120}},
}
WANTED = ("instances", "depth_ray", "normals_geometric", "position")


def lens(name, times=1):
    camera = LENSES[name]
    return CameraEntry.model_validate({**camera, "size": [times * n for n in camera["size"]]}).intrinsics


def surroundings():
    """Balls and cubes all around the origin, above and below, on a ground."""
    places = [turned(0.3 * i, *(2.5 * np.array([np.cos(i), np.sin(i), 0.7 * np.cos(2.1 * i)])).tolist()) for i in range(9)]
    meshes = [sphere(3, 0.6) if i % 2 else cube(0.5) for i in range(9)]
    return placed(*meshes, cube(0.4), cube(0.4), moves=[*places, turned(0.2, 0, 0, 2), turned(0.2, 0.1, 0, -2)], ground=True)


@pytest.mark.parametrize("name", LENSES)
def test_brute_force_sees_the_same(name):
    geometry = placed(random_soup(np.random.default_rng(3), 60), ground=True)
    camera = orbit_camera(lens(name), 0.4, 0.2, 0.5, tilt=0.3)
    seen = rasterize(geometry, camera, keeps_exact=True)
    which, s, margin, gap = cast(geometry, camera)
    certain = (margin > 1e-9) & (gap > 1e-6)
    assert certain.mean() > 0.99
    equal("triangles", "float64 brute force", seen.triangle[certain], which[certain])
    hit = certain & (which >= 0)
    close("1/s", "float64 brute force", seen.exact[hit], 1 / s[hit], "1/m", rtol=1e-9)


def compare(geometry, camera):
    """Labels against Embree's rays; returns how many pixels are a toss-up by float64."""
    seen = rasterize(geometry, camera)
    labels = observe(geometry, camera, seen, WANTED)
    other, distance = trace(embree(geometry), camera)
    rays = pixel_rays(camera.intrinsics)
    differs = other != seen.triangle
    own, theirs, ray = seen.triangle[differs], other[differs], rays[differs]
    (s_own, d_own), (s_other, d_other) = (planes(geometry, camera, t, ray) for t in (own, theirs))
    with np.errstate(invalid="ignore"):
        tie = np.abs(s_own - s_other) <= 1e-6 * np.minimum(np.abs(s_own), np.abs(s_other))
    toss_up = tie | (np.minimum(d_own, d_other) < 1e-3)
    for i in np.flatnonzero(~toss_up):
        assert right_by_float64(geometry, camera, ray[i], own[i]), (own[i], theirs[i])
    hit = ~differs & (other >= 0) & (geometry.triangle_object[other] > 0)
    assert hit.mean() > 0.01
    corners = geometry.corners(other[hit])
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    away = rays[hit] @ camera.R
    normal *= -np.sign((normal * away).sum(axis=1))[:, None]
    equal("instances", "Embree's rays", labels["instances"][hit], geometry.triangle_object[other[hit]])
    flat = np.abs((normal * away).sum(axis=1)) > 0.01  # float32's distance to a surface seen edge-on is less exact
    close("depth_ray", "Embree's rays", labels["depth_ray"][hit][flat], distance[hit][flat], "m", rtol=3e-5)
    place = camera.center + away * distance[hit][:, None]
    close("position", "Embree's rays", labels["position"][hit][flat], place[flat], "m", atol=3e-4)
    turned_normals = (labels["normals_geometric"][hit] * (normal @ camera.R.T)).sum(axis=1)
    assert np.quantile(np.abs(turned_normals), 0.001) > 1 - 1e-4
    return int(toss_up.sum())


@pytest.mark.parametrize("name", LENSES)
def test_embree_sees_the_same(name):
    pytest.importorskip("embreex")
    geometry, own = surroundings(), lens(name, 3)
    toss_ups = sum(compare(geometry, orbit_camera(own, azimuth, 0.1, 0.4, tilt=0.2)) for azimuth in (0.3, 2.9))
    assert toss_ups < 3e-4 * own.width * own.height * 2


@pytest.mark.parametrize("name", ["equirectangular", "cylindrical"])
@pytest.mark.parametrize("families", [("car", "post_box", "bollard", "bench"), ("chair", "table", "sofa", "mug")])
def test_embree_sees_the_same_of_the_zoo(name, families):
    pytest.importorskip("embreex")
    geometry = placed(*(drawn(family, 1) for family in families), moves=circle(4, 1.5), ground=True)
    own = lens(name, 3)
    assert compare(geometry, orbit_camera(own, 0.7, 0.2, 0.5)) < 1e-3 * own.width * own.height


@pytest.mark.parametrize("name", ["equirectangular", "cylindrical"])
@pytest.mark.skipif(not MODELS.exists(), reason="no folder of real models beside the project")
def test_embree_sees_the_same_of_real_models(name):
    pytest.importorskip("embreex")
    meshes = [*real_models(2).values()][:2]
    geometry = placed(*meshes, moves=circle(2, 1.6), ground=True)
    own = lens(name, 3)
    assert compare(geometry, orbit_camera(own, 0.7, 0.2, 0.3)) < 1e-3 * own.width * own.height


def test_a_quarter_turn_of_the_camera_moves_all_columns_by_a_quarter():
    """Ids and distances turn with the camera about its vertical axis, except at rays along edges."""
    geometry, own = surroundings(), lens("equirectangular", 3)
    first = orbit_camera(own, 0.3, 0.1, 0.4)
    turn = np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]])  # the right side comes ahead
    second = Camera(own, turn @ first.R, turn @ first.t)
    a, b = (rasterize(geometry, camera) for camera in (first, second))
    quarter = own.width // 4
    same = b.triangle == np.roll(a.triangle, -quarter, axis=1)
    assert (~same).sum() <= 2
    np.testing.assert_allclose(b.inverse_depth[same], np.roll(a.inverse_depth, -quarter, axis=1)[same], rtol=1e-6)
