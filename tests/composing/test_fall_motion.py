"""Things that are seen while they fall: as motion over time, and caught in flight."""

import itertools
from functools import lru_cache, partial

import numpy as np
import pytest
from test_fall import fallen, options

from resting import deepest, depth, placed, solids, spec
from small import small_recipe
from viewsphere import plugins
from viewsphere.assets.cache import load_normalised
from viewsphere.composing.layouts import Carried
from viewsphere.composing.placing import Room, Way
from viewsphere.composing.seeds import generator
from viewsphere.errors import RecipeError
from viewsphere.geometry.box3d import Box3d
from viewsphere.model.scene import IDENTITY
from viewsphere.planning.plan import plan
from viewsphere.plugins.placer import PlacerSpec


@lru_cache
def box_of(model, step=None):
    return Box3d.between(*load_normalised(model).bounds).corners


def ways(shapes, seed=0, **given):
    keys, rng = [spec(f"m{i}") for i in range(len(shapes))], partial(generator, seed, "layout")
    room, own = Room(field="scenes", moves=True), options("fall", **given)
    module = plugins.load(PlacerSpec, "fall")
    return module.ways(keys, room, shapes, rng, own), module.place(keys, room, shapes, (), rng, own)


@pytest.mark.parametrize("scale", [0.2, 1.0, 8.0])
def test_things_fall_as_fast_as_they_do_and_end_where_they_are_placed(scale):
    shapes = solids(3, scale=scale)
    found, rest = ways(shapes, drop=2.0 * scale)
    for way, pose in zip(found, rest, strict=True):
        np.testing.assert_allclose(way.pose_at(way.seconds[-1]), pose, atol=2e-6 * max(1, scale))
        assert way.pose_at(1e9) == way.pose_at(way.seconds[-1]) and way.pose_at(-1) == way.pose_at(0)
        start, early = np.array(way.pose_at(0.0)), 0.3 * (scale**0.5)
        seconds = np.linspace(0, early, 7)
        heights = np.array([way.pose_at(t)[2][3] for t in seconds])
        np.testing.assert_allclose(heights, start[2, 3] - 9.81 / 2 * seconds**2, atol=0.01 * scale)


def test_a_way_is_straight_between_its_states():
    way = Way((0.0, 1.0, 3.0), ((0, 0, 0, 1, 0, 0, 0), (0, 0, 1, 1, 0, 0, 0), (2, 0, 1, 0, 0, 0, 1)))
    assert way.pose_at(0.25)[2][3] == 0.25 and way.pose_at(2.0)[0][3] == 1.0
    np.testing.assert_allclose(np.array(way.pose_at(2.0))[:3, :3], [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-12)
    up = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 5.0), (0.0, 0.0, 0.0, 1.0))
    assert Carried(way, up, IDENTITY).pose_at(1.0)[2][3] == 6.0


def test_what_is_caught_in_flight_is_not_in_anything_and_some_of_it_in_the_air():
    shapes, heights = solids(5), []
    for seed in range(6):
        poses = fallen(shapes, seed=seed, given={"moment": "mid", "drop": 0.5})
        hulls = placed(shapes, poses)
        assert deepest(hulls) < 0.002 and min(hull[:, 2].min() for hull in hulls) > -0.002
        heights += [hull[:, 2].min() for hull in hulls]
        assert poses == fallen(shapes, seed=seed, given={"moment": "mid", "drop": 0.5})
    assert np.mean(np.array(heights) > 0.02) > 0.3


def sequence(layout="fall", motion="fall", **changes):
    values = {
        "models": [{"source": "zoo:post_box", "count": 3, "scale": {"length": 0.18}, "motion": {"kind": motion}}],
        "scenes": {"count": 1, "objects": 3, "layout": layout, "orientation": "any"},
        "time": {"frames": 100, "fps": 10},
        "viewpoints": {"azimuth": 20, "distance": 3},
        "channels": ["rgb"],
        "splits": {"by": "frame"},
    }
    return plan(small_recipe(**{**values, **changes}))


def test_a_sequence_shows_the_fall_however_shots_cut_it():
    longer, shorter = sequence(shot_frames=100), sequence(shot_frames=33)
    (whole,) = longer.shots(box_of)
    pieces = list(shorter.shots(box_of))
    for i, thing in enumerate(whole.things[:3]):
        cut = [pose for shot in pieces for pose in shot.things[i].motion.poses]
        assert list(thing.motion.poses) == cut and thing.motion.moves
        heights = [pose[2][3] for pose in cut]
        assert heights[0] > heights[20] and cut[-1] == cut[-2]
    still = sequence(models=[{"source": "zoo:post_box", "count": 3, "scale": {"length": 0.18}}])
    rest = next(iter(still.shots(box_of)))
    for fallen_one, lying in zip(whole.things, rest.things, strict=True):
        np.testing.assert_allclose(fallen_one.motion.poses[-1], lying.world_from_object, atol=1e-5)


def test_company_falls_on_the_model_that_it_joins():
    changes = {"scenes": None, "scene": {"company": {"count": 2, "layout": "fall", "motion": {"kind": "fall"}}}}
    models = [{"source": "zoo:post_box", "count": 3, "scale": {"length": 0.18}}]
    shot = next(iter(sequence(models=models, **changes).shots(box_of)))
    assert len(shot.things[0].motion.poses) == 1 and all(len(thing.motion.poses) > 1 for thing in shot.things[1:3])
    hulls = []
    for thing in shot.things[:3]:
        points = load_normalised(thing.model).vertices.astype(np.float64)
        pose = np.array(thing.motion.poses[-1])
        hulls.append(points @ pose[:3, :3].T + pose[:3, 3])
    assert max(depth(a, b) for a, b in itertools.combinations(hulls, 2)) < 0.002


def test_a_fall_needs_a_layout_that_drops():
    with pytest.raises(RecipeError, match=r"models\[0\]\.motion\.kind: expected a layout that drops it, .*; found another"):
        sequence(layout="row")
