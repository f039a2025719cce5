"""The identity of a model, and the conversion of its file to an object."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from viewsphere.model.annotations.appearance import Word
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.omit_none import OmitNone
from viewsphere.model.scene import IDENTITY, Matrix4

Axis = Literal["+x", "-x", "+y", "-y", "+z", "-z"]
Size = tuple[float, float, float]  # width along X, height along Z, length along Y, metres


Measure = Literal["length", "width", "height", "longest", "diagonal"]
"""A length of a model's box: along Y, X or Z, its longest side, or its diagonal."""


class ScaledTo(Frozen):
    """A measure that a model is scaled to, metres."""

    measure: Measure
    metres: float


class Parts(Frozen):
    """The parts of a model to keep: those of the objects in `only` (None: all) except those in `without`.

    An object's parts are its own and those of the objects that it instances: for `Car`, these are `Car` and `Car/Wheel`. Their
    coordinates are in the rigid axes `file_from_axes` (metres) of the whole model.
    """

    only: tuple[str, ...] | None = None
    without: tuple[str, ...] = ()
    file_from_axes: Matrix4 = IDENTITY


class ModelSpec(OmitNone):
    """The identity of a model, and the conversion of its file to an object that faces -Y with +Z up, in metres.

    `source` is a file's absolute path, or `zoo:<family>`, where `seed` selects the model. None for `up`, `forward` or `unit`
    means the value in the file, or in its format's specification. An animated model is turned, scaled and centred as it is at
    its file's first frame. The motion of its thing determines its time step at each instant.
    """

    OMIT_IF_NONE = ("fps", "sidecar", "symmetries", "keypoints", "color", "material", "size", "faces", "split")

    key: str  # unique and stable in the data set: also the name of its folder
    source: str
    seed: int | None = None
    category: str
    supercategory: str = ""
    category_id: int = Field(ge=0)  # 0: background, for scenery only
    up: Axis | None = None
    forward: Axis | None = None
    unit: float | None = None  # metres in one unit of the file
    centring: Literal["box", "area", "floor", "as_is"] = "box"
    scale: Literal["as_is", "real_size"] | float | ScaledTo = "as_is"  # a number: metres from front to back
    real_size: Size | Literal["file"] | None = None  # "file": the size the file has, before any scaling
    confined: bool = True  # texture and buffer paths must be inside the model's folder
    rest: int | None = None  # frame of an animated file, which Blender then reads, if no time step is given
    fps: float | None = None  # frames per second of an animated file, if not the file's own rate
    clip: str | None = None  # name of the animation that is played, where the file has several
    shown: tuple[str, ...] = ()  # objects of a .blend file that are read although renders do not show them
    size: Size | None = None  # size that a procedural model is built to, if it supports that
    parts: Parts | None = None  # the parts of it that are kept, after it is read and normalised
    sidecar: str | None = None  # absolute path of the file with symmetries and keypoints, if it is not next to the model's file
    symmetries: Literal["found"] | None = None  # whether to search for symmetries if none are declared
    keypoints: int | None = None  # how many are spread over its surface where none are named
    faces: Literal["as_file"] | None = None  # single-sided materials are visible from the front only; None: all from both sides
    split: str | None = None  # the split in which its set of models lists it
    color: Word | None = None  # colour in captions, if not the one from its sidecar or its surface
    material: Word | None = None  # likewise for its material

    def key_at(self, frame: int | None) -> str:
        """The key of the model at a frame of its file; for None, its own key."""
        return step_key(self.key, frame)

    @property
    def whole(self) -> ModelSpec:
        """The whole model that this one is a part of: equal for all parts, at any rest frame."""
        unnamed = {"key": "", "category": "", "supercategory": "", "category_id": 0, "rest": None, "parts": None}
        return self.model_copy(update=unnamed)


def step_key(key: str, frame: int | None) -> str:
    """The key of a model at a frame of its file; for None, the model's own key."""
    return key if frame is None else f"{key}-f{frame:04d}"
