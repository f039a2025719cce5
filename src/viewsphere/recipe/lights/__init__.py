"""Lamps of a recipe's scene: one file a kind, named as in recipes. The names below are for your own kinds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, cast

from pydantic import BeforeValidator

from viewsphere import plugins
from viewsphere.plugins.light import LightSpec
from viewsphere.recipe.kinds import ByKind
from viewsphere.recipe.lights.shared.lamps import Aimed, At, Lamp, Placed, place_of

__all__ = ["Aimed", "At", "Lamp", "LightsField", "Placed", "place_of", "spec_of"]


def spec_of(lamp: Lamp) -> LightSpec:
    """The spec of a lamp's kind."""
    return plugins.load(LightSpec, cast(Any, lamp).kind)


def _lights(value: Any) -> Any:
    return [value] if isinstance(value, (Mapping, Lamp)) else value


LightsField = Annotated[tuple[Annotated[Lamp, ByKind(LightSpec, "point")], ...], BeforeValidator(_lights)]
