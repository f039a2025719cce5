"""A .blend file as the scene around the targets of a recipe, with its labelled and shown objects."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from viewsphere.model.fields.frozen import Frozen
from viewsphere.recipe.cameras.time import STEPS, Frames, Steps
from viewsphere.recipe.values import OrShort
from viewsphere.recipe.world.scenery import DRAWS, Draw

Pattern = Annotated[str, Field(min_length=1)]
VALUE = "*"


class LabelRule(Frozen):
    """A rule that labels objects of the file. An object includes its children."""

    name: Pattern | None = Field(default=None, description="pattern of objects' names, such as Car*")
    collection: Pattern | None = Field(default=None, description="or of the collections that objects are in")
    property: Pattern | None = Field(default=None, description="or a custom property that objects have")
    category: Annotated[str, Field(min_length=1, max_length=200)] = Field(
        description="category of these objects; '*' with a property: the property's value"
    )

    @model_validator(mode="after")
    def _check(self) -> LabelRule:
        given = [name for name in ("name", "collection", "property") if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(f"expected one of name, collection, property; found {' and '.join(given) or 'none'}")
        if self.category == VALUE and self.property is None:
            raise ValueError(f"expected a category, such as car; found '*', which takes a property's value, beside {given[0]}")
        return self


class VariantEntry(Frozen):
    """Objects of the file of which one is shown, with its children."""

    one_of: Pattern = Field(description="pattern of the objects' names, such as plane*")
    draw: Draw = Field(default="per_frame", description=f"which one: {DRAWS}")
    order: Literal["random", "in_turn"] = Field(
        default="random", description="at random, or one after another in the order of their names"
    )

    @model_validator(mode="after")
    def _check(self) -> VariantEntry:
        if (self.order, self.draw) == ("in_turn", "fixed"):
            raise ValueError("expected draw: per_model or per_frame beside order: in_turn; found fixed")
        return self


def _variant(value: Any) -> Any:
    return {"one_of": value} if isinstance(value, str) else value


VariantField = Annotated[VariantEntry, BeforeValidator(_variant), OrShort({"type": "string"})]


class BlendEntry(Frozen):
    """A .blend file whose scene is rendered unchanged, by an engine that opens such files (cycles, eevee, workbench)."""

    file: str = Field(min_length=1, description="path of a .blend file")
    at: str | None = Field(
        default=None,
        min_length=1,
        description="object of the file, such as an empty, on which the targets stand, with its rotation; by default the "
        "origin",
    )
    labels: tuple[LabelRule, ...] = Field(
        default=(), description="rules for labelled objects; the first matching rule applies, and all others are background"
    )
    variants: dict[str, VariantField] = Field(
        default={}, description="groups of objects, by any name, of which one is shown: a pattern, or {one_of, draw, order}"
    )
    confined: bool = Field(default=True, strict=True, description="requires its textures and libraries to stay in its folder")

    frames: Frames | None = Field(
        default=None, description="time steps of an animated file: all, a list of frames, or {first, last, step}"
    )
    poses: Steps = Field(default="each", description=f"with frames: {STEPS}")

    @model_validator(mode="after")
    def _check(self) -> BlendEntry:
        if self.poses == "moving" and self.frames is None:
            raise ValueError("expected frames, for poses: moving; found none")
        return self


def _blend(value: Any) -> Any:
    return {"file": value} if isinstance(value, str) else value


BlendField = Annotated[BlendEntry | None, BeforeValidator(_blend), OrShort({"type": "string"})]
