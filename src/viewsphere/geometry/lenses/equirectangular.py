"""An equirectangular panorama: columns are azimuths, rows are elevations, in equal steps of angle."""

from __future__ import annotations

import math
from typing import Any, Literal

from pydantic import Field

from viewsphere.geometry.lenses import BlenderLens, Calibration, ColmapLens, LensOptions, LensParameters, LensSpec
from viewsphere.geometry.lenses.shared import panorama
from viewsphere.geometry.lenses.shared.panorama import Span, SpanField

LIMIT = math.pi / 2
"""The highest elevation, radians."""


class Equirectangular(LensParameters, frozen=True):
    """No parameters besides K, which maps azimuths and elevations (radians, rightwards and downwards) to pixels."""

    model: Literal["equirectangular"] = "equirectangular"


class Options(LensOptions, frozen=True):
    """Options of the lens."""

    span: SpanField = Field(
        default=Span(),
        description="{horizontal, vertical}: angles of view, degrees, up to 360 and 180; default: a full turn, square pixels",
    )


def _calibrate(options: Options, size: tuple[int, int]) -> Calibration:
    """Equal steps of angle; the axis meets the middle."""
    width, height = size
    across = options.span.horizontal
    down = options.span.vertical or across * height / width
    if down > 180:
        fix = f": set size: [{width}, {max(round(width * 180 / across), 1)}]" if options.span.vertical is None else ""
        raise ValueError(f"expected a vertical span of at most 180 degrees; found {down:g}{fix}")
    span = Span(horizontal=across, vertical=down)
    panorama.check_height(size, width * down / across, span)
    return Calibration(width / math.radians(across), height / math.radians(down), width / 2, height / 2, Equirectangular())


def _as_colmap(lens: Any) -> ColmapLens | None:
    """The picture of all directions; COLMAP has no smaller span."""
    i = lens.intrinsics
    missed = abs(math.pi * i.fy - i.height), abs(i.cx - i.width / 2), abs(i.cy - i.height / 2), abs(i.skew)
    if lens.period is None or max(missed) > panorama.CLOSED:
        return None
    return ColmapLens("EQUIRECTANGULAR", (float(i.width), float(i.height)), has_matrix=False)


def _as_blender(lens: Any) -> BlenderLens | None:
    """Blender's panorama of the same span, if the span ends within half a turn to both sides, and at the poles."""
    sides = panorama.sides(lens)
    if sides is None or max(-sides.top, sides.bottom) > LIMIT + panorama.CLOSED:
        return None
    span = {"latitude_min": -min(sides.bottom, LIMIT), "latitude_max": min(-sides.top, LIMIT)}
    return BlenderLens("PANO", "EQUIRECTANGULAR", {"longitude_min": sides.left, "longitude_max": sides.right, **span})


LENS = LensSpec(
    parameters=Equirectangular,
    options=Options,
    calibrate=_calibrate,
    as_colmap=_as_colmap,
    as_blender=_as_blender,
    **panorama.panorama_functions(LIMIT, is_cylinder=False),
)
