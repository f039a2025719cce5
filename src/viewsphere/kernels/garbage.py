"""Python's garbage collection, paused."""

from __future__ import annotations

import gc
from collections.abc import Generator
from contextlib import contextmanager


@contextmanager
def pause_collection() -> Generator[None]:
    """Collect no garbage while the context lasts: among millions of living objects this would take a quarter of the time.

    Imports leave no garbage either: of 0.85 CPU-seconds of imports, collections took 0.15.
    """
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            gc.enable()
