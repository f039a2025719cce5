"""benchmarks/soak tells growth from noise; what it measures of short runs does not grow where nothing is kept warm."""

import sys
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from small import ROOT

sys.path.insert(0, str(ROOT / "benchmarks"))
import soak

COUNT = 160


def noise(share, seed=0):
    return np.random.default_rng(seed).uniform(-share, share, COUNT)


def rising(share):
    return 1 + np.linspace(0, share, COUNT)


@pytest.mark.parametrize(
    "values",
    [
        600 * (rising(0.06) + noise(0.005)),
        600 * (rising(0.08) + noise(0.04)),
        np.repeat([600.0, 640.0], COUNT // 2),
        np.repeat([17.0, 18.0], (100, 60)),
        np.repeat([0.0, 1.0], COUNT // 2),
    ],
    ids=["leak", "noisy leak", "step", "one file in 17", "something aside where nothing was"],
)
def test_growth_is_found(values):
    assert soak.growth(values) > soak.MOST_GROWTH


@pytest.mark.parametrize(
    "values",
    [
        600 * (1 + noise(0.04)),
        600 * (rising(0.03) + noise(0.04, seed=1)),
        600 * (1 + 0.2 * (np.arange(COUNT) % 7) / 6),
        600 * rising(-0.2),
        np.where(np.arange(COUNT) % 9 == 0, 25.0, 17.0),
        np.where(np.arange(COUNT) < 80, 65.0, np.where(np.arange(COUNT) % 5, 95.0, 65.0)),
        np.zeros(COUNT),
        [600.0],
    ],
    ids=[
        "noise",
        "little growth in noise",
        "models that come and go",
        "less",
        "a file now and then",
        "larger scenes",
        "nothing",
        "one moment",
    ],
)
def test_noise_is_no_growth(values):
    assert soak.growth(values) <= soak.MOST_GROWTH


def moments(**values):
    flat = soak.Moment(0, 0.0, parent=150.0, heap=80.0, blocks=500.0, workers=600.0, files=40, aside=2)
    return [replace(flat, frames=100 * (i + 1), **{name: value(i) for name, value in values.items()}) for i in range(200)]


@pytest.mark.parametrize("name", soak.CURVES)
def test_a_run_in_which_something_grows_after_the_warm_up_is_told(name):
    start = getattr(moments()[0], name)
    (problem,) = soak.problems("stills", moments(**{name: lambda i: start * (1 + i / 500)}))
    assert problem.startswith("stills: expected growth of at most 5%")
    assert problem.endswith(soak.CURVES[name][0])


@pytest.mark.parametrize("name", soak.CURVES)
def test_growth_within_the_warm_up_is_none(name):
    start = getattr(moments()[0], name)
    assert not list(soak.problems("stills", moments(**{name: lambda i: start * min(i + 1, 39)})))


def test_the_chart_has_each_curve_of_each_run():
    root = ElementTree.fromstring(soak.chart({"stills": moments(seconds=float), "memory": moments(seconds=float)}))
    curves = [element for element in root.iter() if element.tag.endswith("polyline")]
    assert len(curves) == 2 * (len(soak.CURVES) + 1)
    assert len(curves[0].get("points").split()) == 200


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="what is measured is read below /proc")
@pytest.mark.parametrize(("kind", "frames", "workers"), [("stills", 168, 1), ("sequences", 144, 0), ("memory", 144, 0)])
def test_short_runs_keep_their_open_files_and_leave_nothing_aside(kind, frames, workers):
    course = soak.course(kind, frames, workers, models=3, texels=64)
    assert course[-1].frames > frames - 2 * soak.LEAST_APART
    assert all(moment.parent > moment.heap >= 0 and moment.blocks > 100 and moment.files > 3 for moment in course)
    assert all((moment.workers > 50) == bool(workers) for moment in course)
    grown = [text for text in soak.problems(kind, course) if "MB" not in text]  # models have yet to come that stay warm
    assert not grown
