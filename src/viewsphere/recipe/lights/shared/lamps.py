"""Fields of lamps: strength and colour, a place, a direction."""

from __future__ import annotations

import math
from typing import Annotated, Any, cast

from pydantic import Field, model_validator

from viewsphere.geometry.camera import orbit_center
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Length, Natural
from viewsphere.model.scene import AimedLight, Light, PlacedLight, Vector
from viewsphere.recipe.draws import Coordinate, Drawn, alternatives, is_random
from viewsphere.recipe.entries import concrete, entry_of
from viewsphere.validation.errors import error_at, shown


class At(Frozen):
    """A position given by a direction and a distance, as for cameras."""

    azimuth: Coordinate = Field(default=0.0, description="degrees, as for cameras")
    elevation: Drawn[Annotated[float, Field(strict=True, ge=-90, le=90)]] = Field(
        default=45.0, description="degrees above the horizon"
    )
    distance: Drawn[Length] = Field(description="metres")


class Lamp(entry_of(Light)):
    """Base of all lamps."""

    count: Drawn[Annotated[Natural, Field(le=64)]] = Field(default=1, description="number of such lamps, each drawn separately")


class Placed(entry_of(PlacedLight, optional=("position",)), Lamp):
    """A lamp with a position."""

    at: At | None = Field(default=None, description="or {azimuth, elevation, distance} from there, as for cameras")

    @model_validator(mode="after")
    def _placed(self) -> Placed:
        given = [name for name in ("position", "at") if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(f"expected one of position, at; found {'both' if given else 'none'}")
        return self


class Aimed(entry_of(AimedLight), Placed):
    """A lamp with a direction, given by two positions."""

    @model_validator(mode="after")
    def _pointed(self) -> Aimed:
        places = (_standing(self.at),) if self.at is not None else tuple(alternatives(self.position))
        for place in places:
            if any(_is_one_point(place, toward) for toward in alternatives(self.toward)):
                with error_at("position" if self.at is None else "at"):
                    raise ValueError(f"the lamp is at the point it is aimed at, {shown(place)}: change this place or toward")
        return self


def _standing(at: At) -> Any:
    """The point (x, y, z) of `at`, metres; None if `at` contains distributions."""
    return None if is_random(at) else tuple(round(x, 9) + 0.0 for x in _point(at))


def _point(at: At) -> Vector:
    x, y, z = orbit_center(math.radians(at.azimuth), math.radians(at.elevation), at.distance).tolist()
    return x, y, z


def place_of(lamp: Placed) -> Vector:
    """The position (x, y, z) of a lamp without distributions, metres."""
    return lamp.position if lamp.at is None else _point(lamp.at)


def emitter(lamp: Lamp) -> Any:
    """The light of a lamp that has the same fields as the scene's light."""
    at = getattr(lamp, "at", None)
    return concrete(lamp) if at is None else concrete(lamp, position=_point(at))


def _is_one_point(a: Any, b: Any) -> bool:
    known = isinstance(a, tuple) and isinstance(b, tuple) and not is_random(a) and not is_random(b)
    return known and math.dist(cast(Vector, a), cast(Vector, b)) < 1e-6
