"""birds_eye: an object's box seen from above."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from viewsphere.geometry.rotation import transform
from viewsphere.labels._field import Field
from viewsphere.labels._label import Models, ObjectLabel, rendered
from viewsphere.labels._placement import Placement
from viewsphere.model.sample import Sample

TOLERANCE = 1e-9


@dataclass(frozen=True)
class BirdsEye:
    """A rectangle on the ground: its centre, its length along the heading and its width across, metres, and the heading: the
    angle from world x to the object's front, counter-clockwise seen from above, degrees of -180 to 180.
    """

    x: float
    y: float
    length: float
    width: float
    yaw_deg: float


def of(placement: Placement) -> Mapping[str, Any]:
    """The rectangle along the object's heading around its box, whose edges may lean; and its corners."""
    pose = placement.world_from_object
    yaw = math.atan2(*_front(pose)[::-1])
    along = np.array([math.cos(yaw), math.sin(yaw)])
    axes = np.stack([along, [-along[1], along[0]]])
    flat = transform(pose, placement.box)[:, :2] @ axes.T
    low, high = flat.min(axis=0), flat.max(axis=0)
    (x, y), (length, width) = ((low + high) / 2 @ axes).tolist(), (high - low).tolist()
    signs = np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]])
    corners = np.array([x, y]) + (signs * (high - low) / 2) @ axes
    return {"birds_eye": BirdsEye(x, y, length, width, math.degrees(yaw)), "birds_eye_corners": corners}


def _front(pose: Any) -> tuple[float, float]:
    """The direction of an object's front, -Y, on the ground; of one that faces up or down that of its top."""
    x, y = (-pose[:2, 1]).tolist()
    if math.hypot(x, y) > TOLERANCE:
        return x, y
    return pose[0, 2].item() * -pose[2, 1].item(), pose[1, 2].item() * -pose[2, 1].item()


def prove(sample: Sample, models: Models) -> Iterator[str]:
    """The rectangle holds the world box, touches it on each side, and its corners are its own."""
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


LABEL = ObjectLabel.derived(
    of,
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
    prove=prove,
)
