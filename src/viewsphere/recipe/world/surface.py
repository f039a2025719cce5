"""The ground under a recipe's targets, and changes to their materials."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal, cast

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Discriminator,
    Field,
    Tag,
    model_validator,
)

from viewsphere import plugins
from viewsphere.model.fields.omit_none import OmitNone
from viewsphere.model.scene import Ground, Picture
from viewsphere.model.thing import Repaint
from viewsphere.recipe.draws import Drawn
from viewsphere.recipe.entries import entry_of, is_drawn_color, pictures_of
from viewsphere.recipe.values import COLOR_FORMS, OrShort, parse_color, shape_of, switch
from viewsphere.validation.errors import one_of

ANY = "any"
"""The name that means all materials."""


def _known(name: str) -> str:
    """The name of a material; raises ValueError, with the nearest known one, for others."""
    names = plugins.names("materials")
    if name not in names:
        raise ValueError(one_of(name, (*names, ANY)))
    return name


def _choice(value: Any) -> Any:
    """A list of materials, or `any`, as a choice between them; `any` in a list means all materials."""
    if isinstance(value, Mapping) and "choice" in value:
        given = cast(Mapping[str, Any], value)
        if "weights" in given and ANY in (names := given["choice"]):
            raise ValueError(f"expected names of materials beside weights; found {names!r}")
        return {**given, "choice": _each(given["choice"])}
    return {"choice": _each(value)} if value == ANY or isinstance(value, (list, tuple)) else value


def _each(names: Any) -> Any:
    """The names with `any` replaced by the shipped materials: an installed package does not change what a recipe draws."""
    known = tuple(name for name in plugins.names("materials") if not plugins.is_third_party("materials", name))
    if names == ANY:
        return known
    if not isinstance(names, (list, tuple)):
        return names
    given = cast(Sequence[Any], names)
    return [one for name in given for one in (known if name == ANY else (name,))]


MaterialNames = Annotated[
    Drawn[Annotated[str, AfterValidator(_known)]],
    BeforeValidator(_choice),
    OrShort({"type": "array", "items": {"type": "string"}, "minItems": 1}),
]
"""The name of a material, or several names or `any` for a random one."""


class GroundEntry(entry_of(Ground, optional=("color",), fixed=("catcher", "labels")), OmitNone):
    """A horizontal plane at the lowest point of all that is placed."""

    OMIT_IF_NONE = ("material",)

    material: MaterialNames | None = Field(  # pyright: ignore[reportIncompatibleVariableOverride]
        default=None, description="built-in material: wood, a list of names to draw from, or any; its grain is random"
    )

    @model_validator(mode="after")
    def _one_look(self) -> GroundEntry:
        others = [name for name in pictures_of(Ground) if getattr(self, name) is not None]
        if self.material is not None and others:
            raise ValueError(f"expected material or {others[0]}; found both")
        if self.material is not None and self.tile != type(self).model_fields["tile"].default:
            raise ValueError("expected no tile beside material, which has a size of its own; found one: leave it out")
        return self


def _ground(value: Any) -> Any:
    if is_drawn_color(value):
        return {"color": value}
    if isinstance(value, (dict, GroundEntry)):
        return value
    on = switch(value)
    if on is not None:
        return "on" if on else "off"
    if value == "catcher":
        return {"catcher": True}
    return value if value == "auto" else {"color": parse_color(value, WORDS, ("on", "off", "auto", "catcher"))}


WORDS = "on, off, auto, catcher, a mapping, "

GroundField = Annotated[
    Annotated[GroundEntry, Tag("mapping")] | Annotated[Literal["auto", "on", "off"], Tag("text")],
    Discriminator(shape_of),
    BeforeValidator(_ground),
    OrShort({"enum": [True, False, "on", "off", "catcher"]}, *COLOR_FORMS),
]


class MaterialEntry(entry_of(Repaint, fixed=("material",)), OmitNone):
    """A change to materials of the models; if several match a material, the last one applies."""

    OMIT_IF_NONE = ("image", "images", "texture")

    models: str = Field(default="*", min_length=1, description="keys of its models, a pattern such as car_*")
    images: Picture | None = Field(default=None, description="or a folder of pictures to draw from")
    texture: MaterialNames | None = Field(  # pyright: ignore[reportIncompatibleVariableOverride]
        default=None,
        description="built-in material for opaque materials: wood, a list of names to draw from, or any; its grain is random",
    )

    @model_validator(mode="after")
    def _check(self) -> MaterialEntry:
        changes = [*(name for name in Repaint.model_fields if name != "material"), "images"]
        if all(getattr(self, name) is None for name in changes):
            raise ValueError(f"expected {', '.join(changes[:-1])} or {changes[-1]}; found none")
        sources = [name for name in ("image", "images", "texture") if getattr(self, name) is not None]
        if len(sources) > 1:
            raise ValueError(f"expected {' or '.join(sources)}; found {'both' if len(sources) == 2 else 'all'}")
        return self
