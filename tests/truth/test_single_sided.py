"""Single-sided surfaces: cameras see them from their fronts alone, by any lens; without the option nothing changes."""

import math
from dataclasses import replace

import numpy as np
import pytest

from truth_scenes import FISHEYE, LENSES, cast, lens, mesh_of, orbit_camera, random_soup
from viewsphere.assets.mesh import Material, Mesh
from viewsphere.engines.raster.antialiasing.samples import edge_samples
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.thing import Motion, Thing
from viewsphere.recipe.cameras.lidar import LidarEntry
from viewsphere.truth.correspondences.correspondence import Match
from viewsphere.truth.lidar.sweeping import Turning, still_hits, swept_hits
from viewsphere.truth.raster.geometry import build_geometry, seen_from, with_both_sides
from viewsphere.truth.raster.visibility import homogeneous, rasterize
from viewsphere.truth.surface_points.raster import OCCLUDED, VISIBLE
from viewsphere.truth.view import View

SINGLE = Material(double_sided=False)


def things(count, faces):
    specs = [
        ModelSpec(key=f"m{i}", source="m", category="thing", category_id=i + 1, faces=None if faces == "both" else faces)
        for i in range(count)
    ]
    return [
        Thing(id=i + 1, model=spec, motion=Motion.still(tuple(map(tuple, np.eye(4).tolist())))) for i, spec in enumerate(specs)
    ]


def geometry_of(*meshes: Mesh, faces="as_file", ground=False):
    return build_geometry(things(len(meshes), faces), meshes, ground, 0.01)


def without_backs(mesh: Mesh, eye) -> Mesh:
    """The mesh, whose single-sided triangles that face away from a point are points."""
    a, b, c = (mesh.vertices[mesh.triangles[:, i]].astype(np.float64) for i in range(3))
    single = np.array([not m.double_sided for m in mesh.materials])[mesh.triangle_material]
    turned = single & ((np.cross(b - a, c - a) * (eye - a)).sum(axis=1) <= 0)
    triangles = mesh.triangles.copy()
    triangles[turned] = triangles[turned, :1]
    return replace(mesh, triangles=triangles)


def plate(y, half=1.0, front=-1, material=SINGLE) -> Mesh:
    """A square at this y, whose front looks along -y or +y."""
    x = half * np.array([-1, 1, 1, -1])
    corners = np.stack([x, np.full(4, y), half * np.array([-1, -1, 1, 1])], axis=1)
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    return mesh_of(corners, triangles if front < 0 else triangles[:, ::-1], materials=(material,))


@pytest.mark.parametrize("name", LENSES)
@pytest.mark.parametrize("seed", range(3))
def test_what_is_seen_is_what_remains_without_the_backs(name, seed):
    """Against the same scene without them, and against every ray by brute force."""
    rng = np.random.default_rng(seed)
    soup = random_soup(rng, 30)
    two = replace(soup, materials=(SINGLE, Material()), triangle_material=rng.integers(0, 2, 30).astype(np.int32))
    camera = orbit_camera(lens(40, 30, math.radians(80), LENSES[name]), *rng.uniform(-3, 3, 2), rng.uniform(0.5, 4))
    seen = rasterize(geometry_of(two), camera)
    left = geometry_of(without_backs(two, camera.center))
    expected = rasterize(left, camera)
    np.testing.assert_array_equal(seen.triangle, expected.triangle)
    np.testing.assert_array_equal(seen.inverse_depth, expected.inverse_depth)
    triangle, _, margin, gap = cast(left, camera)
    sure = (margin > 1e-9) & (gap > 1e-6)
    np.testing.assert_array_equal(seen.triangle[sure], triangle[sure])
    both = rasterize(geometry_of(two, faces="both"), camera)
    assert (both.triangle != seen.triangle).any()


def test_a_plate_is_seen_from_its_front_and_not_from_its_back():
    front = orbit_camera(lens(), 0.0, 0.0, 5.0)
    back = orbit_camera(lens(), math.pi, 0.0, 5.0)
    geometry = geometry_of(plate(0.0))
    seen = (rasterize(geometry, front).triangle >= 0).sum()
    assert seen == (rasterize(geometry_of(plate(0.0), faces="both"), front).triangle >= 0).sum() > 100
    assert (rasterize(geometry, back).triangle < 0).all()
    alone = rasterize(geometry, back, object_id=1, window=(-64, -48, 128, 96))
    assert (alone.triangle < 0).all()


def test_through_a_back_the_object_behind_is_seen():
    geometry = geometry_of(plate(-1.0, front=1), plate(0.0))
    camera = orbit_camera(lens(), 0.0, 0.0, 5.0)
    seen = rasterize(geometry, camera)
    ids = seen.instances(geometry).ids
    assert set(np.unique(ids)) == {0, 2}
    np.testing.assert_allclose(1 / seen.inverse_depth[ids == 2], 5.0, rtol=1e-6)
    both = geometry_of(plate(-1.0, front=1), plate(0.0), faces="both")
    assert set(np.unique(rasterize(both, camera).instances(both).ids)) == {0, 1}


@pytest.mark.parametrize("distortion", [None, FISHEYE], ids=["pinhole", "fisheye"])
def test_a_point_is_occluded_where_its_side_is_turned_away(distortion):
    meshes, intrinsics = (plate(0.0),), lens(distortion=distortion)
    cameras = [orbit_camera(intrinsics, azimuth, 0.0, 5.0) for azimuth in (0.0, 0.3, math.pi)]
    for faces, last in (("as_file", OCCLUDED), ("both", VISIBLE)):
        geometry = geometry_of(*meshes, faces=faces)
        here, aside, behind = (View(things(1, faces), geometry, camera, True) for camera in cameras)
        shown = here.visibility.triangle >= 0
        assert shown.any()
        for other, state in ((aside, VISIBLE), (behind, last)):
            assert (Match(here, here.visibility, other).state[shown] == state).all()


@pytest.mark.parametrize("distortion", [None, FISHEYE], ids=["pinhole", "fisheye"])
def test_a_back_hides_no_points(distortion):
    """The plate before the one that is seen turns its back to the second camera, too, which looks from elsewhere."""
    meshes, intrinsics = (plate(-1.0, 0.4, front=1), plate(0.0)), lens(distortion=distortion)
    cameras = [orbit_camera(intrinsics, azimuth, 0.0, 5.0) for azimuth in (0.0, 0.4)]
    states = []
    for faces in ("as_file", "both"):
        geometry = geometry_of(*meshes, faces=faces)
        here, there = (View(things(2, faces), geometry, camera, True) for camera in cameras)
        seen = here.visibility.instances(geometry).ids == 2
        states.append(set(np.unique(Match(here, here.visibility, there).state[seen])))
    assert states == [{VISIBLE}, {VISIBLE, OCCLUDED}]


@pytest.mark.parametrize("distortion", [None, FISHEYE], ids=["pinhole", "fisheye"])
def test_samples_at_edges_show_no_backs(distortion):
    meshes = (plate(-1.0, 0.4, front=1), plate(0.0))
    camera = orbit_camera(lens(distortion=distortion), 0.1, 0.2, 5.0)
    found = []
    for faces in (meshes, meshes[1:]):
        geometry = geometry_of(*faces)
        samples = edge_samples(
            geometry, camera, rasterize(geometry, camera), np.arange(len(geometry.triangles), dtype=np.int32)
        )
        assert samples is not None
        found.append(samples)
    np.testing.assert_array_equal(found[0].pixels, found[1].pixels)
    np.testing.assert_array_equal(np.maximum(found[0].triangle - 2, -1), found[1].triangle)


@pytest.mark.parametrize("is_swept", [False, True])
def test_a_lidar_passes_the_backs_of_walls(is_swept):
    """The near wall turns its back to the sensor, also while it moves; the far one its front."""
    own = LidarEntry(rings=8, elevation=(-10, 10), azimuth_step=2, range=(0, 1000), azimuth=(-40, 40)).intrinsics
    ahead = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    camera = Camera(own, ahead, np.zeros(3))
    walls = plate(10.0, 100.0, front=1), plate(20.0, 100.0)
    geometry = geometry_of(*walls)
    if is_swept:
        still = np.broadcast_to(ahead, (own.width, 3, 3)), np.zeros((own.width, 3))
        nearer = np.tile(np.eye(4), (own.width, 1, 1))
        nearer[:, 1, 3] = -np.linspace(0, 1, own.width)
        hits = swept_hits(geometry, camera, Turning(*map(np.ascontiguousarray, still), {0: nearer}))
    else:
        hits = still_hits(geometry, camera, rasterize(geometry, camera))
    assert len(hits.distance) == own.width * own.height
    np.testing.assert_allclose(hits.place[:, 1], 20.0, rtol=1e-5)


def test_without_the_option_the_geometry_is_the_same_object():
    geometry = geometry_of(plate(0.0), faces="both")
    q = homogeneous(geometry, orbit_camera(lens(), math.pi, 0.0, 5.0))
    assert not len(geometry.single_sided) and seen_from(geometry, q) is geometry and with_both_sides(geometry) is geometry


def test_a_mirror_shows_both_sides():
    camera = orbit_camera(lens(), math.pi, 0.0, 5.0)
    mirrored = with_both_sides(geometry_of(plate(0.0)))
    assert (rasterize(mirrored, Camera(camera.intrinsics, camera.R, camera.t)).triangle >= 0).any()
