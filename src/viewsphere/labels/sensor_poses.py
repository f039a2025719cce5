"""sensor_poses: the poses of the rig's sensors, in the axes of the picture's own camera."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from viewsphere.geometry.camera import project
from viewsphere.geometry.rotation import compose, rigid
from viewsphere.labels.shared.drawing.colors import color_of
from viewsphere.labels.shared.drawing.inset_map import OWN, inset
from viewsphere.labels.shared.drawing.lines import axes
from viewsphere.labels.shared.field import Field
from viewsphere.labels.shared.needs import RigPoses
from viewsphere.labels.shared.spec import Drawing, Models, SampleLabel
from viewsphere.model.sample import ObjectAnnotation, Sample

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

    from viewsphere.labels.shared.context import LabelContext

TOLERANCE = 1e-9
"""Tolerance of the poses' entries as a share of their size: rounding errors of float64 are a million times smaller."""


def _compute(context: LabelContext, objects: Sequence[ObjectAnnotation]) -> Mapping[str, Any]:
    """The poses of all sensors at the picture's instant, including its own."""
    now = context.get(RigPoses())
    if now is None:
        raise ValueError("sensor_poses: expected a sample of a rig, found none")
    own = rigid(context.camera.R, context.camera.t)
    return {"camera_from_sensors": np.stack([compose(own, rigid(one.R.T, one.center)) for one in now.cameras])}


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """Yield an error unless every pose is rigid, and the picture's own pose is the identity."""
    poses = sample.camera_from_sensors
    turns = poses[:, :3, :3]
    if np.abs(turns @ turns.transpose(0, 2, 1) - np.eye(3)).max() > TOLERANCE:
        yield "expected rigid poses, found others"
    if np.abs(poses - np.eye(4)).max(axis=(1, 2)).min() > TOLERANCE * (1 + np.abs(poses).max()):
        yield "expected the identity, the picture's own sensor, among the poses; found none"


def _draw(pen: ImageDraw, sample: Sample, scale: float) -> None:
    """A small map in the lower right corner, with the picture's own sensor in white, and the axes of the other visible
    sensors.
    """
    own = np.abs(sample.camera_from_sensors - np.eye(4)).max(axis=(1, 2)).argmin()
    poses = [(pose, OWN if i == own else color_of(i + 1)) for i, pose in enumerate(sample.camera_from_sensors)]
    inset(pen, sample, scale, poses, at_right=True)
    camera, others = sample.camera, np.delete(sample.camera_from_sensors, own, axis=0)
    pixels = project(camera.intrinsics, others[:, :3, 3])[0]
    seen = ((pixels >= 0) & (pixels <= (sample.width, sample.height))).all(axis=1)
    for pose in others[seen]:
        axes(pen, sample, scale, pose, AXIS)


AXIS = 0.1
"""Length of a sensor's drawn axes, metres."""


LABEL = SampleLabel(
    name="sensor_poses",
    meaning="where the rig's sensors are",
    axes="camera",
    needs=(RigPoses(),),
    fields=(
        Field(
            "camera_from_sensors",
            "rigid, from each sensor's axes to the picture's own, in the rig's order",
            *(float, (-1, 4, 4), "m"),
            is_array=True,
        ),
    ),
    compute=_compute,
    prove=_prove,
    drawing=Drawing(
        "sensor_poses",
        lines=_draw,
        key=(("sensor_poses: the sensors from above, its own white; axes of those it sees: x red, y green, z blue", None),),
    ),
)
