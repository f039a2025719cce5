"""A rolling shutter: a camera whose rows are exposed one after another, each with a pose and a world of its own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Positive

Float = NDArray[np.float64]


class Rolling(Frozen):
    """The readout of a picture, row by row. The instant is the moment of the picture's middle."""

    readout: Positive = Field(
        description="seconds from the exposure of the first row to that of the row after the last; at most the time between "
        "two instants"
    )
    direction: Literal["down", "up"] = Field(default="down", description="down: the top row is exposed first")

    def moments(self, height: int, interval: float) -> Float:
        """The moments of the rows (H,) after the instant, as shares of the time between two instants, `interval` seconds."""
        moments = ((np.arange(height) + 0.5) / height - 0.5) * (self.readout / interval)
        return moments if self.direction == "down" else -moments


@dataclass(frozen=True, eq=False)
class RowPoses:
    """The poses of each row of a picture: `rotation` (H, 3, 3) and `translation` (H, 3) lead from the world to the camera.

    `moving` maps the position of each moving thing in its shot to its poses (H, 4, 4), world from thing, NaN where the thing is
    absent. All other things keep the pose of the instant.
    """

    rotation: Float
    translation: Float
    moving: Mapping[int, Float]

    def repeated(self, times: int) -> RowPoses:
        """The poses of a picture with so many rows for each row."""
        moving = {i: np.repeat(poses, times, axis=0) for i, poses in self.moving.items()}
        return RowPoses(np.repeat(self.rotation, times, axis=0), np.repeat(self.translation, times, axis=0), moving)
