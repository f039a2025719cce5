"""Small balls that shine everywhere."""

from __future__ import annotations

from viewsphere.model.scene import PointLight
from viewsphere.plugins.light import LightSpec
from viewsphere.recipe.entries import entry_of
from viewsphere.recipe.lights.shared.lamps import Placed, emitter


class PointEntry(entry_of(PointLight, fixed=("kind",)), Placed):
    """Small balls that shine everywhere."""


def _emitters(lamp: PointEntry) -> tuple[PointLight]:
    """The lamp itself."""
    return (emitter(lamp),)


LIGHT = LightSpec(options=PointEntry, emitters=_emitters)
