"""What is freed is used again, without new pages from the kernel."""

from __future__ import annotations

import os
import platform
import subprocess
import sys

import pytest

from quick import quick

pytestmark = [
    pytest.mark.timeout(60),
    pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="glibc's allocator is told"),
]
NEW_PAGES = """
import resource, sys
import numpy as np
from viewsphere.run.workers.allocator import keep_freed_memory

def pages(shape, count):
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    kept = [np.ones(shape, np.float32) for _ in range(count)]
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before

told = keep_freed_memory()
shape, count = eval(sys.argv[1])
pages(shape, count)
print(told, pages(shape, count), pages(shape, count))
"""
TELL = """
from viewsphere.run.workers import allocator
allocator.KEPT_BYTES = 1 << 26
told = allocator.keep_freed_memory()
"""
GIVEN_BACK = f"""
import os, resource
import numpy as np
{TELL}
statm = os.open("/proc/self/statm", os.O_RDONLY)

def held():  # open().read() may leave a string at the heap's end, behind which nothing can be given back
    return int(os.pread(statm, 100, 0).split()[1]) * resource.getpagesize()

before = held()
kept = [np.ones(1 << 24, np.float32) for _ in range(4)]
most = held()
kept.clear()
print(told, most - before, held() - before)
"""
RELEASED = """
import sys
import numpy as np
from viewsphere.run.workers.allocator import keep_freed_memory, release_freed_memory

def held():
    return [int(line.split()[1]) for line in open("/proc/self/status") if line.startswith("VmRSS")][0] * 1024

told = keep_freed_memory()
before, count = held(), int(sys.argv[1])
kept = [np.ones(1 << 18, np.float32) for _ in range(count)]
after = [np.ones(100, np.float32) for _ in range(100)]  # in use, behind what is freed
most = held()
kept.clear()
print(release_freed_memory(), most - before, held() - before)
"""
FRAME, LARGE = "(480, 640, 3), 16", "(4096, 4096), 4"  # 59 MB in all; 268 MB, each more than glibc puts on the heap by itself


def answered(script, *arguments, **environment):
    """Return whether the allocator was told, and the script's two numbers."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("MALLOC_", "GLIBC_"))}
    command = [sys.executable, "-c", script, *arguments]
    told, *numbers = subprocess.run(command, env=kept | environment, capture_output=True, text=True, check=True).stdout.split()
    return told == "True", list(map(int, numbers))


@pytest.mark.parametrize("arrays", quick([FRAME, LARGE], FRAME))
def test_freed_memory_is_kept(arrays):
    told, pages = answered(NEW_PAGES, arrays)
    assert told
    assert sum(pages) < 100


@pytest.mark.slow
def test_what_is_beyond_the_kept_bytes_is_given_back():
    told, (most, left) = answered(GIVEN_BACK)
    assert told
    assert most > 3 << 26
    assert left <= 1 << 26


IN_MEMORY = """
import viewsphere as vs
poses = {"azimuth": 0, "elevation": 20, "distance": 3}
recipe = vs.Recipe(models=[{"source": "zoo:chair"}], viewpoints=poses, channels=["depth"], camera={"size": [32, 32]})
assert len(list(vs.render(recipe))) == 1
"""
WORKER = """
from pathlib import Path
from types import SimpleNamespace
from viewsphere.run.executors import local
class Gone:
    def recv(self):
        raise EOFError
portion = SimpleNamespace(plan=SimpleNamespace(recipe=None), record=None, remembering=lambda store: None)
local._serve(Gone(), Path("nowhere"), portion)
"""
COMMAND = """
from viewsphere import cli
from viewsphere.cli import commands
commands.app = lambda standalone_mode: None
try:
    cli.main()
except SystemExit as end:
    assert not end.code
"""


@pytest.mark.parametrize(
    ("process", "is_kept"),
    [
        pytest.param(IN_MEMORY, False, marks=pytest.mark.slow),
        pytest.param(WORKER, True, marks=pytest.mark.slow),
        (COMMAND, True),
    ],
)
def test_workers_and_the_command_line_keep_memory_and_not_the_users_process(process, is_kept):
    told, (most, left) = answered(process + GIVEN_BACK.replace(TELL, "told = True\n"))
    assert told
    assert most > 3 << 26
    assert (left > 3 << 26) == is_kept


@pytest.mark.parametrize(
    "environment",
    [
        {"MALLOC_TRIM_THRESHOLD_": "1000000"},
        {"MALLOC_MMAP_THRESHOLD_": "100000"},
        {"MALLOC_MMAP_MAX_": "65536"},
        {"GLIBC_TUNABLES": "glibc.malloc.trim_threshold=1"},
    ],
)
@pytest.mark.slow
def test_who_tells_the_allocator_something_is_obeyed(environment):
    told, _ = answered(NEW_PAGES, FRAME, **environment)
    assert not told


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
@pytest.mark.parametrize("count, is_released", [(100, True), (10, False)])
def test_much_free_memory_is_released_though_memory_behind_it_is_in_use(count, is_released):
    told, (most, left) = answered(RELEASED, str(count))
    assert told == is_released
    assert most > 0.9 * count * (1 << 20)
    assert (left < 8 << 20) == is_released
