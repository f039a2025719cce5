"""The kinds of file that a data set's channels are written as: a recipe's `files`."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from viewsphere.model.channel import Channel
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Count, Positive

Encoding = Literal["png", "png8", "png16", "jpeg", "webp", "qoi", "jxl", "tiff", "exr", "half", "hdr", "npz"]

SUFFIXES: dict[Encoding, str] = {
    **{"png": ".png", "png8": ".png", "png16": ".png", "jpeg": ".jpg", "webp": ".webp", "qoi": ".qoi", "jxl": ".jxl"},
    **{"tiff": ".tiff", "exr": ".exr", "half": ".exr", "hdr": ".hdr", "npz": ".npz"},
}
"""File name endings, with their dots."""

LOSSY = ("jpeg", "webp", "jxl")
"""Encodings that take a quality; without a quality all but JPEG are lossless."""

DEEP: dict[str, str] = {"png16": "rgb16", "exr": "rgb_linear", "exr32": "rgb_linear", "hdr": "rgb_linear"}
"""The channel that replaces `rgb` for each kind of picture file of more than eight bits."""

LIGHT: dict[str, Encoding] = {"exr": "half", "exr32": "exr", "hdr": "hdr"}
"""The encoding of scene-linear light for each kind of picture file."""

STEP = 0.001
"""Default depth of a step of 16-bit files, metres: 1 mm, up to 65.5 m."""


class Files(Frozen):
    """The file format of each channel; every file names its own format, so data sets may mix them.

    Labels are exact in every format except `depth: png16`, which rounds.
    """

    rgb: Literal["png", "jpeg", "webp", "qoi", "jxl", "png16", "exr", "exr32", "hdr"] = Field(
        default="png",
        description="file of the picture; qoi and jxl (JPEG XL) need the extra codecs; with png16 the channel rgb becomes "
        "rgb16, with exr (half floats), exr32 or hdr it becomes rgb_linear, unless channels list these as well",
    )
    rgba: Literal["png", "webp", "qoi", "jxl"] = Field(default="png", description="file of the picture with alpha")
    quality: Annotated[Count, Field(le=100)] | None = Field(
        default=None, description="1 to 100 for jpeg (default 95), webp and jxl (lossless without it)"
    )
    depth: Literal["tiff", "exr", "npz", "png16"] = Field(
        default="tiff", description="file of the depth: float32 metres, or whole steps of depth_unit in a 16-bit PNG"
    )
    depth_unit: Positive | None = Field(
        default=None,
        description="metres per step of a png16 depth; default 0.001; value 0 is no surface, 65535 this distance or more",
    )
    masks: Literal["png16", "png8"] = Field(
        default="png16",
        description="file of instances, categories, semantic, parts and other ids: 16-bit grey, or a palette of colours",
    )
    geometry: Literal["tiff", "exr", "npz"] = Field(
        default="tiff", description="file of normals, coordinates, flow, disparity and other exact channels"
    )

    shots: Literal["files", "tar"] = Field(
        default="files",
        description="files: a file per channel and frame; tar: one tar per shot, so that a store of a million frames is "
        "not millions of files",
    )

    @model_validator(mode="after")
    def _check(self) -> Files:
        if self.quality is not None and not {self.rgb, self.rgba} & set(LOSSY):
            raise ValueError(f"expected quality only beside {', '.join(LOSSY)}; found rgb: {self.rgb}, rgba: {self.rgba}")
        if self.depth_unit is not None and self.depth != "png16":
            raise ValueError(f"expected depth_unit only beside depth: png16; found depth: {self.depth}")
        return self

    @property
    def deep(self) -> str | None:
        """The channel of more than eight bits that the kind of picture file holds; None for files of eight bits."""
        return DEEP.get(self.rgb)

    @property
    def step(self) -> float:
        """Metres in one step of a 16-bit PNG of depth."""
        return self.depth_unit or STEP

    def encoding(self, channel: Channel) -> Encoding:
        """The encoding that this channel is written in."""
        match channel.name, channel.encoding:
            case "rgb", _:
                return "png" if self.rgb in ("png16", "exr", "exr32", "hdr") else self.rgb
            case "rgb_linear", _:
                return LIGHT.get(self.rgb, self.geometry)
            case "rgba", _:
                return self.rgba
            case _ if channel.in_steps:
                return self.depth
            case _, "png16":
                return self.masks
            case _, "png" | "npz" as own:
                return own
            case _:
                return self.geometry

    def suffix(self, channel: Channel) -> str:
        """File name ending of this channel, with its dot."""
        return SUFFIXES[self.encoding(channel)]
