"""A LiDAR's points against Embree and a sphere's closed form."""

from dataclasses import dataclass

import numpy as np
import pytest

from proven import told
from truth_scenes import placed, random_soup, sphere
from viewsphere.geometry.camera import pixel_rays
from viewsphere.labels import LabelContext
from viewsphere.labels.lidar import LABEL
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.sensors.rig import Sensor
from viewsphere.recipe.cameras.lidar import LidarEntry
from viewsphere.truth.raster.visibility import rasterize
from viewsphere.truth.shot_views import Painted

WHITE = Painted((), (), None)


@dataclass(frozen=True)
class Alone:
    """What is around a sample of one sensor; all is white."""

    sensor: Sensor
    drawn_as: tuple[str, ...] = ("shot", "top", "0.0", "here")
    painted: Painted = WHITE


def turned(rng):
    """Any rotation."""
    q = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return np.ascontiguousarray(q * np.linalg.det(q))


def measured(geometry, camera, said):
    sensor = Sensor(intrinsics=camera.intrinsics, lidar=said.measuring(0))
    return LABEL.compute(LabelContext(geometry, camera, rasterize(geometry, camera), neighbours=Alone(sensor)))


def entry(**more):
    said = {"rings": 24, "elevation": [-60, 60], "azimuth_step": 2, "range": [0, 1000]} | more
    return LidarEntry.model_validate(said)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_embree_finds_the_same_ranges(seed):
    """Within 1e-4 m, in random scenes."""
    pytest.importorskip("embreex")
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    rng, said = np.random.default_rng(seed), entry()
    geometry = placed(random_soup(rng, 400, spread=5.0))
    camera = Camera(said.intrinsics, turned(rng), rng.normal(size=3))
    rows = measured(geometry, camera, said)
    scene = EmbreeScene(robust=True)
    TriangleMesh(scene, geometry.vertices.astype(np.float32), geometry.triangles)
    rays = pixel_rays(said.intrinsics)
    directions = (rays.reshape(-1, 3) @ camera.R).astype(np.float32)
    hit = scene.run(np.broadcast_to(camera.center.astype(np.float32), directions.shape).copy(), directions, output=True)
    ranges = np.where(np.asarray(hit["primID"]) < 0, np.inf, np.asarray(hit["tfar"], np.float64)).reshape(rays.shape[:2])
    own = np.full(ranges.shape, np.inf)
    own[rows["ring"], rows["column"]] = rows["range"]
    both = np.isfinite(own) & np.isfinite(ranges)
    assert both.sum() > 500
    differs = np.isfinite(own) != np.isfinite(ranges)
    differs[both] = np.abs(own[both] - ranges[both]) > 1e-4
    assert differs.sum() <= 2  # edges that rays graze
    told("lidar", "Embree's rays", own[both & ~differs] - ranges[both & ~differs], "m")


def test_points_of_a_ball_lie_on_it():
    """Their normals are the directions from its middle, as far as its faces are small."""
    rng, said = np.random.default_rng(0), entry(rings=None, elevation=None, elevations=[20, 5, 0, -7])
    geometry = placed(sphere(5, 1.5))
    camera = Camera(said.intrinsics, turned(rng), np.array([0.3, -0.4, 2.5]))
    rows = measured(geometry, camera, said)
    x, y, z = rows["xyz"].astype(np.float64).T
    world = (np.stack([-y, -z, x], axis=1) - camera.t) @ camera.R
    assert len(rows) > 20
    np.testing.assert_allclose(np.linalg.norm(world, axis=1), 1.5, atol=2e-3)
    outwards, there = world / np.linalg.norm(world, axis=1)[:, None], camera.center - world
    angles = np.arccos((outwards * there).sum(axis=1) / np.linalg.norm(there, axis=1))
    np.testing.assert_allclose(rows["incidence"], angles, atol=0.06)
    np.testing.assert_allclose(rows["range"], np.linalg.norm(there, axis=1), rtol=1e-5)


def test_a_sweep_of_many_triangles_has_each_ray_once():
    """From inside a ball every ray returns."""
    said = entry()
    geometry = placed(sphere(4, 3.0))
    rows = measured(geometry, Camera(said.intrinsics, np.eye(3), np.array([0.5, 0.2, -0.3])), said)
    assert len(rows) == said.intrinsics.width * said.intrinsics.height
    assert len(np.unique(rows[["ring", "column"]])) == len(rows)
