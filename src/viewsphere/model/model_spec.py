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


class Parts(Frozen):
    """The parts of a model to keep: those of the objects in `only` (None: all) except those in `without`.

    An object's parts are its own and those that it instances: of `Car` these are `Car` and `Car/Wheel`. They stand in the
    rigid axes `file_from_axes` (metres) of the whole model's.
    """

    only: tuple[str, ...] | None = None
    without: tuple[str, ...] = ()
    file_from_axes: Matrix4 = IDENTITY


class ModelSpec(OmitNone):
    """The identity of a model, and the conversion of its file to an object that faces -Y with +Z up, in metres.

    `source` is a file's absolute path, or `zoo:<family>` with `seed` naming the draw. None for `up`, `forward` or `unit`
    means the value in the file, or in its format's specification. An animated model is turned, scaled and centred as it is at
    its file's first frame. The motion of its thing determines the time step that it shows, and when.
    """

    OMIT_IF_NONE = ("fps", "sidecar", "symmetries", "keypoints", "color", "material", "size", "faces")

    key: str  # unique and stable in the data set: also the name of its folder
    source: str
    seed: int | None = None
    category: str
    supercategory: str = ""
    category_id: int = Field(ge=0)  # 0: background, which only scenery is
    up: Axis | None = None
    forward: Axis | None = None
    unit: float | None = None  # metres in one unit of the file
    centring: Literal["box", "area", "floor", "as_is"] = "box"
    scale: Literal["as_is", "real_size"] | float = "as_is"  # a number: metres from front to back
    real_size: Size | Literal["file"] | None = None  # "file": the size the file has, before any scaling
    confined: bool = True  # texture and buffer paths may not leave the model's folder
    rest: int | None = None  # frame of an animated file, which Blender then reads, where no time step is named
    fps: float | None = None  # frames of an animated file that make a second, where that is not what the file says
    clip: str | None = None  # name of the animation that is played, where the file has several
    shown: tuple[str, ...] = ()  # objects of a .blend file that are read although renders do not show them
    size: Size | None = None  # that a drawn model is built to, where it can be
    parts: Parts | None = None  # what is taken of it, when it is read and normalised
    sidecar: str | None = None  # absolute path of the file that says symmetries and keypoints, where it is not beside its own
    symmetries: Literal["found"] | None = None  # whether they are looked for where none are declared
    keypoints: int | None = None  # how many are spread over its surface where none are named
    faces: Literal["as_file"] | None = None  # cameras see single-sided materials from their fronts alone; None: all from both
    color: Word | None = None  # what captions call its colour, where that is not what its sidecar or its surface says
    material: Word | None = None  # the same of its material

    def key_at(self, frame: int | None) -> str:
        """The key of the model as it is at a frame of its file; None: its own."""
        return step_key(self.key, frame)

    @property
    def whole(self) -> ModelSpec:
        """The model that this one is a part of: equal for all parts of one, whichever frame they rest at."""
        unnamed = {"key": "", "category": "", "supercategory": "", "category_id": 0, "rest": None, "parts": None}
        return self.model_copy(update=unnamed)


def step_key(key: str, frame: int | None) -> str:
    """The key of the model of this key as it is at a frame of its file; None: its own."""
    return key if frame is None else f"{key}-f{frame:04d}"
