"""The contents of a data set made elsewhere, for rendering it again: its cameras, its models, and their poses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from viewsphere.errors import StoreError
from viewsphere.model.annotations.symmetries import Symmetries
from viewsphere.model.listed import ListedShot
from viewsphere.model.model_spec import Axis


@dataclass(frozen=True)
class Drafted:
    """A model without a file in the data set: a file name of letters, digits, `_` and `/`, and the file's bytes."""

    name: str
    data: bytes


@dataclass(frozen=True)
class SourceModel:
    """A model of the data set, in the axes and with the origin of its file; one unit of the file is `unit` metres.

    `name` begins its key; `symmetries` are in the file's axes and unit.
    """

    source: Path | Drafted
    category: str
    supercategory: str = ""
    name: str | None = None
    unit: float = 1.0
    symmetries: Symmetries | None = None


@dataclass(frozen=True)
class SourceCameras:
    """The result of a format's `again`.

    `shots` are its pictures, in its world and in metres; the `model` of their objects is a key of `models` here. Without
    models, the shots have only cameras. `up` is the axis of its world that points up, if known. `formats` and `annotations` are
    the recipe's values for writing the format again; `notes` are lines for readers of the recipe.
    """

    name: str
    shots: tuple[ListedShot, ...]
    models: dict[str, SourceModel]
    formats: tuple[str | dict[str, Any], ...]
    annotations: tuple[str, ...] = ()
    up: Axis = "+z"
    notes: tuple[str, ...] = ()


def refuse_any(problems: Sequence[str]) -> None:
    """Raise StoreError, one line, for the first of the problems, if there are any."""
    if problems:
        more = f" ({len(problems) - 1:,} more like it)" if len(problems) > 1 else ""
        raise StoreError(f"{' '.join(problems[0].split())}{more}")
