"""The server's answers: the paths that a page may request, and no others. No part of a path is ever used as a file name."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import UserError, ViewsphereError
from viewsphere.labels import channel_labels, is_shown
from viewsphere.model.channel import PASSES, PICTURES
from viewsphere.report import conventions, model_data
from viewsphere.report.facts import facts
from viewsphere.report.frames import frame_data
from viewsphere.report.page import served_page, vendor_module
from viewsphere.report.paths import without_folders
from viewsphere.report.pictures import Scale, layer, layer_names
from viewsphere.report.summary import hues, summary
from viewsphere.report.unknown import number
from viewsphere.validation.errors import one_of
from viewsphere.view.live import Live
from viewsphere.view.query import MEASURES, Query

WEB = Path(__file__).parent / "web"
VENDOR = "/vendor.js"
"""The path of the libraries."""


SMALL = Scale(400, 78, 400, quick=True)
LARGE = Scale(1600, 88, 1600)
"""The scales of the cards' pictures and of enlarged pictures."""

MOST_ROWS = 200
"""Maximum number of frames in one answer."""

RENEWED = 5.0
"""Seconds for which the counts of all frames are cached."""

PAINTERS_AT_ONCE = 4
"""Number of pictures that are made at the same time."""


@dataclass(frozen=True)
class Answer:
    """The body of a response, its media type, and the seconds for which a browser may keep it."""

    body: bytes
    kind: str = "application/json"
    keep: int = 0


Parameters = Mapping[str, str]


class Answers:
    """Answers of one data set."""

    def __init__(self, live: Live) -> None:
        self._live = live
        # The page's first lines are made in advance, because finding the labels takes a second.
        self._conventions = conventions()
        self._paths: dict[str, Callable[[Parameters], Answer]] = {
            "/": self._page,
            "/state": self._state,
            "/rows": self._rows,
            "/range": self._range,
            "/picture": self._picture,
            "/summary": self._summary,
            "/model": self._model,
            "/facts": self._facts,
            VENDOR: self._vendor,
        }
        self._found = lru_cache(maxsize=16)(self._find)
        self._painting = threading.BoundedSemaphore(PAINTERS_AT_ONCE)
        self._counting = threading.Lock()
        self._counted: tuple[int, float, bytes] | None = None

    def answer(self, path: str, asked: Parameters) -> Answer | None:
        """The answer to a path and its parameters; None for an unknown path. Raises UserError for invalid parameters."""
        known = self._paths.get(path)
        return None if known is None else known(asked)

    def _page(self, asked: Parameters) -> Answer:
        dataset = self._live.dataset
        plan = dataset.plan
        colors = hues([(category.id, 0) for category in plan.categories])
        categories = [{"id": c.id, "name": c.name, "hue": colors[c.id]} for c in plan.categories]
        data = {
            "live": {
                "measures": [{"name": name, "words": m.words, "unit": m.unit} for name, m in MEASURES.items()],
                "layers": _layer_names(plan.channels),
                "state": self._live.state(),
            },
            "facts": {"name": dataset.name, "madeBy": plan.version, "poses": plan.poses},
            "summary": {"categories": categories, "models": [], "frames": 0, "planned": plan.frames},
            "shown": [],
            "sequences": [],
            "models": [],
            "proof": None,
            **self._conventions,
        }
        return Answer(_live_page(dataset.name, data).encode(), "text/html; charset=utf-8")

    def _vendor(self, asked: Parameters) -> Answer:
        return Answer(vendor_module().encode(), "text/javascript; charset=utf-8", keep=3600)

    def _state(self, asked: Parameters) -> Answer:
        return _as_json(self._live.state())

    def _rows(self, asked: Parameters) -> Answer:
        """The frames that match a query, beginning with the first requested one. `listed` and `read` limit the frames to the
        numbers of listed frames and columns in an earlier answer.
        """
        plain = dict(asked)
        first, count = _whole(plain, "first"), _whole(plain, "count")
        known, listed, read = self._live.snapshot, _whole(plain, "listed", -1), _whole(plain, "read", -1)
        listed = len(known.frames) if listed < 0 else min(listed, len(known.frames))
        read = known.read if read < 0 else min(read, known.read)
        query = Query.from_parameters(plain)
        # Columns that a query does not need do not change it.
        searched = read if query.needs_labels else listed
        found = self._found(query, searched, read if query.needs_labels else 0)
        rows = found[first : first + min(count, MOST_ROWS)]
        return _as_json(
            {
                "total": len(found),
                "searched": searched,
                "needsLabels": query.needs_labels,
                "listed": listed,
                "read": read,
                "rows": [self._row(int(number), float(made)) for number, made in known.frames[rows].tolist()],
            }
        )

    def _find(self, query: Query, listed: int, read: int) -> NDArray[np.intp]:
        return query.answer(self._live.snapshot.first(listed, read))

    def _row(self, frame: int, made: float) -> dict[str, Any]:
        """A frame as in the report, with paths as layers; for an unreadable frame, the reason."""
        try:
            sample = self._live.sample(frame)
            plain = frame_data(sample)
        except ViewsphereError as error:
            return {"index": frame, "problem": without_folders(str(error))}
        path = f"picture?frame={frame}&at={made:.0f}&layer="
        names = layer_names(sample)
        large = {f"{name}Large": f"{path}{name}&large=1" for name in names}
        return {**plain, "made": round(made, 1), "layers": {name: path + name for name in names} | large}

    def _range(self, asked: Parameters) -> Answer:
        plain = dict(asked)
        sample, name = self._live.sample(_whole(plain, "frame")), plain.get("layer", "")
        _one_of("layer", name, layer_names(sample))
        with self._painting:
            found = layer(sample, name, SMALL).range
        return _as_json(None if found is None else [number(end) for end in found])

    def _picture(self, asked: Parameters) -> Answer:
        plain = dict(asked)
        sample, name = self._live.sample(_whole(plain, "frame")), plain.get("layer", "")
        _one_of("layer", name, layer_names(sample))
        with self._painting:
            picture = layer(sample, name, LARGE if plain.get("large") else SMALL).webp
        return Answer(picture, "image/webp", keep=3600)

    def _summary(self, asked: Parameters) -> Answer:
        known = self._live.snapshot
        with self._counting:
            if self._counted is None or (self._counted[0] != known.read and time.monotonic() - self._counted[1] > RENEWED):
                found = {**summary(self._live.dataset, known.sound), "sequences": 0, "read": known.read}
                self._counted = (known.read, time.monotonic(), _as_json(found).body)
            return Answer(self._counted[2])

    def _model(self, asked: Parameters) -> Answer:
        dataset, key = self._live.dataset, asked.get("key", "")
        info = next((info for info in dataset.models if info.key == key), None)
        if info is None:
            raise UserError(f"key: expected one of {len(dataset.models):,} models, found {key!r:.100}")
        return _as_json(model_data(dataset, info, self._live.snapshot.sound))

    def _facts(self, asked: Parameters) -> Answer:
        return _as_json(without_folders(facts(self._live.dataset, self._live.times())))


def _layer_names(channels: Sequence[str]) -> list[str]:
    """The layers that frames with these channels may have."""
    have = {*channels}
    drawn = [name for name in chain(PASSES, channel_labels()) if name in have and name not in PICTURES]
    return [*(["rgb"] if is_shown(channels) else []), *drawn]


def _as_json(value: object) -> Answer:
    return Answer(json.dumps(value, ensure_ascii=False, separators=(",", ":"), allow_nan=False).encode())


def _one_of(name: str, found: str, known: list[str]) -> None:
    if found not in known:
        raise UserError(f"{name}: {one_of(found, known)}")


def _whole(asked: dict[str, str], name: str, default: int | None = None) -> int:
    """Remove a whole number of at least 0 from the parameters and return it; raises UserError for anything else."""
    text = asked.pop(name, "")
    if not text and default is not None:
        return default
    if not (text.isascii() and text.isdecimal() and len(text) <= 18):
        raise UserError(f"{name}: expected a whole number, found {text!r:.100}")
    return int(text)


def _live_page(title: str, data: Mapping[str, Any]) -> str:
    """The whole HTML text."""
    return served_page(title, data, WEB, VENDOR)
