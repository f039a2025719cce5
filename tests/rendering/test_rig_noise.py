"""The sensors of a rig have noise of their own; the first has the noise of a single camera."""

import numpy as np
import pytest

from small import small_recipe
from viewsphere import Dataset, generate, render
from viewsphere.check import check

NOISE = {"effects": {"read_noise": 0.5, "shot_noise": 0.3}}
PAIR = {"sensors": {"a": {}, "b": {}}}


def recipe(**changes):
    views = {"azimuth": [0, 120], "elevation": 20, "distance": 1.0}
    return small_recipe(**{"viewpoints": views, "channels": ["rgb"], "formats": [], "scene": NOISE, **changes})


def by_sensor(samples):
    """Pictures by the sensor's name, in order."""
    pictures = {}
    for sample in samples:
        pictures.setdefault(sample.sensor, []).append(sample.rgb)
    return pictures


def test_sensors_at_one_place_differ_by_their_noise_alone():
    pair, (single,) = by_sensor(render(recipe(rig=PAIR))), by_sensor(render(recipe())).values()
    clean = by_sensor(render(recipe(rig=PAIR, scene={})))
    assert np.array_equal(pair["a"], single)
    assert np.array_equal(clean["a"], clean["b"])
    errors = [(np.array(pair[name], float) - clean[name])[..., 1].ravel() for name in "ab"]
    assert errors[0].std() == pytest.approx(errors[1].std(), rel=0.05) and errors[0].std() > 1
    assert abs(np.corrcoef(errors)[0, 1]) < 0.05


def test_a_sensor_s_noise_follows_from_its_name():
    names = {"sensors": {"a": {}, "x": {}, "b": {}}}
    three, pair = by_sensor(render(recipe(rig=names))), by_sensor(render(recipe(rig=PAIR)))
    assert np.array_equal(three["b"], pair["b"])
    assert not np.array_equal(three["x"], three["b"])


@pytest.mark.slow
def test_stored_pictures_are_those_in_memory_and_those_painted_again(tmp_path):
    generate(recipe(rig=PAIR), tmp_path / "out", workers=0)
    dataset = Dataset(tmp_path / "out")
    stored, rendered = by_sensor(dataset), by_sensor(render(recipe(rig=PAIR)))
    assert all(np.array_equal(stored[name], rendered[name]) for name in ("a", "b"))
    report = check(dataset, repaint=None)
    assert report.ok and report.checked["repaint"] == len(dataset), report.findings
