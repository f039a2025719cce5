"""The simulated cluster agrees with closed forms, loses no shot and ends; the page about scale says what is computed."""

import math
import statistics
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from small import ROOT

sys.path.insert(0, str(ROOT / "benchmarks"))
from cluster import Cluster, Load, simulate
from simulate import page, stored


def load(shots, *seconds, objects=0.0, size=0.0):
    return Load(shots, 10, seconds, objects, size)


def test_one_worker_does_one_shot_after_another():
    cluster = Cluster(1, cores=1, start_s=7, handout_s=0.5, requests_per_s=4)
    course = simulate(load(9, 2.0, objects=3), cluster)
    assert course.makespan == pytest.approx(7 + 9 * (0.5 + 2 + 3 / 4))
    assert (course.finished, course.lost) == (9, 0)
    assert course.efficiency == pytest.approx(18 / course.makespan)


@pytest.mark.parametrize(("shots", "rounds"), [(12, 1), (13, 2), (24, 2), (25, 3)])
def test_equal_shots_are_done_in_rounds(shots, rounds):
    assert simulate(load(shots, 5.0), Cluster(3, cores=4, start_s=1)).makespan == pytest.approx(1 + 5 * rounds)


def test_the_one_who_hands_out_may_be_the_limit():
    assert simulate(load(1000, 2.0), Cluster(1000, cores=1, handout_s=0.01)).makespan == pytest.approx(1000 * 0.01 + 2)


@pytest.mark.parametrize("limits", [{"requests_per_s": 50}, {"bytes_per_s": 500}])
def test_the_store_may_be_the_limit(limits):
    course = simulate(load(400, 2.0, objects=5, size=50), Cluster(400, cores=1, **limits))
    assert course.makespan == pytest.approx(2 + 400 * 0.1)


def test_slow_nodes_are_slow_and_others_do_more():
    assert simulate(load(100, 1.0), Cluster(10, cores=1, slow=1.0, slow_factor=3.0)).makespan == pytest.approx(30)
    assert simulate(load(100, 1.0), Cluster(10, cores=1, slow=0.5, slow_factor=4.0)).makespan == pytest.approx(16)


def test_failures_cost_what_they_cost_in_the_mean():
    """J. T. Daly, A higher order estimate of the optimum checkpoint interval for restart dumps, 2006, equation 13."""
    cluster = Cluster(1, cores=1, start_s=20, mtbf_h=100 / 3600, repair_s=30)
    mean = 100 * math.exp((20 + 30) / 100) * math.expm1(40 / 100)
    courses = [simulate(load(200, 40.0), cluster, seed) for seed in range(40)]
    assert statistics.mean(course.makespan for course in courses) == pytest.approx(20 + 200 * mean, rel=0.05)
    assert all(course.lost > 0 for course in courses)


@pytest.mark.slow
@given(
    shots=st.integers(1, 200),
    seconds=st.lists(st.floats(0.1, 50), min_size=1, max_size=5),
    nodes=st.integers(1, 9),
    cores=st.integers(1, 4),
    mtbf=st.sampled_from([math.inf, 0.05]),
    seed=st.integers(0, 99),
)
def test_every_shot_is_made_within_the_bounds_of_any_schedule(shots, seconds, nodes, cores, mtbf, seed):
    cluster = Cluster(nodes, cores, start_s=2, mtbf_h=mtbf, repair_s=5)
    course = simulate(load(shots, *seconds), cluster, seed)
    assert course.finished == shots
    assert shots * min(seconds) <= course.useful * (1 + 1e-9)
    assert course.useful <= course.available
    if mtbf == math.inf:  # R. L. Graham, Bounds for certain multiprocessing anomalies, 1966
        assert course.makespan <= 2 + course.useful / (nodes * cores) + max(seconds) + 1e-6
    assert course == simulate(load(shots, *seconds), cluster, seed)


def test_the_page_about_scale_says_what_is_computed():
    assert page(stored()) in (ROOT / "docs" / "scale.md").read_text("utf-8")
