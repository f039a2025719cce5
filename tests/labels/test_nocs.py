"""nocs against closed forms and Embree's rays, by every lens; its proof notices other shares, poses and boxes."""

from dataclasses import replace

import numpy as np
import pytest

from label_scenes import changed, embree, proof, random_sample
from proven import close
from truth_scenes import EVERY, cube, lens, mesh_of, orbit_camera, placed, sphere
from viewsphere.geometry.camera import pixel_rays
from viewsphere.geometry.rotation import transform
from viewsphere.labels import observe
from viewsphere.labels.nocs import LABEL, picture
from viewsphere.truth.raster.visibility import rasterize

NAMES = ("depth", "instances", "coordinates", "nocs")


def observed(geometry, azimuth=0.0, elevation=0.0):
    camera = orbit_camera(lens(64, 48, 0.9), azimuth, elevation, 4.0)
    return observe(geometry, camera, rasterize(geometry, camera), ["nocs"])["nocs"]


def test_a_cube_s_faces_are_where_its_diagonal_says():
    """Of a cube's diagonal a side is 1 / sqrt(3): the face towards the camera, -Y, is at 0.5 - 0.5 / sqrt(3)."""
    found = observed(placed(cube(0.8)))
    seen = found[np.isfinite(found).all(axis=-1)]
    edge = 0.5 / np.sqrt(3)
    np.testing.assert_allclose(seen[:, 1], 0.5 - edge, atol=1e-6)
    assert np.abs(np.abs(seen - 0.5).max(axis=0) - edge).max() < 0.05
    left, right = found[24, 20], found[24, 40]  # in the picture: x grows to the right, z up
    assert left[0] < 0.5 < right[0] and found[15, 32, 2] > 0.5 > found[33, 32, 2]


def test_a_box_that_is_not_around_the_origin_and_vertices_that_nothing_uses():
    corners = np.array([[2, 1, 5], [4, 1, 5], [4, 1, 6], [2, 1, 6], [-90, 9, 9]])
    card = mesh_of(corners, [[0, 1, 2], [0, 2, 3]])
    move = np.eye(4)
    move[:3, 3] = -3, -1, -5.5
    found = observed(placed(card, moves=[move]))
    seen = found[np.isfinite(found).all(axis=-1)]
    half = np.array([1, 0, 0.5]) / np.sqrt(5)
    np.testing.assert_allclose(seen.min(axis=0), 0.5 - half, atol=0.03)
    np.testing.assert_allclose(seen.max(axis=0), 0.5 + half, atol=0.03)
    np.testing.assert_array_equal(seen[:, 1], 0.5)


def test_instances_of_other_sizes_have_equal_shares_and_scenery_has_none():
    one = observed(placed(sphere(3, 1.0)))
    moved = mesh_of(sphere(3, 1.0).vertices * 0.25, sphere(3, 1.0).triangles)
    camera = orbit_camera(lens(64, 48, 0.9), 0, 0, 1.0)  # as much nearer
    geometry = placed(moved)
    other = observe(geometry, camera, rasterize(geometry, camera), ["nocs"])["nocs"]
    np.testing.assert_allclose(one, other, atol=2e-6)
    scenery = placed(cube(0.2), sphere(3, 0.9), scenery=1, ground=True)
    camera = orbit_camera(lens(64, 48, 0.9), 0.3, 0.4, 4.0)
    visibility = rasterize(scenery, camera)
    assert np.isnan(observe(scenery, camera, visibility, ["nocs"])["nocs"]).all()


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize("seed", range(3))
def test_through_the_pose_they_are_what_embree_meets_and_lifted_depth(name, seed):
    pytest.importorskip("embreex")
    sample, geometry, visibility = random_sample(seed, name, NAMES)
    triangle, points = embree(geometry, sample.camera)
    lifted = pixel_rays(sample.camera.intrinsics) / visibility.inverse_depth[..., None].clip(1e-9)
    lifted = lifted + sample.camera.lens.origins()
    compared = 0
    for o in sample.objects:
        own = (sample.instances == o.id) & (triangle == visibility.triangle)
        low, high = o.box3d_object.min(axis=0), o.box3d_object.max(axis=0)
        local = (low + high) / 2 + (sample.nocs[own].astype(float) - 0.5) * np.linalg.norm(high - low)
        close("nocs", "Embree's rays", transform(o.world_from_object, local), points[own], "m", atol=1e-4)
        close("nocs", "lifted depth", transform(o.camera_from_object, local), lifted[own], "m", atol=5e-6)
        np.testing.assert_allclose(local, sample.coordinates[own], atol=3e-6)
        compared += own.sum()
    assert compared > 300


@pytest.mark.parametrize("name", EVERY)
def test_its_proof_notices_other_shares(name):
    sample, *_ = random_sample(1, name, NAMES)
    assert proof(LABEL, sample) == []
    y, x = np.argwhere(sample.instances > 0)[7]
    background = tuple(np.argwhere(sample.instances == 0)[0])
    for change in (
        lambda a: 1 - a,
        lambda a: a + np.float32(1e-4),
        lambda a: a[..., ::-1].copy(),
        lambda a: a * np.float32(1.5),
        lambda a: a.__setitem__((y, x), np.nan),
        lambda a: a.__setitem__((y, x, 1), np.nan),
        lambda a: a.__setitem__((y, x), a[y, x] + np.float32(2e-5)),
        lambda a: a.__setitem__(background, 0.5),
    ):
        assert proof(LABEL, changed(sample, "nocs", change)), change


@pytest.mark.parametrize("left_out", [(), ("coordinates",), ("depth", "coordinates")])
def test_a_share_that_is_wrong_is_found_by_depth_by_coordinates_or_by_its_pixel(left_out):
    sample, *_ = random_sample(2, "barrel", NAMES)
    some = replace(sample, channels={n: a for n, a in sample.channels.items() if n not in left_out})
    assert proof(LABEL, some) == []
    assert proof(LABEL, changed(some, "nocs", lambda a: a + np.float32([2e-3, 0, 0])))
    turned = tuple(replace(o, camera_from_object=o.camera_from_object @ np.diag([1, 1.001, 1, 1])) for o in some.objects)
    assert proof(LABEL, replace(some, objects=turned))
    wider = tuple(replace(o, box3d_object=o.box3d_object * 1.01) for o in some.objects)
    assert proof(LABEL, replace(some, objects=wider))


def test_its_picture_is_the_usual_one():
    shares = np.array([[[0, 0.5, 1], [np.nan] * 3]], np.float32)
    assert picture(shares).tolist() == [[[0, 128, 255], [0, 0, 0]]]
