"""Channels, the arrays of pixels of a sample: their class, and the passes; labels are in `viewsphere.labels`."""

from __future__ import annotations

from collections.abc import Container, Iterable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import DTypeLike, NDArray


@dataclass(frozen=True)
class Channel:
    """One array of pixels: (height, width) + (components,) if components > 1; `encoding` is its default file. A channel without
    components has any number of rows instead of pixels. `colors`: sRGB colours of the first ids, for files with a palette.
    `in_steps`: PNG files store whole steps of the recipe's `files.depth_unit`.
    """

    name: str
    dtype: DTypeLike
    components: int
    unit: str
    empty: float
    encoding: Literal["png", "png16", "tiff", "npz"]
    meaning: str
    colors: tuple[tuple[int, int, int], ...] = ()
    in_steps: bool = False

    @property
    def suffix(self) -> str:
        """File name ending, with its dot."""
        return ".tiff" if self.encoding == "tiff" else ".png"

    def shape(self, height: int, width: int) -> tuple[int, ...]:
        """Shape of this channel's array for an image of this size."""
        return (height, width) if self.components == 1 else (height, width, self.components)

    def fits(self, array: NDArray[Any], height: int, width: int) -> bool:
        """Return whether an array may be this channel's, for an image of this size."""
        is_shaped = array.ndim == 1 if self.components == 0 else array.shape == self.shape(height, width)
        return is_shaped and array.dtype == self.dtype

    def expected(self, height: int, width: int) -> str:
        """Return a description of the shape and type that fit."""
        return f"{self.shape(height, width) if self.components else 'rows of'} {np.dtype(self.dtype)}"


PASSES: dict[str, Channel] = {
    c.name: c
    for c in (
        Channel("rgb", np.uint8, 3, "sRGB", 0, "png", "colour picture"),
        Channel("rgba", np.uint8, 4, "sRGB", 0, "png", "colour picture without its background; straight alpha"),
        Channel("rgb16", np.uint16, 3, "sRGB", 0, "png", "colour picture in 65,536 levels, without JPEG's traces"),
        Channel("rgb_linear", np.float32, 3, "scene-linear", 0, "tiff", "light of the picture, before exposure and finish"),
        Channel("bayer", np.uint16, 1, "DN", 0, "png", "digital numbers of the camera's imager, a pixel a colour filter"),
        Channel("albedo", np.float32, 3, "1", 0, "tiff", "share of the light that the surface scatters to all sides"),
        Channel("shading", np.float32, 3, "scene-linear", 0, "tiff", "scattered light without the surface's colour"),
        Channel("residual", np.float32, 3, "scene-linear", 0, "tiff", "all other light: mirrored, let through, emitted, sky"),
        Channel("emission", np.float32, 3, "scene-linear", 0, "tiff", "light that the surface sends out; part of residual"),
        Channel("roughness", np.float32, 1, "1", 0, "tiff", "perceptual roughness of the seen surface: 0 mirrors, 1 is matt"),
        Channel("metallic", np.float32, 1, "1", 0, "tiff", "how much of the seen surface is metal, 0 to 1"),
    )
}
"""Channels that an engine paints; all others are labels. All but the pictures are arrays; docs/pictures.md describes them."""

PICTURES = ("rgb", "rgba")
"""The pictures of eight bits, which every engine paints."""

DEEP_PICTURES = ("rgb16", "rgb_linear")
"""The pictures of more than eight bits."""

ALL_PICTURES = (*PICTURES, *DEEP_PICTURES)
"""The passes that are pictures. The first that a data set keeps is its samples' picture."""

MOSAIC = "bayer"
"""The pass that a camera's imager measures, before its colours are interpolated."""

FINISHED = (*ALL_PICTURES, MOSAIC)
"""The passes that a finish makes of a picture's light, which engines need not know."""


LIGHT_PASSES = ("albedo", "shading", "residual", "emission")
"""Parts of a picture's light, sampled like the picture: albedo x shading + residual is the picture before exposure."""

MATERIAL_PASSES = ("roughness", "metallic")
"""Material of the labelled surface, at the pixels' centres."""

DEFAULT_CHANNELS = ("rgb", "depth", "instances", "normals")


def picture_of(kept: Container[str]) -> str | None:
    """The channel that serves as a sample's picture, None if none is kept."""
    return next((name for name in ALL_PICTURES if name in kept), None)


def painted_together(names: Container[str]) -> tuple[tuple[str, ...], ...]:
    """The finished passes among the names, those of one light together: first all with the background, then `rgba`."""
    groups = (("rgb", *DEEP_PICTURES, MOSAIC), ("rgba",))
    return tuple(wanted for group in groups if (wanted := tuple(name for name in group if name in names)))


def lacks_background(names: Container[str]) -> bool:
    """Return whether the first light of `painted_together` is that without background."""
    return painted_together(names)[:1] == (("rgba",),)


def missing(needed: Iterable[str], kept: Container[str]) -> tuple[str, ...]:
    """The needed channels that are not kept; any other picture replaces `rgb`."""
    return tuple(name for name in needed if name not in kept and not (name == "rgb" and picture_of(kept)))
