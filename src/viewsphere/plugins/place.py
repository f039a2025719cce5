"""The spec of a place: a layout of models in which targets stand."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, ClassVar

from pydantic import Field

from viewsphere.model.place import Place, Traffic
from viewsphere.plugins.registry import Kind
from viewsphere.plugins.spec import Spec
from viewsphere.validation.specs import Takes


class PlaceSpec(Spec):
    """A function that lays out a place, and facts about the place."""

    KIND: ClassVar[Kind] = "places"

    random: Annotated[Callable[..., Place], Takes(1)] = Field(
        description="`random(rng)`: a `viewsphere.model.place.Place`; `random(rng, traffic)` for a place with roads"
    )
    indoors: bool = Field(default=False, description="whether targets are in a room")
    roads: bool = Field(default=False, description="whether it lays out a `viewsphere.model.place.Traffic` of its own")

    def drawn(self, rng: Any, traffic: Traffic | None) -> Place:
        """A layout, with the place's usual traffic for None."""
        return self.random(rng) if traffic is None else self.random(rng, traffic)
