"""The parts that panoramas share: their seam, the box of triangles, and the options of a recipe."""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field, WithJsonSchema

from viewsphere.geometry.lenses import Bounds, Lens, Rays, central
from viewsphere.geometry.seam import in_picture, shortest_interval

Float = NDArray[np.float64]
Degrees = Annotated[float, Field(gt=0, le=360, strict=True)]

TURN = 2 * math.pi
ALL_AROUND = 2
"""The last result of `kernels_panorama.bounds` for triangles above or below the centre."""

CLOSED = 1e-6
"""Largest share of a pixel by which a full turn may miss the picture's width; rounding of K is far below it."""


class Span(BaseModel, frozen=True, extra="forbid", allow_inf_nan=False):
    """The angles of view of a panorama, degrees."""

    horizontal: Degrees = Field(default=360.0, description="across")
    vertical: Annotated[float, Field(strict=True, gt=0)] | None = Field(
        default=None, description="from top to bottom; default: square pixels in the middle"
    )


SpanField = Annotated[
    Span,
    WithJsonSchema(
        {
            "type": "object",
            "properties": {
                "horizontal": {"type": "number", "exclusiveMinimum": 0, "maximum": 360},
                "vertical": {"type": "number", "exclusiveMinimum": 0, "maximum": 180},
            },
            "additionalProperties": False,
        }
    ),
]


def check_height(size: tuple[int, int], height: float, span: Span) -> None:
    """Raise ValueError if a picture's height differs by more than half a pixel from that with square pixels in its middle."""
    if abs(size[1] - height) > 0.5:
        raise ValueError(
            f"expected square pixels: a size of {size[0]} x {max(round(height), 1)} for a span of {span.horizontal:g} x "
            f"{span.vertical:g} degrees; found {size[0]} x {size[1]}"
        )


def panorama_functions(limit: float, is_cylinder: bool) -> dict[str, Any]:
    """The functions of a `LensSpec` that shows all azimuths, and elevations up to `limit`, radians. Rows are tangents of
    elevations on a cylinder, and elevations otherwise.
    """

    def rays(lens: Lens, xy: Float) -> Rays:
        from viewsphere.geometry.lenses.shared import kernels_panorama as kernels

        out = np.empty((len(xy), 3))
        kernels.rays(is_cylinder, limit, lens.intrinsics.K, xy, out)
        return central(out)

    def project(lens: Lens, points: Float) -> Float:
        return _project(lens, points, limit, is_cylinder)

    def bounds(
        lens: Lens, R: Float, t: Float, vertices: Float, is_used: NDArray[np.bool_], triangles: NDArray[np.int32]
    ) -> tuple[Bounds | None, bool]:
        return _bounds(lens, (R, t), (vertices, is_used, triangles), limit, is_cylinder)

    return {
        "rays": rays,
        "project": project,
        "bounds": bounds,
        "has_depth": False,
        "period": _period,
        "field_of_view": _field_of_view,
    }


class _Sides(NamedTuple):
    """The ends of a picture in the units to which K applies: radians across; radians or tangents down."""

    left: float
    right: float
    top: float
    bottom: float


def sides(lens: Lens) -> _Sides | None:
    """The ends of a picture whose middle column may be off the axis; None if it is skewed or ends beyond half a turn."""
    i = lens.intrinsics
    left, right = -i.cx / i.fx, (i.width - i.cx) / i.fx
    if i.skew or max(-left, right) > math.pi + CLOSED:
        return None
    return _Sides(max(left, -math.pi), min(right, math.pi), -i.cy / i.fy, (i.height - i.cy) / i.fy)


def _period(lens: Lens) -> int | None:
    """The picture's width if it shows a full turn."""
    i = lens.intrinsics
    return i.width if abs(TURN * i.fx - i.width) <= CLOSED else None


def _project(lens: Lens, points: Float, limit: float, is_cylinder: bool) -> Float:
    """Positions of points in all directions up to the elevation `limit`."""
    from viewsphere.geometry.lenses.shared import kernels_panorama as kernels

    out = np.empty((len(points), 2))
    kernels.project(is_cylinder, limit, points, out)
    xy = lens.positions(*out.T)
    turn = _period(lens)
    if turn is not None:
        x = xy[:, 0]
        x[x < 0.0] += turn
        x[x >= turn] -= turn
        x[x < 0.0] = 0.0  # rounding of the subtraction
    return xy


def _bounds(
    lens: Lens,
    view: tuple[Float, Float],
    surface: tuple[Float, NDArray[np.bool_], NDArray[np.int32]],
    limit: float,
    is_cylinder: bool,
) -> tuple[Bounds | None, bool]:
    """The box of azimuths and elevations: the shortest around the circle. x1 exceeds the width of a full turn for triangles
    across its seam. The view is R and t, the surface is as in `Lens.bounds`.
    """
    from viewsphere.geometry.lenses.shared import kernels_panorama as kernels

    i, (vertices, is_used, triangles) = lens.intrinsics, surface
    room = np.empty((len(vertices), 5))
    left, right, lowest, highest, lies = kernels.bounds(vertices, is_used, triangles, *view, room)
    whole = bool(-limit <= lowest and highest <= limit)
    lowest, highest = max(lowest, -limit), min(highest, limit)
    if lowest > highest:
        return None, False
    turn = _period(lens)
    circle = TURN * i.fx if turn is None else float(turn)
    azimuths = np.array([[left, right]]) if lies == 0 else _edges(room[:, 4][triangles])
    starts, ends = np.mod(i.fx * azimuths + i.cx, circle).T
    starts[starts >= circle], ends[ends >= circle] = 0.0, 0.0  # rounding of np.mod
    x0, x1 = (0.0, circle) if lies == ALL_AROUND else shortest_interval(starts, ends, circle)
    if turn is None:
        x0, x1 = in_picture(x0, x1, circle, i.width)
    v0, v1 = (math.tan(highest), math.tan(lowest)) if is_cylinder else (highest, lowest)
    return (x0, i.cy - i.fy * v0, x1, i.cy - i.fy * v1), whole


def _edges(corners: Float) -> Float:
    """The azimuths (n, 2) at the left and the right end of the edges of triangles with these corners (m, 3)."""
    a, b = corners.reshape(-1), np.roll(corners, -1, axis=1).reshape(-1)
    turned = b - a
    turned -= TURN * np.rint(turned / TURN)
    return np.where(turned[:, None] < 0, np.stack((b, a), axis=1), np.stack((a, b), axis=1))


def _field_of_view(lens: Any) -> tuple[float, float]:
    """The angles across and from top to bottom."""
    i = lens.intrinsics
    ends = lens.rays([[i.cx, 0.0], [i.cx, float(i.height)]]).directions
    top, bottom = (math.degrees(math.atan2(float(y), float(z))) for _, y, z in ends.tolist())
    return math.degrees(i.width / i.fx), bottom - top
