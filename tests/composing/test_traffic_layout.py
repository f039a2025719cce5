"""Vehicles along lanes and in parking bays, walkers on pavements."""

import numpy as np
import pytest

from viewsphere.errors import RecipeError, UserError
from viewsphere.model.place import stretches
from viewsphere.planning.plan import plan
from viewsphere.recipe.recipe import Recipe
from viewsphere.run.shots.stages import Stages

CAMERA = {"size": [32, 32], "fov_deg": 70}


def shots_of(place="zoo:neighbourhood", count=6, **options):
    return planned_shots(place, count, **options)[1]


def planned_shots(place, count, **options):
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
    return planned, [planned.shot(row, stages.box) for row in planned.rows], stages.box


def spots(shots, category):
    poses = [np.array(t.world_from_object) for s in shots for t in s.things if t.is_target and t.model.category == category]
    return np.array([(pose[0, 3], pose[1, 3], pose[0, 1], pose[1, 1]) for pose in poses])  # and the way of their rear, +Y


@pytest.mark.slow
def test_cars_drive_on_the_right_and_walkers_are_on_the_pavement():
    shots = shots_of(parked=0)
    cars, walkers = spots(shots, "car"), spots(shots, "person")
    assert len(cars) >= 6
    assert len(walkers) >= 6
    assert (np.abs(np.abs(cars[:, 0]) - 1.6) < 0.6).all()  # a lane's middle, whatever a box's middle is
    assert (np.sign(cars[:, 0]) == -np.sign(cars[:, 3])).all()  # to +y on the right: the front is -Y
    assert (np.abs(walkers[:, 0]) > 4).all()
    assert np.ptp(cars[:, 1]) > 8


@pytest.mark.slow
def test_parked_cars_stand_beside_the_lane():
    driving, parked = (spots(shots_of(parked=share, bay=2.0), "car") for share in (0, 1))
    assert np.abs(parked[:, 0]).min() > np.abs(driving[:, 0]).max()


def test_a_place_without_lanes_is_refused():
    with pytest.raises(RecipeError, match=r"needs a scene\.place with lanes"):
        shots_of(None)


@pytest.mark.slow
@pytest.mark.parametrize("place", ["zoo:neighbourhood", "zoo:town"])
def test_vehicles_park_in_the_places_bays_and_walkers_are_on_its_pavements(place):
    planned, shots, box_of = planned_shots(
        {"source": place, "turn": 30, "parked": 0.5, "walkers": 30}, count=4, parked=1, reach=25
    )
    bays = np.array([bay.world_from_bay for bay in planned.composition.bays("scene-000000", None)])
    ways = planned.composition.pavements("scene-000000", None)
    lanes = planned.composition.lanes("scene-000000", None)
    pieces = [t for t in shots[0].things if not t.is_target]
    cars = 0
    for thing in (t for s in shots for t in s.things if t.is_target):
        pose = np.array(thing.world_from_object)
        height = pose[2, 3] + box_of(thing.model)[:, 2].min()
        if thing.model.category == "car":
            bay = bays[np.linalg.norm(bays[:, :2, 3] - pose[:2, 3], axis=1).argmin()]
            if np.linalg.norm(bay[:2, 3] - pose[:2, 3]) > 0.3:  # no bay within reach is free
                assert min(_away(pose, part) for lane in lanes for part in stretches(lane)) < 0.3
                continue
            cars += 1
            assert np.allclose(bay[:3, :3], pose[:3, :3])
            assert height == pytest.approx(bay[2, 3], abs=1e-9)
            assert all(_apart(pose, t) > 1.5 for t in pieces if t.model.category in ("car", "person"))
        else:
            assert min(_away(pose, part) for way in ways for part in stretches(way)) < 0.55
            assert height == pytest.approx(0.1, abs=1e-9)
            assert all(
                _apart(pose, t) > 0.3 for t in pieces if t.model.category in ("bench", "lamp post", "lamp_post", "person")
            )
    assert cars >= 3


def test_a_place_without_roads_has_no_traffic_of_its_own():
    with pytest.raises(UserError, match=r"`walkers` needs a place with roads, and zoo:room has none\. Use zoo:neighbourhood"):
        shots_of({"source": "zoo:room", "walkers": 2})


def _apart(pose, thing):
    return np.linalg.norm(pose[:2, 3] - np.array(thing.world_from_object)[:2, 3])


def _away(pose, part):
    start, end = np.array(part[:2]), np.array(part[3:5])
    way = (end - start) / np.linalg.norm(end - start)
    return np.linalg.norm(pose[:2, 3] - start - np.clip((pose[:2, 3] - start) @ way, 0, np.linalg.norm(end - start)) * way)
