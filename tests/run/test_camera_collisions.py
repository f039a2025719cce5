"""Cameras in rooms: none beyond the walls of the model's room, and no way through one."""

from itertools import pairwise

import numpy as np
import pytest

from viewsphere import Recipe, render
from viewsphere.composing.viewpoints.camera import inside_box
from viewsphere.errors import RecipeError
from viewsphere.plugins.source import rooms_of
from viewsphere.run.shots.camera_collisions import _steps, check_way
from viewsphere_zoo import build

SEED_OF_A_FLAT = 4


def recipe(**changed):
    given = {
        "seed": 2,
        "models": [{"source": "zoo:mug"}],
        "camera": {"size": [32, 24], "fov_deg": 60},
        "scene": {"place": "zoo:table_top"},
        "engine": {"name": "raster", "bounces": "off"},
        "channels": ["depth"],
        "splits": {"by": "sequence", "train": 1},
    }
    return Recipe(**given | changed)


def way(*azimuths, distance):
    return {
        "viewpoints": {"kind": "orbit", "azimuth": list(azimuths), "elevation": [20, 20], "distance": [distance, distance]},
        "time": {"frames": 4, "fps": 10},
    }


@pytest.mark.slow
def test_a_camera_in_the_room_is_free_to_go():
    assert len(list(render(recipe(**way(0, 40, distance=0.5))))) == 4


@pytest.mark.slow
def test_a_camera_beyond_the_walls_is_told():
    with pytest.raises(RecipeError, match=r"viewpoints: expected the camera in a room of the place.*beyond the walls"):
        list(render(recipe(**way(0, 40, distance=30))))


class Still:
    """A piece of scenery that stands at the origin."""

    key, scenery, world_from_object = "interior_1", True, np.eye(4)

    def __init__(self, category, mesh):
        self.model, self.mesh = type("Spec", (), {"category": category}), mesh


def checked(thing, points):
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    low, high = (np.array(v, float) for v in thing.mesh.bounds)
    points = np.array(points, float)
    steps = [(i, a, b) for i, (a, b) in enumerate(pairwise(points))]
    check_way([(thing, low + corners * (high - low))], lambda t: t.mesh, steps)


@pytest.mark.parametrize("seed", range(4))
def test_a_way_through_a_wall_is_told_and_one_within_a_room_is_not(seed):
    (room, *_) = rooms_of("zoo:interior", seed)
    interior = Still("interior", build("interior", np.random.default_rng(seed)))
    low, high = room.min(axis=0), room.max(axis=0)
    middle = (low + high) / 2
    inside = np.random.default_rng(seed).uniform(low + 0.05, high - 0.05, (20, 3))
    checked(interior, inside)
    up = np.array([0, 0, 1.0])
    out, above = middle + 0.1 * up, middle + (high - low)[2] * up
    with pytest.raises(
        RecipeError, match=r"way clear of walls; found it going through interior interior_1 between .*, frames 1 and 2"
    ):
        checked(interior, [middle, out, above])


def test_leaves_are_no_walls():
    hedge = Still("hedge", build("hedge", np.random.default_rng(0)))
    low, high = (np.array(v, float) for v in hedge.mesh.bounds)
    middle = (low + high) / 2
    through = [middle - np.array([0, 5, 0]), middle + np.array([0, 5, 0])]
    checked(hedge, through)
    with pytest.raises(RecipeError):
        checked(Still("house", hedge.mesh), through)


def test_a_door_between_two_rooms_is_air():
    rooms = rooms_of("zoo:interior", SEED_OF_A_FLAT)
    walls = Still("interior", build("interior", np.random.default_rng(SEED_OF_A_FLAT)))
    doors = [box for box in rooms if min(np.ptp(box, axis=0)[:2]) < 0.2]
    assert len(doors) > 2
    for door in doors:
        middle, thin = door.mean(axis=0), int(np.argmin(np.ptp(door, axis=0)[:2]))
        across = np.array([0.0, 0.0, 0.0])
        across[thin] = 0.3
        way = np.linspace(middle - across, middle + across, 25)
        assert np.any([inside_box(room, way) for room in rooms], axis=0).all()
        checked(walls, way)


def test_frames_that_are_apart_are_no_step():
    """Of tracks, the first frame and a later one are in a shot: nobody goes straight from one to the other."""
    around = np.array([(-5.0, -5, 1), (5, 5, 1)])
    assert list(_steps(ShotOf([0, 7], around))) == []
    assert [frame for frame, _, _ in _steps(ShotOf([3, 4], around))] == [3]


class ShotOf:
    """A shot of instants with these numbers, whose camera is at these points."""

    def __init__(self, numbers, points):
        self.instants, self.points = [type("Instant", (), {"index": i}) for i in numbers], points

    def camera(self, instant, sensor):
        return type("Camera", (), {"center": self.points[instant]})
