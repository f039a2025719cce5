"""ego_motion: the camera's motion from the previous picture and to the next one."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from viewsphere.geometry.rotation import compose, rigid, rotation_vector
from viewsphere.labels.shared.drawing.inset_map import NEXT, OWN, PREVIOUS, inset
from viewsphere.labels.shared.field import Field
from viewsphere.labels.shared.needs import Poses
from viewsphere.labels.shared.spec import Drawing, Models, SampleLabel
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.model.sensors.camera import Camera

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

    from viewsphere.labels.shared.context import LabelContext

TOLERANCE = 1e-9
"""Tolerance of a rotation's entries: rounding errors of float64 are a million times smaller."""


def _compute(context: LabelContext, objects: Sequence[ObjectAnnotation]) -> Mapping[str, Any]:
    """The relative poses, as odometry measures them."""
    found = (context.get(Poses(-1)), context.get(Poses(1)))
    before, after = (None if moment is None else _relative(context.camera, moment.camera) for moment in found)
    return {"camera_from_previous": before, "camera_from_next": after}


def _relative(to: Camera, of: Camera) -> Any:
    """The rigid matrix (4, 4) from the axes of one camera to those of another."""
    world_from_other = rigid(of.R.T, of.center)
    return compose(rigid(to.R, to.t), world_from_other)


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """Both poses are rigid, and at least one exists: a sequence has two instants or more."""
    known = [pose for pose in (sample.camera_from_previous, sample.camera_from_next) if pose is not None]
    for pose in known:
        turn = pose[:3, :3]
        if np.abs(turn @ turn.T - np.eye(3)).max() > TOLERANCE or np.linalg.det(turn) < 0 or list(pose[3]) != [0, 0, 0, 1]:
            yield f"expected a rigid pose, found {pose.tolist()}"


def _draw(pen: ImageDraw, sample: Sample, scale: float) -> None:
    """A small map in the lower left corner: the camera now, before and after, with its distances and turns."""
    before, after = sample.camera_from_previous, sample.camera_from_next
    moved = after if after is not None else before
    words = "" if moved is None else f"{np.linalg.norm(moved[:3, 3]):.3g} m {_turned_deg(moved):.3g}\u00b0"
    poses = [(pose, color) for pose, color in ((before, PREVIOUS), (np.eye(4), OWN), (after, NEXT)) if pose is not None]
    inset(pen, sample, scale, poses, words, path=True)


def _turned_deg(pose: Any) -> float:
    """The angle of a rigid matrix's rotation."""
    return math.degrees(float(np.linalg.norm(rotation_vector(pose[:3, :3]))))


LABEL = SampleLabel(
    name="ego_motion",
    meaning="how the camera moves",
    axes="camera",
    needs=(Poses(-1), Poses(1)),
    fields=(
        Field(
            "camera_from_previous",
            "rigid, from the camera's axes at the instant before to its own; None at a sequence's beginning",
            *(float, (4, 4), "m", "", True, True),
        ),
        Field("camera_from_next", "the same for the instant after; None at its end", float, (4, 4), "m", "", True, True),
    ),
    compute=_compute,
    prove=_prove,
    drawing=Drawing(
        "ego_motion",
        lines=_draw,
        key=(
            ("ego_motion: the camera from above, and what lies between two instants", None),
            ("before", PREVIOUS),
            ("now", OWN),
            ("after", NEXT),
        ),
    ),
)
