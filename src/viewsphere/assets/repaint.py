"""A recipe's changes to a model's materials."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fnmatch import fnmatchcase

from viewsphere.assets.mesh import Material
from viewsphere.model.thing import Repaint


def repainted(material: Material, repaints: Sequence[Repaint]) -> tuple[Material, Repaint | None]:
    """The material with its new tint, and the last repaint whose pattern matches the material's name, None if none does."""
    found = next((r for r in reversed(repaints) if fnmatchcase(material.name, r.material)), None)
    if found is None or found.tint is None:
        return material, found
    red, green, blue, alpha = material.base_color
    tint = found.tint
    return replace(material, base_color=(red * tint[0], green * tint[1], blue * tint[2], alpha)), found
