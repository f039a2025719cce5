"""eevee: pictures drawn by Blender's EEVEE, through OpenGL; labels, and all but the drawing, are those of `cycles`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from viewsphere.engines import cycles
from viewsphere.engines.cycles import OPENS_SCENES, stage
from viewsphere.engines.cycles import SOURCES as PROGRAMS

if TYPE_CHECKING:
    from pydantic import JsonValue

__all__ = ["CATCHES_SHADOWS", "OPENS_SCENES", "PROGRAMS", "check", "stage"]

CATCHES_SHADOWS = False
"""It has no ground of which only the shadows are seen."""


def check(options: Mapping[str, JsonValue]) -> None:
    """Raise UserError for an option that is not known (with the nearest name), out of range, or without a Blender."""
    cycles.check(options, "eevee")
