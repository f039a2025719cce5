"""The statements that captions make about objects in a picture, and the conditions for each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.appearance.description import words
from viewsphere.geometry.box import Bounds
from viewsphere.labels.shared.captions.english import noun_of, noun_phrase
from viewsphere.labels.shared.needs import ShotAppearance
from viewsphere.labels.shared.placement import ModelFacts
from viewsphere.model.sample import ObjectAnnotation

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import LabelContext

SEEN = 16
"""Minimum number of visible pixels for captions to mention an object, if enough of it is visible."""

MIN_VISIBILITY = 0.1
"""Default minimum `visibility` for captions to mention an object."""

LARGE, SMALL = 0.2, 0.01
"""Shares of the picture: an object counts as large from the first on, as small up to the second."""

HIDDEN = 0.3
"""Hidden share of an object's part inside the picture from which it counts as partly hidden."""

CUT = 0.1
"""`truncation` from which an object counts as partly outside the picture."""

STEEP, RAISED = 60.0, 30.0
"""Degrees of elevation: from the first an object is seen from above, from the second from a side and from above."""

NEARER = 0.9
"""Share of another object's distance up to which an object counts as nearer."""

SUNK = 0.05
"""Share of its height by which an object may reach above the lowest point of an object above it."""

BESIDE = 1.25
"""Maximum distance between the middles of neighbouring objects, as a multiple of the sum of half their diagonals."""

PLACES = (
    ("at the top left", "at the top", "at the top right"),
    ("on the left", "in the middle", "on the right"),
    ("at the bottom left", "at the bottom", "at the bottom right"),
)
SIDES = ("front", "front left", "left", "back left", "back", "back right", "right", "front right")
RELATIONS = ("to the left of", "to the right of", "in front of", "behind", "above", "below", "next to")

Words = tuple[str, str]
"""Words for colour and material; empty if there is none."""

Truths = NDArray[np.bool_]


def words_of(context: LabelContext) -> Mapping[int, Words]:
    """The words for each object's appearance in the shot, by id."""

    def all_words() -> Mapping[int, Words]:
        scenery = context.get(ShotAppearance())
        if scenery is None:
            raise ValueError("expected a sample of a shot, whose materials are known; found none")
        found = dict[int, Words]()
        for thing in scenery.shot.objects:
            place = context.placements[thing.id - 1]
            looks = place and place.facts.looks
            color, material = words(looks, thing.repaints) if looks else (None, None)
            found[thing.id] = color or "", material or ""
        return found

    return context.once("looks", all_words)


def is_told(o: ObjectAnnotation, least: float) -> bool:
    """Return whether enough of an object is visible for sentences to name it."""
    return o.box2d is not None and o.area >= SEEN and o.visibility >= least


def phrases(o: ObjectAnnotation, said: Words) -> Iterator[tuple[str, Words]]:
    """The noun phrases of an object, each with its words: none, colour, material, both."""
    noun, (color, material) = noun_of(o.category), said
    for has_material, has_color in product((False, True), repeat=2):
        if (color or not has_color) and (material or not has_material):
            own = color if has_color else "", material if has_material else ""
            yield noun_phrase(noun, *own), own


def middle_of(box: Bounds) -> tuple[float, float]:
    """The middle of a box."""
    return (box[0] + box[2]) / 2, (box[1] + box[3]) / 2


def place_of(box: Bounds, width: int, height: int) -> str:
    """Return the words for the part of a picture that contains the middle of a box."""
    x, y = middle_of(box)
    return PLACES[_third(y, height)][_third(x, width)]


def _third(value: float, size: int) -> int:
    return 0 if 3 * value < size else 2 if 3 * value > 2 * size else 1


def size_of(area: int, width: int, height: int) -> str:
    """`large` or `small` in a picture of this size; empty if neither."""
    share = area / (width * height)
    return "large" if share >= LARGE else "small" if share <= SMALL else ""


def _is_hidden(o: ObjectAnnotation) -> bool:
    """Return whether much of an object's part inside the picture is hidden."""
    return o.truncation < 1 and 1 - o.visibility / (1 - o.truncation) >= HIDDEN


def _is_cut(o: ObjectAnnotation) -> bool:
    """Return whether an object is partly outside the picture."""
    return o.truncation >= CUT


def side_of(o: ObjectAnnotation) -> str:
    """The side from which the camera sees an object, in words."""
    elevation = o.view.elevation_deg
    if abs(elevation) >= STEEP:
        return "above" if elevation > 0 else "below"
    side = f"its {SIDES[int((o.view.azimuth_deg + 22.5) // 45) % 8]}"
    if abs(elevation) < RAISED:
        return side
    return f"{side} and from {'above' if elevation > 0 else 'below'}"


def has_front(facts: ModelFacts | None) -> bool:
    """Return whether a model has a front; a model known to look the same from several sides has none."""
    known = None if facts is None else facts.symmetries
    return known is None or not (known.discrete or known.continuous)


ONE = ("place", "size", "hidden", "cut", "view")
"""Forms of sentences about a single object."""


def of_one(form: str, o: ObjectAnnotation, size: tuple[int, int], has_front: bool) -> str:
    """Return a form's statement about an object in a picture of this size; empty where the form does not apply."""
    match form:
        case "place":
            return f"is {place_of(o.box2d, *size)} of the picture" if o.box2d else ""
        case "size":
            return f"fills a {extent} part of the picture" if (extent := size_of(o.area, *size)) else ""
        case "hidden":
            return "is partly hidden" if _is_hidden(o) else ""
        case "cut":
            return "is partly outside the picture" if _is_cut(o) else ""
        case "view":
            return f"is seen from {side_of(o)}" if has_front else ""
        case _:
            return ""


@dataclass(frozen=True, eq=False)
class Company:
    """Visible objects together, with the relations between them."""

    objects: Sequence[ObjectAnnotation]

    @cached_property
    def relations(self) -> Mapping[str, Truths]:
        """For each relation a mask (N, N): True where the row's object has the relation to the column's."""
        x0, y0, x1, y1 = np.array([o.box2d for o in self.objects], np.float64).reshape(-1, 4).T
        boxes = np.array([o.box3d for o in self.objects]).reshape(-1, 8, 3)
        low, high = boxes.min(axis=1), boxes.max(axis=1)
        others = ~np.eye(len(boxes), dtype=np.bool_)
        left = (x1[:, None] <= x0) & others
        front = (self.distances[:, None] <= NEARER * self.distances) & _meet(x0, x1) & _meet(y0, y1) & others
        over = low[:, None, 2] >= high[:, 2] - SUNK * (high - low)[:, 2]
        above = over & _meet(low[:, 0], high[:, 0]) & _meet(low[:, 1], high[:, 1]) & others
        middles, halves = (boxes[:, 2] + boxes[:, 4]) / 2, _length(boxes[:, 4] - boxes[:, 2]) / 2
        near = _length(middles[:, None] - middles) <= BESIDE * (halves[:, None] + halves)
        beside = near & others & ~(front | front.T | above | above.T)
        return dict(zip(RELATIONS, (left, left.T, front, front.T, above, above.T, beside), strict=True))

    @cached_property
    def distances(self) -> NDArray[np.float64]:
        """The distances from the camera to the middles of the objects, (N,) metres."""
        return np.array([o.view.distance for o in self.objects])


def _meet(low: NDArray[np.float64], high: NDArray[np.float64]) -> Truths:
    """Return whether ranges have an interior in common, (N, N)."""
    return (low[:, None] < high) & (low < high[:, None])


def _length(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    x, y, z = np.moveaxis(vectors, -1, 0)
    return np.sqrt(x * x + y * y + z * z)
