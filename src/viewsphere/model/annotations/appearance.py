"""The appearance of a model as numbers, from which captions get their words."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Amount, Portion
from viewsphere.model.fields.omit_none import OmitNone
from viewsphere.validation.errors import shown

LONGEST = 40
"""Characters of a word for a colour or a material."""


def _word(text: str) -> str:
    if text != " ".join(text.split()) or not text.isprintable():
        raise ValueError(f"expected words with single spaces between them; found {shown(text)}")
    return text


Word = Annotated[str, Field(min_length=1, max_length=LONGEST), AfterValidator(_word)]


class Patch(OmitNone):
    """The parts of a model that have one material, one basic colour and one word for the material.

    `share` is their share of the model's visible surface. Means over these parts give the colour (linear [r, g, b]), metallic,
    roughness, and the share of light that passes through. `coated`: whether a clear coat makes them glossy. `stays`: whether
    they keep their material when the recipe gives models another material, because they are not opaque.
    """

    OMIT_IF_NONE = ("stays",)

    material: str
    share: Portion
    color: tuple[Amount, Amount, Amount]
    metallic: Portion
    roughness: Portion
    clear: Portion
    coated: bool = False
    stays: Literal[True] | None = None


class Appearance(Frozen):
    """The surface of a model in patches, and the words for colour and material from its sidecar or recipe, if any."""

    patches: tuple[Patch, ...] = ()
    color: Word | None = None
    material: Word | None = None
