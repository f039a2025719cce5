"""What is freed is used again, without new pages from the kernel."""

from __future__ import annotations

import os
import platform
import subprocess
import sys

import pytest

pytestmark = [
    pytest.mark.timeout(60),
    pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="glibc's allocator is told"),
]
SCRIPT = """
import resource, sys
import numpy as np
from viewsphere.run.allocator import keep_freed_memory

def pages():
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    kept = [np.ones((480, 640, 3), np.float32) for _ in range(16)]
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before

told = keep_freed_memory()
pages()
print(told, pages(), pages())
"""


def counted(**environment):
    """Whether the allocator was told; pages that were new when 59 MB were asked for a second and a third time."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("MALLOC_", "GLIBC_"))}
    run = subprocess.run([sys.executable, "-c", SCRIPT], env=kept | environment, capture_output=True, text=True, check=True)
    told, *pages = run.stdout.split()
    return told == "True", sum(map(int, pages))


def test_freed_memory_is_kept():
    told, pages = counted()
    assert told
    assert pages < 100


@pytest.mark.parametrize(
    "environment",
    [
        {"MALLOC_TRIM_THRESHOLD_": "1000000"},
        {"MALLOC_MMAP_THRESHOLD_": "100000"},
        {"GLIBC_TUNABLES": "glibc.malloc.trim_threshold=1"},
    ],
)
def test_who_tells_the_allocator_something_is_obeyed(environment):
    told, _ = counted(**environment)
    assert not told
