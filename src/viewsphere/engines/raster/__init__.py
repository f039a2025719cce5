"""raster: shades truth's visibility buffer on the CPU (numba); the default engine."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from viewsphere.kernels.garbage import importing
from viewsphere.model.channel import PASSES
from viewsphere.plugins.engine import EngineSpec

if TYPE_CHECKING:
    from pydantic import JsonValue

    from viewsphere.assets.animation.deforming import Load
    from viewsphere.engines.raster.staging import RasterStage
    from viewsphere.model.shot import Shot


def _check(options: Mapping[str, JsonValue]) -> None:
    """Raise UserError for an unknown option (with the nearest name) or a value out of range."""
    from viewsphere.engines.raster.options import parse_options

    parse_options(options)


def stage(shot: Shot, load: Load) -> RasterStage:
    """Build geometry, textures, shadow map and ambient light, once for all frames of the shot.

    Raises UserError for an unknown engine option or one out of range.
    """
    with importing():
        from viewsphere.engines.raster.staging import build_stage

    return build_stage(shot, load)


ENGINE = EngineSpec(check=_check, stage=stage, paints=tuple(PASSES), parallel_rays=True, rolling=True)
