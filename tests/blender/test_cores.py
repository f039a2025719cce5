"""The cores that Blender's libraries see while they are loaded; no Blender is needed."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from viewsphere.blender.worker import confine
from viewsphere.blender.worker.confine import few_cores, some_of


@pytest.mark.parametrize("there", [{0}, {3, 5}, {0, 1, 2, 3}, set(range(8, 71))])
@pytest.mark.parametrize("count", [1, 2, 3, 64, 1024])
def test_as_many_cores_as_asked_for_or_all(there, count):
    for number in range(100, 110):
        found = some_of(there, count, number)
        assert found <= there
        assert len(found) == min(count, len(there))


@pytest.mark.parametrize(("there", "count"), [({0, 1, 2, 3}, 1), (set(range(4, 20)), 2), ({1, 3, 5, 7, 9, 11}, 3)])
def test_processes_one_after_another_share_no_core_as_long_as_there_are_some(there, count):
    taken = [some_of(there, count, 7001 + i) for i in range(len(there) // count)]
    assert set().union(*taken) == there


@pytest.mark.skipif(not hasattr(os, "sched_getaffinity"), reason="needs Linux")
@pytest.mark.parametrize("tasks", [Path("/proc/self/task"), Path("/nowhere")])
def test_cores_are_given_back(monkeypatch, tasks):
    """Also where threads are not listed, and when loading fails."""
    monkeypatch.setattr(confine, "TASKS", tasks)
    before = os.sched_getaffinity(0)
    with pytest.raises(ImportError), few_cores(1):
        assert len(os.sched_getaffinity(0)) == 1
        raise ImportError
    assert os.sched_getaffinity(0) == before
    with few_cores(0):
        assert os.sched_getaffinity(0) == before
