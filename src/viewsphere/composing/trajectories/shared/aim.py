"""The aim of a rig: a thing, a point, the models' middle, or the direction ahead."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from viewsphere.composing.trajectories.shared.world import RigPose, World
from viewsphere.errors import RecipeError
from viewsphere.geometry.camera import orbit_center, orbit_rotation
from viewsphere.geometry.rotation import rigid
from viewsphere.recipe.cameras.trajectories import Moving

Float = NDArray[np.float64]

DIGITS = 12
"""Decimal places of recorded poses: the last digits of sines and powers differ between processors."""

SAME = 1e-6
"""Least distance of a rig's target from the rig, metres."""

STEEP = 1e-9
"""Tangent of the angle to the vertical below which a rig looks straight up or down."""


def focuses(entry: Moving, look: object, times: Float, world: World) -> list[Float] | None:
    """Return the target points, (3,) world metres, at every instant; None for the direction ahead."""
    if look == "ahead":
        return None
    if look == "center":
        return [np.array(world.target)] * len(times)
    if isinstance(look, (int, str)):
        found = [np.asarray(world.center(look, i), np.float64) for i in (range(len(times)) if entry.follow else (0,))]
        return found if entry.follow else found * len(times)
    return [np.array(look, np.float64)] * len(times)


def aimed(centers: Float, ahead: Float, focus: Sequence[Float] | None, world: World) -> tuple[RigPose, ...]:
    """The level rig at positions (T, 3); it looks at one focus for each, or along directions (T, 3)."""
    poses: list[RigPose] = []
    for instant, center in enumerate(centers):
        toward = ahead[instant] if focus is None else focus[instant] - center
        length = _norm(toward)
        if length < SAME:
            place = ", ".join(f"{v:.4g}" for v in center)
            raise RecipeError(
                f"viewpoints.look: expected another place than the camera's own; found ({place}) at instant {instant}"
            )
        axes = _facing(toward / length)
        point = on_axis(center, axes[:, 2], world) if focus is None else focus[instant]
        poses.append(posed(axes, center, point))
    return tuple(poses)


def _facing(forward: Float) -> Float:
    """Axes (3, 3), in columns, of a level camera that looks along a unit vector; straight up or down, it is oriented as at
    azimuth 0.
    """
    x, y, z = forward.tolist()
    level = math.sqrt(x * x + y * y)
    if level < STEEP:
        return np.eye(3) if z > 0 else overhead(0.0)
    right = (y / level, -x / level, 0.0)
    down = (x * z / level, y * z / level, -level)
    return np.column_stack([right, down, (x, y, z)])


def overhead(heading: float) -> Float:
    """Axes, in columns, of a camera that looks straight down; `heading` (degrees from +Y, counter-clockwise) is up in its
    picture.
    """
    return np.round(orbit_rotation(math.radians(heading), math.pi / 2).T, DIGITS)


def around(focus: Float, azimuth: float, elevation: float, distance: float, tilt: float) -> RigPose:
    """The rig on a sphere around its target; degrees and metres."""
    a, e, t = (math.radians(v) for v in (azimuth, elevation, tilt))
    return posed(orbit_rotation(a, e, t).T, focus + orbit_center(a, e, distance), focus)


def posed(axes: Float, center: Float, focus: Float) -> RigPose:
    """The pose with these axes (3, 3), in columns, rounded to digits that are equal on all processors."""
    x, y, z = (float(v) + 0.0 for v in np.round(focus, DIGITS))
    return RigPose(np.round(rigid(axes, center), DIGITS) + 0.0, (x, y, z))


def on_axis(center: Float, forward: Float, world: World) -> Float:
    """The point ahead that is nearest to the models; 1 m ahead if the models are behind."""
    distance = float((forward * (np.array(world.target) - center)).sum())
    return center + max(distance, 1.0) * forward


def _norm(vector: Float) -> float:
    x, y, z = vector.tolist()
    return math.sqrt(x * x + y * y + z * z)
