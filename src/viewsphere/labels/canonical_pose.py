"""canonical_pose: the representative of all poses at which a symmetric object looks the same."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.rotation import compose, product, rigid
from viewsphere.labels.shared.drawing.lines import axes
from viewsphere.labels.shared.field import Field
from viewsphere.labels.shared.placement import Placement
from viewsphere.labels.shared.spec import Drawing, Models, ObjectLabel, rendered
from viewsphere.model.annotations.symmetries import Continuous, Symmetries
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.model.scene import IDENTITY

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

Float = NDArray[np.float64]

EQUAL = 1e-4
"""Difference up to which traces and entries of rotations count as equal: the tolerance of declared symmetries."""

ROUNDED = 1e-6
"""Tolerated difference between the entries of a stored canonical pose and the recomputed ones."""


def _fields(placement: Placement) -> Mapping[str, Any]:
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
    """The pose (4, 4) after the symmetry that brings its rotation nearest to the identity. Of several equally near poses, it is
    the one whose first entries, row by row, are largest. So the result depends only on the set of poses that look the same.
    """
    discrete = [compose(pose, np.array(motion)) for motion in (IDENTITY, *symmetries.discrete)]
    poses = np.array([_turned(one, symmetries.continuous) for one in discrete])
    for weights in ORDER:
        values = (poses[:, :3, :3] * weights).sum(axis=(1, 2))
        poses = poses[values >= values.max() - EQUAL]
    return poses[0]


ORDER = (np.eye(3), *np.eye(9).reshape(9, 3, 3))
"""Sums of a rotation's entries that the canonical rotation maximises: the trace, then each entry."""


def _turned(pose: Float, axes: tuple[Continuous, ...]) -> Float:
    """The pose after the best turn around an axis. A ball, which no rotation changes, gets the identity as its rotation."""
    if _is_ball(axes):
        offset = np.array(axes[0].offset)
        return rigid(np.eye(3), product(pose[:3, :3], offset[:, None])[:, 0] + pose[:3, 3] - offset)
    return compose(pose, _best_turn(pose[:3, :3], axes[0])) if axes else pose


def _is_ball(axes: tuple[Continuous, ...]) -> bool:
    """Return whether a model is symmetric around non-parallel axes, and so under every rotation."""
    first = np.array(axes[0].axis) if axes else np.zeros(3)
    return any(float(np.abs(np.cross(first, axis.axis)).max()) > 1e-6 for axis in axes)


def _best_turn(rotation: Float, around: Continuous) -> Float:
    """The turn around an axis after which the first sum of `ORDER` that depends on the angle is largest.

    By Rodrigues each sum over R S is a constant, a term with the cosine of the angle and one with its sine.
    """
    axis, offset = np.array(around.axis), np.array(around.offset)
    x, y, z = axis.tolist()
    crossed = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    across = np.eye(3) - axis[:, None] * axis
    weighted = (product(rotation.T, weights) for weights in ORDER)
    waves = (((one * across).sum(), (one * crossed).sum()) for one in weighted)
    cosine, sine = next(wave for wave in waves if math.hypot(*wave) > EQUAL)
    length = math.hypot(cosine, sine)
    turn = np.eye(3) - across + cosine / length * across + sine / length * crossed
    return rigid(turn, offset - product(turn, offset[:, None])[:, 0])


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """The canonical pose is rigid, no farther from the identity than the pose, and follows from the model's symmetries."""
    for o in rendered(sample):
        pose, turn = o.canonical_pose, o.canonical_pose[:3, :3]
        if np.abs(turn @ turn.T - np.eye(3)).max() > 1e-6 or np.linalg.det(turn) < 0 or list(pose[3]) != [0, 0, 0, 1]:
            yield f"object {o.id}: expected a rigid canonical pose, found {pose.tolist()}"
        if np.trace(turn) < np.trace(o.camera_from_object[:3, :3]) - 3 * EQUAL:
            yield f"object {o.id}: expected a canonical pose nearer to the identity than the pose, found one farther away"
        known = models.get(o.key)
        if known is not None and (known.diameter is None) != (o.diameter is None):
            yield f"object {o.id}: expected the diameter of its model, {known.diameter}, found {o.diameter}"
        if known is not None and known.symmetries is None and not np.array_equal(pose, o.camera_from_object):
            yield f"object {o.id}: expected camera_from_object of a model without symmetries, found another canonical pose"
        if known is not None and known.symmetries is not None and np.abs(pose - _again(o, known.symmetries)).max() > ROUNDED:
            yield f"object {o.id}: expected the canonical pose that its model's symmetries give, found {pose.tolist()}"


def _again(o: ObjectAnnotation, symmetries: Symmetries) -> Float:
    return nearest(o.camera_from_object, symmetries)


def _draw(pen: ImageDraw, sample: Sample, scale: float) -> None:
    """The axes of the canonical pose."""
    for o in sample.objects:
        axes(pen, sample, scale, o.canonical_pose, (o.diameter or 1.0) / 3)


LABEL = ObjectLabel.from_placement(
    _fields,
    name="canonical_pose",
    meaning="one pose for all that look the same",
    axes="object to camera",
    on_request=True,
    fields=(
        Field(
            "canonical_pose",
            "camera_from_object after the symmetry of its model that brings the rotation nearest to the identity; of equally "
            "near ones the pose whose first entries, row by row, are largest",
            *(float, (4, 4), "m"),
            is_array=True,
        ),
        Field("diameter", "the largest distance between two vertices of its model", float, (), "m", "object", optional=True),
    ),
    prove=_prove,
    drawing=Drawing("canonical_pose", lines=_draw, key=(("canonical_pose: x red, y green, z blue", None),)),
)
