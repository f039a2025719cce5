"""velocity: the velocity, angular velocity and acceleration of an object."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.rotation import product, rotation_vector, transform
from viewsphere.labels.shared.drawing.colors import color_of
from viewsphere.labels.shared.drawing.lines import in_space
from viewsphere.labels.shared.field import Field
from viewsphere.labels.shared.needs import Poses
from viewsphere.labels.shared.placement import Placement
from viewsphere.labels.shared.spec import Drawing, Models, ObjectLabel, rendered
from viewsphere.model.sample import ObjectAnnotation, Sample

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

    from viewsphere.labels.shared.context import LabelContext

Float = NDArray[np.float64]

AROUND = (Poses(-1), Poses(0), Poses(1))
FIELDS = ("velocity", "angular_velocity", "acceleration")


def _compute(context: LabelContext, i: int) -> Mapping[str, Any]:
    """Central differences between the poses at the adjacent instants, for the middle of the object's box. At a sequence's ends,
    and where the object appears or disappears, they are one-sided differences without an acceleration.

    For a model that deforms, the point is the middle of the box at this instant and moves with the pose. So the object's motion
    counts, but the motion of its surface does not.
    """
    placement = context.placement(i)
    middle = Box3d(placement.box).center
    known = [(m.seconds, np.array(m.poses[i])) for m in map(context.get, AROUND) if m and m.poses[i]]
    if len(known) < 2:
        return dict.fromkeys(FIELDS)
    (start, before), (end, after) = known[0], known[-1]
    moved = transform(after, middle) - transform(before, middle)
    turned = rotation_vector(product(after[:3, :3], before[:3, :3].T))
    time, acceleration = end - start, None
    if len(known) == 3:
        places = [transform(pose, middle) for _, pose in known]
        acceleration = (places[2] - 2 * places[1] + places[0]) / (time * time / 4)
    return dict(zip(FIELDS, (moved / time, turned / time, acceleration), strict=True))


def _keep(o: ObjectAnnotation) -> Any:
    """Return the three fields; None if they are unknown."""
    kept = [None if getattr(o, name) is None else getattr(o, name).tolist() for name in FIELDS]
    return kept if any(kept) else None


def _restore(kept: Any, placement: Placement, o: ObjectAnnotation) -> Mapping[str, Any]:
    """The fields, from lists of numbers."""
    return {
        name: None if value is None else np.array(value, np.float64)
        for name, value in zip(FIELDS, kept or (None,) * 3, strict=True)
    }


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """An object that turns or speeds up has a velocity, and no number is infinite."""
    for o in rendered(sample):
        if (o.velocity is None) != (o.angular_velocity is None) or (o.velocity is None and o.acceleration is not None):
            yield f"object {o.id}: expected velocity and angular velocity together, found {o.velocity}, {o.angular_velocity}"


def _draw(pen: ImageDraw, sample: Sample, scale: float) -> None:
    """A line from the middle of each object's box to its position half a second later."""
    for o in sample.objects:
        if o.velocity is not None:
            center = Box3d(o.box3d).center
            in_space(pen, sample, scale, np.array([center, center + AHEAD * o.velocity]), color_of(o.id), 3)


AHEAD = 0.5
"""Seconds of motion that are drawn."""


LABEL = ObjectLabel(
    name="velocity",
    meaning="how it moves",
    axes="world",
    on_request=True,
    needs=AROUND,
    fields=(
        Field(
            "velocity",
            "of the middle of its box, moved by the pose alone; None where only one instant has it",
            float,
            (3,),
            "m/s",
            "",
            True,
            True,
        ),
        Field("angular_velocity", "along the axis about which it turns", float, (3,), "rad/s", "", True, True),
        Field("acceleration", "None at a sequence's ends, too", float, (3,), "m/s^2", "", True, True),
    ),
    compute=_compute,
    keep=_keep,
    restore=_restore,
    prove=_prove,
    drawing=Drawing("velocity", lines=_draw, key=(("velocity: half a second of motion", None),)),
)
