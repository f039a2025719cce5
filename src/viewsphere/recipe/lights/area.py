"""Rectangles that shine to one side."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from viewsphere.model.scene import AreaLight
from viewsphere.plugins.light import LightSpec
from viewsphere.recipe.entries import entry_of
from viewsphere.recipe.lights.shared.lamps import Aimed, emitter


class AreaEntry(entry_of(AreaLight), Aimed):
    """Rectangles that shine to one side."""

    kind: Literal["area"] = Field(description="a rectangle that shines to one side")


def _emitters(lamp: AreaEntry) -> tuple[AreaLight]:
    """The lamp itself."""
    return (emitter(lamp),)


LIGHT = LightSpec(options=AreaEntry, emitters=_emitters)
