"""Shots that are listed one by one: a camera, and the models with their poses. A file of shots has one a line, as JSON."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import AfterValidator, Field, model_validator

from viewsphere.limits import limits
from viewsphere.model.fields.file_names import is_reserved
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Number
from viewsphere.model.scene import IDENTITY, Matrix4
from viewsphere.model.sensors.camera import Intrinsics

LARGEST_PICTURE = 16384
"""Pixels along a side."""

Row = tuple[Number, Number, Number, Number]


def _whole_last_row(matrix: Matrix4) -> Matrix4:
    if matrix[3] != IDENTITY[3]:
        raise ValueError(f"expected [0, 0, 0, 1] as the last row; found {list(matrix[3])}")
    return matrix


Pose = Annotated[tuple[Row, Row, Row, Row], AfterValidator(_whole_last_row)]
"""4 rows of 4 numbers."""


def _in_bounds(lens: Intrinsics) -> Intrinsics:
    if max(lens.width, lens.height) > LARGEST_PICTURE:
        raise ValueError(f"expected at most {LARGEST_PICTURE} pixels a side; found {lens.width} x {lens.height}")
    return lens


def _free(name: str) -> str:
    if is_reserved(name) or name.endswith("."):
        raise ValueError(f"expected a name for a folder on any system; found {name!r}")
    return name


class ListedObject(Frozen):
    """A model in a shot."""

    model: str = Field(min_length=1, max_length=200, description="key of a model of the recipe")
    world_from_object: Pose = Field(description="its pose, 4 x 4, rows, in the file's unit")
    scenery: bool = Field(
        default=False, strict=True, description="surroundings of other things, so that cameras may be inside its box"
    )


class ListedShot(Frozen):
    """A shot: its camera, and the models in it, in the order of their ids."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.-]*$", max_length=100), AfterValidator(_free)] | None = Field(
        default=None, description="unique name; by default shot- and its position in the file from 000000 on"
    )
    split: str | None = Field(default=None, min_length=1, max_length=100, description="its split; by default the recipe's")
    image: str | None = Field(default=None, max_length=1000, description="for readers: the picture that it reproduces")
    world_from_camera: Pose = Field(description="the camera's pose, 4 x 4, rows: x right, y down, z forward")
    camera: Annotated[Intrinsics, AfterValidator(_in_bounds)] | None = Field(
        default=None, description="size and lens in pixels from the picture's corner: width, height, fx, fy, cx, cy, ..."
    )
    objects: tuple[ListedObject, ...] = Field(default=(), description="its models and their poses")

    @model_validator(mode="after")
    def _not_too_many(self) -> Self:
        if len(self.objects) > limits.MAX_LISTED_OBJECTS:
            raise ValueError(
                f"objects: expected at most {limits.MAX_LISTED_OBJECTS:,} (limit MAX_LISTED_OBJECTS); found "
                f"{len(self.objects):,}; set VIEWSPHERE_MAX_LISTED_OBJECTS higher if it is meant so"
            )
        return self
