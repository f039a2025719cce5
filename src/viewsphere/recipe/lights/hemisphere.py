"""Even light from above and from below, without shadows."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from viewsphere.model.scene import HemisphereLight
from viewsphere.plugins.light import LightSpec
from viewsphere.recipe.entries import entry_of
from viewsphere.recipe.lights.shared.lamps import Lamp, emitter


class HemisphereEntry(entry_of(HemisphereLight), Lamp):
    """Even light from above and from below, without shadows."""

    kind: Literal["hemisphere"] = Field(description="even light from above, and another from below")


def _emitters(lamp: HemisphereEntry) -> tuple[HemisphereLight]:
    """The lamp itself."""
    return (emitter(lamp),)


LIGHT = LightSpec(options=HemisphereEntry, emitters=_emitters, is_sky=True)
