"""What the targets of a recipe stand on, and changes to their materials."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Discriminator, Field, Tag, model_validator

from viewsphere.model.frozen import Frozen
from viewsphere.model.scene import Ground
from viewsphere.recipe.draws import Drawn, Length, LinearDrawn, Portion, SrgbDrawn, is_drawn_color
from viewsphere.recipe.values import COLOR_FORMS, OrShort, parse_color, shape_of, switch

Picture = Annotated[str, Field(min_length=1)]
_GROUND = Ground()


class GroundEntry(Frozen):
    """A horizontal plane at the lowest point of all that is placed."""

    color: SrgbDrawn | None = Field(default=None, description="sRGB; multiplies the image. Default: grey, with an image white")
    image: Drawn[Picture] | None = Field(default=None, description="path of a picture that repeats every `tile` metres")
    roughness: Drawn[Portion] = Field(default=_GROUND.roughness, description="0 a mirror, 1 matt")
    roughness_image: Drawn[Picture] | None = Field(default=None, description="path of a grey picture: 0 smooth, white rough")
    normal_image: Drawn[Picture] | None = Field(default=None, description="path of a normal map (green up)")
    metallic: Drawn[Portion] = Field(default=_GROUND.metallic, description="1: metal")
    tile: Drawn[Length] = Field(default=_GROUND.tile, description="metres after which images repeat")
    catcher: bool = Field(default=False, strict=True, description="true: only the shadows on it are seen, over the background")


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


class MaterialEntry(Frozen):
    """A change to materials of the models; where several fit one, the last counts."""

    models: str = Field(default="*", min_length=1, description="keys of the models it is for, a pattern such as car_*")
    material: str = Field(default="*", min_length=1, description="names of the materials, a pattern such as paint*")
    tint: LinearDrawn | None = Field(
        default=None, description="multiplies the colour: linear [r, g, b], a name or '#rrggbb'; white changes nothing"
    )
    metallic: Drawn[Portion] | None = Field(default=None, description="instead of what the model says: 1 is metal")
    roughness: Drawn[Portion] | None = Field(default=None, description="instead of what the model says: 0 a mirror, 1 matt")

    @model_validator(mode="after")
    def _check(self) -> MaterialEntry:
        if self.tint is None and self.metallic is None and self.roughness is None:
            raise ValueError("expected tint, metallic or roughness; found none")
        return self
