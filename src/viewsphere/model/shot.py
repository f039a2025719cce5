"""A shot: one concrete scene, nothing random left, and the poses to take it from. Plain JSON."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, JsonValue

from viewsphere.model.camera import Intrinsics
from viewsphere.model.files import Files
from viewsphere.model.frozen import Frozen
from viewsphere.model.scene import Color, Finish, Matrix4, Scene, Vector

Axis = Literal["+x", "-x", "+y", "-y", "+z", "-z"]
Size = tuple[float, float, float]  # width along X, height along Z, length along Y, metres


class Parts(Frozen):
    """What is taken of a model that was read: the parts of the objects in `only` (None: all) but for those in `without`.

    An object's parts are its own and those that it instances: of `Car` these are `Car` and `Car/Wheel`. They stand in the
    rigid axes `file_from_axes` (metres) of the whole model's.
    """

    only: tuple[str, ...] | None = None
    without: tuple[str, ...] = ()
    file_from_axes: Matrix4 = ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))


class ModelSpec(Frozen):
    """Which model, and how its file is turned into an object that faces -Y with +Z up, in metres.

    `source` is a file's absolute path, or `zoo:<family>` with `seed` naming the draw. None for `up`, `forward` or
    `unit` means what the file (or its format's specification) says. At a later `frame` a model is turned, scaled and
    centred as it is at its file's first.
    """

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
    frame: int | None = None  # of an animated file, which Blender then reads; None: the first, by which it is also placed
    clip: str | None = None  # name of the animation that is played, where the file has several; with a frame
    track: str = ""  # key of the animated model that this is at a moment: what stays itself over time
    shown: tuple[str, ...] = ()  # objects of a .blend file that are read although renders do not show them
    parts: Parts | None = None  # what is taken of it, when it is read and normalised

    @property
    def whole(self) -> ModelSpec:
        """The model that this one is a part of: equal for all parts of one."""
        unnamed = {"key": "", "category": "", "supercategory": "", "category_id": 0, "track": "", "parts": None}
        return self.model_copy(update=unnamed)


class Repaint(Frozen):
    """A change to the materials whose names match `material`, a pattern of fnmatch: `tint` (linear) multiplies the base colour,
    the others replace what the file says and its textures say.
    """

    material: str = "*"
    tint: Color | None = None
    metallic: float | None = Field(default=None, ge=0, le=1)
    roughness: float | None = Field(default=None, ge=0, le=1)


class Thing(Frozen):
    """One thing of a scene: an object with an id of 1..N, or with id 0 scenery that is background to every label.

    `world_from_object` is rigid. Things of one model are instances. `scenery` marks what the targets stand in front of,
    labelled or not.
    """

    id: int = Field(ge=0)
    model: ModelSpec
    world_from_object: Matrix4 = ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))
    scenery: bool = False
    repaints: tuple[Repaint, ...] = ()  # the last that matches a material counts


class Moment(Frozen):
    """A time step: a frame of an animated file, and the seconds since that file's first frame."""

    frame: int
    seconds: float


class Pose(Frozen):
    """One viewpoint: camera on a sphere around `target` (world metres; None: the box centre of object 1), and when."""

    index: int
    azimuth_deg: float
    elevation_deg: float
    distance: float = Field(gt=0)
    tilt_deg: float = 0.0
    target: Vector | None = None
    category: str = ""  # named bin: front, front-left, ..., top
    time: Moment | None = None  # where something is animated


class Frame(Frozen):
    """One picture of a shot. `index` counts all frames of the data set from 0; `finish` replaces the scene's."""

    index: int
    pose: Pose
    split: str
    finish: Finish | None = None


class Shot(Frozen):
    """One scene and the frames to take of it: all an engine needs, a few hundred bytes a thing and a pose a frame."""

    key: str  # stable, unique, fit for a folder's name
    things: tuple[Thing, ...]  # ids 1..N in order, then those of id 0
    intrinsics: Intrinsics
    scene: Scene
    frames: tuple[Frame, ...]
    engine: str = "raster"
    engine_options: dict[str, JsonValue] = Field(default_factory=dict)
    channels: tuple[str, ...]
    files: Files = Files()
    label_alpha: float = 0.01
    category_deg: float = Field(default=45.0, gt=0)  # angular resolution of the pose categories

    @property
    def objects(self) -> tuple[Thing, ...]:
        """What is labelled, in the order of the ids."""
        return tuple(p for p in self.things if p.id)

    @property
    def stage_key(self) -> str:
        """Equal for shots that can share a warm stage: all but the frames."""
        return self.model_copy(update={"key": "", "frames": ()}).model_dump_json()
