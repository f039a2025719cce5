"""Vehicles along lanes and in parking bays, walkers on pavements."""

import numpy as np
import pytest

from viewsphere.errors import RecipeError
from viewsphere.recipe.recipe import Recipe
from viewsphere.run.stages import Stages
from viewsphere.sampling.plan import plan

CAMERA = {"size": [32, 32], "fov_deg": 70}


def shots_of(place="zoo:neighbourhood", count=6, **options):
    recipe = Recipe(
        name="street",
        models=[{"source": ["zoo:car", "zoo:person"], "count": 3}],
        scenes={"count": count, "objects": 4, "layout": {"kind": "traffic", **options}, "gap": 0.3},
        viewpoints={"kind": "sphere", "count": 1, "elevation": [10, 25], "distance": [9, 14]},
        camera=CAMERA,
        scene={} if place is None else {"place": place},
        channels=["instances"],
        formats=[],
        splits={"by": "frame", "train": 1},
    )
    planned, stages = plan(recipe), Stages()
    return [planned.shot(row, stages.box) for row in planned.rows]


def spots(shots, category):
    poses = [np.array(t.world_from_object) for s in shots for t in s.things if t.is_target and t.model.category == category]
    return np.array([(pose[0, 3], pose[1, 3], pose[0, 1], pose[1, 1]) for pose in poses])  # and the way of their rear, +Y


def test_cars_drive_on_the_right_and_walkers_are_on_the_pavement():
    shots = shots_of(parked=0)
    cars, walkers = spots(shots, "car"), spots(shots, "person")
    assert len(cars) >= 6
    assert len(walkers) >= 6
    assert (np.abs(np.abs(cars[:, 0]) - 1.6) < 0.6).all()  # a lane's middle, whatever a box's middle is
    assert (np.sign(cars[:, 0]) == -np.sign(cars[:, 3])).all()  # to +y on the right: the front is -Y
    assert (np.abs(walkers[:, 0]) > 4).all()
    assert np.ptp(cars[:, 1]) > 8


def test_parked_cars_stand_beside_the_lane():
    driving, parked = (spots(shots_of(parked=share, bay=2.0), "car") for share in (0, 1))
    assert np.abs(parked[:, 0]).min() > np.abs(driving[:, 0]).max()


def test_a_place_without_lanes_is_refused():
    with pytest.raises(RecipeError, match=r"needs a scene\.place with lanes"):
        shots_of(None)
