"""What a model says of itself, beside its triangles."""

from __future__ import annotations

from dataclasses import dataclass

from viewsphere.model.keypoints import Keypoints
from viewsphere.model.symmetries import Symmetries


@dataclass(frozen=True)
class Traits:
    """Facts about a model in its own axes, metres: the largest distance between two of its vertices; its symmetries, None where
    nobody has said or looked, which is not the same as none; its named points, None without any.

    Of a model that deforms, symmetries are known as it rests, and points that its file does not move.
    """

    diameter: float
    symmetries: Symmetries | None = None
    keypoints: Keypoints | None = None
