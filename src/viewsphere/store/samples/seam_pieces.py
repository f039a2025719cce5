"""Objects across the seam of a picture of a full turn, as two objects with one id, for formats whose boxes end at its sides."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.hull import convex_hull, mask_outline, smallest_rectangle
from viewsphere.geometry.mask import decode_rle, encode_rle, mask_box
from viewsphere.model.sample import Box, ObjectAnnotation, Rle, Sample

PIECE = "seam_piece"
"""The field of `extra` with a piece's number: 1 at the right side of the picture, 2 at its left side."""

OUTSIDE = 2
"""The state of a keypoint outside the picture: in a piece, that of the keypoints of the other one, so that one alone has it."""


def cut_at_seam(sample: Sample) -> Sample:
    """The sample with each object across the seam as two objects with the same id: first the part at the picture's right side.
    Their masks and boxes are those of the parts, and each keypoint is outside one of them. What describes the whole object is
    the same in both.
    """
    period = None if sample.known_camera is None else sample.known_camera.lens.period
    if period is None:
        return sample
    return replace(sample, objects=tuple(piece for o in sample.objects for piece in _pieces(o, period)))


def _pieces(o: ObjectAnnotation, period: int) -> tuple[ObjectAnnotation, ...]:
    if o.box2d is None or o.box2d[2] <= period:
        return (_projected_beside(o, period),)
    mask, columns = o.mask, np.arange(period) >= o.box2d[0]
    return _piece(o, 1, mask & columns, columns, period), _piece(o, 2, mask & ~columns, ~columns, period)


def _piece(
    o: ObjectAnnotation, number: int, mask: NDArray[np.bool_], columns: NDArray[np.bool_], period: int
) -> ObjectAnnotation:
    """One part of an object: its pixels, and the columns at its side of the picture."""
    extra: dict[str, Any] = {**o.extra, PIECE: number}
    if "hull" in extra:
        extra["hull"] = convex_hull(mask_outline(mask))
    if "obb" in extra:
        extra |= {"obb": smallest_rectangle(convex_hull(mask_outline(mask))), "obb_projected": None}
    if "amodal" in extra:
        whole = decode_rle(o.amodal.height, o.amodal.width, o.amodal.counts) & columns
        extra |= {"amodal": _coded(whole), "box2d_amodal": _floats(mask_box(whole))}
    if "keypoint_states" in extra and o.box2d is not None:
        extra["keypoint_states"] = _states(extra, (o.box2d[0] + o.box2d[2] - period) / 2, number)
    return replace(
        o,
        rle=_coded(mask),
        area=int(mask.sum()),
        box2d=_floats(mask_box(mask)),
        box2d_projected=_side(o.box2d_projected, number, period),
        box2d_unclipped=_moved(o.box2d_unclipped, number, period),
        extra=extra,
    )


def _states(extra: Mapping[str, Any], middle: float, number: int) -> NDArray[np.int64]:
    """The states of keypoints in one piece; `middle` is the x farthest from both pieces, which divides the picture."""
    x, states = np.reshape(extra["keypoints"], (-1, 2))[:, 0], np.asarray(extra["keypoint_states"], np.int64)
    is_elsewhere = (x >= middle) != (number == 1)
    return np.where(is_elsewhere & (states < OUTSIDE), OUTSIDE, states)


def _projected_beside(o: ObjectAnnotation, period: int) -> ObjectAnnotation:
    """An object that is visible at one side of the seam at most, with its projected box at that side."""
    around = o.box2d_projected
    if around is None or around[2] <= period:
        return o
    visible = o.box2d[0] if o.box2d else around[0] if period - around[0] >= around[2] - period else 0.0
    number = 1 if visible >= around[0] - 1 else 2
    return replace(o, box2d_projected=_side(around, number, period), box2d_unclipped=_moved(o.box2d_unclipped, number, period))


def _side(box: Box | None, number: int, period: int) -> Box | None:
    """The part of a projected box at one side of the picture; all of a box that does not cross the seam."""
    if box is None or box[2] <= period:
        return box
    return (box[0], box[1], float(period), box[3]) if number == 1 else (0.0, box[1], box[2] - period, box[3])


def _moved(box: Box | None, number: int, period: int) -> Box | None:
    """A whole box, at the turn of the circle in which it is at that side of the picture."""
    return box if box is None or number == 1 or box[2] <= period else (box[0] - period, box[1], box[2] - period, box[3])


def _coded(mask: NDArray[np.bool_]) -> Rle:
    height, width = mask.shape
    return Rle(height, width, encode_rle(mask))


def _floats(box: tuple[int, int, int, int] | None) -> Box | None:
    return None if box is None else (float(box[0]), float(box[1]), float(box[2]), float(box[3]))
