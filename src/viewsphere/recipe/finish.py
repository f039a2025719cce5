"""How the light of a recipe's scene becomes a picture: background, smoother, view, effects; and the camera's jitter."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from viewsphere.model.frozen import Frozen
from viewsphere.model.scene import Background, Smoother, View
from viewsphere.recipe.draws import (
    Coordinate,
    Distribution,
    Drawn,
    Length,
    PointDrawn,
    Portion,
    Signed,
    SrgbDrawn,
    is_drawn_color,
    is_random,
)
from viewsphere.recipe.scenery import Draw
from viewsphere.recipe.surface import Picture
from viewsphere.recipe.values import COLOR_FORMS, OrShort, parse_color

_BACKGROUND, _SMOOTHER, _VIEW = Background(), Smoother(), View()

Fit = Literal["cover", "stretch", "crop"]
Kernel = Literal["none", "box", "gaussian", "poisson"]
Transform = Literal["standard", "filmic", "agx", "raw"]

WORDS = ("sky", "environment", "transparent")
SOURCES = ("color", "image", "images", "environment", "transparent")
OF_IMAGES = ("fit", "zoom", "place", "flip", "blur")


class PerFrame(Frozen):
    """What may be drawn anew for every frame at no cost."""

    draw: Draw = Field(
        default="per_frame",
        description="what is drawn in it: once for the whole data set (fixed), once a model (per_model) or a frame (per_frame)",
    )


class BackgroundEntry(PerFrame):
    """What is seen where nothing else is; the sky when nothing is given."""

    color: SrgbDrawn | None = Field(default=None, description="a plain colour")
    image: Drawn[Picture] | None = Field(default=None, description="path of an image")
    images: Picture | None = Field(default=None, description="folder of images to draw from")
    environment: bool = Field(
        default=False, strict=True, description="true: the sky, below the horizon too; ground: auto is then a catcher"
    )
    transparent: bool = Field(
        default=False, strict=True, description="true: nothing; the channel rgb becomes rgba, red, green, blue and alpha"
    )
    fit: Drawn[Fit] = Field(
        default=_BACKGROUND.fit,
        description="of an image: cover (its largest centred part of the frame's proportions), stretch, or crop (a part)",
    )
    zoom: Drawn[Annotated[float, Field(strict=True, ge=1, le=100)]] = Field(
        default=_BACKGROUND.zoom, description="fit: crop: how many times smaller than the largest part"
    )
    place: Drawn[tuple[Drawn[Portion], Drawn[Portion]]] = Field(
        default=_BACKGROUND.place, description="fit: crop: [x, y], 0 to 1 of the room there is, from the left and the top"
    )
    flip: Drawn[Annotated[bool, Field(strict=True)]] = Field(default=False, description="whether an image is mirrored")
    blur: Drawn[Portion] = Field(default=0.0, description="of an image: a Gaussian's sigma, as a share of the frame's width")

    @model_validator(mode="after")
    def _one(self) -> BackgroundEntry:
        given = [name for name in SOURCES if getattr(self, name)]
        if len(given) > 1:
            raise ValueError(f"expected one of {', '.join(SOURCES)}; found {' and '.join(given)}")
        if self.draw == "fixed" and self.images is None and not is_random(self):
            raise ValueError("expected images beside draw: fixed; found none")
        changed = [name for name in OF_IMAGES if getattr(self, name) != type(self).model_fields[name].default]
        if changed and self.image is None and self.images is None:
            raise ValueError(f"expected image or images beside {changed[0]}; found none")
        if self.fit in ("cover", "stretch") and not {"zoom", "place"}.isdisjoint(changed):
            raise ValueError(f"expected fit: crop beside zoom and place; found fit: {self.fit}")
        return self

    @property
    def is_sky(self) -> bool:
        """Whether the sky is the background."""
        return not any(getattr(self, name) for name in SOURCES if name != "environment")


def _background(value: Any) -> Any:
    if is_drawn_color(value):
        return {"color": value}
    if isinstance(value, (dict, BackgroundEntry)):
        return value
    if value in WORDS:
        return {} if value == "sky" else {value: True}
    return {"color": parse_color(value, "sky, environment, transparent, a mapping of image or images, ", WORDS)}


BackgroundField = Annotated[
    BackgroundEntry,
    BeforeValidator(_background),
    OrShort({"enum": [*WORDS]}, *COLOR_FORMS),
]


class SmootherEntry(PerFrame):
    """What is done to the border between the targets and their background."""

    kind: Drawn[Kernel] = Field(default=_SMOOTHER.kind, description="none, box, gaussian or poisson")
    size: Drawn[Annotated[float, Field(strict=True, gt=0, le=50)]] = Field(
        default=_SMOOTHER.size, description="pixels: half the box' side, or the Gaussian's sigma"
    )


class ViewEntry(PerFrame):
    """From light to a picture."""

    exposure: Drawn[Annotated[float, Field(strict=True, ge=-16, le=16)]] = Field(
        default=_VIEW.exposure, description="stops: 1 is twice as bright"
    )
    temperature_k: Drawn[Annotated[float, Field(strict=True, ge=1500, le=20000)]] = Field(
        default=_VIEW.temperature_k, description="colour temperature of the light that shall look white; 6500 changes nothing"
    )
    tint: Drawn[Signed] = Field(default=_VIEW.tint, description="-1 to 1: green to magenta")
    transform: Drawn[Transform] = Field(default=_VIEW.transform, description="standard, filmic, agx or raw")


class EffectsEntry(PerFrame):
    """What a camera does to its picture; strengths are 0 (nothing) to 1 (as much as ever makes sense)."""

    blur: Drawn[Portion] = Field(default=0.0, description="out of focus: a Gaussian")
    motion_blur: Drawn[Portion] = Field(default=0.0, description="the camera moves")
    motion_angle_deg: Coordinate = Field(default=0.0, description="which way: counter-clockwise from the right")
    depth_of_field: Drawn[Portion] = Field(default=0.0, description="what is nearer or farther than focus is blurred")
    focus: Drawn[Length] | None = Field(default=None, description="metres; default: what the camera looks at")
    vignetting: Drawn[Portion] = Field(default=0.0, description="darker corners")
    chromatic_aberration: Drawn[Portion] = Field(default=0.0, description="coloured edges towards the corners")
    brightness: Drawn[Signed] = Field(default=0.0, description="-1 to 1")
    contrast: Drawn[Signed] = Field(default=0.0, description="-1 to 1")
    saturation: Drawn[Signed] = Field(default=0.0, description="-1 (grey) to 1")
    hue: Drawn[Signed] = Field(default=0.0, description="-1 to 1: 1 turns colours half way round")
    edge_highlight: Drawn[Portion] = Field(default=0.0, description="brighter edges")
    shot_noise: Drawn[Portion] = Field(default=0.0, description="noise of the light, more where it is bright")
    read_noise: Drawn[Portion] = Field(default=0.0, description="noise of the sensor, everywhere alike")
    jpeg: Drawn[Portion] = Field(default=0.0, description="traces of compression")

    @property
    def is_noisy(self) -> bool:
        """Whether there may be noise, which is another in every frame."""
        return any(isinstance(value, Distribution) or value > 0 for value in (self.shot_noise, self.read_noise))


class JitterEntry(PerFrame):
    """What is added to the numbers of every viewpoint."""

    azimuth_deg: Coordinate = Field(default=0.0, description="degrees")
    elevation_deg: Coordinate = Field(default=0.0, description="degrees, not beyond the poles")
    distance: Drawn[Annotated[float, Field(strict=True, ge=-0.9, le=10)]] = Field(
        default=0.0, description="as a share: 0.1 is a tenth farther away"
    )
    tilt_deg: Coordinate = Field(default=0.0, description="degrees")
    target: PointDrawn = Field(default=(0.0, 0.0, 0.0), description="metres, [x, y, z]: added to what the camera looks at")


def _of(name: str) -> BeforeValidator:
    return BeforeValidator(lambda value: {name: value} if isinstance(value, str) else value)


SmootherField = Annotated[SmootherEntry, _of("kind"), OrShort({"enum": ["none", "box", "gaussian", "poisson"]})]
ViewField = Annotated[ViewEntry, _of("transform"), OrShort({"enum": ["standard", "filmic", "agx", "raw"]})]
