"""Pictures of a sequence: what was moved looks as what was built at that instant, wherever the sequence is cut."""

from __future__ import annotations

import numpy as np
import pytest
from test_raster import box, mesh_of, rectangle

from shots import still_shot
from viewsphere.assets.mesh import Material
from viewsphere.engines import raster
from viewsphere.engines.raster.shadows.still_maps import MOST, STEPS, StillMaps, rounded, snapped
from viewsphere.model.instant import Viewpoint
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Ground, PointLight, Scene, Sun
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.thing import Motion, Thing
from viewsphere.truth.raster.visibility import rasterize

COUNT = 5
LENS = Intrinsics(width=128, height=96, fx=120, fy=120, cx=64, cy=48)
SUN = Sun(azimuth=60, elevation=40, angle_deg=1.0)
GLASS = Material("glass", (0.2, 0.8, 0.3, 0.4), alpha_mode="BLEND")
MESHES = {
    "tall": mesh_of(box((-0.3, -0.3, -0.5), (0.3, 0.3, 0.5))),
    "pane": mesh_of(rectangle((-0.6, 0, -0.4), (1.2, 0, 0), (0, 0, 0.8)), GLASS),
    "wall": mesh_of(box((-2.0, 1.6, -0.6), (2.0, 1.8, 1.2))),
    "long": mesh_of(box((-0.9, -0.2, -0.2), (0.9, 0.2, 0.2))),
}
SCENES = {
    "sun": Scene(sun=SUN, ground=Ground(), floor=-1.0),
    "lamp": Scene(sun=None, lights=(PointLight(position=(0.6, -1.0, 1.8), strength=6.0),), ground=Ground(), floor=-1.0),
}


def pose(i, speed, turn):
    c, s = np.cos(turn * i), np.sin(turn * i)
    return ((c, -s, 0.0, speed * (i - 3)), (s, c, 0.0, -0.3 * speed * i), (0.0, 0.0, 1.0, 0.1 * i), (0.0, 0.0, 0.0, 1.0))


def thing(number, key, motion, scenery=False):
    spec = ModelSpec(key=key, source="memory", category="c", category_id=number)
    return Thing(id=number, model=spec, motion=motion, scenery=scenery)


def sequence_of(scene, has_scenery=False, sequence="drive", moves=False):
    """A tall box that drives and turns, a pane that comes and goes, a long box that stands still; scenery that `moves`."""
    gone = Motion(poses=tuple(pose(i, -0.25, 0.3) if i not in (1, 4) else None for i in range(COUNT)))
    things = [
        thing(1, "tall", Motion(poses=tuple(pose(i, 0.2, 0.5) for i in range(COUNT)))),
        thing(2, "pane", gone),
        thing(3, "long", Motion.still(pose(3, 0.1, 0.2))),
    ]
    things += [thing(0, "wall", Motion(), scenery=True)] * has_scenery
    things += [thing(0, "long", Motion(poses=tuple(pose(i, 0.4, 0.1) for i in range(COUNT))), scenery=True)] * moves
    views = [Viewpoint(index=i, azimuth_deg=20, elevation_deg=35, distance=5) for i in range(COUNT)]
    return still_shot(things, LENS, views, scene=SCENES[scene], sequence=sequence)


def stage_of(shot):
    return raster.stage(shot, lambda spec: MESHES[spec.key])


def picture(stage, i, transparent=False):
    name = "rgba" if transparent else "rgb"
    return stage.paint(i, 0, rasterize(stage.at(i), stage.shot.camera(i)), (name,))[name]


def cut(shot, first, stop):
    """These instants of a shot alone."""
    things = [
        each if each.motion.is_still else each.model_copy(update={"motion": Motion(poses=each.motion.poses[first:stop])})
        for each in shot.things
    ]
    return shot.model_copy(update={"things": tuple(things), "instants": shot.instants[first:stop]})


@pytest.mark.slow
@pytest.mark.parametrize(
    "scene, has_scenery, moves", [("sun", False, False), ("sun", True, True), ("lamp", True, False), ("lamp", False, True)]
)
def test_an_instant_looks_as_if_it_were_built_alone(scene, has_scenery, moves):
    """In any order, with a neighbour's geometry asked for between, on one stage or cut into shots of any length."""
    shot = sequence_of(scene, has_scenery, moves=moves)
    alone = [picture(stage_of(shot), i) for i in range(COUNT)]
    assert len({one.tobytes() for one in alone}) == COUNT
    stage = stage_of(shot)
    for i in (0, 1, 2, 3, 4, 2, 1, 4, 0):
        visible = rasterize(stage.at(i), shot.camera(i))
        stage.at((i + 1) % COUNT)
        stage.at((i - 1) % COUNT)
        assert np.array_equal(stage.paint(i, 0, visible, ("rgb",))["rgb"], alone[i]), i
    for first, stop in ((0, 2), (2, 3), (3, 5)):
        part = stage_of(cut(shot, first, stop))
        for i in range(first, stop):
            assert np.array_equal(picture(part, i - first), alone[i]), i
    again = stage.for_shot(shot)
    assert np.array_equal(picture(again, 3), alone[3])


@pytest.mark.slow
@pytest.mark.parametrize("has_scenery", [False, True])
def test_stills_of_what_moves_are_those_of_what_stands(has_scenery):
    """No sequence: each instant is a picture of its own, equal to the bit to one of things that stand there."""
    shot = sequence_of("sun", has_scenery, sequence="")
    stage = stage_of(shot)
    for i in range(COUNT):
        alone = shot.model_copy(update={"things": shot.things_at(i)})
        assert np.array_equal(picture(stage, i), picture(stage_of(alone), i))


@pytest.mark.parametrize(
    "scene, occlusion, most, share",
    [
        ("sun", "off", 0.6, 0.02),
        ("lamp", "off", 0.3, 0.01),
        pytest.param("sun", "fast", 2.0, 0.03, marks=pytest.mark.slow),
        pytest.param("lamp", "fast", 2.0, 0.03, marks=pytest.mark.slow),
    ],
)
def test_a_sequence_looks_like_stills(scene, occlusion, most, share):
    """But for the shadows' edges, as maps are a little coarser where they stay in place for a while; and for ambient
    occlusion, which each target has of its own.
    """
    option = {"engine_options": {"ambient_occlusion": occlusion}}
    moving, still = (stage_of(sequence_of(scene, sequence=name).model_copy(update=option)) for name in ("drive", ""))
    for i in range(COUNT):
        apart = np.abs(picture(moving, i).astype(int) - picture(still, i)).max(axis=-1)
        assert apart.mean() < most and (apart > 8).mean() < share, (apart.mean(), (apart > 8).mean())


@pytest.mark.slow
def test_a_stage_tells_stills_from_a_sequence():
    stage = stage_of(sequence_of("sun"))
    moving = picture(stage, 1)
    still = stage.for_shot(sequence_of("sun", sequence=""))
    assert np.array_equal(picture(still, 1), picture(stage_of(still.shot), 1))
    assert np.array_equal(picture(stage, 1), moving)


@pytest.mark.slow
def test_what_stands_still_is_drawn_once():
    """As long as the map stays where it is, and nothing comes or goes."""
    slow = Motion(poses=tuple(pose(0.01 * i, 0.2, 0.0) for i in range(COUNT)))
    shot = sequence_of("sun", has_scenery=True)
    stage = stage_of(
        shot.model_copy(
            update={"things": (thing(1, "tall", slow), thing(2, "long", Motion.still(pose(3, 0.1, 0.2))), shot.things[3])}
        )
    )
    maps = []
    for i in range(COUNT):
        stage.baked(i)
        maps.append(stage._packed[0].maps)
    assert all(each is maps[0] for each in maps) and len(maps[0]._maps) <= 2
    assert sum(len(part().triangles) for part in maps[0].moving) == 12
    assert sum(len(part().triangles) for part in maps[0].still) + 12 == len(stage.at(0).triangles)


@pytest.mark.slow
def test_what_is_in_no_picture_has_no_rows_but_casts_shadows():
    """A wall behind the camera, which shades the ground before it, beside one that is looked at."""
    behind = Motion.still(((1, 0, 0, 0.0), (0, 1, 0, -8.0), (0, 0, 3, 1.0), (0, 0, 0, 1)))
    shot = sequence_of("sun", has_scenery=True)
    low = SUN.model_copy(update={"azimuth": 0.0, "elevation": 20.0})
    scene = shot.scene.model_copy(update={"sun": low})
    shot = shot.model_copy(update={"things": (*shot.things, thing(0, "wall", behind, scenery=True)), "scene": scene})
    stage = stage_of(shot)
    own = picture(stage, 0)
    rows = stage.baked(0).rows
    assert rows._written.tolist() == [True, True, True, True, False]
    rows.write([4])
    assert np.array_equal(picture(stage, 0), own)
    alone = shot.model_copy(update={"things": shot.things[:-1]})
    assert (picture(stage_of(alone), 0).astype(int) - own > 20).any()


def test_few_maps_are_kept():
    rows = stage_of(sequence_of("sun")).baked(0).rows
    maps = StillMaps.for_things(rows.part, 1, (), 1)
    for i in range(3 * MOST):
        maps.keep((b"", float(i), 0.0, 4), np.full((4, 20), i, np.float32))
    assert maps.begun((b"", 0.0, 0.0, 4)) is None
    assert [maps.begun((b"", float(i), 0.0, 4))[0, 0] for i in range(2 * MOST, 3 * MOST)] == [*range(2 * MOST, 3 * MOST)]


def test_a_snapped_map_holds_what_the_fitted_one_does():
    rng = np.random.default_rng(0)
    for _ in range(200):
        span, middle = 10 ** rng.uniform(-3, 3), rng.normal(size=2) * 100
        wide, centre = snapped(span, middle)
        assert (np.abs(centre - middle) + span / 2 <= wide / 2 * (1 + 1e-9)).all()
        assert wide <= span * 2**0.25 * STEPS / (STEPS - 1) * (1 + 1e-9)
        assert rounded(wide) == pytest.approx(wide) or rounded(wide) == pytest.approx(wide * 2**0.25)
