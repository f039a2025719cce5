"""Frames of animated files, as recipes name them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Literal, cast

from pydantic import BeforeValidator, Discriminator, Field, Tag, model_validator

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Count, Positive
from viewsphere.recipe.values import shape_of
from viewsphere.validation.errors import shown

FrameNumber = Annotated[int, Field(strict=True, ge=-1_000_000, le=1_000_000)]


Rate = Annotated[Positive, Field(ge=1, le=1000)]

RATE = (
    "frames per second; by default the file's. Files with times (glTF, Alembic) are divided into such frames; in other files, "
    "frames have this duration"
)


class FrameRange(Frozen):
    """Every `step`-th frame from `first` to `last`."""

    first: FrameNumber | None = Field(default=None, description="by default the file's own first frame")
    last: FrameNumber | None = Field(default=None, description="upper limit; by default the file's own last frame")
    step: Count = Field(default=1, description="frames from one time step to the next")

    @model_validator(mode="after")
    def _ordered(self) -> FrameRange:
        if self.first is not None and self.last is not None and self.first > self.last:
            raise ValueError(f"expected first up to last; found {self.first} and {self.last}")
        return self

    def frames_within(self, first: int, last: int) -> tuple[int, ...]:
        """The frames of this range in a file whose first and last frame are `first` and `last`."""
        begin, end = first if self.first is None else self.first, last if self.last is None else self.last
        return tuple(range(begin, end + 1, self.step))


def _ascending(value: object) -> object:
    if isinstance(value, int) and not isinstance(value, bool):
        return (value,)
    numbers = cast("Sequence[object]", value) if isinstance(value, (list, tuple)) else ()
    for a, b in pairwise(numbers):
        if isinstance(a, int) and isinstance(b, int) and a >= b:
            raise ValueError(f"expected frames that ascend; found {shown(a)} before {shown(b)}")
    return value


Frames = Annotated[
    Annotated[tuple[FrameNumber, ...], Field(min_length=1), BeforeValidator(_ascending), Tag("list")]
    | Annotated[FrameRange, Tag("mapping")]
    | Annotated[Literal["all"], Tag("text")],
    Discriminator(
        lambda v: "list" if shape_of(v) == "number" else shape_of(v),
        custom_error_type="frames",
        custom_error_message="expected all, a list of frames or {first, last, step}",
    ),
]

Steps = Literal["each", "moving"]

STEPS = (
    "each: every pose at every time step; moving: the k-th pose at the k-th time step, so that camera and model move "
    "together; needs as many poses as time steps"
)


def chosen_frames(frames: Frames, first: int, last: int) -> tuple[int, ...]:
    """The chosen frames of a file whose first and last frame are `first` and `last`; empty for a range beyond the file."""
    if isinstance(frames, tuple):
        return frames
    return (FrameRange() if frames == "all" else frames).frames_within(first, last)
