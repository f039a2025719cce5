"""LiDAR: the measurement along the rays of a scan, and the record of one returned point."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Length, Natural, Portion, Positive

LIDAR = "lidar"
"""The channel of the points that a LiDAR returns; LiDARs keep it by default, cameras lack it."""

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
"""One point: position in the LiDAR's axes (x ahead, y left, z up), metres; its distance along the ray, metres; the returned
power; the angle between ray and surface normal, 0 to pi/2; seconds from the instant to the measurement; object and category, 0
for none; its ring, counted from the highest, and its column, counted from the left.
"""

Curve = tuple[tuple[Annotated[float, Field(ge=0)], Portion], ...]
"""Probabilities at ascending values: linear in between, constant beyond the ends, 0 if the list is empty."""


class Lidar(Frozen):
    """`range` (metres): nearer and farther points do not return. A white surface seen straight on returns intensity 1 at
    `reference_range` metres, and intensity falls with the square of the distance; None: the sensor compensates for the
    distance.

    `sigma` (metres) is the standard deviation of measured ranges; `dropout` the probability that a point does not return, by
    its true range and, in addition, by its intensity. `seed` determines the random draws.

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
