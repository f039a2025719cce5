"""The ground that a recipe's targets stand on, and changes to their materials."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import (
    BeforeValidator,
    Discriminator,
    Field,
    Tag,
    model_validator,
)

from viewsphere.model.brief import Brief
from viewsphere.model.scene import Ground, Picture
from viewsphere.model.thing import Repaint
from viewsphere.recipe.entries import entry_of, is_drawn_color
from viewsphere.recipe.values import COLOR_FORMS, OrShort, parse_color, shape_of, switch


class GroundEntry(entry_of(Ground, optional=("color",), fixed=("catcher", "labels"))):
    """A horizontal plane at the lowest point of all that is placed."""


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


class MaterialEntry(entry_of(Repaint, fixed=("material",)), Brief):
    """A change to materials of the models; where several fit one, the last counts."""

    UNSAID = ("image", "images")

    models: str = Field(default="*", min_length=1, description="keys of the models it is for, a pattern such as car_*")
    images: Picture | None = Field(default=None, description="or a folder of pictures to draw from")

    @model_validator(mode="after")
    def _check(self) -> MaterialEntry:
        changes = [*(name for name in Repaint.model_fields if name != "material"), "images"]
        if all(getattr(self, name) is None for name in changes):
            raise ValueError(f"expected {', '.join(changes[:-1])} or {changes[-1]}; found none")
        if self.image is not None and self.images is not None:
            raise ValueError("expected image or images; found both")
        return self
