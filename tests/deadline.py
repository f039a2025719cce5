"""How long tests wait for what must come: only one that fails waits so long, however busy the machine is."""

from __future__ import annotations

import time
from collections.abc import Callable

DEADLINE = 300
"""Seconds; less than pytest's own limit, so that a test says itself what it waited for."""


def until(true: Callable[[], object]) -> bool:
    """Return whether this becomes true before the deadline; asked about it again and again."""
    end = time.monotonic() + DEADLINE
    while not true():
        if time.monotonic() > end:
            return False
        time.sleep(0.02)
    return True
