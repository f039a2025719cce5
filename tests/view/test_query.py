"""Filters and sorting over columns say what looking at every sample says."""

import math

import numpy as np
import pytest

from viewsphere import Dataset
from viewsphere.errors import UserError
from viewsphere.report.table import table_of
from viewsphere.view.live import LISTED, Known
from viewsphere.view.query import MEASURES, Query


@pytest.fixture(scope="module")
def samples(small_run):
    return list(Dataset(small_run))


@pytest.fixture(scope="module")
def known(samples):
    """The samples backwards, finished one second after the other, so that no order is that of the rows."""
    frames = np.zeros(len(samples), LISTED)
    frames["number"] = [sample.index for sample in reversed(samples)]
    frames["made"] = np.arange(len(samples)) // 2
    return Known(frames, table_of(reversed(samples)), np.zeros(len(samples), bool))


def asked(known, **parameters):
    """Numbers of the frames that the server would answer with."""
    return known.frames["number"][Query.from_parameters(parameters).answer(known)].tolist()


def value_of(sample, name, o=None):
    pose = sample.known_pose
    own = {
        "camera_azimuth": lambda: pose.azimuth_deg % 360,
        "camera_elevation": lambda: pose.elevation_deg,
        "camera_distance": lambda: pose.distance,
        "objects": lambda: len(sample.objects),
        "seen": lambda: sum(o.area > 0 for o in sample.objects),
        "visibility": lambda: o.visibility,
        "truncation": lambda: o.truncation,
        "side": lambda: math.nan if o.box2d is None else math.sqrt((o.box2d[2] - o.box2d[0]) * (o.box2d[3] - o.box2d[1])),
        "distance": lambda: o.view.distance,
        "azimuth": lambda: o.view.azimuth_deg % 360,
        "elevation": lambda: o.view.elevation_deg,
    }
    return float(np.float32(own[name]()))


def values(sample, name):
    return [value_of(sample, name, o) for o in sample.objects] if MEASURES[name].is_of_object else [value_of(sample, name)]


@pytest.mark.parametrize("name", MEASURES)
def test_a_measure_between_two_numbers(known, samples, name):
    found = sorted({value for sample in samples for value in values(sample, name)})
    for low, high in [(found[0], found[len(found) // 2]), (found[len(found) // 2], found[-1]), (found[-1] + 1, found[-1] + 2)]:
        inside = (lambda v, a=low, z=high: a <= v < z) if "azimuth" in name else (lambda v, a=low, z=high: a <= v <= z)
        expected = [s.index for s in samples if any(inside(v) for v in values(s, name))]
        assert asked(known, **{name: f"{low!r},{high!r}"}) == expected
    assert asked(known, **{name: ","}) == [s.index for s in samples]


def test_azimuths_come_round(known, samples):
    expected = [s.index for s in samples if (value_of(s, "camera_azimuth") - 230) % 360 < 140]
    assert 0 < len(expected) < len(samples)
    assert asked(known, camera_azimuth="230,370") == expected


@pytest.mark.parametrize("name", MEASURES)
def test_sorted_by_a_measure(known, samples, name):
    rising = [min(values(samples[number], name)) for number in asked(known, order=name)]
    falling = [max(values(samples[number], name)) for number in asked(known, order=f"-{name}")]
    assert rising == sorted(rising)
    assert falling == sorted(falling, reverse=True)
    assert len(rising) == len(falling) == len(samples)


def test_one_object_meets_all_that_is_asked_of_objects(known, samples):
    first = samples[0].objects[0]
    for parameters in (
        {"model": first.key},
        {"category": str(first.category_id), "pose": first.pose_category},
        {"model": first.key, "pose": first.pose_category, "split": samples[0].split},
        {"model": "none"},
        {"split": "none"},
        {"pose": "unknown"},
        {"category": "99"},
    ):
        wanted = {"model": "key", "pose": "pose_category"}
        of_object = {wanted[name]: value for name, value in parameters.items() if name in wanted}
        if "category" in parameters:
            of_object["category_id"] = int(parameters["category"])
        expected = [
            s.index
            for s in samples
            if s.split == parameters.get("split", s.split)
            and any(all(getattr(o, name) == value for name, value in of_object.items()) for o in s.objects)
        ]
        assert asked(known, **parameters) == expected, parameters


def test_orders(known, samples):
    numbers = [s.index for s in samples]
    assert asked(known, order="frame") == numbers
    newest = asked(known, order="newest")
    made = dict(known.frames.tolist())
    assert [made[number] for number in newest] == sorted(made.values(), reverse=True)
    mixed = asked(known, order="mixed")
    assert sorted(mixed) == numbers
    assert mixed not in (numbers, numbers[::-1])


def test_frames_that_cannot_be_read_meet_nothing_but_are_listed(known):
    damaged = known.damaged.copy()
    damaged[0] = True
    half = Known(known.frames, known.table, damaged)
    number = int(known.frames["number"][0])
    assert number in asked(half)
    assert number not in asked(half, objects="0,9")


def test_an_earlier_time_is_answered_as_it_was(known):
    """A page that scrolls is answered from what there was when it began, whatever came since."""
    before = known.first(4, 4)
    assert asked(before, order="frame") == sorted(known.frames["number"][:4].tolist())
    assert asked(before, objects="0,9") == sorted(known.frames["number"][:4].tolist())
    assert len(before.table.objects) == int(before.table.frames["objects"].sum())


@pytest.mark.parametrize(
    ("parameters", "word"),
    [
        ({"visibility": "1"}, "two numbers"),
        ({"visibility": "a,b"}, "a number"),
        ({"visibility": "nan,1"}, "a number"),
        ({"order": "fastest"}, "order"),
        ({"order": "--visibility"}, "order"),
        ({"category": "-1"}, "category"),
        ({"category": "9" * 5000}, "category"),
        ({"category": "٣"}, "category"),
        ({"file": "/etc/passwd"}, "file"),
    ],
)
def test_what_cannot_be_asked(parameters, word):
    with pytest.raises(UserError, match=word):
        Query.from_parameters(parameters)
