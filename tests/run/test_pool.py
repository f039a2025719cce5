"""The pool hands out what is warm, keeps everybody busy, and survives the death of its workers."""

import os
from collections import Counter

import pytest

from viewsphere.errors import UserError, ViewsphereError
from viewsphere.run.pool import Job, Queue, run_jobs


def jobs(**counts):
    return [Job(f"{name}-{i}", name, dict) for name, n in counts.items() for i in range(n)]


def test_one_model_keeps_four_workers_busy():
    queue = Queue(jobs(car=16))
    hands = [queue.next("").affinity for _ in range(4)]
    assert hands == ["car"] * 4
    assert len(queue) == 12


def test_a_worker_keeps_what_it_has_warm_until_it_is_done():
    queue = Queue(jobs(a=3, b=3))
    first, second = queue.next(""), queue.next("")
    assert (first.affinity, second.affinity) == ("a", "b")
    assert [queue.next("a").key for _ in range(2)] == ["a-1", "a-2"]
    assert queue.next("a").affinity == "b"


def test_help_goes_where_most_is_left():
    queue = Queue(jobs(a=2, b=9))
    queue.next("")
    queue.next("")
    assert queue.next("").affinity == "b"


def test_every_job_is_handed_out_once():
    queue, warm, seen = Queue(jobs(a=5, b=1, c=7)), ["", "", ""], Counter()
    while queue:
        hand = len(queue) % 3
        job = queue.next(warm[hand])
        warm[hand] = job.affinity
        seen[job.key] += 1
    assert len(seen) == 13
    assert set(seen.values()) == {1}


def test_a_job_is_tried_twice():
    queue = Queue(jobs(a=1))
    job = queue.next("")
    assert queue.again(job)
    assert queue.next("") is job
    assert not queue.again(job)


class Deadly:
    """A task that ends the process which unpacks it."""

    def __reduce__(self):
        return os._exit, (3,)


def test_a_worker_that_dies_costs_a_retry_then_an_error(tmp_path):
    outcomes = list(run_jobs([Job("x", "x", Deadly)], tmp_path, 1))
    assert len(outcomes) == 1
    assert "died 2 times (exit code 3)" in str(outcomes[0].error)


def test_what_a_worker_cannot_do_ends_the_run_with_its_traceback(tmp_path):
    with pytest.raises(ViewsphereError, match=r"x: a worker failed\nTraceback(.|\n)*AttributeError") as caught:
        list(run_jobs([Job("x", "x", dict)], tmp_path, 1))
    assert not isinstance(caught.value, UserError)
