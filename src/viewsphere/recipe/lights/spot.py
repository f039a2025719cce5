"""Lamps that shine into a cone."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from viewsphere.model.scene import SpotLight
from viewsphere.plugins.light import LightSpec
from viewsphere.recipe.entries import entry_of
from viewsphere.recipe.lights.shared.lamps import Aimed, emitter


class SpotEntry(entry_of(SpotLight), Aimed):
    """Lamps that shine into a cone."""

    kind: Literal["spot"] = Field(description="a cone of light")


def _emitters(lamp: SpotEntry) -> tuple[SpotLight]:
    """The lamp itself."""
    return (emitter(lamp),)


LIGHT = LightSpec(options=SpotEntry, emitters=_emitters)
