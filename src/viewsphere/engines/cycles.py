"""cycles: path-traced pictures by Blender's Cycles, which runs in a process of its own; labels are the same as raster's."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from viewsphere.engines import _blender
from viewsphere.engines._blender import PROGRAMS, indices, save, shows_sky, stage
from viewsphere.model.channel import PASSES

if TYPE_CHECKING:
    from pydantic import JsonValue

__all__ = ["OPENS_SCENES", "PAINTS", "PROGRAMS", "check", "indices", "save", "shows_sky", "stage"]

OPENS_SCENES = True
"""Cycles renders .blend files that are the scene."""

PAINTS = tuple(PASSES)
"""The passes that Cycles paints: all."""


def check(options: Mapping[str, JsonValue]) -> None:
    """Raise UserError for an option that is not known (with the nearest name), out of range, or without a Blender."""
    _blender.check(options, "cycles")
