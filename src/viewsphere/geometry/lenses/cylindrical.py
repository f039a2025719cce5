"""A cylindrical panorama: columns are azimuths in equal steps of angle, rows are heights on an upright cylinder."""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.geometry.lenses import BlenderLens, Calibration, LensOptions, LensParameters, LensSpec
from viewsphere.geometry.lenses.shared import panorama
from viewsphere.geometry.lenses.shared.panorama import Span, SpanField

Float = NDArray[np.float64]

LIMIT = math.radians(89.9)
"""The highest elevation, radians: a cylinder has no pixel for straight up. Spans end below it."""

TALLEST = 179.0
"""The largest vertical span, degrees."""


class Cylindrical(LensParameters, frozen=True):
    """No parameters besides K, which maps azimuths (radians, rightwards) and y / sqrt(x^2 + z^2) to pixels."""

    model: Literal["cylindrical"] = "cylindrical"


class Options(LensOptions, frozen=True):
    """Options of the lens."""

    span: SpanField = Field(
        default=Span(),
        description="{horizontal, vertical}: angles of view, degrees, up to 360 and 179; default: a full turn, square pixels",
    )


def _calibrate(options: Options, size: tuple[int, int]) -> Calibration:
    """Square pixels on the horizon; the axis meets the middle."""
    width, height = size
    focal = width / math.radians(options.span.horizontal)
    down = options.span.vertical or 2 * math.degrees(math.atan(height / (2 * focal)))
    if down > TALLEST:
        raise ValueError(f"expected a vertical span of at most {TALLEST:g} degrees; found {down:g}")
    half = math.tan(math.radians(down) / 2)
    span = Span(horizontal=options.span.horizontal, vertical=down)
    panorama.check_height(size, 2 * focal * half, span)
    return Calibration(focal, height / (2 * half), width / 2, height / 2, Cylindrical())


def _as_blender(lens: Any) -> BlenderLens | None:
    """Blender's central cylindrical panorama of the same span, if the span ends within half a turn to both sides."""
    sides = panorama.sides(lens)
    if sides is None:
        return None
    across = {"central_cylindrical_range_u_min": sides.left, "central_cylindrical_range_u_max": sides.right}
    down = {"central_cylindrical_range_v_min": -sides.bottom, "central_cylindrical_range_v_max": -sides.top}
    return BlenderLens("PANO", "CENTRAL_CYLINDRICAL", {**across, **down, "central_cylindrical_radius": 1.0})


def _screen(directions: Float) -> Float:
    """Places on the upright cylinder of radius 1."""
    return directions / np.hypot(directions[:, 0], directions[:, 2])[:, None]


LENS = LensSpec(
    parameters=Cylindrical,
    options=Options,
    calibrate=_calibrate,
    as_blender=_as_blender,
    screen=_screen,
    **panorama.panorama_functions(LIMIT, is_cylinder=True),
)
