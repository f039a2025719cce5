"""The CPU time of a run's parts, measured around its functions from outside."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import ModuleType
from typing import Any

Part = tuple[ModuleType, str, str]
"""A module, the name of a function of it, and what the table calls it."""


@contextmanager
def timed(parts: Sequence[Part], times: dict[str, float]) -> Iterator[None]:
    """Add up the CPU milliseconds of the parts, by what they are called, while the context lasts."""
    kept = [getattr(module, name) for module, name, _ in parts]

    def watched(inner: Callable[..., Any], label: str) -> Callable[..., Any]:
        def run(*args: Any, **more: Any) -> Any:
            begun = time.process_time()
            result = inner(*args, **more)
            times[label] = times.get(label, 0.0) + 1e3 * (time.process_time() - begun)
            return result

        return run

    for (module, name, label), inner in zip(parts, kept, strict=True):
        setattr(module, name, watched(inner, label))
    try:
        yield
    finally:
        for (module, name, _), inner in zip(parts, kept, strict=True):
            setattr(module, name, inner)
