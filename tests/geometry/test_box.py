import numpy as np
import pytest

from lens_limits import lens_limit
from quick import quick
from viewsphere.geometry.box import clip_to_image, is_behind, overlap, projected_bounds
from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.camera import orbit_center, orbit_rotation, project
from viewsphere.geometry.lenses import lens_parameters
from viewsphere.geometry.pose_category import SIDES, pose_category
from viewsphere.model.sensors.camera import Camera, Intrinsics

FACES, EDGES, VERTEX_SIGNS = (Box3d.layout()[name] for name in ("faces", "edges", "signs"))
CUBE_TRIANGLES = np.array([(f[a], f[b], f[c]) for f in FACES.values() for a, b, c in ((0, 1, 2), (0, 2, 3))], np.int32)


def camera_at(azimuth=0.0, elevation=0.0, distance=4.0, lens=None, size=(640, 480), focal=500.0):
    rotation = orbit_rotation(azimuth, elevation)
    intrinsics = Intrinsics(width=size[0], height=size[1], fx=focal, fy=focal, cx=size[0] / 2, cy=size[1] / 2, distortion=lens)
    return Camera(intrinsics, rotation, -rotation @ orbit_center(azimuth, elevation, distance))


def bounds_of(camera, vertices, triangles=CUBE_TRIANGLES):
    return projected_bounds(camera, vertices, triangles)


def test_vertices_and_faces_are_those_of_the_design():
    v = Box3d.between((-1, -2, -3), (4, 5, 6)).corners
    assert v[0].tolist() == [4, 5, -3]
    assert v[1].tolist() == [4, -2, -3]
    assert v[2].tolist() == [-1, -2, -3]
    assert v[3].tolist() == [-1, 5, -3]
    np.testing.assert_array_equal(v[4:, :2], v[:4, :2])
    assert np.all(v[4:, 2] == 6)
    assert Box3d(v).size == (5, 9, 7)
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
    bounds, whole = bounds_of(camera_at(), Box3d.between((-0.5,) * 3, (0.5,) * 3).corners)
    half = 0.5 / 3.5 * 500
    np.testing.assert_allclose(bounds, (320 - half, 240 - half, 320 + half, 240 + half), rtol=1e-14)
    assert whole


def test_only_vertices_of_triangles_count():
    vertices = np.vstack([Box3d.between((-0.5,) * 3, (0.5,) * 3).corners, [[100, 0, 0]]])
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
    bounds, whole = bounds_of(camera_at(distance=-4.0), Box3d.between((-0.5,) * 3, (0.5,) * 3).corners)
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


LENSES = {
    "barrel": lens_parameters("brown_conrady", coefficients=(-0.45, 0.25, 0.01, -0.015, -0.02)),
    "folding": lens_parameters("brown_conrady", coefficients=(-0.3, 0.0, 0.0, 0.0)),
    "pincushion": lens_parameters("brown_conrady", coefficients=(0.6, 0.4, -0.03, 0.02)),
    "rational": lens_parameters("brown_conrady", coefficients=(0.4, 0.05, -0.001, 0.0007, 0.01, 0.9, 0.32, 0.02)),
    "equidistant": lens_parameters("fisheye", coefficients=(0.0, 0.0, 0.0, 0.0)),
    "fisheye": lens_parameters("fisheye", coefficients=(-0.12, 0.03, -0.02, 0.003)),
}


def finely_seen(camera, corners, samples=1001):
    """Pixels of many points on a triangle's edges, most where one leaves the lens' field or turns, and on the field's rim."""
    local = corners @ camera.R.T + camera.t
    local /= np.linalg.norm(local, axis=1)[:, None]
    found = [_rim_seen(camera, local)]
    for a, b in zip(local, local[[1, 2, 0]], strict=True):
        s = np.linspace(0, 1, samples)
        for _ in range(4):
            pixels = project(camera.intrinsics, a + s[:, None] * (b - a))[0]
            found.append(pixels)
            near = [*np.flatnonzero(np.diff(np.isnan(pixels[:, 0])))]
            if not np.isnan(pixels).all():
                near += [*np.nanargmin(pixels, axis=0), *np.nanargmax(pixels, axis=0)]
            s = np.concatenate([np.linspace(s[max(i - 1, 0)], s[min(i + 2, len(s) - 1)], 401) for i in near] or [s])
            s = np.unique(s)
    pixels = np.concatenate(found)
    return pixels[~np.isnan(pixels[:, 0])]


def _rim_seen(camera, corners):
    """Pixels of those directions at the limit of a lens that lie in a triangle."""
    limit = lens_limit(camera.distortion) * (1 - 1e-9)
    if not np.isfinite(limit):
        return np.empty((0, 2))
    turn = np.linspace(0, 2 * np.pi, 20001)
    r, z = (np.sin(limit), np.cos(limit)) if camera.distortion.model == "fisheye" else (limit, 1.0)
    rim = np.stack([r * np.cos(turn), r * np.sin(turn), np.full_like(turn, z)], axis=1)
    return project(camera.intrinsics, rim[(np.linalg.solve(corners.T, rim.T) >= 0).all(axis=0)])[0]


def random_camera(rng, lens, focal=300.0):
    fx, fy = focal * rng.uniform(0.7, 1.5, 2)
    intrinsics = Intrinsics(width=640, height=480, fx=fx, fy=fy, cx=300.0, cy=250.0, skew=rng.uniform(-9, 9), distortion=lens)
    return Camera(intrinsics, orbit_rotation(*rng.uniform(-3, 3, 3)), rng.normal(size=3) * 0.1)


def box_of(pixels):
    return np.array([*pixels.min(axis=0), *pixels.max(axis=0)])


ONE = np.array([[0, 1, 2]], np.int32)


@pytest.mark.slow
@pytest.mark.parametrize("name", LENSES)
@pytest.mark.parametrize(("spread", "focal"), [(0.04, 60.0), (0.1, 300.0), (0.5, 300.0)], ids=["8 px", "small", "large"])
def test_boxes_of_bent_triangles_are_exact_to_a_thousandth(name, spread, focal):
    lens, rng = LENSES[name], np.random.default_rng(5)
    reach, bulges = 0.99 * min(lens_limit(lens), 2.0 if lens.model == "fisheye" else 1.2), []
    while len(bulges) < 40:
        camera, out, turn = random_camera(rng, lens, focal), reach * rng.uniform(0.3, 1), rng.uniform(0, 2 * np.pi)
        flat = out * np.array([np.cos(turn), np.sin(turn)]) + spread * rng.normal(size=(3, 2))
        off = np.hypot(*flat.T)[:, None]
        if off.max() > reach:
            continue
        local = np.hstack([flat * np.sin(off) / off, np.cos(off)] if lens.model == "fisheye" else [flat, np.ones((3, 1))])
        triangle = (local * 10 ** rng.uniform(-1, 1, (3, 1)) - camera.t) @ camera.R
        bounds, whole = bounds_of(camera, triangle, ONE)
        expected = box_of(finely_seen(camera, triangle))
        assert whole
        np.testing.assert_allclose(bounds, expected, atol=1e-3)
        corners = project(camera.intrinsics, triangle @ camera.R.T + camera.t)[0]
        if focal > 60 or np.ptp(corners, axis=0).max() <= 8:
            bulges.append(np.abs(box_of(corners) - expected).max())
    assert max(bulges) > (0.003 if focal < 100 else 0.02)  # the corners alone would not do


@pytest.mark.parametrize("name", quick(LENSES, "folding"))
def test_boxes_of_triangles_that_leave_the_field_are_exact(name):
    lens, rng, cut = LENSES[name], np.random.default_rng(6), 0
    for _ in range(60):
        camera = random_camera(rng, lens)
        triangle = rng.normal(size=3) + rng.normal(size=(3, 3)) * 10 ** rng.uniform(-1.0, 0.7)
        bounds, whole = bounds_of(camera, triangle, ONE)
        pixels = finely_seen(camera, triangle)
        assert (bounds is None) == (len(pixels) == 0)
        if bounds is not None:
            clipped, expected = np.clip(bounds, -1000, 1000), np.clip(box_of(pixels), -1000, 1000)
            np.testing.assert_allclose(clipped, expected, atol=0.01)
            cut += not whole
    assert cut > (0 if name == "equidistant" else 8)


def test_an_edge_that_reaches_behind_and_back_is_cut_twice():
    """Both ends are in a fisheye's field, the middle is not; and an edge of which only the middle is."""
    narrow = lens_parameters("fisheye", coefficients=(-0.2, 0.0, 0.0, 0.0))  # folds at 74 degrees
    wide = lens_parameters("fisheye", coefficients=(-0.04, 0.0, 0.0, 0.0))  # at 165
    for lens, corners in ((narrow, [[-9, 0.1, 1], [9, 0.1, 1], [0, 9, 1]]), (wide, [[-2, 0.1, -5], [2, 0.1, -5], [0, 5, -5]])):
        intrinsics = Intrinsics(width=640, height=480, fx=150.0, fy=150.0, cx=320.0, cy=240.0, distortion=lens)
        camera, triangle = Camera(intrinsics, np.eye(3), np.zeros(3)), np.array(corners, float)
        bounds, whole = bounds_of(camera, triangle, ONE)
        pixels = finely_seen(camera, triangle)
        assert not whole
        np.testing.assert_allclose(bounds, box_of(pixels), atol=0.01)


@pytest.mark.parametrize("limit_folds", [False, True])
def test_what_surrounds_the_camera_fills_a_fisheye(limit_folds):
    """All corners of a cube around the camera may be seen though the middle of its back is not."""
    lens = lens_parameters("fisheye", coefficients=(-0.04 if limit_folds else 0.0, 0.0, 0.0, 0.0))
    intrinsics = Intrinsics(width=640, height=640, fx=90.0, fy=90.0, cx=320.0, cy=320.0, distortion=lens)
    camera = Camera(intrinsics, np.eye(3), np.zeros(3))
    bounds, whole = bounds_of(camera, Box3d.between((-1.0,) * 3, (1.1,) * 3).corners)
    limit = lens_limit(lens)
    radius = 90 * (limit + lens.coefficients[0] * limit**3)
    assert not whole
    np.testing.assert_allclose(bounds, (320 - radius, 320 - radius, 320 + radius, 320 + radius), atol=1e-4)


def test_what_covers_a_whole_lens_has_the_box_of_its_limit():
    """A wall none of whose edges is in the field."""
    folding = LENSES["folding"]
    wall = np.array([[-50.0, 2, -50], [50, 2, -50], [0, 2, 90]])
    bounds, whole = bounds_of(camera_at(distance=1.0, lens=folding), wall, ONE)
    r = lens_limit(folding)
    radius = 500 * (r - 0.3 * r**3)
    assert not whole
    np.testing.assert_allclose(bounds, (320 - radius, 240 - radius, 320 + radius, 240 + radius), atol=1e-4)


def test_edges_that_leave_a_lens_are_cut_at_its_limit():
    camera = camera_at(distance=1.0, lens=LENSES["folding"])
    vertices = np.array([[0.0, 0, 0], [0.4, 0, 0], [50, 0.5, 0.1]])
    bounds, whole = bounds_of(camera, vertices, ONE)
    pixels = finely_seen(camera, vertices)
    assert not whole
    np.testing.assert_allclose(bounds, box_of(pixels), atol=0.01)


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
    v = Box3d.between((-1, -1, -1), (1, 1, 1)).corners
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


def test_a_box_is_behind_where_none_of_its_corners_is_in_front():
    """And then nothing of the model has a 2D box; found for as many boxes as there are none for."""
    rng, found = np.random.default_rng(5), []
    for _ in range(200):
        camera = camera_at(rng.uniform(0, 360), rng.uniform(-80, 80), 2.0)
        low = rng.uniform(-6, 5, 3)
        corners = Box3d.between(low, low + rng.uniform(0.1, 3, 3)).corners
        depth = corners @ camera.R[2] + camera.t[2]
        behind = is_behind(camera, np.stack([corners.min(axis=0), corners.max(axis=0)]))
        assert behind == (depth.max() < 1e-6)
        if behind:
            assert bounds_of(camera, corners) == (None, False)
        found.append(behind)
    assert 20 < sum(found) < 180
