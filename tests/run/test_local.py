"""The local executor hands out what is warm, keeps everybody busy, and survives the death of its workers."""

import os
import signal
import sys
from collections import Counter
from multiprocessing import active_children
from pathlib import Path

import pytest

import viewsphere as vs
from faults import workers_of
from small import small_recipe
from viewsphere.errors import UserError, ViewsphereError, WorkerDied
from viewsphere.model.model_spec import ModelSpec
from viewsphere.planning.extension import whole
from viewsphere.run.executors import Job, Listed, Queue
from viewsphere.run.executors._jobs import MOST_DEATHS
from viewsphere.run.executors.local import LocalPool
from viewsphere.run.shots.tasks import ModelTask

PORTION = whole(vs.plan(small_recipe()))


def left(queue):
    return list(iter(lambda: queue.next(""), None))


def jobs(**counts):
    return Listed(tuple(Job(f"{name}-{i}", name, dict) for name, n in counts.items() for i in range(n)))


def test_one_model_keeps_four_workers_busy():
    queue = Queue(jobs(car=16))
    lines = [queue.next("").line for _ in range(4)]
    assert lines == ["car"] * 4
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


def test_a_job_is_tried_twice_the_second_time_when_nobody_else_is_at_work():
    queue = Queue(jobs(a=2))
    job = queue.next("")
    assert queue.last() is None
    assert queue.again(job, "it fell") is None
    assert [other.key for other in left(queue)] == ["a-1"]
    assert queue.last() is job
    assert queue.last() is None
    assert str(queue.again(job, "it fell").error) == "a-0: its worker died 2 times (it fell)"


def test_a_job_lost_with_its_machine_goes_to_the_next_worker():
    queue = Queue(jobs(a=2))
    job = queue.next("")
    assert queue.again(job, "a machine fell", alone=False) is None
    assert not queue.is_done
    assert [other.key for other in left(queue)] == ["a-0", "a-1"]
    assert queue.is_done


def test_a_run_in_which_nobody_lives_ends():
    queue = Queue(jobs(a=99))
    for _ in range(MOST_DEATHS - 1):
        assert queue.again(queue.next(""), "it fell") is None
    queue.ended()
    for _ in range(MOST_DEATHS - 1):
        assert queue.again(queue.next(""), "it fell") is None
    with pytest.raises(WorkerDied, match=f"a-30: its worker died .it fell., and so did {MOST_DEATHS - 1} before it"):
        queue.again(queue.next(""), "it fell")


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


class Ends:
    """A task that ends the process which unpacks it."""

    def __init__(self, how, *told):
        self.how = how, told

    def __reduce__(self):
        return self.how


def _note(folder):
    """Where a worker notes that it tries; gives how often that was."""
    Path(folder, f"{os.getpid()}").touch()
    return len(list(Path(folder).iterdir()))


def _killed(folder):
    _note(folder)
    os.kill(os.getpid(), signal.SIGKILL)


def _while_alone(folder, parent, before):
    """Dies at first, and then says who else is at work."""
    if _note(folder) == 1:
        os._exit(3)
    raise UserError(f"{len(set(workers_of(parent)) - before)} workers")


class Calls:
    """A task that calls a function as it is done."""

    def __init__(self, function, *told):
        self.function, self.told = function, told

    @property
    def kind(self):
        self.function(*self.told)


def _without_memory():
    raise MemoryError


@pytest.mark.slow
@pytest.mark.parametrize(
    ("task", "said"),
    [
        (lambda folder: Ends(os._exit, 3), "died 2 times (exit code 3)"),
        (lambda folder: Calls(_without_memory), "died 2 times (it was refused memory, the last time while it was alone: give"),
        pytest.param(
            lambda folder: Calls(_killed, folder),
            "died 2 times (it was killed, as systems do when memory runs out, the last time while it was alone: give it more",
            marks=pytest.mark.skipif(os.name == "nt", reason="signals"),
        ),
    ],
)  # fmt: skip
def test_a_worker_that_dies_costs_a_retry_then_an_error(task, said, tmp_path):
    with LocalPool(tmp_path, PORTION, 1) as pool:
        outcomes = list(pool.run(Listed((Job("x", "x", task(tmp_path)),))))
    assert len(outcomes) == 1
    assert said in str(outcomes[0].error)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_it_is_tried_again_alone_when_all_others_are_done(tmp_path):
    before = set(workers_of(os.getpid()))
    notes = tmp_path / "notes"
    notes.mkdir()
    tasks = {"bad": Calls(_while_alone, notes, os.getpid(), before), **dict.fromkeys(("a", "b", "c"), LOOK_AT_CHAIR)}
    with LocalPool(tmp_path / "out", PORTION, 2) as pool:
        outcomes = list(pool.run(Listed(tuple(Job(key, key, task) for key, task in tasks.items()))))
    assert [outcome.key for outcome in outcomes][-1] == "bad"
    assert str(outcomes[-1].error) == "1 workers"
    assert not any(outcome.error for outcome in outcomes[:-1])


@pytest.mark.slow
def test_what_a_worker_cannot_do_ends_the_run_with_its_traceback(tmp_path):
    with (
        pytest.raises(ViewsphereError, match=r"x: a worker failed\nTraceback(.|\n)*AttributeError") as caught,
        LocalPool(tmp_path, PORTION, 1) as pool,
    ):
        list(pool.run(Listed((Job("x", "x", dict),))))
    assert not isinstance(caught.value, UserError)


CHAIR = ModelSpec(key="chair", source="zoo:chair", category="chair", category_id=1, seed=1)


LOOK_AT_CHAIR = ModelTask("same model", CHAIR)


@pytest.mark.slow
def test_workers_stay_for_the_next_list_and_one_that_died_meanwhile_is_replaced(tmp_path):
    def pids():
        return {child.pid for child in active_children()} - before

    before, job = {child.pid for child in active_children()}, Job("chair", "chair", LOOK_AT_CHAIR)
    with LocalPool(tmp_path, PORTION, 1) as pool:
        first = list(pool.run(Listed((job,)))), pids()
        second = list(pool.run(Listed((job, job)))), pids()
        os.kill(*first[1], signal.SIGKILL)
        third = list(pool.run(Listed((job,)))), pids()
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


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="signals are masked on POSIX alone")
def test_ctrl_c_while_a_worker_starts_is_the_parents_to_hear(tmp_path, capfd):
    with LocalPool(tmp_path, Impatient(), 1) as pool:
        outcomes = list(pool.run(Listed((Job("chair", "chair", LOOK_AT_CHAIR),))))
    assert [outcome.error for outcome in outcomes] == [None]
    assert "Traceback" not in capfd.readouterr().err
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())
