"""A shot: one concrete scene, nothing random left, and the poses to take it from. Plain JSON."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, JsonValue

from viewsphere.model.camera import Intrinsics
from viewsphere.model.frozen import Frozen

Vector = tuple[float, float, float]
Component = Annotated[float, Field(ge=0)]
Color = tuple[Component, Component, Component]
Axis = Literal["+x", "-x", "+y", "-y", "+z", "-z"]
Size = tuple[float, float, float]  # width along X, height along Z, length along Y, metres
Matrix4 = tuple[
    tuple[float, float, float, float],
    tuple[float, float, float, float],
    tuple[float, float, float, float],
    tuple[float, float, float, float],
]


class ModelSpec(Frozen):
    """Which model, and how its file is turned into an object that faces -Y with +Z up, in metres.

    `source` is a file's absolute path, or `zoo:<family>` with `seed` naming the draw. None for `up`, `forward` or
    `unit` means what the file (or its format's specification) says.
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


class Placement(Frozen):
    """One thing of a scene: an object with an id of 1..N, or with id 0 scenery that is background to every label.

    `world_from_object` is rigid. Placements of one model are instances. `scenery` marks what the targets stand in front of,
    labelled or not.
    """

    id: int = Field(ge=0)
    model: ModelSpec
    world_from_object: Matrix4 = ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))
    scenery: bool = False


class Sun(Frozen):
    """A distant light. Azimuth and elevation are those of the direction it stands in, as for cameras."""

    azimuth_deg: float = Field(default=40.0, description="direction the sun stands in, degrees, as for cameras")
    elevation_deg: float = Field(default=50.0, gt=0, le=90, description="degrees above the horizon")
    strength: float = Field(default=3.0, ge=0, description="irradiance on a plane that faces the sun, in the sky's units")
    color: Color = Field(default=(1.0, 0.96, 0.9), description="linear red, green, blue")


class Sky(Frozen):
    """Ambient light from above: a vertical gradient, linear colours."""

    zenith: Color = Field(default=(0.55, 0.7, 1.0), description="linear red, green, blue overhead")
    horizon: Color = Field(default=(0.9, 0.92, 0.95), description="linear red, green, blue at the horizon")
    strength: float = Field(default=1.0, ge=0, description="factor of both colours")


class Ground(Frozen):
    """A horizontal plane at the lowest point of all that is placed."""

    color: Color = (0.42, 0.41, 0.39)  # sRGB 0..1


class Background(Frozen):
    """What is seen where nothing else is: a plain colour, an image (covering the frame, centred), else the sky."""

    color: Color | None = None  # sRGB 0..1
    image: str | None = None  # absolute path


class Scene(Frozen):
    """Light, ground and background; None for `sun` or `ground` means there is none."""

    sun: Sun | None = Sun()
    sky: Sky = Sky()
    ground: Ground | None = None
    background: Background = Background()


class Pose(Frozen):
    """One viewpoint: camera on a sphere around `target` (world metres; None: the box centre of object 1)."""

    index: int
    azimuth_deg: float
    elevation_deg: float
    distance: float = Field(gt=0)
    tilt_deg: float = 0.0
    target: Vector | None = None
    category: str = ""  # named bin: front, front-left, ..., top


class Frame(Frozen):
    """One picture of a shot. `index` counts all frames of the data set from 0; `background` replaces the scene's."""

    index: int
    pose: Pose
    split: str
    background: Background | None = None


class Shot(Frozen):
    """One scene and the frames to take of it: all an engine needs, a few hundred bytes a placement and a pose a frame."""

    key: str  # stable, unique, fit for a folder's name
    placements: tuple[Placement, ...]  # ids 1..N in order, then those of id 0
    intrinsics: Intrinsics
    scene: Scene
    frames: tuple[Frame, ...]
    engine: str = "raster"
    engine_options: dict[str, JsonValue] = Field(default_factory=dict)
    channels: tuple[str, ...]
    label_alpha: float = 0.01
    category_deg: float = Field(default=45.0, gt=0)  # angular resolution of the pose categories

    @property
    def objects(self) -> tuple[Placement, ...]:
        """What is labelled, in the order of the ids."""
        return tuple(p for p in self.placements if p.id)

    @property
    def stage_key(self) -> str:
        """Equal for shots that can share a warm stage: all but the frames."""
        return self.model_copy(update={"key": "", "frames": ()}).model_dump_json()
