"""A user's facts about one model in a file beside it: `mug.glb.viewsphere.yaml` for `mug.glb`."""

from __future__ import annotations

from itertools import chain
from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, ValidationError, model_validator

from viewsphere.errors import RecipeError
from viewsphere.model.annotations.appearance import Word
from viewsphere.model.annotations.keypoints import Keypoints, PointName
from viewsphere.model.annotations.symmetries import Symmetries
from viewsphere.model.fields.frozen import Frozen
from viewsphere.recipe.reading.file import read
from viewsphere.validation.errors import report, shown

ENDING = ".viewsphere.yaml"
"""Suffix after the full name of the model's file."""


def _all_of_them(symmetries: Symmetries | None) -> Symmetries | None:
    if symmetries is not None and (pair := symmetries.unlisted()):
        first, second = (f"discrete[{i}]" for i in pair)
        raise ValueError(
            f"expected every symmetry, as only then one pose stands for all; {first} followed by {second} is one, too, and was "
            f"not found among them: add it, and whatever follows in the same way"
        )
    return symmetries


class Sidecar(Frozen):
    """Symmetries, named points and body parts of a model, and words for its appearance."""

    axes: Literal["file", "object"] = Field(
        default="file",
        description="axes of its numbers: the model file's own axes, origin and unit; or the object's: metres, +Z up, "
        "front -Y, the origin from `centring`",
    )
    symmetries: Annotated[Symmetries | None, AfterValidator(_all_of_them)] = Field(
        default=None, description="rigid motions that leave the model unchanged; {} declares that there are none"
    )
    keypoints: Keypoints | None = Field(default=None, description="named points")
    body_parts: dict[PointName, Annotated[tuple[PointName, ...], Field(min_length=1)]] | None = Field(
        default=None,
        min_length=1,
        description="names of body parts, each with the bones of its skin: `{head: [Head, Neck], ...}`; other bones "
        "belong to no part. Without it, each bone is a part",
    )
    color: Word | None = Field(default=None, description="word for its colour in captions")
    material: Word | None = Field(default=None, description="word for its material in captions")

    @model_validator(mode="after")
    def _check(self) -> Sidecar:
        bones = list(chain.from_iterable((self.body_parts or {}).values()))
        again = next((bone for i, bone in enumerate(bones) if bone in bones[:i]), None)
        if again is not None:
            raise ValueError(f"expected every bone of body_parts once; found {shown(again)} again")
        return self


def read_sidecar(path: Path) -> Sidecar:
    """The sidecar in a file; raises RecipeError, one line per error, with file, line and field."""
    data, marks = read(path, "axes, symmetries, keypoints, body_parts, color, material")
    try:
        return Sidecar.model_validate(data)
    except ValidationError as error:
        raise RecipeError(report(error, data, marks)) from None
