import math

import numpy as np
import pytest

from proven import close, equal, told
from small import still_channels
from truth_scenes import EVERY, FISHEYE, cube, lens, mesh_of, orbit_camera, placed, random_soup, sphere
from viewsphere.geometry.camera import pixel_rays
from viewsphere.labels import channels, observe
from viewsphere.model.channel import PASSES
from viewsphere.truth.raster.visibility import rasterize

ALL = tuple(name for name in still_channels() if name not in PASSES)


def scene(name, seed=0):
    rng = np.random.default_rng(seed)
    move = np.eye(4)
    move[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    move[:3, :3] *= np.linalg.det(move[:3, :3])
    move[:3, 3] = 0.5, -0.3, 0.4
    geometry = placed(cube(0.7), random_soup(rng, 60), sphere(3, 0.8), moves=[np.eye(4), move, move], ground=True)
    camera = orbit_camera(lens(96, 72, 1.1, EVERY[name]), 0.4, 0.5, 5.0, tilt=0.2)
    visibility = rasterize(geometry, camera)
    return geometry, camera, visibility, observe(geometry, camera, visibility, ALL)


@pytest.mark.parametrize("name", EVERY)
def test_table_says_what_comes_out(name):
    geometry, camera, visibility, observed = scene(name)
    assert list(observed) == list(ALL)
    for key, array in observed.items():
        assert array.dtype == channels()[key].dtype, key
        assert array.shape == channels()[key].shape(72, 96), key
        assert np.array_equal(
            array[visibility.triangle < 0],
            np.full_like(array[visibility.triangle < 0], channels()[key].empty),
            equal_nan=bool(np.isnan(channels()[key].empty)),
        ), key
    assert list(observe(geometry, camera, visibility, iter(["parts"]))) == ["parts"]
    with pytest.raises(ValueError, match=r"channel 'rgb': expected one of depth, "):
        observe(geometry, camera, visibility, ["rgb"])


@pytest.mark.parametrize("name", EVERY)
def test_all_channels_tell_of_one_point(name):
    geometry, camera, visibility, observed = scene(name)
    seen = visibility.triangle >= 0
    triangle = visibility.triangle[seen]
    objects = geometry.triangle_object[triangle]
    assert {0, 1, 2, 3} == set(objects)
    assert np.array_equal(observed["instances"][seen], objects)
    equal("categories", "closed form", observed["categories"][seen], np.array([0, 10, 11, 12])[objects])
    assert np.array_equal(
        observed["parts"][seen], np.append(geometry.triangle_part, 0)[np.minimum(triangle, len(geometry.triangle_part))]
    )
    start = np.array((0, *geometry.triangle_start[:-1]))
    assert np.array_equal(observed["triangles"][seen], np.where(objects > 0, triangle - start[objects], -1))

    weights = observed["barycentrics"][seen].astype(float)
    largest = np.maximum(np.abs(weights).max(axis=1), 1)  # the ground goes on beyond its triangles
    assert (np.abs(weights.sum(axis=1) - 1) < 1e-6 * largest).all()
    assert weights[objects > 0].min() > -1e-6
    corners = geometry.vertices[geometry.triangles[triangle]]
    point = (weights[..., None] * corners).sum(axis=1)
    rays = pixel_rays(camera.intrinsics)[seen]
    along = camera.lens.origins()[seen] + rays / visibility.inverse_depth[seen, None]
    off = np.abs(point @ camera.R.T + camera.t - along).max(axis=1)
    assert (off < 1e-6 * largest * np.abs(corners).max()).all()
    told("barycentrics", "lifted rays", off[objects > 0], "m")
    np.testing.assert_allclose(observed["depth"][seen], along[:, 2], rtol=1e-6)

    solid = objects > 0
    local = observed["coordinates"][seen]
    assert np.isnan(local[~solid]).all()
    inside = (weights[..., None] * geometry.coordinates[geometry.triangles[triangle]]).sum(axis=1)
    close("coordinates", "barycentrics of vertices", local[solid], inside[solid], "m", atol=2e-6)


@pytest.mark.parametrize("name", EVERY)
def test_normals_are_unit_and_face_the_camera(name):
    geometry, camera, visibility, observed = scene(name)
    seen = visibility.triangle >= 0
    rays = pixel_rays(camera.intrinsics)[seen]
    corners = geometry.vertices[geometry.triangles[visibility.triangle[seen]]] @ camera.R.T
    expected = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    expected /= np.linalg.norm(expected, axis=1)[:, None]
    expected *= -np.sign((expected * rays).sum(axis=1))[:, None]
    close("normals_geometric", "closed form", observed["normals_geometric"][seen], expected, atol=1e-5)
    normals = observed["normals"][seen].astype(float)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-6)
    assert (normals * rays).sum(axis=1).max() < 1e-6
    flat = np.isin(geometry.triangle_object[visibility.triangle[seen]], (0, 1))
    close("normals", "closed form", normals[flat], expected[flat], atol=1e-6)


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize("inside_out", [False, True])
def test_shading_normals_of_a_ball(name, inside_out):
    ball = sphere(4)
    triangles = ball.triangles[:, ::-1] if inside_out else ball.triangles  # wrong winding, right normals
    geometry = placed(mesh_of(ball.vertices, triangles, ball.normals))
    camera = orbit_camera(lens(96, 72, 0.8, EVERY[name]), 0.4, 0.5, 4.0)
    visibility = rasterize(geometry, camera)
    normals = observe(geometry, camera, visibility, ["normals"])["normals"]
    seen = visibility.triangle >= 0
    rays = pixel_rays(camera.intrinsics)[seen]
    radial = camera.lens.origins()[seen] + rays / visibility.inverse_depth[seen, None] + camera.R @ camera.center
    radial /= np.linalg.norm(radial, axis=1)[:, None]
    apart = np.degrees(np.arccos(np.clip((normals[seen] * radial).sum(axis=1), -1, 1)))
    assert apart.max() < 3.0  # the rim, where a normal turned away is bent back
    assert np.median(apart) < 0.1


def test_bad_vertex_normals_give_way_to_the_triangle_normal():
    quad = [[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]]
    for normal in ([0, 0, 0], [1e-30, 0, 0]):
        geometry = placed(mesh_of(quad, [[0, 1, 2], [0, 2, 3]], [normal] * 4))
        camera = orbit_camera(lens(16, 16, 0.4), distance=4.0)
        visibility = rasterize(geometry, camera)
        normals = observe(geometry, camera, visibility, ["normals"])["normals"]
        assert (visibility.triangle >= 0).all()
        np.testing.assert_allclose(normals, np.broadcast_to([0, 0, -1.0], normals.shape), atol=1e-7)


def test_depth_behind_a_fisheye_is_negative():
    camera = orbit_camera(lens(96, 96, math.radians(250), FISHEYE), distance=0.1)
    geometry = placed(sphere(3))
    observed = observe(geometry, camera, rasterize(geometry, camera), ["depth", "coordinates"])
    rays = pixel_rays(camera.intrinsics)
    back = rays[..., 2] < 0
    assert 0.3 < back.mean() < 0.7
    assert (observed["depth"][back] < 0).all()
    in_camera = observed["coordinates"] @ camera.R.T + camera.t
    real = np.isfinite(rays[..., 0])
    np.testing.assert_allclose(observed["depth"][real], in_camera[real][:, 2], atol=1e-6)


def test_part_and_face_seen_from_each_side():
    """Six cameras, six faces: the cube's parts in the order -x, +x, -y, +y, -z, +z."""
    geometry = placed(cube(0.5))
    views = {1: (-math.pi / 2, 0), 2: (math.pi / 2, 0), 3: (0, 0), 4: (math.pi, 0), 5: (0, -math.pi / 2), 6: (0, math.pi / 2)}
    for part, (azimuth, elevation) in views.items():
        camera = orbit_camera(lens(32, 32, 0.2), azimuth, elevation, 4.0)
        observed = observe(geometry, camera, rasterize(geometry, camera), ["parts", "normals", "coordinates"])
        assert (observed["parts"] == part).all()
        np.testing.assert_allclose(observed["normals"], np.broadcast_to([0, 0, -1.0], (32, 32, 3)), atol=1e-6)
        axis, sign = (part - 1) // 2, (-1, 1)[(part - 1) % 2]
        np.testing.assert_allclose(observed["coordinates"][..., axis], sign * 0.5, atol=1e-6)
