"""A concrete scene, without random values: its lights, its ground, and the steps from light to a picture.

Light has one unit: a white Lambert surface that receives an irradiance of pi has a radiance of 1.
"""

from __future__ import annotations

from collections.abc import Mapping
from hashlib import blake2b
from typing import Annotated, Any, Literal, cast

from pydantic import BeforeValidator, ConfigDict, Field, JsonValue, model_validator

from viewsphere.model.annotations.procedural_material import ProceduralMaterial
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Amount, Length, Metres, Number, Portion, Signed, Strength
from viewsphere.model.fields.omit_none import OmitNone
from viewsphere.model.sensors.imager import MountedImager
from viewsphere.model.weather import Fog, Lamps, Rain, Snow, Wet
from viewsphere.validation.errors import shown

WEATHER = ("fog", "rain", "snow", "wet", "lamps")
"""Fields of a scene that describe its weather and its lit lamps."""

SEED = "seed"
"""The name of the noise's seed among the strengths and options of effects."""

Vector = tuple[float, float, float]
Row = tuple[float, float, float, float]
Matrix4 = tuple[Row, Row, Row, Row]
IDENTITY: Matrix4 = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))
Position = tuple[Metres, Metres, Metres]

LINEAR, SRGB, PICTURE = "linear", "sRGB", "picture"
"""Markers of fields that hold a kind of colour or a file name: recipes have short forms for these."""

Color = Annotated[tuple[Amount, Amount, Amount], LINEAR]
Srgb = Annotated[tuple[Portion, Portion, Portion], SRGB]
Picture = Annotated[str, Field(min_length=1), PICTURE]
WHITE: Color = (1.0, 1.0, 1.0)


class Sun(Frozen):
    """A distant light. Azimuth and elevation give the direction towards it, as for cameras."""

    azimuth: Number = Field(default=40.0, description="azimuth, degrees, as for cameras")
    elevation: float = Field(default=50.0, gt=0, le=90, description="degrees above the horizon")
    strength: Strength = Field(default=3.0, description="irradiance on a surface that faces it, in the sky's units")
    color: Color = Field(default=(1.0, 0.96, 0.9), description="linear [r, g, b]")
    angle_deg: float = Field(default=0.53, ge=0, le=60, description="angular width; wider means softer shadows")


class Sky(Frozen):
    """Ambient light from above: a vertical gradient."""

    IS_CHOICE = True
    kind: Literal["gradient"] = Field(default="gradient", description="a vertical gradient")
    zenith: Color = Field(default=(0.55, 0.7, 1.0), description="colour overhead: linear [r, g, b]")
    horizon: Color = Field(default=(0.9, 0.92, 0.95), description="colour at the horizon: linear [r, g, b]")
    strength: Strength = Field(default=1.0, description="factor of both colours")


class Daylight(Frozen):
    """A sky that follows from the sun's position, clear to overcast; its air dims and colours the sun."""

    IS_CHOICE = True
    kind: Literal["daylight"] = Field(default="daylight", description="a sky computed from the sun's position")
    turbidity: float = Field(default=3.0, ge=1.8, le=10, description="haze: 2 is very clear, 10 hazy")
    clouds: Portion = Field(default=0.0, description="0 clear, 1 overcast: then there is no sun")
    strength: Strength = Field(default=1.0, description="factor of the sky's light")


class Environment(Frozen):
    """Light from all directions, from a picture of the whole sphere (equirectangular EXR or HDR, linear)."""

    IS_CHOICE = True
    kind: Literal["hdri"] = Field(default="hdri", description="a picture of the whole sphere")
    file: str = Field(description="absolute path of an EXR or HDR file")
    strength: Strength = Field(default=1.0, description="factor of its light")
    rotation_deg: Number = Field(default=0.0, description="rotation about the vertical, counter-clockwise from above")


AnySky = Annotated[Sky | Daylight | Environment, Field(discriminator="kind")]


class Light(Frozen):
    """The fields that all lamps have."""

    strength: Strength = Field(description="irradiance at one metre, facing it; for a hemisphere its radiance")
    color: Color = Field(default=WHITE, description="linear [r, g, b]")


class PlacedLight(Light):
    """A lamp with a position, in world axes."""

    position: Position = Field(description="[x, y, z] in metres from the centre of the targets' box")


class AimedLight(PlacedLight):
    """A lamp with a direction, given by two positions."""

    toward: Position = Field(default=(0.0, 0.0, 0.0), description="target, [x, y, z] as for position")


class PointLight(PlacedLight):
    """A small ball that shines in all directions."""

    IS_CHOICE = True
    kind: Literal["point"] = Field(default="point", description="a small ball that shines everywhere")
    radius: Amount = Field(default=0.05, description="metres: larger means softer shadows")


class SpotLight(AimedLight):
    """A small disc that shines into a cone around the direction to `toward`; full inside of (1 - blend) of its angle."""

    IS_CHOICE = True
    kind: Literal["spot"] = Field(default="spot", description="a cone of light")
    radius: Amount = Field(default=0.05, description="metres: larger means softer shadows")
    angle_deg: float = Field(default=45.0, gt=0, le=160, description="of the whole cone")
    blend: Portion = Field(default=0.15, description="share of the cone that fades")


class AreaLight(AimedLight):
    """A rectangle that shines to one side, towards `toward`, by Lambert's law; its width is horizontal."""

    IS_CHOICE = True
    kind: Literal["area"] = Field(default="area", description="a rectangle that shines to one side")
    size: tuple[Length, Length] = Field(default=(1.0, 1.0), description="[width, height] in metres")


class HemisphereLight(Light):
    """Uniform light from above and another from below: radiance `strength` times each colour. It casts no shadow."""

    IS_CHOICE = True
    kind: Literal["hemisphere"] = Field(default="hemisphere", description="even light from above, and another from below")
    below: Color = Field(default=(0.0, 0.0, 0.0), description="colour of light from below: linear [r, g, b]")


AnyLight = Annotated[PointLight | SpotLight | AreaLight | HemisphereLight, Field(discriminator="kind")]


class Ground(OmitNone):
    """An endless level plane at the lowest point of all that is placed.

    A catcher shows only the shadows and the occlusion that it receives; labels ignore it unless `labels` is set.
    """

    color: Srgb = Field(
        default=(0.62, 0.61, 0.59), description="multiplies the image (default with an image: white): sRGB [r, g, b]"
    )
    pattern: Literal["slabs", "plain"] = Field(
        default="slabs", description="look of ground without pictures: slabs of concrete, or plain"
    )
    image: Picture | None = Field(default=None, description="path of a picture that repeats every `tile` metres")
    roughness: Portion = Field(default=1.0, description="0 a mirror, 1 matt")
    roughness_image: Picture | None = Field(default=None, description="path of a grey picture: 0 smooth, white rough")
    normal_image: Picture | None = Field(default=None, description="path of a normal map (green up)")
    metallic: Portion = Field(default=0.0, description="1: metal")
    tile: Length = Field(default=2.0, description="width of one repetition of images in metres; a slab is half as wide")
    catcher: bool = Field(default=False, description="true: shows only the shadows on it, over the background")
    labels: bool = Field(default=False, description="gives a catcher depth and normals; other ground always has them")
    material: ProceduralMaterial | None = Field(default=None, description="built-in material instead of slabs or pictures")

    OMIT_IF_NONE = ("material",)

    @property
    def has_slabs(self) -> bool:
        """Return whether slabs are visible."""
        pictured = self.image or self.roughness_image or self.normal_image or self.material
        return self.pattern == "slabs" and not (pictured or self.catcher)

    @property
    def is_labelled(self) -> bool:
        """Return whether labels include the ground."""
        return self.labels or not self.catcher


class Background(Frozen):
    """The picture behind all surfaces: a plain colour, an image, or by default the sky.

    cover: the largest centred part with the frame's proportions; stretch: all of it; crop: a part of the frame's proportions,
    `zoom` times smaller than the largest, at `place` (x, y), as shares of the remaining room.
    """

    color: Srgb | None = Field(default=None, description="a plain colour: sRGB [r, g, b]")
    image: Picture | None = Field(default=None, description="path of an image")
    transparent: bool = Field(
        default=False, description="true: no background; the channel rgb becomes rgba: red, green, blue and alpha"
    )
    fit: Literal["cover", "stretch", "crop"] = Field(
        default="cover",
        description="for an image: cover (its largest centred part with the frame's proportions), stretch, or crop (a part)",
    )
    zoom: float = Field(default=1.0, ge=1, le=100, description="fit: crop: zoom relative to the largest part")
    place: tuple[Portion, Portion] = Field(
        default=(0.5, 0.5), description="fit: crop: [x, y], position from 0 (left, top) to 1"
    )
    flip: bool = Field(default=False, description="mirrors an image")
    blur: Portion = Field(default=0.0, description="for an image: a Gaussian's sigma, as a share of the frame's width")


class ViewTransform(Frozen):
    """The conversion of scene-linear to display-linear light: exposure in stops, the white point, a view transform."""

    exposure: float = Field(default=0.0, ge=-16, le=16, description="stops: 1 is twice as bright")
    temperature_k: float = Field(
        default=6500.0,
        ge=1500,
        le=20000,
        description="colour temperature of the light that appears white; 6500 changes nothing",
    )
    tint: Signed = Field(default=0.0, description="-1 to 1: green to magenta")
    transform: Literal["standard", "filmic", "agx", "raw"] = Field(
        default="standard", description="standard, filmic, agx or raw"
    )


class Smoother(Frozen):
    """The smoothing of the border between the targets and their background: Dwibedi et al., *Cut, Paste and Learn* (2017)."""

    kind: Literal["none", "box", "gaussian", "poisson"] = Field(default="none", description="none, box, gaussian or poisson")
    size: float = Field(default=1.5, gt=0, le=50, description="pixels: half the box' side, or the Gaussian's sigma")


class Effects(Frozen):
    """The camera's effects on its picture: the strengths and options of plug-ins (`viewsphere.plugins.effect`) by their names,
    and the `seed` of their noise. A strength of 0, or none, is no effect. Labels never change.
    """

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, JsonValue] = Field(init=False)  # pyright: ignore[reportIncompatibleVariableOverride]

    @model_validator(mode="after")
    def _check_seed(self) -> Effects:
        seed = self.values.get(SEED, 0)
        if type(seed) is not int or seed < 0:
            raise ValueError(f"expected a whole number as {SEED}, 0 or more; found {shown(seed)}")
        return self

    @property
    def values(self) -> Mapping[str, JsonValue]:
        """The strengths, options and seed by name, in the order in which they are stored."""
        return self.__pydantic_extra__

    @property
    def seed(self) -> int:
        """The seed of the noise."""
        return cast(int, self.values.get(SEED, 0))


class Finish(OmitNone):
    """The steps from light to a picture that need no new stage, so that every frame may have its own.

    `imager` is that of the sensor whose picture is finished: `Shot.finish` adds it.
    """

    OMIT_IF_NONE = ("imager",)

    background: Background = Background.of_defaults()
    smoother: Smoother = Smoother.of_defaults()
    view: ViewTransform = ViewTransform.of_defaults()
    effects: Effects = Effects.of_defaults()
    imager: MountedImager | None = None

    def with_noise_of(self, sensor: str) -> Finish:
        """The same finish, with noise that also follows from a sensor's name; without noise it is unchanged."""
        if not self.effects.seed:
            return self
        seed = int.from_bytes(blake2b(f"{self.effects.seed}:{sensor}".encode(), digest_size=4).digest(), "little")
        return self.model_copy(update={"effects": self.effects.model_copy(update={SEED: seed})})

    def with_background(self, transparent: bool) -> Finish:
        """The same finish, with its background, or transparent behind the scene."""
        if self.background.transparent == transparent:
            return self
        background = self.background.model_copy(update={"transparent": transparent})
        return self.model_copy(update={"background": background})


class BlendScene(Frozen):
    """A .blend file whose scene is rendered unchanged; its labelled objects are things of the shot.

    `world_from_file` is rigid and in metres on both sides; `unit` is the metres in one unit of the file. `shown` are objects
    that are rendered although the file hides them, `hidden` those that are not. Without light of its own (`is_lit`) the
    scene's sun and sky light it.
    """

    file: str  # absolute path
    world_from_file: Matrix4 = IDENTITY
    unit: float = Field(default=1.0, gt=0)
    shown: tuple[str, ...] = ()
    hidden: tuple[str, ...] = ()
    is_lit: bool = True
    frame: int | None = None  # the file's; None: its first
    confined: bool = True  # textures and libraries must be inside its folder


class Floor(Frozen):
    """The height of the ground, metres: lower where something is below `height`, unless it `is_fixed`."""

    height: float
    is_fixed: bool = False

    def under(self, lowest: float) -> float:
        """The ground's height, given the height of the lowest placed point."""
        return self.height if self.is_fixed else min(self.height, lowest)


def _floor(value: Any) -> Any:
    return {"height": value} if isinstance(value, (int, float)) else value


class Scene(Frozen):
    """Light, ground, finish and weather; None for `sun`, `ground` or weather means there is none. `blend` has its own light and
    ground.

    `floor`: the height of the ground; a plain number is the largest height. Without it, the ground is below everything placed,
    at all instants of the shot. A moving sequence that is split into several shots needs a floor for one common height.
    `fog_outdoors` replaces `fog`: it is fog beyond the windows of a room, in front of sky and ground only.
    """

    sun: Sun | None = Sun.of_defaults()
    sky: AnySky = Sky.of_defaults()
    lights: tuple[AnyLight, ...] = ()
    ground: Ground | None = None
    floor: Annotated[Floor | None, BeforeValidator(_floor)] = None
    finish: Finish = Finish.of_defaults()
    blend: BlendScene | None = None
    fog: Fog | None = None
    rain: Rain | None = None
    snow: Snow | None = None
    wet: Wet | None = None
    lamps: Lamps | None = None
    fog_outdoors: Fog | None = None

    @property
    def weather(self) -> bool:
        """Return whether the scene has any weather."""
        return any(getattr(self, name) is not None for name in (*WEATHER, "fog_outdoors") if name != "lamps")
