"""What labels of stereo pairs share: the sensor that is rectified with a picture's own, and how far away it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere.geometry.rotation import transform
from viewsphere.labels._sight import Sight
from viewsphere.truth.correspondence import Match
from viewsphere.truth.view import View

ALONG = 1e-9
"""How much of a rectified sensor's offset may be across the rows of the picture: rounding."""

ROUNDING = 1e-13
"""The same, as a share of the distance from the origin."""


@dataclass(frozen=True, eq=False)
class Pair:
    """Another sensor that is rectified with a picture's own: its name, and the baseline in metres, which is positive."""

    sensor: str
    baseline: float


def pair(sight: Sight) -> Pair | None:
    """The first of the rig's other sensors that is rectified with the picture's own; None if none is.

    Rectified: equal rotation, size and K, no distortion, and apart along x only.
    """
    own = sight.neighbour()
    if own is None or sight.around is None:
        return None
    for name in sight.around.sensors:
        other = sight.neighbour(0, name)
        baseline = 0.0 if other is None else _baseline(own, other)
        if baseline:
            return Pair(name, baseline)
    return None


def _baseline(own: View, other: View) -> float:
    """How far apart two cameras are that are rectified; 0 for others."""
    if not (own.is_pinhole and own.turns_like(other)):
        return 0.0
    x, y, z = np.abs(transform(own.camera.R, other.center - own.center)).tolist()
    slack = ALONG * x + ROUNDING * float(np.abs(own.center).max())
    return x if y <= slack and z <= slack else 0.0


def pair_match(sight: Sight) -> Match | None:
    """Where the seen points are in the other picture."""
    other = pair(sight)
    return None if other is None else sight.match(0, other.sensor)
