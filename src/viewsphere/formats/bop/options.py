"""The options of an export to BOP."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from viewsphere.model.frozen import Frozen


class Options(Frozen):
    """The layout of files, and the resolution of depth."""

    layout: Literal["scenewise", "imagewise", "webdataset"] = Field(
        default="scenewise",
        description="`scenewise`: JSON files of whole scenes, a PNG for each mask; `imagewise`: all files of a picture by "
        "themselves, masks as run lengths; `webdataset`: the same in tar shards",
    )
    depth_scale: float = Field(
        default=1.0,
        gt=0,
        le=1000,
        description="millimetres of a step of depth: depth ends at 65,535 of these; many of BOP's own data sets have 0.1",
    )
