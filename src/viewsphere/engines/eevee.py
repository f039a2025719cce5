"""eevee: pictures drawn by Blender's EEVEE, through OpenGL; labels, and all but the drawing, are those of `cycles`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from viewsphere.engines.shared import blender as _blender
from viewsphere.engines.shared.blender import PROGRAMS, stage
from viewsphere.plugins.engine import EngineSpec

if TYPE_CHECKING:
    from pydantic import JsonValue


def check(options: Mapping[str, JsonValue]) -> None:
    """Raise UserError for an option that is not known (with the nearest name), out of range, or without a Blender."""
    _blender.check(options, "eevee")


ENGINE = EngineSpec(check=check, stage=stage, opens_scenes=True, catches_shadows=False, programs=PROGRAMS)
