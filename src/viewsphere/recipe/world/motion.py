"""The recipe's entries for the motion of things.

`viewsphere.composing.motion` has the kinds of motion and their options.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

from pydantic import (
    ConfigDict,
    Discriminator,
    Field,
    JsonValue,
    Tag,
    model_validator,
)

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Number
from viewsphere.recipe.draws import Drawn, span
from viewsphere.recipe.values import shape_of


class MotionEntry(Frozen):
    """One motion: its kind, when the thing enters and leaves, and options that the kind itself checks."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, JsonValue] = Field(init=False)  # pyright: ignore[reportIncompatibleVariableOverride]

    kind: str = Field(
        min_length=1, description="keyframes, spline, constant, random, oscillate, path, clip, fall, or one of your own"
    )
    enter: Drawn[Number] | None = Field(default=None, description="seconds: the thing is absent before")
    leave: Drawn[Number] | None = Field(default=None, description="seconds: the thing is absent from then on")

    @model_validator(mode="after")
    def _check(self) -> MotionEntry:
        if self.enter is not None and self.leave is not None and span(self.leave)[1] <= span(self.enter)[0]:
            raise ValueError(
                f"expected leave after enter; found enter {span(self.enter)[0]:g} and leave {span(self.leave)[1]:g}"
            )
        return self

    @property
    def options(self) -> dict[str, JsonValue]:
        """The options of the kind."""
        return dict(self.__pydantic_extra__)


Motions = MotionEntry | tuple[MotionEntry, ...]
"""One motion, or several, each applied to the result of the previous ones."""

MotionsField = Annotated[
    Annotated[MotionEntry, Tag("mapping")] | Annotated[tuple[MotionEntry, ...], Field(min_length=1), Tag("list")],
    Discriminator(
        shape_of,
        custom_error_type="motion",
        custom_error_message="expected {kind: ...} or a list of these",
    ),
]

MotionField = MotionsField | None

MOTION = "motion under time: {kind: constant, velocity: [0, -1, 0]}, or a list of motions to combine"


def listed(motions: Motions | None, field: str) -> Iterator[tuple[str, MotionEntry]]:
    """Each motion with the field that it is written in: `models[0].motion`, or `models[0].motion[1]` in a list."""
    if isinstance(motions, MotionEntry):
        yield field, motions
    else:
        yield from ((f"{field}[{i}]", entry) for i, entry in enumerate(motions or ()))


def has_clip(motions: Motions | None) -> bool:
    """True if the animation of a model's file is among the motions."""
    return any(entry.kind == "clip" for _, entry in listed(motions, ""))
