"""LiDAR: how a sensor measures along the rays of its scan, and one point that it returns."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Length, Natural, Portion, Positive

LIDAR = "lidar"
"""The channel of the points that a LiDAR returns, which it keeps by default, and cameras do not have."""

POINT = np.dtype(
    [
        ("xyz", "<f4", (3,)),
        ("range", "<f4"),
        ("intensity", "<f4"),
        ("incidence", "<f4"),
        ("time", "<f4"),
        ("instance", "<i4"),
        ("category", "<i4"),
        ("ring", "<u2"),
        ("column", "<u2"),
    ]
)
"""One point: where it is in the LiDAR's axes (x ahead, y left, z up), metres; its distance along the ray, metres; the power
that comes back; the angle between ray and surface normal, 0 to pi/2; seconds from the instant to when it is measured; object
and category, 0 for none; its ring, counted from the highest, and its column, counted from the left.
"""

Curve = tuple[tuple[Annotated[float, Field(ge=0)], Portion], ...]
"""Probabilities at some values, which ascend: in between they are linear, beyond them those of the ends; none: 0."""


class Lidar(Frozen):
    """`range` (metres): nearer and farther points do not return. A white surface seen straight on returns intensity 1 at
    `reference_range` metres, and the square of the distance weakens it; None: the sensor makes up for the distance.

    `sigma` (metres) is the standard deviation of measured ranges; `dropout` the probability that a point does not return, by
    its true range and by its intensity besides. `seed` is what draws follow from.

    The columns are measured one after another, from the left, within `sweep` seconds, with the instant in the middle.
    """

    range: tuple[Annotated[float, Field(ge=0)], Length]
    reference_range: Positive | None = None
    sigma: Annotated[float, Field(ge=0)] = 0.0
    dropout: Portion = 0.0
    dropout_by_range: Curve = ()
    dropout_by_intensity: Curve = ()
    sweep: Annotated[float, Field(ge=0)] = 0.0
    seed: Natural = 0
