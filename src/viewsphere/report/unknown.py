"""What may not be known of a frame: the one place that decides it for the report."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from numpy.typing import NDArray

from viewsphere.model.camera import Camera
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.model.shot import Pose

DIGITS = 6


def camera_of(sample: Sample) -> Camera | None:
    """The frame's camera; None for a picture of which nobody knows it."""
    return sample.known_camera


def pose_of(sample: Sample) -> Pose | None:
    """The frame's pose; None for a picture of which nobody knows it."""
    return sample.known_pose


def size_of(sample: Sample) -> tuple[int, int]:
    """Width and height of the picture in pixels."""
    return sample.width, sample.height


def placed(annotation: ObjectAnnotation) -> bool:
    """Whether the object's place in space is known, so that its 3D fields are numbers."""
    return annotation.is_placed


def number(value: float) -> float | None:
    """The value with six significant digits, as JSON takes it; None for NaN and infinities."""
    value = float(value)
    if not math.isfinite(value):
        return None
    rounded = float(f"{value:.{DIGITS}g}")
    return int(rounded) if rounded.is_integer() else rounded


def numbers(values: Iterable[float] | NDArray[Any]) -> list[float | None]:
    """Each of some values as `number` gives it."""
    return [number(v) for v in values]
