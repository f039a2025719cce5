"""A report's numbers, counted over all frames, as plain data."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.report.table import FrameTable
from viewsphere.report.unknown import number, numbers
from viewsphere.store import Dataset

_WIDTHS = (30.0, 24.0, 22.5, 20.0, 18.0, 15.0, 12.0, 10.0, 9.0, 7.5, 6.0, 5.0)
"""Widths that a cell may have, degrees; each divides a full turn."""

_FREE = 10.0
"""Cell width for viewpoints that are not on a grid, degrees."""

_PER_DEGREE = 2
"""Steps per degree to which viewpoints are rounded before the search for a grid."""

BINS = 24
"""Approximate number of bins in a histogram."""

HUES = 6
"""Number of categories with their own colour; all others share a grey."""

UNNAMED = "unknown"


def summary(dataset: Dataset, table: FrameTable) -> dict[str, Any]:
    """Counts, categories, splits, models, pose bins, sphere cells and distributions of all finished frames."""
    frames, objects = table.frames, table.objects
    categories = _categories(dataset, table)
    sizes = Counter(zip(frames["width"].tolist(), frames["height"].tolist(), strict=True)) - Counter({(0, 0): len(frames)})
    return {
        "frames": len(frames),
        "planned": dataset.plan.frames,
        "objects": len(objects),
        "seen": int(objects["seen"].sum()),
        "empty": int((frames["seen"] == 0).sum()),
        "sizes": [[w, h, n] for (w, h), n in sizes.most_common(3)],
        "categories": categories,
        "splits": _splits(dataset, table),
        "models": _models(dataset, table),
        "poses": _pose_bins(table),
        "cameras": asdict(sphere_cells(frames["azimuth"], frames["elevation"])),
        "views": asdict(sphere_cells(objects["azimuth"], objects["elevation"])),
        "distances": _distances(frames["distance"]),
        "distributions": _distributions(table, [c["id"] for c in categories]),
    }


def hues(counts: Sequence[tuple[int, int]]) -> dict[int, int]:
    """The number of each category id's colour, from (id, objects): the most frequent get 0 to 5 in order of ids, others -1."""
    ranked = sorted(counts, key=lambda c: (-c[1], c[0]))[:HUES]
    colored = sorted(identifier for identifier, _ in ranked)
    return {identifier: colored.index(identifier) if identifier in colored else -1 for identifier, _ in counts}


def _categories(dataset: Dataset, table: FrameTable) -> list[dict[str, Any]]:
    objects = table.objects
    placed = Counter(objects["category"].tolist())
    seen = Counter(objects["category"][objects["seen"]].tolist())
    pairs = objects["frame"].astype(np.int64) << 32 | objects["category"]  # one number sorts far faster than a record of two
    in_frames = Counter((np.unique(pairs) & 0xFFFFFFFF).tolist())
    colors = hues([(c.id, placed[c.id]) for c in dataset.categories])
    return [
        {
            "id": c.id,
            "name": c.name,
            "supercategory": c.supercategory,
            "objects": placed[c.id],
            "seen": seen[c.id],
            "frames": in_frames[c.id],
            "hue": colors[c.id],
        }
        for c in dataset.categories
    ]


def _splits(dataset: Dataset, table: FrameTable) -> list[dict[str, Any]]:
    counts = np.bincount(table.frames["split"], minlength=len(table.splits)).tolist()
    counts_by_split = dict(zip(table.splits, counts, strict=True))
    names = dict.fromkeys((*dataset.splits, *table.splits))
    return [{"name": name, "frames": counts_by_split.get(name, 0)} for name in names]


def _models(dataset: Dataset, table: FrameTable) -> list[dict[str, Any]]:
    counts = np.bincount(table.objects["model"], minlength=len(table.models)).tolist()
    counts_by_model = dict(zip(table.models, counts, strict=True))
    return [
        {
            "key": info.key,
            "category": info.category_id,
            "objects": counts_by_model.get(info.key, 0),
            "triangles": info.triangles,
            "size": numbers(info.size),
            "parts": len(info.parts),
        }
        for info in dataset.models
    ]


def _pose_bins(table: FrameTable) -> list[dict[str, Any]]:
    counts = np.bincount(table.objects["pose"], minlength=len(table.poses)).tolist()
    rows = [{"name": name or UNNAMED, "objects": count} for name, count in zip(table.poses, counts, strict=True)]
    return sorted(rows, key=lambda row: (-row["objects"], row["name"]))


def _distances(distance: NDArray[np.float32]) -> dict[str, Any]:
    known = distance[np.isfinite(distance)]
    edges = nice_edges(known)
    return {"edges": numbers(edges), "counts": _histogram(known, edges)}


def _distributions(table: FrameTable, categories: Sequence[int]) -> list[dict[str, Any]]:
    objects = table.objects
    share = np.linspace(0, 1, 21)
    rows = (
        ("side", "Size of the 2D box", "px, side of a square of its area", None),
        ("visibility", "Visible share", "of the object's own pixels", share),
        ("truncation", "Truncated share", "outside the image", share),
        ("distance", "Distance", "m, camera to box centre", None),
    )
    distributions: list[dict[str, Any]] = []
    for name, title, unit, fixed in rows:
        values = objects[name]
        known = np.isfinite(values)
        edges = nice_edges(values[known]) if fixed is None else fixed
        series = [_histogram(values[known & (objects["category"] == c)], edges) for c in categories]
        distributions.append(
            {
                "name": name,
                "title": title,
                "unit": unit,
                "share": fixed is not None,
                "edges": numbers(edges),
                "series": series,
                "known": int(known.sum()),
                "median": number(float(np.median(values[known]))) if known.any() else None,
            }
        )
    return distributions


def _histogram(values: NDArray[np.float32], edges: NDArray[np.float64]) -> list[int]:
    return np.histogram(values.astype(np.float64).round(5), edges)[0].tolist() if len(edges) > 1 else []


def nice_edges(values: NDArray[np.floating], bins: int = BINS) -> NDArray[np.float64]:
    """Edges of about `bins` equal bins at round numbers that contain all values; empty if there are no values.

    A single value lies in the middle of three bins: it is drawn as one bar, not as a block from end to end.
    """
    if not len(values):
        return np.zeros(0)
    low, high = round(float(values.min()), 5), round(float(values.max()), 5)
    if low == high:
        step = max(0.1 * abs(high), 1e-3)
        return np.round(high + step * np.arange(-1.5, 2), 12).astype(np.float64)
    spread = max(high - low, 0.02 * abs(high), 1e-6)
    power = 10.0 ** math.floor(math.log10(spread / bins))
    step = next(power * k for k in (1, 2, 2.5, 5, 10) if power * k >= spread / bins * (1 - 1e-9))
    first, last = math.floor(low / step + 1e-6), math.floor(high / step + 1e-6) + 1
    return np.round(np.arange(first, last + 1, dtype=np.float64) * step, 12).astype(np.float64)


@dataclass(frozen=True)
class _Cells:
    """Cells on the sphere: `azimuth` and `elevation` are (first edge, width) in degrees.

    `occupied` holds (column, row, frames): a cell spans the azimuths from first edge + column * width on, one width, and the
    elevations likewise, within -90 and 90.
    """

    azimuth: tuple[float, float]
    elevation: tuple[float, float]
    occupied: tuple[tuple[int, int, int], ...]


def sphere_cells(azimuth_deg: NDArray[np.floating], elevation_deg: NDArray[np.floating]) -> _Cells:
    """Count viewpoints in cells that fit them: centred on a grid's steps where they lie on one, else 10 degrees wide.

    So a regular grid fills its cells evenly, and the cells add no pattern of their own. Viewpoints that are NaN are left out.
    """
    known = np.isfinite(azimuth_deg) & np.isfinite(elevation_deg)
    azimuth = np.round(azimuth_deg[known].astype(np.float64), 4) % 360
    elevation = np.round(elevation_deg[known].astype(np.float64), 4)
    first_azimuth, width = _edges(azimuth, 360.0)
    first_elevation, height = _edges(elevation, 0.0)
    columns = np.floor(np.round((azimuth - first_azimuth) % 360 / width, 6)).astype(int) % round(360 / width)
    rows = np.floor(np.round((elevation - first_elevation) / height, 6)).astype(int)
    lowest = rows.min(initial=0)
    height_in_rows = rows.max(initial=0) - lowest + 1
    cells, counts = np.unique(columns * height_in_rows + rows - lowest, return_counts=True)
    found = zip(*np.divmod(cells, height_in_rows), counts, strict=True)
    occupied = tuple((int(column), int(row + lowest), int(count)) for column, row, count in found)
    return _Cells((first_azimuth, width), (first_elevation, height), occupied)


def _edges(degrees: NDArray[np.float64], turn: float) -> tuple[float, float]:
    """First edge and width of the cells of one coordinate; `turn` is 360 for azimuth, which comes round, else 0."""
    values = np.unique(np.round(degrees * _PER_DEGREE).astype(int))
    step = math.gcd(*np.diff(values).tolist(), int(turn * _PER_DEGREE)) / _PER_DEGREE if len(values) else 0.0
    # A single elevation has no step.
    fitting = [w for w in _WIDTHS if step == 0 or math.isclose(step / w, round(step / w))] if len(values) else []
    if not fitting or (step and step < _WIDTHS[-1]):
        return (0.0 if turn else -90.0), _FREE
    width = _FREE if step == 0 else fitting[0]
    first = float(values[0]) / _PER_DEGREE - width / 2
    return first, width
