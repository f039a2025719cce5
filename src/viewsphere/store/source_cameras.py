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
    """A model of which the data set has no file of its own: a name for one, of letters, digits, `_` and `/`, and its bytes."""

    name: str
    data: bytes


@dataclass(frozen=True)
class SourceModel:
    """A model of the data set, whose axes and origin are those of its file, of which `unit` metres are one unit.

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

    `shots` are its pictures, in its world and in metres; `model` of their objects is a key of `models` here. Without any models
    there are only cameras. `up` is the axis of its world that points up, as far as anybody knows. `formats` and `annotations`
    are what a recipe says to write the format again; `notes` are lines for whoever reads the recipe.
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
