"""The wanted visibility and truncation of a frame's models."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field, model_validator

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.validation_errors import shown
from viewsphere.recipe.values import Interval


def _shares(value: tuple[float, float]) -> tuple[float, float]:
    if value[0] < 0 or value[1] > 1:
        raise ValueError(f"expected shares of 0 to 1; found {shown(value)}")
    return value


Shares = Annotated[Interval, AfterValidator(_shares)]


class WantedEntry(Frozen):
    """Shares [low, high] in which the labels of these names of a frame's model shall lie; of random scenes those of the model
    of which least is seen, and of the one of which most is cut off.
    """

    visibility: Shares | None = Field(default=None, description="visible share: [0.3, 0.6]")
    truncation: Shares | None = Field(default=None, description="share outside the picture: [0.2, 0.5]")

    @model_validator(mode="after")
    def _check(self) -> WantedEntry:
        if self.visibility is None and self.truncation is None:
            raise ValueError("expected visibility or truncation; found neither")
        return self

    def miss(self, visibility: float, truncation: float) -> float:
        """The sum of a frame's distances from both wanted ranges; 0 within them."""
        pairs = ((self.visibility, visibility), (self.truncation, truncation))
        return sum(max(ends[0] - value, value - ends[1], 0.0) for ends, value in pairs if ends is not None)
