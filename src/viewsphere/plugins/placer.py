"""The spec of a placer: where models that share a frame are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Annotated, Any, ClassVar

from pydantic import Field

from viewsphere.model.scene import Matrix4
from viewsphere.plugins.registry import Kind
from viewsphere.plugins.spec import SpecWithOptions
from viewsphere.validation.specs import Takes


class PlacerSpec(SpecWithOptions):
    """Functions that place models. Options may be distributions; functions take them, nothing drawn, as their last value."""

    KIND: ClassVar[Kind] = "placers"

    place: Annotated[Callable[..., Sequence[Matrix4]], Takes(5)] = Field(
        description="`place(cast, room, shapes, views, rng)`: world from object for each member of the cast, metres, rigid. "
        "Models are on the floor z = 0, clear of `room.taken`; `shapes[i]` belongs to `cast[i]`; `views` are the cameras known "
        "so far. All randomness comes from `rng`. Raises RecipeError where the cast does not fit, naming `room.field`"
    )
    ways: Annotated[Callable[..., Sequence[Any]] | None, Takes(4)] = Field(
        default=None, description="`ways(cast, room, shapes, rng)`: the `Way` of each model to its place"
    )
    around: Annotated[Callable[..., Sequence[Any]] | None, Takes(4)] = Field(
        default=None, description="`around(cast, room, shapes, rng)`: the pieces of scenery that hold the models"
    )
    is_slow: bool = Field(default=False, description="whether positions are computed only when frames are rendered")
    packages: tuple[str, ...] = Field(default=(), description="packages of the extra `physics` that it needs")
