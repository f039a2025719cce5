"""Shots that no recipe makes yet: a thing that moves over three instants, and a rig of two sensors of different size.

Every label of theirs is proved by rays that Embree casts at meshes which this test places itself.
"""

import math

import numpy as np
import pytest

from viewsphere.composing.viewpoints.camera import looking
from viewsphere.geometry.camera import pixel_rays
from viewsphere.geometry.lenses import lens_parameters
from viewsphere.model.instant import Instant, Viewpoint
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import IDENTITY, Ground, Scene
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.model.sensors.rig import Rig, Sensor
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Motion, Thing
from viewsphere.run.shots.stages import Stages

trimesh = pytest.importorskip("trimesh")
pytest.importorskip("embreex")

CHAIR = ModelSpec(key="chair", source="zoo:chair", seed=4, category="chair", category_id=1)
BOX = ModelSpec(key="bin", source="zoo:wheelie_bin", seed=2, category="bin", category_id=2)
CHANNELS = ("rgb", "depth", "instances", "categories", "coordinates")
AHEAD = Viewpoint(index=0, azimuth_deg=25, elevation_deg=18, distance=4.2)
LENS = Intrinsics(width=96, height=72, fx=110, fy=110, cx=48, cy=36)


def at(x: float, y: float, z: float, turn_deg: float):
    c, s = math.cos(math.radians(turn_deg)), math.sin(math.radians(turn_deg))
    return ((c, -s, 0.0, x), (s, c, 0.0, y), (0.0, 0.0, 1.0, z), (0.0, 0.0, 0.0, 1.0))


def moving_shot(engine="raster") -> Shot:
    """A bin that stands, a chair that passes before it, turns, and is not there at the fourth instant."""
    passing = Motion(poses=(at(-0.7, -0.6, 0.6, 0), at(0.0, -0.7, 0.9, 40), at(0.6, -0.5, 0.7, 125), None))
    things = (Thing(id=1, model=CHAIR, motion=passing), Thing(id=2, model=BOX, motion=Motion.still(at(0.1, 0.3, 0.6, 10))))
    instants = tuple(
        looking(AHEAD.model_copy(update={"azimuth_deg": 25 + 4 * i}), (0.0, 0.0, 0.5), index=i, split="train") for i in range(4)
    )
    return Shot(
        key="moving", things=things, rig=Rig.single(LENS), instants=instants, scene=Scene(ground=Ground()), first=40,
        sequence="passing", engine=engine, engine_options=OPTIONS[engine], channels=CHANNELS,
    )  # fmt: skip


def rig_shot(engine="raster") -> Shot:
    """Two cameras, the second wider, smaller, bent, and mounted to the right of the first, turned inwards."""
    bent = lens_parameters("brown_conrady", coefficients=(-0.2, 0.05, 0.001, -0.002))
    wide = Intrinsics(width=80, height=60, fx=50, fy=52, cx=39, cy=31, distortion=bent if engine == "raster" else None)
    c, s = math.cos(-0.12), math.sin(-0.12)
    mounted = ((c, 0.0, s, 0.5), (0.0, 1.0, 0.0, 0.05), (-s, 0.0, c, -0.1), (0.0, 0.0, 0.0, 1.0))
    rig = Rig(sensors=(Sensor(name="left", intrinsics=LENS), Sensor(name="right", intrinsics=wide, rig_from_sensor=mounted)))
    return moving_shot(engine).model_copy(update={"key": "rig", "rig": rig})


OPTIONS = {"raster": {}, "cycles": {"samples": 1, "denoise": "off"}}
SHOTS = {"moving": moving_shot, "rig": rig_shot}


def world_triangles(stages: Stages, shot: Shot, instant: int):
    """Corners (T, 3, 3) of all that is there at an instant, the owner of each triangle."""
    corners, owners = [], []
    for thing in shot.things:
        pose = thing.motion.poses[0] if len(thing.motion.poses) == 1 else thing.motion.poses[instant]
        if pose is None:
            continue
        mesh, world = stages.model(thing.model), np.array(pose)
        points = mesh.vertices.astype(float) @ world[:3, :3].T + world[:3, 3]
        corners.append(points[mesh.triangles])
        owners.append(np.full(len(mesh.triangles), thing.id))
    return np.concatenate(corners), np.concatenate(owners)


def sensor_camera(shot: Shot, instant: int, sensor: int) -> Camera:
    """Written out again: world from rig, then rig from sensor, inverted."""
    mounted = shot.rig.sensors[sensor]
    world = np.array(shot.instants[instant].world_from_rig) @ np.array(mounted.rig_from_sensor)
    return Camera(mounted.intrinsics, world[:3, :3].T, -world[:3, :3].T @ world[:3, 3])


def cast(corners, camera):
    """Depth (H, W), inf where nothing is, and the triangle met, by Embree."""
    rays = pixel_rays(camera.intrinsics)
    mesh = trimesh.Trimesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3), process=False)
    directions = rays.reshape(-1, 3) @ camera.R
    origins = np.broadcast_to(camera.center, directions.shape)
    where, ray, triangle = mesh.ray.intersects_location(origins, directions, multiple_hits=False)
    depth, met = np.full(len(directions), np.inf), np.full(len(directions), -1)
    depth[ray] = ((where - camera.center) @ camera.R.T)[:, 2]
    met[ray] = triangle
    return depth.reshape(rays.shape[:2]), met.reshape(rays.shape[:2])


def proved(shot: Shot, samples) -> None:
    """Ids, masks, boxes and depth are what Embree sees of the things where they are at each instant."""
    stages, sensors = Stages(), len(shot.rig.sensors)
    for position, sample in enumerate(samples):
        instant, sensor = divmod(position, sensors)
        camera = sensor_camera(shot, instant, sensor)
        assert (sample.index, sample.instant, sample.sequence) == (shot.first + position, instant, shot.sequence)
        assert sample.sensor == shot.rig.sensors[sensor].name
        np.testing.assert_allclose(sample.camera.R, camera.R, atol=1e-12)
        np.testing.assert_allclose(sample.camera.t, camera.t, atol=1e-12)
        corners, owners = world_triangles(stages, shot, instant)
        depth, met = cast(corners, camera)
        ids = np.where(met >= 0, owners[met], 0)
        assert sample.rgb.shape == (*ids.shape, 3)
        assert (sample.instances != ids).mean() < 2e-3  # rays along an outline
        same = (sample.instances == ids) & (ids > 0)
        assert np.abs(sample.depth[same] / depth[same] - 1).max() < 1e-4
        there = {thing.id for thing in shot.things if thing.motion.pose_at(instant) is not None}
        assert [o.id for o in sample.objects] == sorted(there)
        for o in sample.objects:
            assert np.array_equal(o.mask, sample.instances == o.id) and o.area == o.mask.sum() > 15
            np.testing.assert_allclose(o.world_from_object, shot.things[o.id - 1].motion.pose_at(instant), atol=1e-12)
            np.testing.assert_allclose(o.camera_from_object[:3, :3], camera.R @ o.world_from_object[:3, :3], atol=1e-12)
            world = sample.coordinates[o.mask].astype(float) @ o.world_from_object[:3, :3].T + o.world_from_object[:3, 3]
            seen = (world @ camera.R.T + camera.t)[:, 2]
            assert np.abs(seen - sample.depth[o.mask]).max() < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("name", SHOTS)
def test_labels_of_what_moves_and_of_every_sensor_are_what_embree_sees(name):
    shot = SHOTS[name]()
    samples = list(Stages().render(shot))
    assert len(samples) == len(shot.instants) * len(shot.rig.sensors)
    proved(shot, samples)
    positions = {i: s.objects[0].world_from_object[0, 3] for i, s in enumerate(samples) if s.objects[0].id == 1}
    assert len(set(positions.values())) == 3


@pytest.mark.slow
def test_any_cut_of_a_sequence_gives_the_same_samples():
    """One by one, from a stage that was warm for another instant, or all together."""
    shot, stages = moving_shot(), Stages()
    whole = list(Stages().render(shot))
    for i in reversed(range(len(shot.instants))):
        things = shot.things_at(i)
        one = shot.model_copy(update={"things": things, "instants": shot.instants[i : i + 1], "first": shot.first + i})
        (sample,) = stages.render(one)
        assert all(np.array_equal(sample.channels[n], whole[i].channels[n], equal_nan=n == "coordinates") for n in CHANNELS)
        assert [o.rle for o in sample.objects] == [o.rle for o in whole[i].objects]


@pytest.mark.parametrize("name", SHOTS)
def test_cycles_paints_them_and_its_labels_are_the_same(name, blender):
    shot = SHOTS[name]("cycles")
    samples = list(Stages().render(shot))
    proved(shot, samples)
    here = list(Stages().render(SHOTS[name]("cycles").model_copy(update={"engine": "raster", "engine_options": {}})))
    for theirs, ours in zip(samples, here, strict=True):
        assert np.array_equal(theirs.instances, ours.instances) and np.array_equal(theirs.depth, ours.depth)
        shown = theirs.rgb.astype(int).sum(axis=2)
        assert shown[theirs.instances > 0].std() > 0 and shown[theirs.instances == 0].std() > 0


def test_shots_that_cannot_be_are_refused():
    shot = moving_shot()
    with pytest.raises(ValueError, match=r"one an instant \(2\); found 4"):
        Shot.model_validate(shot.model_dump() | {"instants": shot.model_dump()["instants"][:2]})
    with pytest.raises(ValueError, match="different names"):
        Rig(sensors=(Sensor(intrinsics=LENS), Sensor(intrinsics=LENS)))
    with pytest.raises(ValueError, match="axes to be those of its first sensor"):
        Rig(sensors=(Sensor(intrinsics=LENS, rig_from_sensor=at(0, 0, 1, 0)),))
    assert Instant(index=0, world_from_rig=IDENTITY, focus=(0, 0, 0)).viewpoint is None


def test_an_instant_at_which_nothing_is_there():
    shot = moving_shot()
    alone = shot.model_copy(update={"things": shot.things[:1], "scene": Scene()})
    *before, last = Stages().render(alone)
    assert all(len(sample.objects) == 1 for sample in before)
    assert last.objects == ()
    assert not last.channels["instances"].any() and np.isinf(last.channels["depth"]).all()
