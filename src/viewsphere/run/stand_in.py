"""The stand-in model for a data set of cameras without a model of its own."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from viewsphere.limits import limits
from viewsphere.model.listed import ListedShot
from viewsphere.model.scene import Vector

SOURCE, CATEGORY = "zoo:car", "car"
FILLED = 0.5
"""Share of a picture's width that it fills, of half of the cameras."""

SHORTEST = 1e-3
"""Metres: of the model, and of what cameras are apart that do not stand at one place."""

LONGEST = 0.9
"""Of the size that models may have."""

PARALLEL = 1e-6
"""Smallest of the singular values, as a share of the largest, at which optical axes meet somewhere."""


@dataclass(frozen=True)
class StandIn:
    """A model at `origin`, a point of the cameras' world, `length` metres from front to back."""

    origin: Vector
    length: float


def stand_in(shots: Sequence[ListedShot]) -> StandIn:
    """A model at the point that is nearest to all optical axes, or ahead of the first camera where these are parallel or meet
    behind it or in it; as large as half of the cameras show it well, and not so large that one would be inside.
    """
    poses = np.array([shot.world_from_camera for shot in shots])
    centers, axes = poses[:, :3, 3], poses[:, :3, 2]
    across = np.eye(3) - axes[:, :, None] * axes[:, None, :]
    normal, rhs = across.sum(axis=0), (across @ centers[:, :, None]).sum(axis=0)[:, 0]
    origin, _, _, singular = np.linalg.lstsq(normal, rhs, rcond=None)
    if singular[-1] < PARALLEL * singular[0] or float(np.median(_ahead(centers, axes, origin))) <= SHORTEST:
        spread = float(np.linalg.norm(centers - centers.mean(axis=0), axis=1).max())
        origin = centers[0] + (2 * spread if spread > SHORTEST else 1.0) * axes[0]
    distances = np.linalg.norm(centers - origin, axis=1)
    widths = [shot.camera.width / shot.camera.fx for shot in shots if shot.camera] or [1.0]
    sides = FILLED * float(np.median(distances)) * float(np.median(widths)), float(distances.min()), LONGEST * limits.MAX_SIZE
    length = min(sides)
    x, y, z = (round(value, 6) for value in origin.tolist())
    return StandIn((x, y, z), max(SHORTEST, float(f"{length:.3g}")) if math.isfinite(length) else 1.0)


def _ahead(centers: np.ndarray, axes: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Return the distance of a point ahead of each camera."""
    return ((point - centers) * axes).sum(axis=1)
