"""What a user says of one model in a file beside it: `mug.glb.viewsphere.yaml` of `mug.glb`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, ValidationError

from viewsphere.errors import RecipeError
from viewsphere.model.frozen import Frozen
from viewsphere.model.keypoints import Keypoints
from viewsphere.model.looks import Word
from viewsphere.model.mistakes import report
from viewsphere.model.symmetries import Symmetries
from viewsphere.recipe.file import read

ENDING = ".viewsphere.yaml"
"""Follows the whole name of the model's file."""


def _all_of_them(symmetries: Symmetries | None) -> Symmetries | None:
    if symmetries is not None and (pair := symmetries.unlisted()):
        first, second = (f"discrete[{i}]" for i in pair)
        raise ValueError(
            f"expected every symmetry, as only then one pose stands for all; {first} followed by {second} is one, too, and was "
            f"not found among them: add it, and whatever follows in the same way"
        )
    return symmetries


class Sidecar(Frozen):
    """Symmetries and named points of a model, and words for what it looks like."""

    axes: Literal["file", "object"] = Field(
        default="file",
        description="what its numbers are in: the model file's own axes, origin and unit; or the object's: metres, +Z up, "
        "front -Y, the origin where `centring` puts it",
    )
    symmetries: Annotated[Symmetries | None, AfterValidator(_all_of_them)] = Field(
        default=None, description="rigid motions that leave the model as it is; {} says that there are none"
    )
    keypoints: Keypoints | None = Field(default=None, description="named points")
    color: Word | None = Field(default=None, description="what captions call its colour")
    material: Word | None = Field(default=None, description="what captions call its material")


def read_sidecar(path: Path) -> Sidecar:
    """The sidecar in a file; raises RecipeError in a line a mistake, which names file, line and field."""
    data, marks = read(path, "axes, symmetries, keypoints, color, material")
    try:
        return Sidecar.model_validate(data)
    except ValidationError as error:
        raise RecipeError(report(error, data, marks)) from None
