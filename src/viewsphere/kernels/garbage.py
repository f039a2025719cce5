"""Python's garbage collection, paused or spared."""

from __future__ import annotations

import gc
from collections.abc import Generator
from contextlib import contextmanager
from contextvars import ContextVar

_spares = ContextVar("_spares", default=False)
"""Whether this process is viewsphere's own. (`gc.get_freeze_count` would say so as well, but counts for 10 ms.)"""


@contextmanager
def pause_collection() -> Generator[None]:
    """Collect no garbage while the context lasts: among millions of living objects this would take a quarter of the time."""
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            gc.enable()


@contextmanager
def importing() -> Generator[None]:
    """Import modules without collections, which find no garbage: they took 0.1 of the 1.3 CPU-seconds of one picture.

    In viewsphere's own processes, which call `spare_imports` at their start, later collections skip all that lives by then.
    """
    with pause_collection():
        yield
        if _spares.get():
            gc.freeze()


def spare_imports() -> None:
    """Let later collections in this process skip what `importing` leaves, even if part of it should become garbage."""
    _spares.set(True)
