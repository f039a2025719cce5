"""Files that several exports of one pass share: made once a frame, then linked."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from viewsphere.urls import link_file


class Made:
    """The files made of the frame that is exported now, by the names of their encodings."""

    def __init__(self) -> None:
        self._frame = -1
        self._files: dict[str, Path] = {}

    def put(self, frame: int, name: str, make: Callable[[], bytes], file: Path) -> str | None:
        """Write what `make` gives into a file, or link it to where the same was written before; says how it was linked."""
        if frame != self._frame:
            self._frame, self._files = frame, {}
        first = self._files.setdefault(name, file)
        if first is not file:
            return link_file(first, file)
        file.write_bytes(make())
        return None
