"""The local executor hands out what is warm, keeps everybody busy, and survives the death of its workers."""

import os
import signal
from collections import Counter
from multiprocessing import active_children

import pytest

import viewsphere as vs
from small import small_recipe
from viewsphere.errors import UserError, ViewsphereError
from viewsphere.model.model_spec import ModelSpec
from viewsphere.run.executors import Job, Listed, Queue
from viewsphere.run.executors.local import LocalCrew
from viewsphere.run.tasks import ModelTask
from viewsphere.sampling.extension import whole

PORTION = whole(vs.plan(small_recipe()))


def left(queue):
    return list(iter(lambda: queue.next(""), None))


def jobs(**counts):
    return Listed(tuple(Job(f"{name}-{i}", name, dict) for name, n in counts.items() for i in range(n)))


def test_one_model_keeps_four_workers_busy():
    queue = Queue(jobs(car=16))
    hands = [queue.next("").line for _ in range(4)]
    assert hands == ["car"] * 4
    assert len(left(queue)) == 12


def test_a_worker_keeps_what_it_has_warm_until_it_is_done():
    queue = Queue(jobs(a=3, b=3))
    first, second = queue.next(""), queue.next("")
    assert (first.line, second.line) == ("a", "b")
    assert [queue.next("a").key for _ in range(2)] == ["a-1", "a-2"]
    assert queue.next("a").line == "b"


def test_help_goes_where_most_is_left():
    queue = Queue(jobs(a=2, b=9))
    queue.next("")
    queue.next("")
    assert queue.next("").line == "b"


def test_every_job_is_handed_out_once():
    queue, warm, seen = Queue(jobs(a=5, b=1, c=7)), ["", "", ""], Counter()
    while (job := queue.next(warm[sum(seen.values()) % 3])) is not None:
        warm[sum(seen.values()) % 3] = job.line
        seen[job.key] += 1
    assert len(seen) == 13
    assert set(seen.values()) == {1}


def test_a_job_is_tried_twice():
    queue = Queue(jobs(a=1))
    job = queue.next("")
    assert queue.again(job)
    assert queue.next("") is job
    assert not queue.again(job)


def test_jobs_are_counted_out_when_somebody_is_free():
    asked = []

    class Endless:
        def lines(self):
            return [("a", 10**8)]

        def jobs(self, line):
            for number in range(10**8):
                asked.append(number)
                yield Job(f"{line}-{number}", line, dict)

    queue = Queue(Endless())
    assert [queue.next("a").key for _ in range(3)] == ["a-0", "a-1", "a-2"]
    assert asked == [0, 1, 2]


class Deadly:
    """A task that ends the process which unpacks it."""

    def __reduce__(self):
        return os._exit, (3,)


def test_a_worker_that_dies_costs_a_retry_then_an_error(tmp_path):
    with LocalCrew(tmp_path, PORTION, 1) as crew:
        outcomes = list(crew.run(Listed((Job("x", "x", Deadly()),))))
    assert len(outcomes) == 1
    assert "died 2 times (exit code 3)" in str(outcomes[0].error)


def test_what_a_worker_cannot_do_ends_the_run_with_its_traceback(tmp_path):
    with (
        pytest.raises(ViewsphereError, match=r"x: a worker failed\nTraceback(.|\n)*AttributeError") as caught,
        LocalCrew(tmp_path, PORTION, 1) as crew,
    ):
        list(crew.run(Listed((Job("x", "x", dict),))))
    assert not isinstance(caught.value, UserError)


CHAIR = ModelSpec(key="chair", source="zoo:chair", category="chair", category_id=1, seed=1)


LOOK_AT_CHAIR = ModelTask("same model", CHAIR)


def test_workers_stay_for_the_next_list_and_one_that_died_meanwhile_is_replaced(tmp_path):
    def pids():
        return {child.pid for child in active_children()} - before

    before, job = {child.pid for child in active_children()}, Job("chair", "chair", LOOK_AT_CHAIR)
    with LocalCrew(tmp_path, PORTION, 1) as crew:
        first = list(crew.run(Listed((job,)))), pids()
        second = list(crew.run(Listed((job, job)))), pids()
        os.kill(*first[1], signal.SIGKILL)
        third = list(crew.run(Listed((job,)))), pids()
    assert [len(outcomes) for outcomes, _ in (first, second, third)] == [1, 2, 1]
    assert not any(outcome.error for outcomes, _ in (first, second, third) for outcome in outcomes)
    assert first[1] == second[1] and len(third[1]) == 1 and third[1] != first[1]
    assert not pids()


def test_those_who_have_something_warm_count_before_they_ask():
    queue = Queue(jobs(a=2, b=2), ["a"])
    assert queue.next("").line == "b"


class Impatient:
    """Shared by all jobs: a portion that is sent to a worker when Ctrl-C reaches it, before it has done anything."""

    def __reduce__(self):
        return _interrupted, ()


def _interrupted():
    os.kill(os.getpid(), signal.SIGINT)
    return PORTION


@pytest.mark.skipif(os.name != "posix", reason="signals are masked on POSIX alone")
def test_ctrl_c_while_a_worker_starts_is_the_parents_to_hear(tmp_path, capfd):
    with LocalCrew(tmp_path, Impatient(), 1) as crew:
        outcomes = list(crew.run(Listed((Job("chair", "chair", LOOK_AT_CHAIR),))))
    assert [outcome.error for outcome in outcomes] == [None]
    assert "Traceback" not in capfd.readouterr().err
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())
