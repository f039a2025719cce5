"""Sequences for the page: the played instants, with the points and positions in each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from viewsphere.geometry.rotation import rigid
from viewsphere.labels import Extent, channel_labels
from viewsphere.labels.tracks import colors_of, positions
from viewsphere.model.sample import Sample
from viewsphere.report.unknown import number, numbers
from viewsphere.store.samples.films import Film

MOST_INSTANTS = 60
"""Maximum number of a played sequence's instants, evenly spaced."""

MOST_POINTS = 400
"""Maximum number of a picture's shown tracks, evenly spread."""

PROBES = 8
"""Number of instants that determine the value range of a sequence's pictures."""

SCALED = ("flow", "disparity")
"""Layers whose colours have the same meaning throughout a sequence."""

Extents = dict[str, Extent]


def played(films: Sequence[Film], frames: int) -> list[Film]:
    """Sequences spread evenly over the data set, with evenly spaced instants and at most this many frames in total. Each
    sequence has at least two instants.
    """
    if not films:
        return []
    instants = min(MOST_INSTANTS, max(len(film.instants) for film in films))
    sensors = max(len(film.sensors) for film in films)
    number = min(len(films), max(1, frames // (instants * sensors)))
    each = max(2, min(instants, frames // (number * sensors)))
    chosen = [films[i] for i in np.unique(np.linspace(0, len(films) - 1, number).round().astype(int))]
    return [_thinned(film, each) for film in chosen]


def _thinned(film: Film, count: int) -> Film:
    kept = film.spread(count)
    return replace(
        film,
        instants=tuple(film.instants[i] for i in kept),
        times=tuple(film.times[i] for i in kept),
        places=tuple(film.places[i] for i in kept),
    )


def sequence_data(film: Film, positions: Sequence[int], whole: int) -> dict[str, Any]:
    """A sequence: sensors, times in seconds, and for each instant the numbers of the shown frames; `positions` of the shown
    frames in the data set ascend, and `whole` is how many instants the sequence has.
    """
    row = {position: i for i, position in enumerate(positions)}
    return {
        "name": film.sequence,
        "sensors": list(film.sensors),
        "instants": list(film.instants),
        "times": [number(time) for time in film.times],
        "seconds": [number(seconds) for seconds in film.shown_for],
        "whole": whole,
        "frames": [[row[place] for place in places] for places in film.places],
    }


def extents_of(samples: Sequence[Sample], film: Film) -> Extents:
    """Return the value ranges of a sequence's layers, by their names."""
    known, found = channel_labels(), dict[str, list[Extent]]()
    for i in film.spread(PROBES):
        for sample in (samples[place] for place in film.places[i]):
            for name in SCALED:
                drawing = known[name].drawing
                if name in sample.channels and drawing and drawing.extent:
                    found.setdefault(name, []).append(drawing.extent(sample))
    return {name: (min(low for low, _ in pairs), max(high for _, high in pairs)) for name, pairs in found.items()}


def moment_data(sample: Sample) -> dict[str, Any]:
    """The place of a sample in its sequence, and the positions of its camera, objects and points; empty for a still picture."""
    if not sample.sequence:
        return {}
    return {
        "sequence": sample.sequence,
        "sensor": sample.sensor,
        "instant": sample.instant,
        "time": number(sample.time),
        "worldFromCamera": _pose(sample),
        "boxes": [None if not o.is_placed else numbers(np.round(o.box3d, 3).ravel()) for o in sample.objects],
        **_points(sample),
    }


def _pose(sample: Sample) -> list[float | None] | None:
    """The camera's pose, rows of (3, 4)."""
    camera = sample.known_camera
    return None if camera is None else numbers(np.linalg.inv(rigid(camera.R, camera.t))[:3].ravel())


def _points(sample: Sample) -> dict[str, Any]:
    """Points as x, y in tenths of pixels and state, one after another (x null where it has no pixel), and their colours."""
    if "tracks" not in sample.channels or sample.known_camera is None:
        return {}
    rows = sample.channels["tracks"]
    kept = np.unique(np.linspace(0, len(rows) - 1, min(len(rows), MOST_POINTS)).round().astype(int))
    places, colors = positions(sample), colors_of(rows, sample.width, sample.height)
    points: list[int | None] = []
    for i in kept:
        known = bool(np.isfinite(places[i]).all()) and float(np.abs(places[i]).max()) < 1e5
        x, y = np.round(10 * places[i]).astype(int).tolist() if known else (None, None)
        points += [x, y, int(rows["state"][i])]
    return {"points": points, "pointColors": [f"#{bytes(colors[i]).hex()}" for i in kept]}
