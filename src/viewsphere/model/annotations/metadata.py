"""The metadata of a model, beside its triangles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from viewsphere.model.annotations.appearance import Appearance
from viewsphere.model.annotations.keypoints import Keypoints
from viewsphere.model.annotations.symmetries import Symmetries


def unknown() -> Appearance | None:
    """Nobody knows what the model looks like."""
    return None


@dataclass(frozen=True)
class ModelMetadata:
    """Facts about a model in its own axes, metres: the largest distance between two of its vertices; its symmetries, None where
    nobody has said or looked, which is not the same as none; its named points, None without any; the words that are said of its
    colour and material, None without; and `looks`, which looks at it.

    Of a model that deforms, symmetries are known as it rests, and points that its file does not move.
    """

    diameter: float
    symmetries: Symmetries | None = None
    keypoints: Keypoints | None = None
    color: str | None = None
    material: str | None = None
    looks: Callable[[], Appearance | None] = unknown
