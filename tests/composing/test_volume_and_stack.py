"""In the air no two meet; piles stand; models lie as they would come to rest."""

import itertools

import numpy as np
import pytest
from test_fall import fallen

from resting import deepest, depth, one_more_second, placed, shape_of, solids
from small import small_recipe
from viewsphere.assets.cache import load_normalised
from viewsphere.composing.layouts import stable_turn, stable_ways
from viewsphere.composing.placing.volume import apart
from viewsphere.errors import RecipeError
from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.rotation import random_rotation, transform
from viewsphere.planning.plan import plan


def test_no_two_meet_in_the_air_and_all_are_in_the_volume():
    shapes = [shape.turned(random_rotation(np.random.default_rng(i))) for i, shape in enumerate(solids(12))]
    poses = fallen(shapes, "volume", given={"size": [2.0, 1.6, 1.4], "height": 0.5}, gap=0.05)
    hulls = placed(shapes, poses)
    whole = np.concatenate(hulls)
    assert (whole.min(axis=0) >= np.array([-1, -0.8, 0.5]) - 1e-9).all() and (
        whole.max(axis=0) <= np.array([1, 0.8, 1.9]) + 1e-9
    ).all()
    assert max(depth(a, b) for a, b in itertools.combinations(hulls, 2)) < -0.05 + 1e-6
    assert np.ptp([hull.mean(axis=0)[2] for hull in hulls]) > 0.3


def test_a_side_that_separates_is_a_proof():
    """Boxes that are told apart by a gap are; those that are not told apart meet, or are nearer."""
    rng, said = np.random.default_rng(3), set()
    for _ in range(60):
        a, b = (
            transform(random_rotation(rng), Box3d.between((-1, -0.6, -0.4), (1, 0.6, 0.4)).corners) + rng.uniform(-1.3, 1.3, 3)
            for _ in "ab"
        )
        gap = -depth(a, b)
        said.add(apart(a, b, 0.1))
        if abs(gap - 0.1) > 0.02:
            assert apart(a, b, 0.1) == (gap > 0.1)
    assert said == {True, False}


@pytest.mark.slow
def test_too_many_for_the_air_are_told_with_what_was_found():
    with pytest.raises(
        RecipeError, match=r"scenes\.layout: expected room for 30 models in 0.8 x 0.8 x 0.8 m; found it for \d+"
    ):
        fallen(solids(30), "volume", given={"size": [0.8, 0.8, 0.8]})
    with pytest.raises(RecipeError, match=r"below the 0.4 m of air there; found one up to 1 m"):
        fallen(solids(2), "volume", given={"size": [1.0, 1.0, 1.0]}, clearance=0.4)


def bricks(count):
    rng = np.random.default_rng(5)
    corners = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))
    return [shape_of(corners * rng.uniform((0.2, 0.2, 0.06), (0.3, 0.3, 0.1))) for _ in range(count)]


@pytest.mark.slow
def test_piles_stand_by_themselves():
    shapes = bricks(6)
    poses = fallen(shapes, "stack", given={"high": 3}, gap=0.1)
    hulls = placed(shapes, poses)
    assert deepest(hulls) < 0.002
    lows = sorted(hull[:, 2].min() for hull in hulls)
    assert all(abs(low) < 0.002 for low in lows[:2]) and lows[2] > 0.05 and lows[4] > 0.1
    way, turn, sunk = one_more_second(shapes, poses)
    assert way < 0.001 and turn < 0.5 and sunk < 0.002
    assert fallen(shapes, "stack", given={"high": 3}, gap=0.1) == poses


def test_a_pile_that_does_not_stand_is_told():
    balls = np.random.default_rng(0).normal(size=(2, 400, 3))
    round_ones = [shape_of(0.2 * ball / np.linalg.norm(ball, axis=1, keepdims=True)) for ball in balls]
    with pytest.raises(
        RecipeError, match=r"scenes\.layout: expected models of which one stays on another, such as m1 on m0; found none"
    ):
        fallen(round_ones, "stack", given={"friction": 0.02})


def test_stable_ways_to_lie_are_those_on_which_a_body_comes_to_rest():
    brick = bricks(1)[0]
    ways, chances = stable_ways(brick.hull)
    assert len(ways) == 6 and chances.sum() == pytest.approx(1)
    heights = [np.ptp((brick.hull @ way.T)[:, 2]) for way in ways]
    assert sorted(heights) == pytest.approx(heights)  # the flatter, the likelier
    assert chances[:2].sum() > 0.7
    dropped = [shape_of(brick.hull @ random_rotation(np.random.default_rng(i)).T) for i in range(24)]
    poses = fallen(dropped, given={"spread": [8, 8], "drop": 0.3})
    flat = [np.ptp(hull[:, 2]) < heights[0] + 0.01 for hull in placed(dropped, poses)]
    assert np.mean(flat) == pytest.approx(chances[:2].sum(), abs=0.25)


def test_stable_turns_are_drawn_by_their_chances():
    brick = bricks(1)[0]
    _, chances = stable_ways(brick.hull)
    heights = [np.ptp((brick.hull @ stable_turn(brick.hull, np.random.default_rng(i)).T)[:, 2]) for i in range(300)]
    assert np.mean(np.array(heights) < 0.105) == pytest.approx(chances[:2].sum(), abs=0.08)


def test_models_lie_in_a_scene():
    scenes = {"count": 6, "objects": 2, "orientation": "stable"}
    planned = plan(small_recipe(scenes=scenes, scene={"ground": True}, splits={"by": "frame"}))

    def box_of(model, step=None):
        return Box3d.between(*load_normalised(model).bounds).corners

    ups = []
    for row in planned.rows:
        if row.positions[0][0] == 0:
            for thing in planned.shot(row, box_of).things[:2]:
                ups.append(abs(thing.world_from_object[2][2]))
                low = transform(np.array(thing.world_from_object), load_normalised(thing.model).vertices)[:, 2].min()
                assert low == pytest.approx(0, abs=1e-6)
    assert min(ups) < 0.1  # a post box lies on its side more often than it stands


@pytest.mark.slow
def test_hulls_stand_closer_than_boxes_and_not_in_one_another():
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 0.6, 0], [0, 0, 1], [1, 0, 0.2]], float) - (0.5, 0.3, 0)
    sizes = {"boxes": [], "hulls": []}
    for between, spans in sizes.items():
        shapes = [shape_of(points)] * 7
        for seed in range(6):
            flat = [
                hull * (1, 1, 0) for hull in placed(shapes, fallen(shapes, "scatter", seed, {"between": between}, gap=0.02))
            ]
            spans.append(np.ptp(np.concatenate(flat)[:, :2], axis=0).prod())
            upright = [np.concatenate([f, f + np.array((0, 0, 1))]) for f in flat]
            assert max(depth(a, b) for a, b in itertools.combinations(upright, 2)) < -0.02 + 1e-6
    assert np.mean(sizes["hulls"]) < 0.9 * np.mean(sizes["boxes"])
