"""birds_eye: an object's box seen from above."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from viewsphere.geometry.rotation import transform
from viewsphere.labels.shared.drawing.colors import color_of
from viewsphere.labels.shared.drawing.lines import in_space
from viewsphere.labels.shared.field import Field
from viewsphere.labels.shared.placement import Placement
from viewsphere.labels.shared.spec import Drawing, Models, ObjectLabel, rendered
from viewsphere.model.sample import Sample

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

TOLERANCE = 1e-9
"""Length of a front's level part below which the object points straight up or down."""


@dataclass(frozen=True)
class BirdsEye:
    """A rectangle on the ground: its centre, its length along the heading, its width across it (metres), and the heading. The
    heading is the angle from world x to the object's front, counter-clockwise seen from above, in degrees from -180 to 180.
    """

    x: float
    y: float
    length: float
    width: float
    yaw_deg: float


def _fields(placement: Placement) -> Mapping[str, Any]:
    """The rectangle along the object's heading around its box (which may be tilted), and the rectangle's corners."""
    pose = placement.world_from_object
    cos, sin = _heading(pose)
    x, y = transform(pose, placement.box)[:, :2].T
    along, across = x * cos + y * sin, y * cos - x * sin
    (back, front), (right, left) = ((float(reach.min()), float(reach.max())) for reach in (along, across))
    ends = ((front, left), (front, right), (back, right), (back, left))
    corners = np.array([(a * cos - b * sin, a * sin + b * cos) for a, b in ends])
    a, b = (front + back) / 2, (left + right) / 2
    yaw = round(math.degrees(math.atan2(sin, cos)), 9) + 0.0
    told = BirdsEye(a * cos - b * sin, a * sin + b * cos, front - back, left - right, yaw)
    return {"birds_eye": told, "birds_eye_corners": corners}


def _heading(pose: Any) -> tuple[float, float]:
    """The direction of an object's front, -Y, on the ground. If the object faces up, it is the direction of its bottom; if the
    object faces down, that of its top.
    """
    x, y = (-pose[:2, 1]).tolist()
    if math.hypot(x, y) <= TOLERANCE:
        x, y = (pose[:2, 2] * pose[2, 1]).tolist()
    length = math.hypot(x, y)
    return x / length, y / length


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """The rectangle contains the world box and touches it on each side, and the stored corners match the rectangle."""
    for o in rendered(sample):
        told, corners = o.birds_eye, o.birds_eye_corners
        turn = math.radians(told.yaw_deg)
        along, across = np.array([math.cos(turn), math.sin(turn)]), np.array([-math.sin(turn), math.cos(turn)])
        away = o.box3d[:, :2] - (told.x, told.y)
        slack = 1e-6 * (1 + float(np.abs(o.box3d).max()))
        for name, axis, size in (("length", along, told.length), ("width", across, told.width)):
            reach = away @ axis
            if abs(reach.max() - size / 2) > slack or abs(reach.min() + size / 2) > slack:
                yield f"object {o.id}: expected a {name} of {reach.max() - reach.min():.6g} m around its box, found {size:.6g}"
        ends = ((told.length, told.width), (told.length, -told.width), (-told.length, -told.width), (-told.length, told.width))
        expected = [np.array((told.x, told.y)) + (a * along + b * across) / 2 for a, b in ends]
        if np.abs(np.array(expected) - corners).max() > slack:
            yield f"object {o.id}: expected birds_eye_corners {np.array(expected).tolist()}, found {corners.tolist()}"


def _draw(pen: ImageDraw, sample: Sample, scale: float) -> None:
    """The rectangle at the height of the box's lowest corner, with a line to its front."""
    for o in sample.objects:
        low = float(o.box3d[:, 2].min())
        corners = np.column_stack([o.birds_eye_corners, np.full(4, low)])
        in_space(pen, sample, scale, corners[[0, 1, 2, 3, 0]], color_of(o.id))
        in_space(pen, sample, scale, np.array([corners.mean(axis=0), corners[:2].mean(axis=0)]), color_of(o.id))


LABEL = ObjectLabel.from_placement(
    _fields,
    name="birds_eye",
    meaning="its box from above",
    axes="world",
    on_request=True,
    fields=(
        Field("birds_eye", "centre, length, width (metres) and heading (degrees from world x)", BirdsEye),
        Field(
            "birds_eye_corners", "corners: front left, front right, back right, back left", float, (4, 2), "m", is_array=True
        ),
    ),
    prove=_prove,
    drawing=Drawing("birds_eye", lines=_draw, key=(("birds_eye: a line leads to the front", None),)),
)
