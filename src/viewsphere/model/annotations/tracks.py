"""Point tracks: which points of a sequence are followed, and one sample's positions of them."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Count

Query = tuple[int, float, float]
"""An instant of the sequence, and a position (x, y) in its picture, in pixels."""

TRACK = np.dtype([("instant", "<i4"), ("query", "<f8", (2,)), ("object", "<i4"), ("point", "<f8", (4,)), ("state", "u1")])
"""One point in one sample: the instant and the position (x, y), pixels, at which its sensor picked it; the id of the object
under the point, 0 for none; its world position, homogeneous: (x, y, z, 1) in metres, (x, y, z, 0) the direction of a point of
the sky, NaN where it is not there; and its state in the picture: 0 visible, 1 occluded, 2 outside, 3 behind, 4 invalid.
"""


class Tracks(Frozen):
    """The points that each sensor of a sequence follows.

    The points are a grid of pixels with this spacing, or `count` random pixels `on` objects or on the whole picture, or listed
    `points`. Each point is picked at every instant of `at`. The draws follow from `seed`.
    """

    at: tuple[int, ...] = Field(min_length=1)
    grid: Count | None = None
    count: Count | None = None
    on: Literal["objects", "all"] = "objects"
    points: tuple[Query, ...] = ()
    seed: int = 0
