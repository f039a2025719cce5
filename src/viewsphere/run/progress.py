"""The progress of a run."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Progress:
    """The progress of a run.

    Phases are skies (their pictures are analysed), models, kernels (compiled once on a machine, then cached), frames and
    exports. Phases without work are left out.

    Attributes:
        phase: Name of the phase.
        done: Number of finished units of the phase; frames and exports count frames.
        total: Number of units of the phase.
        resumed: Number of units that were there before this run.
        under_way: Number of finished frames in unfinished shots. They do not count as done, and a run that is stopped loses
            them.
        nodes: Number of working machines of a cluster; None without a cluster.
    """

    phase: str
    done: int
    total: int
    resumed: int = 0
    under_way: int = 0
    nodes: int | None = None


Listener = Callable[[Progress], None]


def null_listener(progress: Progress) -> None:
    """The listener that ignores progress."""


def shown_on_terminal(progress: Progress) -> None:
    """Count compiled kernels in a line on standard error if it is a terminal; otherwise print nothing."""
    if sys.stderr is not None and sys.stderr.isatty():
        end = "\n" if progress.done == progress.total else ""
        sys.stderr.write(f"\rcompiling kernels, once on this machine: {progress.done} of {progress.total}{end}")
        sys.stderr.flush()
