"""The `time` of a recipe, which makes sequences."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Count, Number, Positive

MOST_INSTANTS = 1_000_000
"""Limit of instants in a sequence, equal to the default of `max_frames`."""


class TimeEntry(Frozen):
    """The number of pictures in a sequence, and their rate."""

    frames: Annotated[Count, Field(le=MOST_INSTANTS)] | None = Field(
        default=None, description="number of instants in each sequence; or set seconds"
    )
    seconds: Positive | None = Field(default=None, description="length of each sequence in seconds; or set frames")
    fps: Annotated[Positive, Field(le=1e6)] = Field(default=25.0, description="instants per second")
    shutter: Annotated[Number, Field(ge=0, le=1)] = Field(
        default=0.0, description="exposure time, as a share of the time between two instants"
    )

    @model_validator(mode="after")
    def _one(self) -> TimeEntry:
        if (self.frames is None) == (self.seconds is None):
            raise ValueError(f"expected one of frames, seconds; found {'none' if self.frames is None else 'both'}")
        if self.seconds is not None and self.seconds * self.fps > MOST_INSTANTS:
            raise ValueError(f"expected at most {MOST_INSTANTS:,} instants; found {self.seconds * self.fps:,.0f}")
        return self

    @property
    def count(self) -> int:
        """Number of instants; the first is at 0 s."""
        return self.frames or max(1, round((self.seconds or 0.0) * self.fps))

    def seconds_at(self, instant: int) -> float:
        """Seconds of an instant."""
        return instant / self.fps
