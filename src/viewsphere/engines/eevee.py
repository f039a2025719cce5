"""eevee: pictures drawn by Blender's EEVEE through OpenGL; labels, and everything except the drawing, are the same as for
`cycles`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from viewsphere.engines.shared import blender as _blender
from viewsphere.engines.shared.blender import PROGRAMS, stage
from viewsphere.model.channel import FINISHED
from viewsphere.plugins.engine import EngineSpec

if TYPE_CHECKING:
    from pydantic import JsonValue


def _check(options: Mapping[str, JsonValue]) -> None:
    """Raise UserError for an unknown option (with the nearest name), a value out of range, or a missing Blender."""
    _blender.check(options, "eevee")


ENGINE = EngineSpec(
    check=_check,
    stage=stage,
    opens_scenes=True,
    catches_shadows=False,
    parallel_rays=True,
    programs=PROGRAMS,
    paints=FINISHED,
)
