"""raster: shades truth's visibility buffer on the CPU (numba); the default engine."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from viewsphere.assets.mesh import Mesh
    from viewsphere.engines.raster.staging import RasterStage
    from viewsphere.model.shot import ModelSpec, Shot

SHOT_FRAMES = 16
"""Frames a shot holds by default: enough to pay for building its stage."""


def stage(shot: Shot, load: Callable[[ModelSpec], Mesh]) -> RasterStage:
    """Build geometry, textures, shadow map and ambient light, once for all frames of the shot.

    Raises UserError for an unknown engine option or one out of range.
    """
    from viewsphere.engines.raster.staging import build_stage

    return build_stage(shot, load)
