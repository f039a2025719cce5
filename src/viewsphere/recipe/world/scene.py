"""The camera, the scene and the engine of a recipe."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Any, Literal, cast

from pydantic import (
    AfterValidator,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    JsonValue,
    Tag,
    field_validator,
    model_validator,
)

from viewsphere.errors import RecipeError
from viewsphere.geometry.camera import focal_from_sensor
from viewsphere.geometry.lenses import LensOptions, LensParameters, focal_from_fov
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Count, Number, Positive
from viewsphere.model.scene import WEATHER
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.sensors.rolling import Rolling
from viewsphere.recipe.cameras.imager import ImagerField
from viewsphere.recipe.cameras.lens import DistortionField
from viewsphere.recipe.cameras.projection import WithProjection
from viewsphere.recipe.draws import Drawn, alternatives, is_random
from viewsphere.recipe.lights import LightsField, spec_of
from viewsphere.recipe.values import OrShort, pair
from viewsphere.recipe.world.blend import BlendField, VariantEntry
from viewsphere.recipe.world.effects import EffectsEntry
from viewsphere.recipe.world.finish import (
    BackgroundEntry,
    BackgroundField,
    JitterEntry,
    PerFrame,
    SmootherEntry,
    SmootherField,
    ViewEntry,
    ViewField,
    once_a_sequence,
)
from viewsphere.recipe.world.light import SKY_SUFFIXES, GradientEntry, HdriSky, SkyField, SunField
from viewsphere.recipe.world.scenery import CompanyEntry, CompanyField, Draw, PlaceEntry, PlaceField, PlaneEntry, PlanesField
from viewsphere.recipe.world.surface import GroundEntry, GroundField, MaterialEntry
from viewsphere.recipe.world.weather import FogField, LampsField, RainField, SnowField, WetField, check_weather
from viewsphere.validation.errors import error_at, shown, told_of

LARGEST_IMAGE = 16384
OF_FILE = ("place", "sun", "sky", "ground")
"""Fields that a recipe with a .blend scene must not have, because the file defines them."""
LENSES = ("fov_deg", "focal_px", "focal_mm", "K", "of_viewpoints", "projection")

Row = tuple[Number, Number, Number]
Pixels = Annotated[Count, Field(le=LARGEST_IMAGE)]


def _size(value: object) -> object:
    if not isinstance(value, (list, tuple)):
        raise ValueError(f"expected [width, height] in pixels, such as [640, 480]; found {shown(value)}")
    return cast(object, value)


PictureSize = Annotated[tuple[Pixels, Pixels], BeforeValidator(_size)]


def _of_pinhole(value: tuple[Row, Row, Row]) -> tuple[Row, Row, Row]:
    if value[0][0] <= 0 or value[1][0] != 0 or value[1][1] <= 0 or value[2] != (0, 0, 1):
        raise ValueError("expected [[fx, skew, cx], [0, fy, cy], [0, 0, 1]] with fx and fy above 0")
    return value


CameraMatrix = Annotated[tuple[Row, Row, Row], AfterValidator(_of_pinhole)]


def _focal(value: Any) -> Any:
    """A single number as two equal ones."""
    return pair(value) if isinstance(value, (int, float)) and not isinstance(value, bool) else value


FocalField = Annotated[
    Annotated[tuple[Positive, Positive], Tag("list")] | Annotated[Drawn[Positive], Tag("mapping")],
    Discriminator(
        lambda value: "list" if isinstance(value, (list, tuple)) else "mapping",
    ),
    BeforeValidator(_focal),
    OrShort({"type": "number"}),
]


class CameraEntry(WithProjection):
    """Image size, and one description of the lens."""

    LENS = ("fov_deg", "fov_axis", "focal_px", "focal_mm", "sensor_mm", "K", "principal_point", "distortion", "of_viewpoints")

    size: PictureSize = Field(default=(640, 480), description="[width, height] of the image in pixels")
    fov_deg: Drawn[Annotated[Number, Field(gt=0, lt=180)]] | None = Field(
        default=None,
        description="angle of view in degrees, across the image's width or as set by fov_axis; a number, [low, high] or a"
        " distribution, drawn for each picture or sequence like the rest of the lens",
    )
    fov_axis: Literal["horizontal", "vertical"] = Field(default="horizontal", description="direction of fov_deg")
    focal_px: FocalField | None = Field(
        default=None, description="focal length in pixels: a number, [fx, fy], or a distribution over numbers"
    )
    focal_mm: Drawn[Positive] | None = Field(
        default=None, description="focal length in millimetres, a number, [low, high] or a distribution; needs sensor_mm"
    )
    sensor_mm: Positive | tuple[Positive, Positive] | None = Field(
        default=None, description="sensor width in millimetres (square pixels), or [width, height]"
    )
    K: CameraMatrix | None = Field(
        default=None,
        description="full 3x3 camera matrix in pixels, origin at the image's corner (centre: width/2, height/2)",
    )
    principal_point: Drawn[tuple[Drawn[Number], Drawn[Number]]] | None = Field(
        default=None,
        description="[cx, cy] in pixels, origin at the image's corner, each a number or a distribution; by default the "
        "centre, or from K",
    )
    distortion: DistortionField | None = Field(
        default=None, description="lens model and its parameters: {model: fisheye, coefficients: [k1, k2, k3, k4]}"
    )
    rolling: Rolling | None = Field(
        default=None, description="a rolling shutter, of all cameras of a rig: {readout: 0.03, direction: down}; needs time"
    )
    of_viewpoints: Literal[True] | None = Field(
        default=None, description="true: size and lens from the viewpoints' file (nerfstudio, COLMAP)"
    )
    imager: ImagerField | None = Field(
        default=None,
        description="sensor behind the lens: phone, webcam, machine_vision, drone, or a mapping of preset and other fields; by "
        "default a perfect one",
    )

    also: dict[str, dict[str, Any]] | None = Field(
        default=None,
        description="further cameras at the same place that look the same way, by name, each with its own lens: {pinhole: "
        "{fov_deg: 90}}, or {pinhole: {}} for the same K without distortion; the recipe then has a rig of all",
    )

    OMIT_IF_NONE = ("imager", "rolling", "also")

    @model_validator(mode="before")
    @classmethod
    def _default_lens(cls, data: Any) -> Any:
        return {"fov_deg": 40.0, **data} if isinstance(data, dict) and not data.keys() - {"size", "imager", "rolling"} else data

    @field_validator("sensor_mm", mode="before")
    @classmethod
    def _sensor(cls, value: Any) -> Any:
        sizes = value if isinstance(value, (list, tuple)) else (value,)
        numbers = [v for v in cast(tuple[Any, ...], sizes) if isinstance(v, (int, float)) and v is not True and v > 0]
        if value is not None and (len(numbers) != len(sizes) or len(sizes) > 2):
            raise ValueError(f"expected millimetres above 0, one number or [width, height]; found {shown(value)}")
        return value

    @model_validator(mode="after")
    def _one_lens(self) -> CameraEntry:
        given = [name for name in LENSES if getattr(self, name) is not None]
        if len(given) != 1:
            names = " and ".join(given) or "none"
            raise ValueError(
                f"expected one of fov_deg, focal_px, focal_mm with sensor_mm, K, of_viewpoints, projection; found {names}"
            )
        if self.of_viewpoints and (self.size != type(self).model_fields["size"].default or self.distortion):
            raise ValueError("expected no size and no distortion beside of_viewpoints, which says both; found one")
        if (self.focal_mm is None) != (self.sensor_mm is None):
            raise ValueError("expected focal_mm and sensor_mm together; found one of them")
        if self.principal_point is not None and (self.K or self.of_viewpoints):
            raise ValueError("expected no principal_point beside K and of_viewpoints, which say it; found one")
        return self

    @property
    def lacks_depth(self) -> bool:
        """True if z-depth is not defined for the lens, as for a panorama."""
        return self.projection is not None and not self.projection.has_depth

    @property
    def is_random(self) -> bool:
        """True if any part of the lens is drawn."""
        return is_random(self)

    @property
    def intrinsics(self) -> Intrinsics:
        """The lens as focal lengths and principal point in pixels, once it is drawn."""
        width, height = self.size
        if self.projection is not None:
            return _calibrated(self.projection, self.size, self.rolling)
        cx, cy = self.principal_point or (width / 2, height / 2)
        skew = 0.0
        if self.K is not None:
            (fx, skew, cx), (_, fy, cy), _ = self.K
        elif self.focal_px is not None:
            fx, fy = self.focal_px if isinstance(self.focal_px, tuple) else (self.focal_px, self.focal_px)
        elif self.focal_mm is not None and self.sensor_mm is not None:
            sensor = self.sensor_mm if isinstance(self.sensor_mm, tuple) else (self.sensor_mm, None)
            fx = focal_from_sensor(self.focal_mm, sensor[0], width)
            fy = fx if sensor[1] is None else focal_from_sensor(self.focal_mm, sensor[1], height)
        else:
            assert self.fov_deg is not None
            across = width if self.fov_axis == "horizontal" else height
            fx = fy = _focal_length(self.fov_deg, across, self.distortion)
        with told_of("camera"):
            return Intrinsics(
                width=width,
                height=height,
                fx=fx,
                fy=fy,
                cx=cx,
                cy=cy,
                skew=skew,
                distortion=self.distortion,
                rolling=self.rolling,
            )


def _focal_length(fov_deg: float, extent: int, distortion: LensParameters | None) -> float:
    try:
        return focal_from_fov(math.radians(fov_deg), extent, distortion)
    except ValueError as error:
        raise RecipeError(f"camera.fov_deg: {error}") from None


def _calibrated(options: LensOptions, size: tuple[int, int], rolling: Rolling | None) -> Intrinsics:
    try:
        calibration = options.calibration(size)
    except ValueError as error:
        raise RecipeError(f"camera: {error}") from None
    with told_of("camera"):
        return Intrinsics(width=size[0], height=size[1], **calibration._asdict(), rolling=rolling)


class SceneEntry(Frozen):
    """Light, ground, background, and the surroundings of the targets. All values may be random."""

    draw: Draw = Field(
        default="per_model",
        description="when random sun, sky, lights, ground and materials are drawn: once for the data set (fixed), once a "
        "model (per_model), a sequence (per_sequence) or a frame (per_frame, which rebuilds the scene each "
        "time)",
    )
    place: PlaceField = Field(
        default=None,
        description="place where the targets stand: zoo:neighbourhood, a model file, or a mapping of source and more",
    )
    blend: BlendField = Field(
        default=None,
        description="a .blend file around the targets, for the engines cycles, eevee and workbench: its path, or a "
        "mapping of file, at, labels, variants and more",
    )
    company: CompanyField = Field(
        default=None, description="number of other models of the same split beside each, or a mapping of count and layout"
    )
    planes: PlanesField = Field(default=(), description="upright planes with pictures")
    sun: Drawn[SunField] = Field(
        default="auto",
        description="on, off, auto (on, but off under an hdri), or position and light: azimuth, elevation, "
        "strength, color, angle_deg",
    )
    sky: Drawn[SkyField] = Field(
        default=GradientEntry.of_defaults(),
        description="ambient light: zenith, horizon and strength of a gradient, daylight, night, or an EXR or HDR file",
    )
    lights: LightsField = Field(default=(), description="lamps: point, spot, area, hemisphere, or your own")
    ground: Drawn[GroundField] = Field(
        default="auto",
        description="on, off, catcher, a colour, a mapping of color, image, roughness and more, or auto: on under the sky, a "
        "catcher before the environment, else off",
    )
    materials: tuple[MaterialEntry, ...] = Field(default=(), description="changes to the models' materials")
    background: Drawn[BackgroundField] = Field(
        default=BackgroundEntry.of_defaults(),
        description="sky, environment, transparent, a colour, {image: path}, or {images: folder, draw: per_frame}",
    )
    smoother: SmootherField = Field(
        default=SmootherEntry.of_defaults(),
        description="softening of the models' border: none, box, gaussian or poisson, or a mapping",
    )
    view: ViewField = Field(
        default=ViewEntry.of_defaults(), description="exposure, temperature_k, tint and transform; or the transform alone"
    )
    effects: EffectsEntry = Field(default=EffectsEntry.of_defaults(), description="camera effects such as blur and noise")
    jitter: JitterEntry = Field(default=JitterEntry.of_defaults(), description="random offsets added to every viewpoint")
    fog: Drawn[FogField] = Field(default="off", description="off, visibility in metres, or a mapping of visibility and height")
    rain: Drawn[RainField] = Field(
        default="off", description="off, millimetres an hour, or a mapping of rate, wind, exposure and clouds"
    )
    snow: Drawn[SnowField] = Field(
        default="off", description="falling snow: off, millimetres of water an hour, or a mapping as for rain"
    )
    wet: Drawn[WetField] = Field(
        default="auto", description="off, auto (follows the rain), wetness from 0 to 1, or a mapping of amount and puddles"
    )

    lamps: Drawn[LampsField] = Field(
        default="auto",
        description="lamps of a place: on, off, auto (on under sky: night), or a mapping of strength, color, most and windows",
    )

    @model_validator(mode="after")
    def _check(self) -> SceneEntry:
        backgrounds = self.backgrounds
        if len({entry.transparent for entry in backgrounds}) > 1:
            raise ValueError("expected a transparent background in all frames or in none; found it among others")
        if len(backgrounds) > 1 and any(entry.draw != "per_frame" for entry in backgrounds):
            raise ValueError("expected no draw inside of a choice of backgrounds, which is made per_frame; found one")
        if any(entry.transparent for entry in backgrounds) and "poisson" in alternatives(self.smoother.kind):
            with error_at("smoother", "kind"):
                raise ValueError(
                    "expected none, box or gaussian beside background: transparent; found poisson, which takes the border's "
                    "colours from a background: choose another, or give a background"
                )
        self._check_blend()
        check_weather(self.rain, self.snow)
        return self

    def _check_blend(self) -> None:
        if self.blend is None:
            return
        for name in OF_FILE:
            given = getattr(self, name)
            if given != type(self).model_fields[name].default and (name, given) != ("ground", "off"):
                with error_at(name):
                    raise ValueError(f"expected no {name} beside blend, whose file has its own; found one: leave it out")
        for i, lamp in enumerate(self.lights):
            if spec_of(lamp).is_sky:
                kind = cast(Any, lamp).kind
                with error_at("lights", i):
                    raise ValueError(f"expected a lamp beside blend, whose file has its own sky; found {kind}: leave it out")

    @property
    def backgrounds(self) -> tuple[BackgroundEntry, ...]:
        """The values that the background may take."""
        return tuple(alternatives(self.background))

    @property
    def precipitation(self) -> tuple[str, ...]:
        """The fields of weather that may fall through the picture: rain, snow, both or none."""
        return tuple(name for name in ("rain", "snow") if any(value != "off" for value in alternatives(getattr(self, name))))

    @property
    def automatic_ground(self) -> Literal["on", "off", "catcher"]:
        """The ground that `ground: auto` selects in this scene."""
        if self.blend is not None:
            return "off"
        if any(entry.environment for entry in self.backgrounds):
            return "catcher"
        return "on" if all(entry.is_sky for entry in self.backgrounds) else "off"

    @property
    def has_ground(self) -> bool:
        """True if there can be an opaque ground."""
        return any(map(self._hides, alternatives(self.ground)))

    @property
    def always_has_ground(self) -> bool:
        """True if every draw has an opaque ground."""
        return all(map(self._hides, alternatives(self.ground)))

    def _hides(self, ground: GroundEntry | Literal["auto", "on", "off"]) -> bool:
        if isinstance(ground, GroundEntry):
            return not ground.catcher
        return (self.automatic_ground if ground == "auto" else ground) == "on"

    @property
    def is_composed(self) -> bool:
        """True if the scene has more than a model and the ground; everything then stands on world z = 0."""
        return bool(self.place or self.blend or self.company or self.planes)

    @property
    def is_moved_each_frame(self) -> bool:
        """True if the surroundings (place, distractors, billboards, variants) are drawn for every frame or sequence."""
        return any(entry.draw in ("per_frame", "per_sequence") for _, entry in self._around)

    @property
    def _around(self) -> Iterator[tuple[str, PlaceEntry | CompanyEntry | PlaneEntry | VariantEntry]]:
        """The drawn surroundings of the targets, each with its field."""
        if self.place is not None:
            yield "place", self.place
        if self.company is not None:
            yield "company", self.company
        yield from ((f"planes[{i}]", plane) for i, plane in enumerate(self.planes))
        if self.blend is not None:
            yield from ((f"blend.variants.{name}", variant) for name, variant in self.blend.variants.items())

    def over_time(self) -> SceneEntry:
        """The entry for sequences: values drawn per frame by default are drawn once a sequence.

        Raises ValueError if the recipe requests a scene per frame.
        """
        parts: dict[str, Frozen] = {name: once_a_sequence(part) for name, part in self if isinstance(part, PerFrame)}
        if self.blend is not None:
            variants = {name: once_a_sequence(variant) for name, variant in self.blend.variants.items()}
            parts["blend"] = self.blend.model_copy(update={"variants": variants})
        timed = self.model_copy(update=parts)
        for name, entry in (("", self), *timed._around):
            if entry.draw == "per_frame":
                raise ValueError(
                    f"{name + '.' if name else ''}draw: expected fixed, per_model or per_sequence beside time, as a sequence "
                    "shows one scene; found per_frame"
                )
        return timed

    @property
    def flickering(self) -> Iterator[str]:
        """The fields with draws for every frame; in recipes with `time`, such draws must be requested explicitly."""
        return (name for name, part in self if isinstance(part, PerFrame) and part.draw == "per_frame")

    def check_still(self) -> None:
        """Raise ValueError for draws once a sequence, because only recipes with `time` have sequences."""
        parts = ((name, part) for name, part in self if isinstance(part, PerFrame))
        for name, entry in (("", self), *parts, *self._around):
            if entry.draw == "per_sequence":
                raise ValueError(f"{name + '.' if name else ''}draw: expected time beside per_sequence; found none: set time")

    @property
    def is_new_each_frame(self) -> bool:
        """True if data shared by all frames of one shot is drawn for every frame."""
        lit = (self.sun, self.sky, self.lights, self.ground, self.materials, *(getattr(self, name) for name in WEATHER))
        drawn = is_random(lit) or self._has_folder or self._has_grain
        return self.is_moved_each_frame or (self.draw == "per_frame" and drawn)

    @property
    def _has_grain(self) -> bool:
        """True if the ground or a model has a material with random grain."""
        grounds = [ground for ground in alternatives(self.ground) if isinstance(ground, GroundEntry)]
        return any(ground.material is not None for ground in grounds) or any(m.texture is not None for m in self.materials)

    @property
    def _has_folder(self) -> bool:
        """True if a sky or a material draws its picture from a folder."""
        if any(material.images is not None for material in self.materials):
            return True
        skies = [sky for sky in alternatives(self.sky) if isinstance(sky, HdriSky)]
        return any(not path.lower().endswith(SKY_SUFFIXES) for sky in skies for path in alternatives(sky.hdri))

    @property
    def has_fixed_scenery(self) -> bool:
        """True if the scene has scenery (a place, billboards, a .blend file) that is the same for all models."""
        variants = () if self.blend is None else self.blend.variants.values()
        drawn = [entry for entry in (self.place, *self.planes, *variants) if entry is not None]
        return bool(drawn or self.blend) and all(entry.draw == "fixed" for entry in drawn)


class EngineEntry(Frozen):
    """The renderer: a name, and options that the engine itself checks."""

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
