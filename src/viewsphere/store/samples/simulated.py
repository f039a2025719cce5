"""The store of simulation results, such as the rest poses of a heap: each is computed once, and stored.

Two machines may differ in the last bit of a result. So all shots of a scene use the result that was kept first, on any
machine and after any crash. An entry is a folder with one file: OUT/store/simulated/ab/<the rest of the digest>/made.json.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from viewsphere.errors import StoreError
from viewsphere.files import read_text
from viewsphere.store.shots.folder import Store

MADE = "made.json"


@dataclass(frozen=True)
class Simulated:
    """Keeps the simulation results of a data set in its store; without `writes`, it only reads stored results."""

    root: Path
    writes: bool = True

    def __call__(self, names: tuple[str, ...], make: Callable[[], Any]) -> Any:
        """The plain data first stored for these names, else the result of `make`. Raises StoreError for an unreadable entry."""
        digest = hashlib.sha256("\0".join(names).encode()).hexdigest()
        store = Store(self.root)
        folder = store.folder / "simulated" / digest[:2] / digest[2:40]
        if not (folder / MADE).is_file():
            made = make()
            if not self.writes:
                return made
            text = json.dumps(made, separators=(",", ":"))
            with store.scratch_folder(folder) as aside:
                (aside / MADE).write_text(text, "utf-8", newline="\n")
        try:
            return json.loads(read_text(folder / MADE, "MAX_RECORD_BYTES"))
        except (OSError, ValueError) as error:
            raise StoreError(f"{folder / MADE}: expected what was simulated, found {error}: remove this file") from None
