"""All formats, with what users choose one by."""

from __future__ import annotations

import inspect
from dataclasses import dataclass
from typing import Any

from viewsphere import plugins


@dataclass(frozen=True)
class Listed:
    """A format: its first sentence, the labels and passes that it always needs, what it holds, what reads it, its options, and
    whether it can be written, and imported.
    """

    name: str
    summary: str
    needs: tuple[str, ...]
    holds: tuple[str, ...]
    read_by: tuple[str, ...]
    options: tuple[str, ...]
    writes: bool
    reads: bool


def listed() -> tuple[Listed, ...]:
    """All formats that are installed, by their names."""
    return tuple(_listed(name, plugins.load("formats", name)) for name in plugins.names("formats"))


def _listed(name: str, module: Any) -> Listed:
    options = getattr(module, "Options", None)
    return Listed(
        name=name,
        summary=(inspect.getdoc(module) or "").partition("\n\n")[0].replace("\n", " "),
        needs=tuple(getattr(module, "CHANNELS", ())),
        holds=tuple(getattr(module, "HOLDS", ())),
        read_by=tuple(getattr(module, "READ_BY", ())),
        options=tuple(options.model_fields) if options else (),
        writes=hasattr(module, "writer"),
        reads=hasattr(module, "read"),
    )
