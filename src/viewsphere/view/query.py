"""The frames that a page requests, and their order: filters and sorting over columns, without reading a record."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import UserError
from viewsphere.report.table import FrameTable
from viewsphere.view.live import Known


@dataclass(frozen=True)
class _Measure:
    """A number to filter and sort by: its name, its unit, and the column of objects, or else of frames, that holds it."""

    words: str
    unit: str
    column: str
    is_of_object: bool


MEASURES = {
    "visibility": _Measure("Visible share", "%", "visibility", True),
    "truncation": _Measure("Truncated share", "%", "truncation", True),
    "side": _Measure("Size of the 2D box", "px", "side", True),
    "distance": _Measure("Distance", "m", "distance", True),
    "azimuth": _Measure("Azimuth it is seen from", "°", "azimuth", True),
    "elevation": _Measure("Elevation it is seen from", "°", "elevation", True),
    "camera_azimuth": _Measure("Camera's azimuth", "°", "azimuth", False),
    "camera_elevation": _Measure("Camera's elevation", "°", "elevation", False),
    "camera_distance": _Measure("Camera's distance", "m", "distance", False),
    "objects": _Measure("Objects", "", "objects", False),
    "seen": _Measure("Objects seen", "", "seen", False),
}
"""The measures by the names that a page uses."""

ORDERS = ("newest", "frame", "mixed")
"""Orders other than by a measure."""

KNUTH = 2654435761
"""The golden ratio as a share of 2**32: its multiples are spread evenly."""


@dataclass(frozen=True)
class _Within:
    """A measure between two numbers, both inclusive; azimuths wrap around, from the first number up to the second."""

    measure: str
    low: float
    high: float


@dataclass(frozen=True)
class Query:
    """The conditions on frames: the split and camera apply to the frame, all others to one of its objects.

    An order is one of `ORDERS`, or a measure, descending behind a minus.
    """

    category: int | None = None
    model: str = ""
    split: str = ""
    pose: str = ""
    within: tuple[_Within, ...] = ()
    order: str = "frame"

    @property
    def needs_labels(self) -> bool:
        """Return whether it needs the columns of frames."""
        return self != Query(order=self.order) or self.order not in ORDERS

    @staticmethod
    def from_parameters(asked: Mapping[str, str]) -> Query:
        """The query from a page's parameters; raises UserError for an invalid one."""
        known = {"category", "model", "split", "pose", "order", *MEASURES}
        for name in asked.keys() - known:
            raise UserError(f"{name}: expected one of {', '.join(sorted(known))}; found another")
        order = asked.get("order", "frame")
        if order not in ORDERS and order.removeprefix("-") not in MEASURES:
            raise UserError(f"order: expected one of {', '.join((*ORDERS, *MEASURES))}; found {order!r:.100}")
        category = asked.get("category", "")
        within = tuple(_within(name, asked[name]) for name in MEASURES if name in asked)
        model, split, pose = (asked.get(name, "") for name in ("model", "split", "pose"))
        if not ((category.isascii() and category.isdecimal() and len(category) < 10) or not category):
            raise UserError(f"category: expected a category's number, found {category!r:.100}")
        return Query(int(category) if category else None, model, split, pose, within, order)

    def answer(self, known: Known) -> NDArray[np.intp]:
        """Rows of the frames that match the query, in its order."""
        table = known.table
        if not self.needs_labels:
            return _ordered(self.order, known.frames)
        frames = ~known.damaged
        if self.split:
            frames &= table.frames["split"] == _code(table.splits, self.split)
        for one in self._of_frames(True):
            frames &= _is_within(table.frames, one)
        objects = self._objects(table)
        if objects is not None:
            frames &= np.bincount(table.objects["frame"][objects], minlength=len(frames)) > 0
        rows = np.flatnonzero(frames)
        if self.order in ORDERS:
            return rows[_ordered(self.order, known.frames[: len(frames)][rows])]
        return rows[self._sorted(table, objects)[rows].argsort(kind="stable")]

    def _of_frames(self, wanted: bool) -> tuple[_Within, ...]:
        return tuple(one for one in self.within if MEASURES[one.measure].is_of_object != wanted)

    def _objects(self, table: FrameTable) -> NDArray[np.bool_] | None:
        """Return a mask of the objects that meet the conditions on objects; None if there are no such conditions."""
        objects = table.objects
        conditions: list[Callable[[], NDArray[np.bool_]]] = []
        if self.category is not None:
            conditions.append(lambda: objects["category"] == self.category)
        if self.model:
            conditions.append(lambda: objects["model"] == _code(table.models, self.model))
        if self.pose:
            conditions.append(lambda: objects["pose"] == _code(table.poses, "" if self.pose == "unknown" else self.pose))
        conditions += [partial(_is_within, objects, one) for one in self._of_frames(False)]
        if not conditions:
            return None
        met = np.ones(len(objects), bool)
        for condition in conditions:
            met &= condition()
        return met

    def _sorted(self, table: FrameTable, objects: NDArray[np.bool_] | None) -> NDArray[np.float64]:
        """Return each frame's sort key, ascending; frames without one come last.

        For a measure of objects, the key is the least value of the matching objects; after a minus sign, the greatest.
        """
        measure = MEASURES[self.order.removeprefix("-")]
        sign = -1.0 if self.order.startswith("-") else 1.0
        if not measure.is_of_object:
            values = sign * table.frames[measure.column].astype(np.float64)
            return np.where(np.isnan(values), math.inf, values)
        met = np.ones(len(table.objects), bool) if objects is None else objects
        values = sign * table.objects[measure.column][met].astype(np.float64)
        least = np.full(len(table.frames), math.inf)
        np.minimum.at(least, table.objects["frame"][met], np.where(np.isnan(values), math.inf, values))
        return least


def _is_within(rows: NDArray[Any], one: _Within) -> NDArray[np.bool_]:
    values = rows[MEASURES[one.measure].column].astype(np.float64)  # as precise as the query
    if MEASURES[one.measure].column == "azimuth":
        low, high = (free if math.isinf(end) else end for end, free in ((one.low, 0.0), (one.high, 360.0)))
        return (values - math.fmod(low, 360.0)) % 360 < high - low
    return (values >= one.low) & (values <= one.high)


def _ordered(order: str, frames: NDArray[Any]) -> NDArray[np.intp]:
    """The places of frames in one of `ORDERS`."""
    number = frames["number"]
    if order == "newest":
        return np.lexsort((number, -frames["made"]))
    return np.argsort(number if order == "frame" else number * KNUTH % 2**32, kind="stable")


def _code(names: tuple[str, ...], name: str) -> int:
    return names.index(name) if name in names else -1


def _within(name: str, text: str) -> _Within:
    low, comma, high = text.partition(",")
    if not comma:
        raise UserError(f"{name}: expected two numbers with a comma between them, found {text!r:.100}")
    return _Within(name, _number(name, low, -math.inf), _number(name, high, math.inf))


def _number(name: str, text: str, empty: float = math.nan) -> float:
    try:
        number = float(text) if text or math.isnan(empty) else empty
    except ValueError:
        number = math.nan
    if math.isnan(number):
        raise UserError(f"{name}: expected a number, found {text!r:.100}")
    return number
