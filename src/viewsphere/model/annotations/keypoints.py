"""Named points of a model."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
from itertools import chain
from typing import Annotated, TypeVar

from numpy.typing import ArrayLike
from pydantic import AfterValidator, Field, model_validator

from viewsphere.geometry.rotation import transform
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Number
from viewsphere.validation.errors import nearest, shown

MOST_POINTS = 1000
"""Points of one model."""

LONGEST_NAME = 100
"""Characters of a point's name."""


_SIDE = re.compile(r"left|right|(?<![a-z])[lr](?![a-z])", re.IGNORECASE)
_OTHER = {"left": "right", "right": "left", "l": "r", "r": "l"}


def left_and_right(names: Iterable[str]) -> tuple[Pair, ...]:
    """The pairs among names that contain left and right, as words or separate letters: `hand_left`, `LeftHand`, `hand.L`."""
    names = list(names)
    others = {name: _SIDE.sub(_turned, name) for name in names}
    is_left = {name: (side := _SIDE.search(name)) is not None and side[0].lower() in ("left", "l") for name in names}
    return tuple((name, others[name]) for name in names if is_left[name] and others[name] in others)


def _turned(side: re.Match[str]) -> str:
    side_name = side[0]
    other = _OTHER[side_name.lower()]
    return other.upper() if side_name.isupper() else other.capitalize() if side_name[0].isupper() else other


def is_name(text: str) -> bool:
    """Return whether this is a valid name of a point."""
    return 0 < len(text) <= LONGEST_NAME and text.isprintable() and text == text.strip()


def _name(text: str) -> str:
    if not is_name(text):
        raise ValueError(f"expected a name of printable text, without spaces around it; found {shown(text)}")
    return text


T = TypeVar("T")
PointName = Annotated[str, Field(min_length=1, max_length=LONGEST_NAME), AfterValidator(_name)]
Pair = tuple[PointName, PointName]
Place = tuple[Number, Number, Number]


class Keypoints(Frozen):
    """Named points in a model's own axes, metres, in order.

    `skeleton` holds lines between two points. `flips` holds the pairs that a mirror image exchanges, left before right.
    """

    points: dict[PointName, Place] = Field(min_length=1, max_length=MOST_POINTS)
    skeleton: tuple[Pair, ...] = ()
    flips: tuple[Pair, ...] = ()

    @model_validator(mode="after")
    def _check(self) -> Keypoints:
        for field, pairs in (("skeleton", self.skeleton), ("flips", self.flips)):
            for first, other in pairs:
                for name in (first, other):
                    if name not in self.points:
                        raise ValueError(
                            f"expected {field} of names in points; found {shown(name)}{nearest(name, self.points)}"
                        )
                if first == other:
                    raise ValueError(f"expected two points in each pair of {field}; found {shown(first)} twice")
        _once([frozenset(pair) for pair in self.skeleton], "line of skeleton", lambda pair: " - ".join(sorted(pair)))
        _once([*chain.from_iterable(self.flips)], "point of flips", lambda name: name)
        return self

    def only(self, names: Collection[str]) -> Keypoints | None:
        """Return the keypoints with these names, and the pairs among them; None if there are none."""
        points = {name: place for name, place in self.points.items() if name in names}
        skeleton, flips = (tuple(pair for pair in pairs if points.keys() >= {*pair}) for pairs in (self.skeleton, self.flips))
        return Keypoints(points=points, skeleton=skeleton, flips=flips) if points else None

    def moved(self, similarity: ArrayLike) -> Keypoints:
        """The same points in other axes; `similarity` (4, 4) transforms points from these axes to the others."""
        places = transform(similarity, [*self.points.values()]).tolist()
        return self.model_copy(update={"points": {name: tuple(place) for name, place in zip(self.points, places, strict=True)}})


def _once(values: list[T], what: str, words: Callable[[T], str]) -> None:
    again = next((value for i, value in enumerate(values) if value in values[:i]), None)
    if again is not None:
        raise ValueError(f"expected every {what} once; found {words(again)} again")


@dataclass(frozen=True)
class At:
    """A place in the box around a part: its centre, or the point at `where` (x, y, z), from -1 to 1 towards its sides. For an
    edge or a corner of the box, it is the part's nearest vertex. Of several `parts`, `seat_pad|seat`, the first that the model
    has is used.
    """

    parts: str
    where: Place = (0.0, 0.0, 0.0)


def sided(name: str, parts: str, where: Place = (0.0, 0.0, 0.0)) -> dict[str, At]:
    """The points `name_left` and `name_right`: `{}` in `parts` is replaced by left or right, and `where` is the place of the
    left point, at +X.
    """
    x, y, z = where
    return {f"{name}_left": At(parts.format("left"), where), f"{name}_right": At(parts.format("right"), (-x, y, z))}
