"""The exact rasteriser along parallel rays: closed forms, and an independent caster of a whole scene."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from truth_scenes import cube, mesh_of, orbit_camera, placed, sphere
from viewsphere import Recipe
from viewsphere.assets.cache import load_normalised
from viewsphere.geometry.box import projected_bounds
from viewsphere.geometry.camera import project
from viewsphere.geometry.lenses import lens_parameters
from viewsphere.labels import observe
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.planning.models import numbered_specs
from viewsphere.truth.raster.visibility import rasterize

MODELS = Path(__file__).parents[2].parent / "shared" / "models"

PROFILE = settings(max_examples=15, derandomize=True, deadline=None, database=None)
PARALLEL = lens_parameters("orthographic")


def parallel(width=64, height=48, width_m=3.2, **fields) -> Intrinsics:
    scale = width / width_m
    values = {"fx": scale, "fy": scale, "cx": width / 2, "cy": height / 2} | fields
    return Intrinsics(width=width, height=height, distortion=PARALLEL, **values)


def random_camera(rng, width=160, height=120) -> Camera:
    """A random pose around the scene, near enough that the plane of the camera often cuts through it."""
    skew = {"fy": width / 7.0, "cx": width / 2 + rng.normal(), "skew": rng.normal()}
    intrinsics = parallel(width, height, rng.uniform(2, 9), **skew)
    angles = rng.uniform(0, 2 * np.pi), rng.uniform(-0.2, 1.5)
    return orbit_camera(intrinsics, *angles, rng.uniform(0.2, 7), (0.4, 0.1, 0.5), rng.uniform(-1, 1))


def rays_of(camera):
    """Origins and the direction of all pixels' rays in the world, written out here."""
    i = camera.intrinsics
    v, u = np.indices((i.height, i.width)) + 0.5
    y = (v - i.cy) / i.fy
    x = (u - i.cx - i.skew * y) / i.fx
    return camera.center + x[..., None] * camera.R[0] + y[..., None] * camera.R[1], camera.R[2]


def along(geometry, origin, direction):
    """Distances (T,) at which a ray meets triangles, infinite where it does not, and the least barycentric, all in float64."""
    a, b, c = (geometry.vertices[geometry.triangles[:, k]] - origin for k in range(3))
    with np.errstate(all="ignore"):
        p = np.cross(direction, c - a)
        det = (p * (b - a)).sum(-1)
        u, q = -(p * a).sum(-1) / det, np.cross(-a, b - a)
        v, s = q @ direction / det, (q * (c - a)).sum(-1) / det
        least = np.minimum(np.minimum(u, v), 1 - u - v)
    return np.where((least >= -1e-12) & (s > 0), s, np.inf), least


def wrong_pixels(geometry, camera):
    """The pixels whose triangle differs from Embree's, the largest relative error of z, and the number of pixels with a
    triangle. Pixels are left out if brute force in float64 confirms the rasteriser.
    """
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    scene = EmbreeScene(robust=True)
    TriangleMesh(scene, geometry.vertices.astype(np.float32), geometry.triangles)
    seen, (origins, direction) = rasterize(geometry, camera, keeps_exact=True), rays_of(camera)
    flat = origins.reshape(-1, 3).astype(np.float32)
    hit = scene.run(flat, np.tile(direction, (len(flat), 1)).astype(np.float32), output=True)
    other = np.asarray(hit["primID"], np.int64).reshape(seen.triangle.shape)
    wrong = []
    for row, column in np.argwhere(other != seen.triangle):
        s, _ = along(geometry, origins[row, column], direction)
        triangle, nearest = seen.triangle[row, column], s.min()
        own = s[triangle] if triangle >= 0 else np.inf
        if not (own == nearest or own <= nearest * (1 + 2.0**-21)):
            wrong.append((row, column))
    errors = [0.0]
    for row, column in np.argwhere(seen.triangle >= 0)[::97]:
        s, _ = along(geometry, origins[row, column], direction)
        own = s[seen.triangle[row, column]]
        if np.isfinite(own):
            errors.append(abs(1 / seen.exact[row, column] - own) / own)
    return wrong, max(errors), int((seen.triangle >= 0).sum())


def test_a_cube_seen_straight_on_covers_its_side_and_has_the_depth_of_its_front():
    geometry = placed(cube(), moves=[np.eye(4)])
    low, high = geometry.vertices.min(axis=0), geometry.vertices.max(axis=0)
    camera = orbit_camera(parallel(64, 48, 3.2), distance=5.0)
    seen = rasterize(geometry, camera)
    side = (high - low)[[0, 2]] * 20
    assert (seen.triangle >= 0).sum() == side[0] * side[1]
    depth = 1 / seen.inverse_depth[seen.triangle >= 0]
    assert depth == pytest.approx(5.0 + low[1], rel=1e-6)
    box, whole = projected_bounds(camera, geometry.vertices, geometry.triangles)
    assert whole and box == pytest.approx((32 - side[0] / 2, 24 - side[1] / 2, 32 + side[0] / 2, 24 + side[1] / 2), abs=1e-9)


@pytest.mark.parametrize("distance", [1.5, 40.0])
def test_a_sphere_covers_its_great_circle_at_any_distance(distance):
    ball = sphere(5, 0.9)
    geometry = placed(ball, moves=[np.eye(4)])
    camera = orbit_camera(parallel(400, 300, 2.5), 0.7, 0.4, distance)
    seen = rasterize(geometry, camera)
    radius = np.linalg.norm(geometry.vertices, axis=1).max() * 160
    area = int((seen.triangle >= 0).sum())
    assert 0.995 * math.pi * radius**2 < area <= math.pi * radius**2 + 4 * radius
    assert 1 / seen.inverse_depth.max() == pytest.approx(distance - 0.9, abs=2e-3)


def test_what_is_behind_the_plane_of_the_camera_is_cut_off_exactly():
    """A plate from 2 m in front of the camera to 2 m behind: its front half is seen, and its depth is linear."""
    plate = mesh_of([[-1, -2, -1], [1, -2, -1], [1, 2, 1], [-1, 2, 1]], [[0, 1, 2], [0, 2, 3]])
    geometry = placed(plate, moves=[np.eye(4)])
    camera = orbit_camera(parallel(80, 80, 4.0), distance=1e-12)
    seen = rasterize(geometry, camera)
    rows, columns = np.nonzero(seen.triangle >= 0)
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (20, 39, 20, 59)
    depth = 1 / seen.inverse_depth[20:40, 30]
    assert depth == pytest.approx(2 * (40 - np.arange(20, 40) - 0.5) / 20, rel=1e-6)
    box, whole = projected_bounds(camera, geometry.vertices, geometry.triangles)
    assert not whole and box == pytest.approx((20, 20, 60, 40), abs=1e-4)


@PROFILE
@given(seed=st.integers(0, 10**6))
@pytest.mark.slow
def test_every_pixel_of_a_scene_shows_what_its_ray_meets_first(seed):
    pytest.importorskip("embreex")
    from test_scene_embree import scene

    geometry = scene()[2]
    wrong, error, _ = wrong_pixels(without_far_ground(geometry), random_camera(np.random.default_rng(seed)))
    assert not wrong and error < 1e-9


@pytest.mark.parametrize("source", ["zoo:car", "zoo:chair", "fuze.obj", "awkward/huge_coords_1e7.obj"])
def test_every_pixel_of_a_model_shows_what_its_ray_meets_first(source):
    """Two scenes of the zoo, and two files where they are present."""
    pytest.importorskip("embreex")
    file = MODELS / source if "/" in source else MODELS / "misc" / source
    if not source.startswith("zoo:") and not file.is_file():
        pytest.skip("no shared models here")
    model = {"source": source} if source.startswith("zoo:") else {"source": str(file), "category": "thing"}
    views = {"azimuth": 0, "elevation": 10, "distance": 3}
    recipe = Recipe.model_validate({"name": "x", "models": [model], "viewpoints": views})
    geometry = placed(load_normalised(next(iter(numbered_specs(recipe)))[0]), moves=[np.eye(4)])
    size = float(np.linalg.norm(np.ptp(geometry.vertices, axis=0)))
    rng = np.random.default_rng(5)
    for _ in range(2):
        angles = rng.uniform(0, 2 * np.pi), rng.uniform(-0.3, 1.2)
        wrong, error, count = wrong_pixels(geometry, orbit_camera(parallel(160, 120, 1.1 * size), *angles, 1.5 * size))
        assert not wrong and error < 1e-9 and count > 500


def without_far_ground(geometry):
    from viewsphere.truth.raster.geometry import without_ground

    return without_ground(geometry)


@PROFILE
@given(seed=st.integers(0, 10**6))
def test_the_ground_is_the_whole_plane(seed):
    from test_scene_embree import scene

    geometry, rng = scene()[2], np.random.default_rng(seed)
    camera = random_camera(rng)
    seen, (origins, direction) = rasterize(geometry, camera, keeps_exact=True), rays_of(camera)
    ground = seen.triangle >= geometry.triangle_start[-1]
    height = (geometry.ground_z - origins[..., 2]) / direction[2]
    assert not ground[height <= 0].any()
    assert np.allclose(1 / seen.exact[ground], height[ground], rtol=1e-9, atol=1e-9)
    assert (seen.triangle[height > 1e-9] >= 0).all()


@PROFILE
@given(seed=st.integers(0, 10**6))
def test_windows_samples_and_single_objects_show_the_same_surfaces(seed):
    from test_scene_embree import scene

    geometry, rng = scene()[2], np.random.default_rng(seed)
    camera = random_camera(rng, 60, 40)
    i, whole = camera.intrinsics, rasterize(geometry, camera)
    assert np.array_equal(rasterize(geometry, camera, window=(7, 5, 33, 31)).triangle, whole.triangle[5:31, 7:33])
    fine = rasterize(geometry, camera, subdivision=3)
    assert np.array_equal(fine.triangle[1::3, 1::3], whole.triangle)
    shifted = i.model_copy(update={"cx": i.cx + 10, "cy": i.cy + 10})
    around = rasterize(geometry, Camera(shifted, camera.R, camera.t), object_id=2, window=(0, 0, 80, 60))
    own = rasterize(geometry, camera, object_id=2, window=(-10, -10, 70, 50))
    assert np.array_equal(own.triangle, around.triangle)
    ids = np.where(whole.triangle >= 0, geometry.triangle_object[whole.triangle], 0)
    assert (own.triangle[10:50, 10:70][ids == 2] == whole.triangle[ids == 2]).all()


@PROFILE
@given(seed=st.integers(0, 10**6))
def test_points_normals_and_barycentrics_are_those_of_the_ray(seed):
    from test_scene_embree import scene

    geometry, rng = scene()[2], np.random.default_rng(seed)
    camera = random_camera(rng, 60, 40)
    seen, (origins, direction) = rasterize(geometry, camera), rays_of(camera)
    names = ("position", "barycentrics", "normals_geometric", "depth", "depth_ray", "normals")
    found, hit = observe(geometry, camera, seen, names), seen.triangle >= 0
    expected = origins + found["depth"][..., None].astype(float) * direction
    assert np.allclose(found["position"][hit], expected[hit], rtol=1e-5, atol=1e-5)
    assert np.array_equal(found["depth"], found["depth_ray"])
    corners = geometry.vertices[geometry.triangles[seen.triangle[hit]]]
    on = (found["barycentrics"][hit][..., None] * corners).sum(axis=1)
    near = np.abs(corners).max(axis=(1, 2)) < 100
    assert np.allclose(on[near], expected[hit][near], rtol=1e-4, atol=1e-4)
    assert (found["normals_geometric"][hit][:, 2] <= 0).all() and (found["normals"][hit][:, 2] < 1e-6).all()
    xy, is_shown = project(camera.intrinsics, expected[hit] @ camera.R.T + camera.t)
    rows, columns = np.nonzero(hit)
    assert is_shown.all() and np.allclose(xy, np.column_stack((columns, rows)) + 0.5, atol=1e-9)
