"""Puts a file or a folder in its place in one step, on Windows too."""

from __future__ import annotations

import os
import time
from pathlib import Path

WAITS_S = (0.02, 0.05, 0.1, 0.2, 0.4, 0.8) if os.name == "nt" else ()
"""Seconds before each further try. Windows refuses to move what another program has open, and virus scanners and indexers
open what was just written."""


def move(source: Path, target: Path) -> None:
    """Rename `source`; a file that is `target` gives way to it, a folder does not.

    Raises OSError; where refusals pass (`WAITS_S`), after the last try.
    """
    for seconds in WAITS_S:
        try:
            os.replace(source, target)  # noqa: PTH105, the one place that renames
            return
        except PermissionError:
            time.sleep(seconds)
    os.replace(source, target)  # noqa: PTH105
