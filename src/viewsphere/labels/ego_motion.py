"""ego_motion: how the camera moves between a picture and those before and after it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from viewsphere.geometry.rotation import compose, rigid, rotation_vector
from viewsphere.labels._field import Field
from viewsphere.labels._label import Drawing, Models, Needs, SampleLabel
from viewsphere.labels._lines import arrow
from viewsphere.labels._sight import Sight
from viewsphere.model.camera import Camera
from viewsphere.model.sample import ObjectAnnotation, Sample

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

TOLERANCE = 1e-9


def compute(sight: Sight, objects: Sequence[ObjectAnnotation]) -> Mapping[str, Any]:
    """The relative poses, as odometry measures them."""
    found = (sight.moment(-1), sight.moment(1))
    before, after = (None if moment is None else relative(sight.camera, moment.camera) for moment in found)
    return {"camera_from_previous": before, "camera_from_next": after}


def relative(to: Camera, of: Camera) -> Any:
    """The rigid matrix (4, 4) from the axes of one camera to those of another."""
    world_from_other = rigid(of.R.T, of.center)
    return compose(rigid(to.R, to.t), world_from_other)


def prove(sample: Sample, models: Models) -> Iterator[str]:
    """Both are rigid, and at least one is there: a sequence has two instants or more."""
    known = [pose for pose in (sample.camera_from_previous, sample.camera_from_next) if pose is not None]
    for pose in known:
        turn = pose[:3, :3]
        if np.abs(turn @ turn.T - np.eye(3)).max() > TOLERANCE or np.linalg.det(turn) < 0 or list(pose[3]) != [0, 0, 0, 1]:
            yield f"expected a rigid pose, found {pose.tolist()}"


COLOR = (20, 170, 180)


def draw(pen: ImageDraw, sample: Sample, scale: float) -> None:
    """How the camera goes on, at a sequence's end how it came: an arrow from the picture's middle to the side that it moves to,
    with its metres, those ahead, and its turn.
    """
    ahead, before = sample.camera_from_next, sample.camera_from_previous
    way = np.zeros(3) if ahead is None and before is None else ahead[:3, 3] if ahead is not None else -before[:3, 3]
    pose, far = before if ahead is None else ahead, float(np.linalg.norm(way))
    x, y = scale * sample.width / 2, scale * sample.height / 2
    aside = way[:2] / max(far, 1e-9) * 0.8 * min(x, y)
    if far and np.linalg.norm(aside) > 1:
        arrow(pen, (x, y), (x + float(aside[0]), y + float(aside[1])), COLOR, 3)
    turn = 0.0 if pose is None else float(np.degrees(np.linalg.norm(rotation_vector(pose[:3, :3]))))
    words = f"{far:.3g} m, ahead {way[2]:.2g} m, {turn:.3g} deg"
    pen.rectangle(pen.textbbox((4, 2), words), fill=COLOR)
    pen.text((4, 2), words, fill=(255, 255, 255))


LABEL = SampleLabel(
    name="ego_motion",
    meaning="how the camera moves",
    axes="camera",
    needs=Needs(poses=(-1, 1)),
    fields=(
        Field(
            "camera_from_previous",
            "rigid, from the camera's axes at the instant before to its own; None at a sequence's beginning",
            *(float, (4, 4), "m", "", True, True),
        ),
        Field("camera_from_next", "the same for the instant after; None at its end", float, (4, 4), "m", "", True, True),
    ),
    compute=compute,
    prove=prove,
    drawing=Drawing("ego_motion", lines=draw, key=(("ego_motion: to where the camera moves, and how it turns", None),)),
)
