"""The one table of channels: what an observation may hold, and how each is kept in a file."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Observation = Mapping[str, NDArray[Any]]
"""Named arrays of one frame, each as its row of `CHANNELS` says."""


@dataclass(frozen=True)
class Channel:
    """One per-pixel array: (height, width) + (components,) if components > 1."""

    name: str
    dtype: type[np.generic]
    components: int
    unit: str
    empty: float
    encoding: Literal["png", "png16", "tiff"]
    meaning: str

    @property
    def suffix(self) -> str:
        """File name ending, with its dot."""
        return ".tiff" if self.encoding == "tiff" else ".png"

    def shape(self, height: int, width: int) -> tuple[int, ...]:
        """Shape of this channel's array for an image of this size."""
        return (height, width) if self.components == 1 else (height, width, self.components)


CHANNELS: dict[str, Channel] = {
    c.name: c
    for c in (
        Channel("rgb", np.uint8, 3, "sRGB", 0, "png", "colour picture"),
        Channel("rgba", np.uint8, 4, "sRGB", 0, "png", "colour picture without its background; straight alpha"),
        Channel("depth", np.float32, 1, "m", np.inf, "tiff", "distance along the camera's z axis"),
        Channel("instances", np.int32, 1, "object id", 0, "png16", "which object is seen; 0 is background"),
        Channel("categories", np.int32, 1, "category id", 0, "png16", "category of the object seen; 0 is background"),
        Channel("parts", np.int32, 1, "part id", 0, "png16", "named part of the object's model, from 1; 0 is none"),
        Channel("normals", np.float32, 3, "1", 0, "tiff", "shading normal, camera axes, towards the camera"),
        Channel("normals_geometric", np.float32, 3, "1", 0, "tiff", "triangle's normal, camera axes, towards the camera"),
        Channel("coordinates", np.float32, 3, "m", np.nan, "tiff", "the seen point in its object's own axes"),
        Channel("triangles", np.int32, 1, "triangle", -1, "tiff", "index in the object's exported model; -1 where no object"),
        Channel("barycentrics", np.float32, 3, "1", 0, "tiff", "weights of the triangle's corners at the seen point"),
    )
}

PICTURES = ("rgb", "rgba")
"""Channels that an engine paints; all others are computed. Of those that are kept, the first is a frame's picture."""

DEFAULT_CHANNELS = ("rgb", "depth", "instances", "normals")


def picture_of(kept: Container[str]) -> str | None:
    """The channel to show where one picture is wanted, None if there is none."""
    return next((name for name in PICTURES if name in kept), None)


def missing(needed: Iterable[str], kept: Container[str]) -> tuple[str, ...]:
    """Those of the needed channels that are not kept; a picture without background does for one that has it."""
    return tuple(name for name in needed if name not in kept and not (name == "rgb" and picture_of(kept)))
