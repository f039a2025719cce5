"""sensor_poses: where the other sensors of the rig are, as the picture's own camera sees them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from viewsphere.geometry.rotation import compose, rigid
from viewsphere.labels._field import Field
from viewsphere.labels._label import Drawing, Models, Needs, SampleLabel
from viewsphere.labels._paint import color_of
from viewsphere.labels._sight import Sight
from viewsphere.model.sample import ObjectAnnotation, Sample

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

TOLERANCE = 1e-9


def compute(sight: Sight, objects: Sequence[ObjectAnnotation]) -> Mapping[str, Any]:
    """The poses of all sensors at the picture's instant, its own among them."""
    now = sight.moment()
    if now is None:
        raise ValueError("sensor_poses: expected a sample of a rig, found none")
    own = rigid(sight.camera.R, sight.camera.t)
    return {"camera_from_sensors": np.stack([compose(own, rigid(one.R.T, one.center)) for one in now.cameras])}


def prove(sample: Sample, models: Models) -> Iterator[str]:
    """All are rigid, and the picture's own is the identity."""
    poses = sample.camera_from_sensors
    turns = poses[:, :3, :3]
    if np.abs(turns @ turns.transpose(0, 2, 1) - np.eye(3)).max() > TOLERANCE:
        yield "expected rigid poses, found others"
    if np.abs(poses - np.eye(4)).max(axis=(1, 2)).min() > TOLERANCE * (1 + np.abs(poses).max()):
        yield "expected the identity, the picture's own sensor, among the poses; found none"


PAPER, INK = (250, 250, 248, 215), (60, 62, 66)


def draw(pen: ImageDraw, sample: Sample, scale: float) -> None:
    """A plan of the rig in the lower left corner, from above: the picture's camera looks up, every sensor has its colour and
    looks along its line.
    """
    poses = sample.camera_from_sensors
    side = 0.4 * scale * min(sample.width, sample.height)
    left, low = 4.0, scale * sample.height - 4
    pen.rectangle((left, low - side, left + side, low), fill=PAPER, outline=INK)
    places, looks = poses[:, [0, 2], 3], poses[:, [0, 2], 2]
    middle = (places.min(axis=0) + places.max(axis=0)) / 2
    size = 0.5 * side / max(float(np.ptp(places, axis=0).max()), 1e-6)
    for i, (place, look) in enumerate(zip(places, looks, strict=True)):
        x, y = (left + side / 2, low - side / 2) + size * (place - middle) * (1, -1)
        dx, dy = 0.18 * side * look * (1, -1)
        pen.line((x, y, x + dx, y + dy), fill=color_of(i + 1), width=2)
        pen.ellipse((x - 4, y - 4, x + 4, y + 4), fill=color_of(i + 1))


LABEL = SampleLabel(
    name="sensor_poses",
    meaning="where the rig's sensors are",
    axes="camera",
    needs=Needs(rig=True),
    fields=(
        Field(
            "camera_from_sensors",
            "rigid, from each sensor's axes to the picture's own, in the rig's order",
            *(float, (-1, 4, 4), "m"),
            is_array=True,
        ),
    ),
    compute=compute,
    prove=prove,
    drawing=Drawing("sensor_poses", lines=draw, key=(("sensor_poses: the rig from above", None),)),
)
