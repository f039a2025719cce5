"""The metadata of a model, beside its triangles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from viewsphere.model.annotations.appearance import Appearance
from viewsphere.model.annotations.keypoints import Keypoints
from viewsphere.model.annotations.symmetries import Symmetries


def _unknown() -> Appearance | None:
    """None: the appearance of the model is unknown."""
    return None


@dataclass(frozen=True)
class ModelMetadata:
    """Facts about a model in its own axes, metres: the largest distance between two vertices, symmetries, named points, the
    words for its colour and material, and `looks`, which computes its appearance. Symmetries are None if they were neither
    declared nor searched for, which differs from having none; the points and the words are None if there are none.

    A model that deforms has the symmetries of its rest pose, and the points that its file does not move.
    """

    diameter: float
    symmetries: Symmetries | None = None
    keypoints: Keypoints | None = None
    color: str | None = None
    material: str | None = None
    looks: Callable[[], Appearance | None] = _unknown
