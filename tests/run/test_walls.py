"""Cameras in rooms: none beyond the walls of the model's room, and no way through one."""

import numpy as np
import pytest

from viewsphere import Recipe, render
from viewsphere.errors import RecipeError
from viewsphere.run.walls import check_way
from viewsphere.zoo import build, rooms_of


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


def test_a_camera_in_the_room_is_free_to_go():
    assert len(list(render(recipe(**way(0, 40, distance=0.5))))) == 4


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
    check_way([(thing, low + corners * (high - low))], lambda t: t.mesh, np.array(points, float))


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
        RecipeError, match=r"way clear of walls; found it going through interior interior_1 between .* pictures 1 and 2"
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
