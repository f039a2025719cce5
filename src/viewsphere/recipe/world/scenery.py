"""The surroundings of a recipe's targets: a place, distractors (`company`), and billboards (`planes`)."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import FARTHEST, Length, Number, Portion
from viewsphere.model.fields.omit_none import OmitNone
from viewsphere.model.model_spec import Axis
from viewsphere.plugins import prefix_of
from viewsphere.plugins.place import PlaceSpec
from viewsphere.plugins.source import place_of, with_roads
from viewsphere.recipe.draws import CountDrawn, CountOrNone, Drawn, is_random, span
from viewsphere.recipe.models import Unit
from viewsphere.recipe.values import Interval, OrShort, Point
from viewsphere.recipe.world.layout import LAYOUT, ORIENTATION, Layout, Orientation, Spot, placer_of, spots_of
from viewsphere.recipe.world.motion import MOTION, MotionField, MotionsField
from viewsphere.validation.errors import shown

Draw = Literal["fixed", "per_model", "per_sequence", "per_frame"]
Labels = Literal["background", "own"]

DRAWS = "one for the whole data set (fixed), one a model (per_model), a sequence (per_sequence) or a frame (per_frame)"
LABELS = "background, or own: every piece is an object with a category, boxes and a mask"
OF_FILES = ("origin", "up", "forward", "unit", "category")


class PlaceEntry(OmitNone):
    """The place around the targets."""

    OMIT_IF_NONE = ("parked", "walkers", "motion")

    source: str = Field(min_length=1, description="a place, such as zoo:neighbourhood, or a model file")
    draw: Draw = Field(default="fixed", description=f"for a place of a source, and turn: {DRAWS}")
    labels: Labels = Field(default="background", description=LABELS)
    turn: Drawn[Number] = Field(
        default=0.0, description="rotation of the place about the vertical through the targets, degrees"
    )
    origin: Point = Field(default=(0.0, 0.0, 0.0), description="for a file: the point where the targets stand, metres")
    up: Axis | None = Field(default=None, description="for a file: its axis that points up; by default the format's")
    forward: Axis | None = Field(default=None, description="for a file: its axis that becomes -Y")
    unit: Unit | None = Field(default=None, description="for a file: m, cm, mm, in, ft or the metres in one unit")
    category: str = Field(default="", max_length=200, description="for a file with labels: own")
    parked: Drawn[Portion] | None = Field(
        default=None,
        description="for a place with roads: share of parking bays and driveways with a car; default: 0.4 in zoo:town, 0 in "
        "zoo:neighbourhood",
    )
    walkers: CountOrNone | None = Field(
        default=None, description="for a place with roads: number of people on its pavements; default: 0"
    )
    motion: Annotated[dict[Annotated[str, Field(min_length=1)], MotionsField], Field(min_length=1)] | None = Field(
        default=None,
        description="motion of its pieces under time, by patterns of their names: {tree_*: {kind: oscillate, ...}}",
    )

    @property
    def prefix(self) -> str:
        """The prefix of the place's source; empty for a file."""
        return prefix_of(self.source)

    @property
    def is_room(self) -> bool:
        """True if it is an indoor place of a source."""
        place = self._spec
        return place is not None and place.indoors

    @property
    def has_roads(self) -> bool:
        """True for a place of a source that has roads."""
        place = self._spec
        return place is not None and place.roads

    @property
    def _spec(self) -> PlaceSpec | None:
        return place_of(self.source)

    @model_validator(mode="after")
    def _check_traffic(self) -> PlaceEntry:
        given = [name for name in ("parked", "walkers") if getattr(self, name) is not None]
        if given and not self.has_roads:
            raise ValueError(
                f"`{given[0]}` needs a place with roads, and {self.source} has none. Use {with_roads()}, or remove `{given[0]}`"
            )
        return self

    @model_validator(mode="after")
    def _check(self) -> PlaceEntry:
        if self.prefix:
            given = [name for name in OF_FILES if getattr(self, name) != type(self).model_fields[name].default]
            if given:
                raise ValueError(f"expected a file beside {given[0]}; found {self.source!r}")
            if (self.labels, self.draw) == ("own", "per_frame"):
                raise ValueError(
                    "expected draw: fixed or per_model beside labels: own, for which every piece is kept as a model; "
                    "found per_frame"
                )
        elif self.draw != "fixed" and not is_random(self.turn):
            raise ValueError(f"expected draw: fixed for a file, which is always the same; found {self.draw}")
        elif (self.labels == "own") != bool(self.category):
            raise ValueError("expected category and labels: own together, for a file; found one of them")
        return self


class CompanyEntry(OmitNone):
    """Other models of the recipe, of the same split, next to the model of each frame."""

    OMIT_IF_NONE = ("motion",)

    count: CountDrawn | None = Field(
        default=None, description="number of models, a number, [low, high] or a distribution; not needed if layout is a list"
    )
    layout: Layout = Field(default="scatter", description=LAYOUT)
    gap: Annotated[Number, Field(ge=0)] = Field(default=0.3, description="least distance between two of them, metres")
    draw: Draw = Field(default="per_model", description=f"when number, models and places are drawn: {DRAWS}")
    orientation: Orientation = Field(default="upright", description=ORIENTATION)
    motion: MotionField = Field(default=None, description=f"{MOTION}; for distractors")

    @model_validator(mode="after")
    def _check(self) -> CompanyEntry:
        listed = len(self.spots) or None
        if self.count is None and listed is None:
            raise ValueError("expected count, or a layout that lists where each stands; found neither")
        if self.count is not None and listed is not None and self.count != listed:
            raise ValueError(f"expected count {listed}, as many as the layout lists; found {self.count}")
        return self

    @property
    def number(self) -> int:
        """Number of distractors; if it is random, the largest."""
        return int(span(self.count)[1]) if self.count is not None else len(self.spots)

    @property
    def placer(self) -> str:
        """Name of the placer that places the distractors."""
        return placer_of(self.layout)

    @property
    def spots(self) -> tuple[Spot, ...]:
        """The listed spots of the distractors; empty if a placer chooses them."""
        return spots_of(self.layout)


class Around(Frozen):
    """A random position of a plane around the origin, facing it."""

    distance: Interval = Field(description="metres from the origin")
    azimuth: Interval = Field(
        default=(0.0, 360.0), description="direction from the origin, degrees, as for cameras; 180 is behind the model"
    )

    @model_validator(mode="after")
    def _check(self) -> Around:
        if self.distance[0] <= 0 or self.distance[1] > FARTHEST:
            raise ValueError(f"expected distances above 0 and up to {FARTHEST:g}; found {shown(self.distance)}")
        return self


class PlaneEntry(Frozen):
    """Upright planes with pictures."""

    image: str | None = Field(default=None, min_length=1, description="path of a picture")
    images: str | None = Field(default=None, min_length=1, description="folder of pictures to draw from")
    height: Length = Field(description="metres; the width follows from the picture")
    at: Spot | None = Field(default=None, description="[x, y, azimuth in degrees that the picture faces]")
    around: Around | None = Field(default=None, description="or a random position around the origin: {distance, azimuth}")
    count: CountDrawn = Field(default=1, description="number of planes, a number, [low, high] or a distribution")
    share: Annotated[Number, Field(ge=0, le=1)] = Field(default=1.0, description="chance of each plane to appear")
    draw: Draw = Field(default="fixed", description=f"when picture, presence and position are drawn: {DRAWS}")
    labels: Labels = Field(default="background", description=LABELS)
    category: str = Field(default="", max_length=200, description="with labels: own")

    @model_validator(mode="after")
    def _check(self) -> PlaneEntry:
        if (self.image is None) == (self.images is None):
            raise ValueError(f"expected one of image, images; found {'none' if self.image is None else 'both'}")
        if (self.at is None) == (self.around is None):
            raise ValueError(f"expected one of at, around; found {'none' if self.at is None else 'both'}")
        if self.at is not None and self.most > 1:
            raise ValueError(f"expected around beside count {self.most}: planes cannot all stand at one spot")
        if (self.labels == "own") != bool(self.category):
            raise ValueError("expected category and labels: own together; found one of them")
        return self

    @property
    def most(self) -> int:
        """Largest number of planes at once."""
        return int(span(self.count)[1])


def _place(value: Any) -> Any:
    return {"source": value} if isinstance(value, str) else value


def _company(value: Any) -> Any:
    is_count = isinstance(value, (int, float, list, tuple)) and not isinstance(value, bool)
    return {"count": value} if is_count else value


def _planes(value: Any) -> Any:
    return [value] if isinstance(value, (dict, PlaneEntry)) else value


PlaceField = Annotated[PlaceEntry | None, BeforeValidator(_place), OrShort({"type": "string"})]
CompanyField = Annotated[CompanyEntry | None, BeforeValidator(_company), OrShort({"type": "integer", "minimum": 1})]
PlanesField = Annotated[tuple[PlaneEntry, ...], BeforeValidator(_planes)]
