"""The camera, the scene and the engine of a recipe."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, cast

from pydantic import (
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    JsonValue,
    Tag,
    WithJsonSchema,
    field_validator,
    model_validator,
)

from viewsphere.geometry.camera import focal_from_fov, focal_from_sensor
from viewsphere.model.camera import Distortion, Intrinsics
from viewsphere.model.frozen import Frozen
from viewsphere.model.mistakes import shown
from viewsphere.model.recipe_scenery import CompanyField, PlaceField, PlanesField
from viewsphere.model.recipe_values import (
    COLOR_FORMS,
    Count,
    Number,
    OrShort,
    Positive,
    SrgbColor,
    pair,
    parse_color,
    shape_of,
    switch,
)
from viewsphere.model.scene import Ground, Sky, Sun

LARGEST_IMAGE = 16384
LENSES = ("fov_deg", "focal_px", "focal_mm", "K", "of_viewpoints")

Row = tuple[Number, Number, Number]
Pixels = Annotated[Count, Field(le=LARGEST_IMAGE)]


class CameraEntry(Frozen):
    """Image size, and one description of the lens."""

    size: tuple[Pixels, Pixels] = Field(default=(640, 480), description="[width, height] of the image in pixels")
    fov_deg: Annotated[Number, Field(gt=0, lt=180)] | None = Field(
        default=None, description="angle of view in degrees, across the image's width unless fov_axis says otherwise"
    )
    fov_axis: Literal["horizontal", "vertical"] = Field(default="horizontal", description="what fov_deg measures")
    focal_px: Annotated[tuple[Positive, Positive], BeforeValidator(pair), OrShort({"type": "number"})] | None = Field(
        default=None, description="focal length in pixels: a number or [fx, fy]"
    )
    focal_mm: Positive | None = Field(default=None, description="focal length in millimetres; needs sensor_mm")
    sensor_mm: Positive | tuple[Positive, Positive] | None = Field(
        default=None, description="sensor width in millimetres (square pixels), or [width, height]"
    )
    K: tuple[Row, Row, Row] | None = Field(
        default=None,
        description="full 3x3 camera matrix in pixels, origin at the image's corner (centre: width/2, height/2)",
    )
    distortion: Distortion | None = Field(default=None, description="lens distortion with OpenCV's coefficients")
    of_viewpoints: Literal[True] | None = Field(
        default=None, description="true: size and lens as the viewpoints' file says (nerfstudio, COLMAP)"
    )

    @model_validator(mode="before")
    @classmethod
    def _default_lens(cls, data: Any) -> Any:
        return {"fov_deg": 40.0, **data} if isinstance(data, dict) and not data.keys() - {"size"} else data

    @field_validator("sensor_mm", mode="before")
    @classmethod
    def _sensor(cls, value: Any) -> Any:
        sizes = value if isinstance(value, (list, tuple)) else (value,)
        numbers = [v for v in cast(tuple[Any, ...], sizes) if isinstance(v, (int, float)) and v is not True and v > 0]
        if value is not None and (len(numbers) != len(sizes) or len(sizes) > 2):
            raise ValueError(f"expected millimetres above 0, one number or [width, height]; found {shown(value)}")
        return value

    @field_validator("K")
    @classmethod
    def _pinhole(cls, value: tuple[Row, Row, Row] | None) -> tuple[Row, Row, Row] | None:
        if value and (value[0][0] <= 0 or value[1][0] != 0 or value[1][1] <= 0 or value[2] != (0, 0, 1)):
            raise ValueError("expected [[fx, skew, cx], [0, fy, cy], [0, 0, 1]] with fx and fy above 0")
        return value

    @model_validator(mode="after")
    def _one_lens(self) -> CameraEntry:
        given = [name for name in LENSES if getattr(self, name) is not None]
        if len(given) != 1:
            found = " and ".join(given) or "none"
            raise ValueError(f"expected one of fov_deg, focal_px, focal_mm with sensor_mm, K, of_viewpoints; found {found}")
        if self.of_viewpoints and (self.size != type(self).model_fields["size"].default or self.distortion):
            raise ValueError("expected no size and no distortion beside of_viewpoints, which says both; found one")
        if (self.focal_mm is None) != (self.sensor_mm is None):
            raise ValueError("expected focal_mm and sensor_mm together; found one of them")
        return self

    @property
    def intrinsics(self) -> Intrinsics:
        """The lens as focal lengths and principal point in pixels."""
        width, height = self.size
        cx, cy, skew = width / 2, height / 2, 0.0
        if self.K is not None:
            (fx, skew, cx), (_, fy, cy), _ = self.K
        elif self.focal_px is not None:
            fx, fy = self.focal_px
        elif self.focal_mm is not None and self.sensor_mm is not None:
            sensor = self.sensor_mm if isinstance(self.sensor_mm, tuple) else (self.sensor_mm, None)
            fx = focal_from_sensor(self.focal_mm, sensor[0], width)
            fy = fx if sensor[1] is None else focal_from_sensor(self.focal_mm, sensor[1], height)
        else:
            assert self.fov_deg is not None
            across = width if self.fov_axis == "horizontal" else height
            is_fisheye = self.distortion is not None and self.distortion.model == "fisheye"
            fx = fy = focal_from_fov(math.radians(self.fov_deg), across, is_fisheye)
        return Intrinsics(width=width, height=height, fx=fx, fy=fy, cx=cx, cy=cy, skew=skew, distortion=self.distortion)


class BackgroundEntry(Frozen):
    """What is seen where nothing else is; the sky when nothing is given."""

    color: SrgbColor | None = Field(default=None, description="a plain colour")
    image: str | None = Field(default=None, min_length=1, description="path of an image that covers the frame")
    images: str | None = Field(default=None, min_length=1, description="folder of images to draw from")
    draw: Literal["fixed", "per_frame"] = Field(
        default="per_frame", description="for images: one for the whole data set, or one for every frame"
    )

    @model_validator(mode="after")
    def _one(self) -> BackgroundEntry:
        given = [name for name in ("color", "image", "images") if getattr(self, name) is not None]
        if len(given) > 1:
            raise ValueError(f"expected one of color, image, images; found {' and '.join(given)}")
        if self.draw == "fixed" and self.images is None:
            raise ValueError("expected images beside draw: fixed; found none")
        return self

    @property
    def is_sky(self) -> bool:
        """Whether the sky is the background."""
        return self.color is None and self.image is None and self.images is None


def _background(value: Any) -> Any:
    if isinstance(value, (dict, BackgroundEntry)):
        return value
    return {} if value == "sky" else {"color": parse_color(value, "sky, a mapping of image or images, ")}


def _ground(value: Any) -> Any:
    on = switch(value)
    if on is not None:
        return "on" if on else "off"
    return value if value == "auto" else parse_color(value, "on, off, auto, ")


def _sun(value: Any) -> Any:
    on = switch(value)
    return value if on is None else ({} if on else "off")


SWITCH: list[Any] = [True, False, "on", "off"]


class SceneEntry(Frozen):
    """Light, ground and background, and what stands around the targets."""

    place: PlaceField = Field(
        default=None, description="where the targets stand: zoo:neighbourhood, a model file, or a mapping of source and more"
    )
    company: CompanyField = Field(
        default=None, description="how many other models of the same split stand beside each, or a mapping of count and layout"
    )
    planes: PlanesField = Field(default=(), description="upright planes with pictures")
    background: Annotated[BackgroundEntry, BeforeValidator(_background), OrShort({"const": "sky"}, *COLOR_FORMS)] = Field(
        default=BackgroundEntry(),
        description="sky, a colour, {image: path}, or {images: folder, draw: fixed or per_frame}",
    )
    ground: Annotated[
        Literal["on", "off", "auto"] | tuple[float, float, float],
        BeforeValidator(_ground),
        WithJsonSchema({"anyOf": [{"enum": [*SWITCH, "auto"]}, *COLOR_FORMS]}),
    ] = Field(default="auto", description="on, off, a colour, or auto: on under the sky, off before a colour or an image")
    sun: Annotated[
        Annotated[Sun, Tag("mapping")] | Annotated[Literal["off"], Tag("text")],
        Discriminator(shape_of, custom_error_type="sun", custom_error_message="expected on, off or a mapping"),
        BeforeValidator(_sun),
        OrShort({"enum": SWITCH}),
    ] = Field(default=Sun(), description="off, or azimuth_deg, elevation_deg, strength, color (linear RGB)")
    sky: Sky = Field(default=Sky(), description="ambient light: zenith, horizon (linear RGB), strength")

    @property
    def is_composed(self) -> bool:
        """Whether there is more than one model and the ground: then world z = 0 is the floor that all stand on."""
        return bool(self.place or self.company or self.planes)

    @property
    def is_new_each_frame(self) -> bool:
        """Whether anything but the background is drawn for every frame."""
        drawn = (self.place, self.company, *self.planes)
        return any(entry is not None and entry.draw == "per_frame" for entry in drawn)

    @property
    def has_fixed_scenery(self) -> bool:
        """Whether there is a place or planes, the same for all models."""
        drawn = (self.place, *self.planes)
        return any(drawn) and not any(entry is not None and entry.draw != "fixed" for entry in drawn)

    @property
    def floor(self) -> Ground | None:
        """The ground there will be."""
        if isinstance(self.ground, tuple):
            return Ground(color=self.ground)
        on = self.background.is_sky if self.ground == "auto" else self.ground == "on"
        return Ground() if on else None

    @property
    def light(self) -> Sun | None:
        """The sun, if there is one."""
        return self.sun if isinstance(self.sun, Sun) else None


class EngineEntry(Frozen):
    """What paints the pictures: a name, and options that the engine itself checks."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, JsonValue] = Field(init=False)  # pyright: ignore[reportIncompatibleVariableOverride]

    name: str = Field(default="raster", min_length=1, description="name of the engine")

    @property
    def options(self) -> dict[str, JsonValue]:
        """Everything but the name."""
        return dict(self.__pydantic_extra__)


def engine_entry(value: Any) -> Any:
    """An engine's name alone as an entry without options."""
    return {"name": value} if isinstance(value, str) else value
