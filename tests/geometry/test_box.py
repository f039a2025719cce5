import numpy as np
import pytest

from viewsphere.geometry.box import (
    EDGES,
    FACES,
    VERTEX_SIGNS,
    box_size,
    box_vertices,
    clip_to_image,
    overlap,
    projected_bounds,
)
from viewsphere.geometry.camera import orbit_center, orbit_rotation, project
from viewsphere.geometry.pose_category import SIDES, pose_category
from viewsphere.model.camera import Camera, Distortion, Intrinsics

CUBE_TRIANGLES = np.array([(f[a], f[b], f[c]) for f in FACES.values() for a, b, c in ((0, 1, 2), (0, 2, 3))], np.int32)


def camera_at(azimuth=0.0, elevation=0.0, distance=4.0, lens=None, size=(640, 480), focal=500.0):
    rotation = orbit_rotation(azimuth, elevation)
    intrinsics = Intrinsics(width=size[0], height=size[1], fx=focal, fy=focal, cx=size[0] / 2, cy=size[1] / 2, distortion=lens)
    return Camera(intrinsics, rotation, -rotation @ orbit_center(azimuth, elevation, distance))


def bounds_of(camera, vertices, triangles=CUBE_TRIANGLES):
    return projected_bounds(camera, vertices, triangles, (0, len(triangles)), (0, len(vertices)))


def test_vertices_and_faces_are_those_of_the_design():
    v = box_vertices((-1, -2, -3), (4, 5, 6))
    assert v[0].tolist() == [4, 5, -3]
    assert v[1].tolist() == [4, -2, -3]
    assert v[2].tolist() == [-1, -2, -3]
    assert v[3].tolist() == [-1, 5, -3]
    np.testing.assert_array_equal(v[4:, :2], v[:4, :2])
    assert np.all(v[4:, 2] == 6)
    assert box_size(v) == (5, 9, 7)
    sides = {
        "bottom": (2, -3),
        "top": (2, 6),
        "right": (0, -1),
        "front": (1, -2),
        "left": (0, 4),
        "back": (1, 5),
    }
    assert list(FACES) == ["bottom", "top", "right", "front", "left", "back"]
    for name, (axis, value) in sides.items():
        assert np.all(v[list(FACES[name])][:, axis] == value), name


def test_faces_go_round_and_edges_are_the_twelve():
    signs = np.array(VERTEX_SIGNS)
    expected = {(i, j) for j in range(8) for i in range(j) if (signs[i] != signs[j]).sum() == 1}
    assert {tuple(sorted(e)) for e in EDGES} == expected
    assert len(EDGES) == 12
    for face in FACES.values():
        for a, b in zip(face, face[1:] + face[:1], strict=True):
            assert (signs[a] != signs[b]).sum() == 1


def test_a_cube_seen_head_on():
    bounds, whole = bounds_of(camera_at(), box_vertices((-0.5,) * 3, (0.5,) * 3))
    half = 0.5 / 3.5 * 500
    np.testing.assert_allclose(bounds, (320 - half, 240 - half, 320 + half, 240 + half), rtol=1e-14)
    assert whole


def test_only_vertices_of_triangles_count():
    vertices = np.vstack([box_vertices((-0.5,) * 3, (0.5,) * 3), [[100, 0, 0]]])
    np.testing.assert_array_equal(bounds_of(camera_at(), vertices)[0], bounds_of(camera_at(), vertices[:8])[0])


def test_triangles_that_cross_the_camera_plane_are_cut():
    # a strip on the floor one metre below the camera, from 3 m behind it to 7 m in front, 2 m wide
    vertices = np.array([[-1.0, -7, -1], [1, -7, -1], [1, 3, -1], [-1, 3, -1]])
    triangles = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    bounds, whole = bounds_of(camera_at(), vertices, triangles)
    assert not whole
    assert bounds[1] == pytest.approx(240 + 500 / 7)  # the far edge
    assert bounds[0] < -1e6 < 1e6 < bounds[2]
    assert clip_to_image(bounds, 640, 480) == pytest.approx((0, 240 + 500 / 7, 640, 480))


def test_what_is_behind_the_camera_has_no_box():
    bounds, whole = bounds_of(camera_at(distance=-4.0), box_vertices((-0.5,) * 3, (0.5,) * 3))
    assert bounds is None
    assert not whole


def test_cutting_agrees_with_a_finely_divided_model():
    rng = np.random.default_rng(3)
    s = np.linspace(0, 1, 4001)
    for _ in range(20):
        camera = camera_at(distance=0.3)
        triangle = rng.uniform(-1, 1, (3, 3))
        bounds, _ = bounds_of(camera, triangle, np.array([[0, 1, 2]], np.int32))
        points = np.concatenate([a + s[:, None] * (b - a) for a, b in zip(triangle, triangle[[1, 2, 0]], strict=True)])
        local = points @ camera.R.T + camera.t
        local = local[local[:, 2] > 1e-3]
        if bounds is None:
            assert len(local) == 0
            continue
        pixels = local[:, :2] / local[:, 2:] * 500 + (320, 240)
        near = clip_to_image((*pixels.min(0), *pixels.max(0)), 640, 480)
        found = clip_to_image(bounds, 640, 480)
        assert (found is None) == (near is None)
        if found:
            np.testing.assert_allclose(found, near, atol=2)


BARREL = Distortion(model="brown_conrady", coefficients=(-0.25, 0.05, 0.001, -0.002, 0.0))
FISHEYE = Distortion(model="fisheye", coefficients=(0.02, -0.01, 0.002, 0.0))


@pytest.mark.parametrize("lens", [BARREL, FISHEYE], ids=["brown_conrady", "fisheye"])
def test_bent_edges_are_followed(lens):
    camera = camera_at(0.4, 0.3, 3.0, lens)
    vertices = box_vertices((-1, -0.5, -0.6), (0.8, 0.7, 0.5))
    bounds, whole = bounds_of(camera, vertices)
    s = np.linspace(0, 1, 5001)[:, None]
    edges = np.concatenate([vertices[a] + s * (vertices[b] - vertices[a]) for a, b in EDGES])
    pixels, _ = project(camera.intrinsics, edges @ camera.R.T + camera.t)
    np.testing.assert_allclose(bounds, (*pixels.min(0), *pixels.max(0)), atol=0.01)
    assert whole


def test_edges_that_leave_a_lens_are_cut_at_its_limit():
    folding = Distortion(model="brown_conrady", coefficients=(-0.3, 0.0, 0.0, 0.0))
    camera = camera_at(distance=1.0, lens=folding)
    vertices = np.array([[0.0, 0, 0], [0.4, 0, 0], [50, 0.5, 0.1]])
    bounds, whole = bounds_of(camera, vertices, np.array([[0, 1, 2]], np.int32))
    edge = vertices[1] + np.linspace(0, 1, 20001)[:, None] * (vertices[2] - vertices[1])
    pixels, _ = project(camera.intrinsics, edge @ camera.R.T + camera.t)
    assert not whole
    assert bounds[2] == pytest.approx(np.nanmax(pixels[:, 0]), abs=0.5)


def test_clipping_and_overlap():
    assert clip_to_image((-5, 2, 700, 30), 640, 480) == (0, 2, 640, 30)
    for outside in ((-5, 0, 0, 9), (640, 0, 650, 9), (0, -9, 9, 0), (0, 480, 9, 490)):
        assert clip_to_image(outside, 640, 480) is None
    assert overlap((0, 0, 2, 2), (1, 1, 3, 3))
    assert not overlap((0, 0, 2, 2), (2, 0, 3, 3))


@pytest.mark.parametrize("k", range(8))
def test_pose_categories_at_45_degrees(k):
    for off in (-22.5, 0, 22.4, -0.1, 360, -360):
        assert pose_category(45 * k + off, 0) == SIDES[k]
    assert pose_category(45 * k + 22.5, 0) == SIDES[(k + 1) % 8]


def test_pose_categories_name_the_side_that_is_seen():
    v = box_vertices((-1, -1, -1), (1, 1, 1))
    for azimuth in (0, 90, 180, 270):
        eye = orbit_center(np.radians(azimuth), 0.0, 10.0)
        nearest = min(FACES, key=lambda f: np.linalg.norm(v[list(FACES[f])].mean(0) - eye))
        assert pose_category(azimuth, 0) == nearest


def test_pose_categories_by_elevation_and_resolution():
    assert [pose_category(0, e) for e in (90, 60, 59.9, 30, 29.9, -30, -30.1, -59.9, -60, -90)] == [
        *("top", "top", "front-above", "front-above", "front"),
        *("front", "front-below", "front-below", "bottom", "bottom"),
    ]
    assert [pose_category(a, 0, 90) for a in (44, 45, 135, 225, 315)] == [
        "front",
        "left",
        "back",
        "right",
        "front",
    ]
    assert [pose_category(a, 0, 30) for a in (0, 15, 44.9, 350)] == ["az000", "az030", "az030", "az000"]
    assert pose_category(22.5, 0, 22.5) == "az022.5"
    assert len({pose_category(a, 0, 22.5) for a in np.arange(0, 360, 0.5)}) == 16
    assert pose_category(22.5 - 1e-9, 0) == "front-left"
    for bad in (0, -45, 50):
        with pytest.raises(ValueError, match="divides 360"):
            pose_category(0, 0, bad)
