"""canonical_pose: of all poses in which a symmetric object looks the same, the one that stands for all of them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.rotation import compose, product, rigid
from viewsphere.labels._field import Field
from viewsphere.labels._label import Drawing, Models, ObjectLabel, rendered
from viewsphere.labels._lines import axes
from viewsphere.labels._placement import Placement
from viewsphere.model.sample import Sample
from viewsphere.model.scene import IDENTITY
from viewsphere.model.symmetries import Continuous, Symmetries

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

Float = NDArray[np.float64]

EQUAL = 1e-9
"""By how much traces of rotations may differ that are equally near to the identity."""


def of(placement: Placement) -> Mapping[str, Any]:
    """The pose in camera, followed by the symmetry that brings its rotation nearest to the identity.

    G. Pitteri et al., On Object Symmetries and 6D Pose Estimation from Images (https://arxiv.org/abs/1908.07640), section 3.
    """
    facts = placement.facts
    own = placement.camera_from_object
    return {
        "canonical_pose": own if facts.symmetries is None else nearest(own, facts.symmetries),
        "diameter": facts.diameter,
    }


def nearest(pose: Float, symmetries: Symmetries) -> Float:
    """The pose (4, 4) after the symmetry that brings its rotation nearest to the identity; of equally near ones the first."""
    best, chosen = -math.inf, pose
    for discrete in (IDENTITY, *symmetries.discrete):
        turned = compose(pose, np.array(discrete))
        for found in _turns(turned, symmetries.continuous):
            trace = float(found[0, 0] + found[1, 1] + found[2, 2])
            if trace > best + EQUAL:
                best, chosen = trace, found
    return chosen


def _turns(pose: Float, axes: tuple[Continuous, ...]) -> Iterator[Float]:
    """The pose itself, and after the best turn around each axis; of a ball, which any rotation leaves as it is, the one whose
    rotation is the identity.
    """
    yield pose
    if is_ball(axes):
        offset = np.array(axes[0].offset)
        yield rigid(np.eye(3), product(pose[:3, :3], offset[:, None])[:, 0] + pose[:3, 3] - offset)
        return
    for axis in axes:
        yield compose(pose, _best_turn(pose[:3, :3], axis))


def is_ball(axes: tuple[Continuous, ...]) -> bool:
    """Whether a model may be turned around axes that are not parallel, and so in any way."""
    first = np.array(axes[0].axis) if axes else np.zeros(3)
    return any(float(np.abs(np.cross(first, axis.axis)).max()) > 1e-6 for axis in axes)


def _best_turn(rotation: Float, around: Continuous) -> Float:
    """The turn around an axis after which a rotation's trace is largest.

    By Rodrigues the trace of R S is a sum of one term alone, one times the cosine and one times the sine of the angle.
    """
    axis, offset = np.array(around.axis), np.array(around.offset)
    x, y, z = axis.tolist()
    crossed = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    along = axis[:, None] * axis
    cosine = float((rotation * (np.eye(3) - along)).sum())  # trace(R A) is the sum of R times A transposed
    sine = float((rotation * crossed.T).sum())
    length = math.hypot(cosine, sine)
    c, s = (cosine / length, sine / length) if length > EQUAL else (1.0, 0.0)
    turn = along + c * (np.eye(3) - along) + s * crossed
    return rigid(turn, offset - product(turn, offset[:, None])[:, 0])


def prove(sample: Sample, models: Models) -> Iterator[str]:
    """The canonical pose is rigid and, of a model without symmetries, the pose itself; it is as far from the camera as the
    symmetry's axis allows, and no farther from the identity than the pose.
    """
    for o in rendered(sample):
        pose, turn = o.canonical_pose, o.canonical_pose[:3, :3]
        if np.abs(turn @ turn.T - np.eye(3)).max() > 1e-6 or np.linalg.det(turn) < 0 or list(pose[3]) != [0, 0, 0, 1]:
            yield f"object {o.id}: expected a rigid canonical pose, found {pose.tolist()}"
        if np.trace(turn) < np.trace(o.camera_from_object[:3, :3]) - 1e-6:
            yield f"object {o.id}: expected a canonical pose nearer to the identity than the pose, found one farther away"
        known = models.get(o.key)
        if known is not None and (known.diameter is None) != (o.diameter is None):
            yield f"object {o.id}: expected the diameter of its model, {known.diameter}, found {o.diameter}"
        if known is not None and known.symmetries is None and not np.array_equal(pose, o.camera_from_object):
            yield f"object {o.id}: expected camera_from_object of a model without symmetries, found another canonical pose"


def draw(pen: ImageDraw, sample: Sample, scale: float) -> None:
    """The axes of the canonical pose."""
    for o in sample.objects:
        axes(pen, sample, scale, o.canonical_pose, (o.diameter or 1.0) / 3)


LABEL = ObjectLabel.derived(
    of,
    name="canonical_pose",
    meaning="one pose for all that look the same",
    axes="object to camera",
    on_request=True,
    fields=(
        Field(
            "canonical_pose",
            "camera_from_object after the symmetry of its model that brings the rotation nearest to the identity",
            *(float, (4, 4), "m"),
            is_array=True,
        ),
        Field("diameter", "the largest distance between two vertices of its model", float, (), "m", "object", optional=True),
    ),
    prove=prove,
    drawing=Drawing("canonical_pose", lines=draw, key=(("canonical_pose: x red, y green, z blue", None),)),
)
