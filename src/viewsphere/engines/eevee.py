"""eevee: pictures drawn by Blender's EEVEE, through OpenGL; labels, and all but the drawing, are those of `cycles`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from viewsphere.engines import cycles

if TYPE_CHECKING:
    from pydantic import JsonValue

    from viewsphere.assets.mesh import Mesh
    from viewsphere.engines.cycles.staging import CyclesStage
    from viewsphere.model.shot import ModelSpec, Shot

PROGRAMS = cycles.SOURCES
"""Sources besides these that pictures depend on."""

OPENS_SCENES = True
"""It renders .blend files that are the scene."""


def check(options: Mapping[str, JsonValue]) -> None:
    """Raise UserError for an option that is not known (with the nearest name), out of range, or without a Blender."""
    cycles.check(options, "eevee")


def stage(shot: Shot, load: Callable[[ModelSpec], Mesh]) -> CyclesStage:
    """Build the shot's scene in Blender, and its geometry here.

    Raises UserError for an unknown engine option, one out of range or a shadow catcher, or where Blender cannot be used or
    cannot draw.
    """
    return cycles.stage(shot, load)
