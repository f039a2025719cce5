"""How much of an object is seen, and how much lies outside the image."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.box import Bounds, overlap
from viewsphere.model.camera import Camera
from viewsphere.truth.geometry import Geometry


def visible_and_cut(
    geometry: Geometry,
    camera: Camera,
    object_id: int,
    area: int,
    bounds: Sequence[Bounds | None],
    whole: Sequence[bool],
) -> tuple[float, float]:
    """Visibility and truncation of one object; `bounds` and `whole` are all objects' `projected_bounds`.

    Visibility is `area`, its visible pixels, over all pixels it would cover alone, on a canvas of three
    times the image's width and height (BOP's visib_fract,
    https://github.com/thodan/bop_toolkit/blob/master/docs/bop_datasets_format.md); truncation is the share
    of those outside the image. An object that covers no pixel has visibility 0.
    """
    own = bounds[object_id - 1]
    if own is None:
        if not area:
            return 0.0, 1.0
        own = (-math.inf, -math.inf, math.inf, math.inf)  # all that is seen of it is nearer than boxes begin
    width, height = camera.width, camera.height
    image = (0.0, 0.0, float(width), float(height))
    if whole[object_id - 1] and not overlap(own, image):
        return 0.0, 1.0
    inside = whole[object_id - 1] and own[0] >= 0 and own[1] >= 0 and own[2] <= width and own[3] <= height
    if inside and not area:
        return 0.0, 0.0
    if inside and _unobstructed(geometry, camera, object_id, bounds, whole):
        return 1.0, 0.0
    total, kept = _pixels_alone(geometry, camera, object_id, own if whole[object_id - 1] else None)
    if total == 0:
        return 0.0, 0.0 if overlap(own, image) else 1.0
    return area / total, (total - kept) / total


def _unobstructed(
    geometry: Geometry, camera: Camera, object_id: int, bounds: Sequence[Bounds | None], whole: Sequence[bool]
) -> bool:
    """Whether nothing can hide any of the object: no other's box meets its own, no scenery is there, and no ground is in the
    way.
    """
    if geometry.has_scenery:
        return False  # a street's box meets all others: to look at scenery's boxes would cost more than it saves
    own = bounds[object_id - 1]
    for i, other in enumerate(bounds):
        if i != object_id - 1 and own and other and (not whole[i] or overlap(own, other)):
            return False
    return geometry.ground_z is None or float(camera.center[2]) > geometry.ground_z


def _pixels_alone(geometry: Geometry, camera: Camera, object_id: int, own: Bounds | None) -> tuple[int, int]:
    """Pixels the object would cover alone on the large canvas, and how many of them lie in the image."""
    from viewsphere.truth.visibility import silhouette

    width, height = camera.width, camera.height
    x0, y0, x1, y1 = own or (-math.inf, -math.inf, math.inf, math.inf)
    left, top = math.floor(max(x0, -width)), math.floor(max(y0, -height))
    right, bottom = math.ceil(min(x1, 2 * width)), math.ceil(min(y1, 2 * height))
    if right <= left or bottom <= top:
        return 0, 0
    alone: NDArray[np.bool_] = silhouette(geometry, camera, object_id, (left, top, right, bottom))
    in_image = alone[max(-top, 0) : max(height - top, 0), max(-left, 0) : max(width - left, 0)]
    return int(np.count_nonzero(alone)), int(np.count_nonzero(in_image))
