"""A concrete scene: its lights, what the targets stand on, and how light becomes a picture. Nothing random left.

Light has one unit: a white Lambert surface that receives an irradiance of pi has a radiance of 1.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from viewsphere.model.frozen import Frozen

Vector = tuple[float, float, float]
Row = tuple[float, float, float, float]
Matrix4 = tuple[Row, Row, Row, Row]
IDENTITY: Matrix4 = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))
Component = Annotated[float, Field(ge=0)]
Color = tuple[Component, Component, Component]
Share = Annotated[float, Field(ge=0, le=1)]
Strength = Annotated[float, Field(ge=0)]
WHITE: Color = (1.0, 1.0, 1.0)


class Sun(Frozen):
    """A distant light. Azimuth and elevation are those of the direction it stands in, as for cameras."""

    azimuth_deg: float = Field(default=40.0, description="direction the sun stands in, degrees, as for cameras")
    elevation_deg: float = Field(default=50.0, gt=0, le=90, description="degrees above the horizon")
    strength: float = Field(default=3.0, ge=0, description="irradiance on a plane that faces the sun, in the sky's units")
    color: Color = Field(default=(1.0, 0.96, 0.9), description="linear red, green, blue")
    angle_deg: float = Field(default=0.53, ge=0, le=60, description="how wide the sun is: wider means softer shadows")


class Sky(Frozen):
    """Ambient light from above: a vertical gradient, linear colours."""

    kind: Literal["gradient"] = Field(default="gradient", description="a vertical gradient")
    zenith: Color = Field(default=(0.55, 0.7, 1.0), description="linear red, green, blue overhead")
    horizon: Color = Field(default=(0.9, 0.92, 0.95), description="linear red, green, blue at the horizon")
    strength: float = Field(default=1.0, ge=0, description="factor of both colours")


class Daylight(Frozen):
    """The sky that the sun's place makes, clear to overcast; the sun itself is dimmed and coloured by its air."""

    kind: Literal["daylight"] = Field(default="daylight", description="a sky made by the sun's place")
    turbidity: float = Field(default=3.0, ge=1.8, le=10, description="haze: 2 is very clear, 10 hazy")
    clouds: Share = Field(default=0.0, description="0 clear, 1 overcast: then there is no sun")
    strength: float = Field(default=1.0, ge=0, description="factor of the sky's radiance")


class Environment(Frozen):
    """Light from everywhere, from a picture of the whole sphere (equirectangular EXR or HDR, linear)."""

    kind: Literal["hdri"] = Field(default="hdri", description="a picture of the whole sphere")
    file: str = Field(description="path of an EXR or HDR file")
    rotation_deg: float = Field(default=0.0, description="turns the picture about the vertical, counter-clockwise from above")
    strength: float = Field(default=1.0, ge=0, description="factor of its radiance")


AnySky = Annotated[Sky | Daylight | Environment, Field(discriminator="kind")]


class PointLight(Frozen):
    """A small ball that shines everywhere. Positions are metres from the centre of the box around the targets, world axes.

    `strength` is the irradiance at one metre, facing the light.
    """

    kind: Literal["point"] = "point"
    position: Vector
    strength: Strength
    color: Color = WHITE
    radius: float = Field(default=0.05, ge=0)


class SpotLight(Frozen):
    """A small disc that shines into a cone around the direction to `toward`; full inside of (1 - blend) of its angle."""

    kind: Literal["spot"] = "spot"
    position: Vector
    strength: Strength
    color: Color = WHITE
    radius: float = Field(default=0.05, ge=0)
    toward: Vector = (0.0, 0.0, 0.0)
    angle_deg: float = Field(default=45.0, gt=0, le=160)  # of the whole cone
    blend: Share = 0.15


class AreaLight(Frozen):
    """A rectangle that shines to one side, towards `toward`, as Lambert says; its width lies level."""

    kind: Literal["area"] = "area"
    position: Vector
    strength: Strength
    color: Color = WHITE
    toward: Vector = (0.0, 0.0, 0.0)
    size: tuple[float, float] = (1.0, 1.0)  # metres


class HemisphereLight(Frozen):
    """Even light from above and another from below: radiance `strength` times each colour. It casts no shadow."""

    kind: Literal["hemisphere"] = "hemisphere"
    strength: Strength
    color: Color = WHITE
    below: Color = (0.0, 0.0, 0.0)


AnyLight = Annotated[PointLight | SpotLight | AreaLight | HemisphereLight, Field(discriminator="kind")]


class Ground(Frozen):
    """A horizontal plane at the lowest point of all that is placed. Images repeat every `tile` metres.

    A catcher shows nothing but the shadows and the occlusion it receives.
    """

    color: Color = (0.56, 0.55, 0.53)  # sRGB 0..1; multiplies the image
    image: str | None = None  # absolute path, sRGB
    roughness: Share = 1.0
    roughness_image: str | None = None
    normal_image: str | None = None
    metallic: Share = 0.0
    tile: float = Field(default=2.0, gt=0)
    catcher: bool = False


class Background(Frozen):
    """What is seen where nothing else is: a plain colour, an image, else the sky.

    cover: the largest centred part with the frame's proportions; stretch: all of it; crop: a part of the frame's
    proportions, `zoom` times smaller than the largest, at `place` (x, y) of the room there is. `blur` is a Gaussian's sigma
    as a share of the frame's width.
    """

    color: Color | None = None  # sRGB 0..1
    image: str | None = None  # absolute path
    fit: Literal["cover", "stretch", "crop"] = "cover"
    zoom: float = Field(default=1.0, ge=1)
    place: tuple[Share, Share] = (0.5, 0.5)
    flip: bool = False
    blur: Share = 0.0
    transparent: bool = False  # nothing at all: the picture has alpha


class View(Frozen):
    """From scene-linear light to display-linear: stops of exposure, the light that shall look white, a view transform.

    temperature_k: correlated colour temperature; 6500 changes nothing. tint: above 0 towards magenta.
    """

    exposure: float = Field(default=0.0, ge=-16, le=16)
    temperature_k: float = Field(default=6500.0, ge=1500, le=20000)
    tint: float = Field(default=0.0, ge=-1, le=1)
    transform: Literal["standard", "filmic", "agx", "raw"] = "standard"


class Smoother(Frozen):
    """What is done to the border between the targets and their background: Dwibedi et al., *Cut, Paste and Learn* (2017)."""

    kind: Literal["none", "box", "gaussian", "poisson"] = "none"
    size: float = Field(default=1.5, gt=0, le=50)  # pixels: half the box' side, the Gaussian's sigma


class Effects(Frozen):
    """What a camera does to its picture; strengths are 0 (nothing) to 1 (as much as ever makes sense). Labels never change."""

    blur: Share = 0.0
    motion_blur: Share = 0.0
    motion_angle_deg: float = 0.0  # across the picture, counter-clockwise from the right
    depth_of_field: Share = 0.0
    focus: float | None = Field(default=None, gt=0)  # metres along the camera's axis; None: what the camera looks at
    vignetting: Share = 0.0
    chromatic_aberration: Share = 0.0
    brightness: float = Field(default=0.0, ge=-1, le=1)
    contrast: float = Field(default=0.0, ge=-1, le=1)
    saturation: float = Field(default=0.0, ge=-1, le=1)
    hue: float = Field(default=0.0, ge=-1, le=1)  # 1: half a turn
    edge_highlight: Share = 0.0
    shot_noise: Share = 0.0
    read_noise: Share = 0.0
    jpeg: Share = 0.0
    seed: int = Field(default=0, ge=0)  # of the noise


class Finish(Frozen):
    """How light becomes a picture: all that costs no new stage, so every frame may have its own."""

    background: Background = Background()
    smoother: Smoother = Smoother()
    view: View = View()
    effects: Effects = Effects()

    def with_background(self, transparent: bool) -> Finish:
        """The same with its background, or with none at all."""
        background = self.background.model_copy(update={"transparent": transparent})
        return self.model_copy(update={"background": background})


class BlendScene(Frozen):
    """A .blend file whose scene is rendered as it is; what of it is labelled are things of the shot.

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
    confined: bool = True  # textures and libraries may not lie outside of its folder


class Scene(Frozen):
    """Light, ground and finish; None for `sun` or `ground` means there is none. `blend` has its own light and ground."""

    sun: Sun | None = Sun()
    sky: AnySky = Sky()
    lights: tuple[AnyLight, ...] = ()
    ground: Ground | None = None
    floor: float | None = None  # metres: the ground is at most this high, where something moves
    finish: Finish = Finish()
    blend: BlendScene | None = None
