"""Error messages for reader processes that ended without an answer."""

from __future__ import annotations

FROM_OUTSIDE = ("SIGKILL", "SIGTERM", "SIGINT", "SIGHUP", "SIGQUIT")
"""Signals that come from other processes or the system: a damaged file never makes a reader end by one of them."""


def too_slow(seconds: float) -> str:
    """The message for a reader that exceeded its time limit."""
    return (
        f"expected to be read within {seconds:g} s (limit MAX_READ_SECONDS), stopped then; simplify the model, or "
        "set VIEWSPHERE_MAX_READ_SECONDS higher"
    )


def ended(reader: str, how: str, memory: int) -> str:
    """The message for a reader process that ended without an answer; `how`: the signal that ended it, or its exit status."""
    if how in FROM_OUTSIDE:
        return (
            f"{reader} ended unexpectedly: it was killed ({how}), perhaps because memory ran out; the file may be whole: "
            "try again with more memory free, or fewer --workers"
        )
    allowed = f"{memory:,} bytes of memory (limit MAX_READ_BYTES)"
    return f"reading it crashed ({how}), with {allowed}: damaged, or larger than that allows"
