"""The entries that turn light into a picture: background, smoother and view; and the camera's jitter."""

from __future__ import annotations

from typing import Annotated, Any, Literal, TypeVar

from pydantic import BeforeValidator, Discriminator, Field, Tag, model_validator

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.scene import Background, Picture, Smoother, ViewTransform
from viewsphere.recipe.draws import Coordinate, Drawn, PointDrawn, is_random
from viewsphere.recipe.entries import entry_of, is_drawn_color, words_of
from viewsphere.recipe.values import COLOR_FORMS, OrShort, parse_color
from viewsphere.recipe.world.scenery import Draw

WORDS = ("sky", "environment", "transparent")
SOURCES = ("color", "image", "images", "environment", "transparent")
OF_IMAGES = tuple(name for name in Background.model_fields if name not in SOURCES)


Entry = TypeVar("Entry", bound=Frozen)


class PerFrame(Frozen):
    """Base of the entries that can be drawn for every frame at no cost."""

    draw: Draw = Field(
        default="per_frame",
        description="when it is drawn: once for the data set (fixed), once a model (per_model), a sequence (per_sequence,"
        " the default with time) or a frame (per_frame)",
    )


def once_a_sequence(entry: Entry) -> Entry:
    """The entry, drawn once a sequence if drawing for every frame is only its default."""
    is_asked = "draw" in entry.model_fields_set or getattr(entry, "draw", None) != "per_frame"
    return entry if is_asked else entry.model_copy(update={"draw": "per_sequence"})


class BackgroundEntry(entry_of(Background, optional=("color", "image"), fixed=("transparent",)), PerFrame):
    """The background behind everything; the sky by default."""

    images: Picture | None = Field(default=None, description="folder of images to draw from")
    environment: bool = Field(
        default=False, strict=True, description="true: the sky, below the horizon too; ground: auto is then a catcher"
    )

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
        """True if the sky is the background."""
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


class SmootherEntry(entry_of(Smoother), PerFrame):
    """Softening of the border between the targets and their background."""


Stops = Annotated[
    Annotated[Drawn[Annotated[float, Field(strict=True, ge=-16, le=16)]], Tag("drawn")]
    | Annotated[Literal["auto"], Tag("word")],
    Discriminator(lambda value: "word" if isinstance(value, str) else "drawn"),
]


class ViewEntry(entry_of(ViewTransform), PerFrame):
    """The conversion of light to a picture."""

    exposure: Stops = Field(  # pyright: ignore[reportIncompatibleVariableOverride]
        default="auto", description="stops: 1 is twice as bright; auto: 0, or in rooms a daylight exposure"
    )


class JitterEntry(PerFrame):
    """Random offsets added to every viewpoint."""

    azimuth: Coordinate = Field(default=0.0, description="degrees")
    elevation: Coordinate = Field(default=0.0, description="degrees, not beyond the poles")
    distance: Drawn[Annotated[float, Field(strict=True, ge=-0.9, le=10)]] = Field(
        default=0.0, description="as a share: 0.1 is a tenth farther away"
    )
    tilt: Coordinate = Field(default=0.0, description="degrees")
    target: PointDrawn = Field(default=(0.0, 0.0, 0.0), description="metres, [x, y, z]: added to the camera's target")
    off_center: Drawn[tuple[Coordinate, Coordinate]] = Field(
        default=(0.0, 0.0),
        description="[x, y]: offset of the target to the right of and below the picture's middle, as shares of the "
        "picture's width and height; 0.5 is the edge",
    )


def _of(name: str) -> BeforeValidator:
    return BeforeValidator(lambda value: {name: value} if isinstance(value, str) else value)


SmootherField = Annotated[SmootherEntry, _of("kind"), OrShort({"enum": words_of(Smoother, "kind")})]
ViewField = Annotated[ViewEntry, _of("transform"), OrShort({"enum": words_of(ViewTransform, "transform")})]
