"""cycles: pictures path-traced by Blender's Cycles, which runs in its own process; labels are the same as raster's."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from viewsphere.engines.shared import blender as _blender
from viewsphere.engines.shared.blender import PROGRAMS, indices, save, shows_sky, stage
from viewsphere.model.channel import PASSES
from viewsphere.plugins.engine import EngineSpec

if TYPE_CHECKING:
    from pydantic import JsonValue


def _check(options: Mapping[str, JsonValue]) -> None:
    """Raise UserError for an unknown option (with the nearest name), a value out of range, or a missing Blender."""
    _blender.check(options, "cycles")


ENGINE = EngineSpec(
    check=_check,
    stage=stage,
    paints=tuple(PASSES),
    opens_scenes=True,
    parallel_rays=True,
    programs=PROGRAMS,
    save=save,
    shows_sky=shows_sky,
    indices=indices,
)
