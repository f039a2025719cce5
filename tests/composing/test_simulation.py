"""Bodies fall as they do, bounce as they should, come to rest, and lie beside one another."""

import itertools
import math
import sys

import numpy as np
import pytest

from resting import deepest, one_more_second, placed, solids
from viewsphere.composing.physics import Board, Touch, World, body_of
from viewsphere.errors import MissingExtraError
from viewsphere.geometry.rotation import rigid
from viewsphere.model.scene import IDENTITY


def ball(radius=0.2):
    points = np.random.default_rng(0).normal(size=(300, 3))
    return radius * points / np.linalg.norm(points, axis=1, keepdims=True)


def at(x, y, z):
    return tuple(map(tuple, rigid(np.eye(3), (x, y, z)).tolist()))


@pytest.mark.parametrize("length", [0.05, 0.4, 5.0])
def test_free_fall_takes_as_long_as_it_does_whatever_the_scale(length):
    body = body_of([ball(length / 2)], 300.0)
    world = World([body], [at(0, 0, 50 * length)], (), length)
    world.step(200)
    fallen = 50 * length - world.poses[0][2][3]
    assert fallen == pytest.approx(9.81 / 2 * world.seconds**2, rel=0.01)


@pytest.mark.parametrize("restitution", [0.0, 0.3, 0.6, 0.9])
def test_a_ball_bounces_as_high_as_its_restitution_says(restitution):
    world = World([body_of([ball()], 300.0, touch=Touch(restitution=restitution))], [at(0, 0, 1.2)], (), 0.4)
    heights = []
    for _ in range(900):
        world.step()
        heights.append(world.poses[0][2][3] - 0.2)
    landed = int(np.argmin(heights[:300]))
    assert math.sqrt(max(heights[landed:])) == pytest.approx(restitution, abs=0.1)  # of 1 m


def test_a_slope_of_less_friction_lets_things_slide():
    """On a board that stands at an angle is not what there is: a push on the floor stops after v^2 / (2 mu g)."""
    ways = []
    for friction in (0.2, 0.4):
        world = World([body_of([ball()[:, :3] * (1, 1, 0.2)], 300.0, touch=Touch(friction))], [at(0, 0, 0.04)], (), 0.4)
        world.settle()
        start = world.poses[0][0][3]
        world._data.qvel[0] = 2.0
        world.step(900)
        ways.append(world.poses[0][0][3] - start)
    assert ways == pytest.approx([2**2 / (2 * mu * 9.81) for mu in (0.2, 0.4)], rel=0.25)


def test_a_hull_has_its_volume_and_a_flat_model_gets_one():
    cube = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 2)], float)
    assert body_of([np.concatenate([cube, cube.mean(axis=0)[None]])], 300.0).mass == pytest.approx(600)
    assert body_of([cube], 300.0, mass=3.0).mass == 3
    assert body_of([cube * (1, 1, 0)], 300.0).mass > 0


def test_a_heap_in_a_box_comes_to_rest_beside_one_another():
    shapes = solids(8)
    walls = [
        Board((x, y, 0.3), (0.4 if y else 0.02, 0.02 if y else 0.4, 0.3)) for x, y in ((0.4, 0), (-0.4, 0), (0, 0.4), (0, -0.4))
    ]
    starts = [at(0.1 * (i % 2), 0.1 * (i % 3), 0.3 + 0.4 * i) for i in range(8)]
    world = World([body_of([shape.hull], 300.0) for shape in shapes], starts, walls, 0.4)
    assert world.settle()
    assert world.deepest < 0.002 and deepest(placed(shapes, world.poses)) < 0.002
    way, turn, sunk = one_more_second(shapes, world.poses, walls)
    assert way < 0.001 and turn < 0.5 and sunk < 0.002
    assert (0, -1) not in world.touching and any(-1 in pair for pair in world.touching)


def test_without_mujoco_it_is_said_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'viewsphere\[physics\]'"):
        World([body_of([ball()], 300.0)], [IDENTITY], (), 0.4)


def cube(half=0.2):
    return half * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)


def on_ice(speed):
    """A cube without friction that slides as fast as this, metres a second, on the floor."""
    world = World([body_of([cube()], 300.0, touch=Touch(friction=0.0))], [at(0, 0, 0.2)], (), 0.4)
    world.step(100)
    world._data.qvel[0] = speed
    return world


@pytest.mark.parametrize(("speed", "rests"), [(0.0004, True), (0.01, False), (0.1, False)])
def test_what_goes_a_centimetre_a_second_is_not_at_rest(speed, rests):
    world = on_ice(speed)
    assert world.settle(1.8) == rests  # before anything is damped
    assert rests or world.poses[0][0][3] == pytest.approx(1.8 * speed, rel=0.05)


def test_what_stands_still_for_a_moment_is_not_at_rest():
    """A cube on ice that is at rest until something gives it a push, as what stands on an edge falls after a while."""
    world, seen = on_ice(0.0), []

    def look():
        seen.append(world.seconds)
        if len(seen) == 16:
            world._data.qvel[0] = 0.2

    assert not world.settle(1.8, look=look)
    assert world.poses[0][0][3] > 0.1


def test_what_turns_a_degree_a_second_is_not_at_rest():
    world, angles = on_ice(0.0), itertools.count(0.0, 0.0005)

    def look():
        half = next(angles)
        world._data.qpos[3:] = math.cos(half), 0.0, 0.0, math.sin(half)

    assert not world.settle(1.8, look=look)


@pytest.mark.parametrize("typical", [0.02, 0.4, 20.0])
def test_bodies_are_left_where_they_began_to_rest(typical):
    """A second of the world's passes after that, whatever the scale, and for it bodies are let go without any speed."""
    body, seen = body_of([cube(typical / 2)], 300.0, touch=Touch(friction=0.0)), []
    world = World([body], [at(0, 0, 0.6 * typical)], (), typical)

    def look():
        seen.append((world.seconds, world.poses[0][0][3]))
        if len(seen) == 12:
            world._data.qvel[0] = 0.0003

    assert world.settle(look=look)
    assert world.speed == 0 and world.deepest < 0.005 * typical
    between = seen[1][0] - seen[0][0]
    assert -1e-9 <= seen[-1][0] - world.seconds - 1.0 < 0.01 + between
    rested = [x for seconds, x in seen if seconds >= world.seconds - between / 2]
    assert max(rested) - min(rested) < 2e-5 * typical


def test_a_large_thing_that_goes_two_millimetres_a_second_is_not_at_rest():
    world = World([body_of([cube(10.0)], 300.0, touch=Touch(friction=0.0))], [at(0, 0, 10.0)], (), 20.0)
    world.step(100)
    world._data.qvel[0] = 0.002 * world._scale**0.5

    def look():
        world._data.qvel[0] = 0.002 * world._scale**0.5

    assert not world.settle(1.8, look=look)
