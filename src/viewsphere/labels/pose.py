"""pose: the position and rotation of an object."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from viewsphere.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix, rigid
from viewsphere.labels.shared.drawing.lines import axes
from viewsphere.labels.shared.placement import Placement
from viewsphere.labels.shared.spec import Drawing, Field, Models, ObjectLabel, rendered
from viewsphere.model.sample import Sample

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

TOLERANCE = 1e-9
"""Tolerance of a pose's entries as a share of their size: rounding errors of float64 are a million times smaller."""


def _fields(placement: Placement) -> Mapping[str, Any]:
    """The pose in world axes and in camera axes."""
    in_camera = placement.camera_from_object
    return {
        "world_from_object": placement.world_from_object,
        "camera_from_object": in_camera,
        "quaternion": quaternion_from_matrix(in_camera[:3, :3]),
    }


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """The pose in camera axes is the pose in world axes, transformed to the camera; the quaternion is its rotation."""
    if sample.known_camera is None:
        return
    camera_from_world = rigid(sample.camera.R, sample.camera.t)
    for o in rendered(sample):
        expected = camera_from_world @ o.world_from_object
        slack = TOLERANCE * (1 + float(np.abs(expected).max()))
        if not np.allclose(o.camera_from_object, expected, rtol=0, atol=slack):
            yield f"object {o.id}: camera_from_object does not follow from the pose"
        if not np.allclose(matrix_from_quaternion(o.quaternion), o.camera_from_object[:3, :3], rtol=0, atol=TOLERANCE):
            yield f"object {o.id}: the quaternion is not camera_from_object's rotation"


def _draw(pen: ImageDraw, sample: Sample, scale: float) -> None:
    """Every object's own axes, half as long as its longest side."""
    for o in sample.objects:
        axes(pen, sample, scale, o.camera_from_object, max(o.size) / 2)


LABEL = ObjectLabel.from_placement(
    _fields,
    name="pose",
    meaning="where it is and how it is turned",
    fields=(
        Field("world_from_object", "rigid motion", float, (4, 4), "m", "object to world", is_array=True),
        Field(
            "camera_from_object",
            "6D pose in camera: p_camera = R @ p_object + t",
            float,
            (4, 4),
            "m",
            "object to camera",
            is_array=True,
        ),
        Field("quaternion", "rotation of camera_from_object: (w, x, y, z), w >= 0", float, (4,)),
    ),
    prove=_prove,
    drawing=Drawing("pose", lines=_draw, key=(("pose: x red, y green, z blue", None),)),
)
