"""From a recipe's tracks to the points that are followed."""

from __future__ import annotations

import csv
import hashlib
import math
from collections.abc import Iterator
from pathlib import Path

from viewsphere.errors import RecipeError
from viewsphere.files import read_text, written_path
from viewsphere.model.annotations.tracks import Query, Tracks
from viewsphere.model.sensors.rig import Rig
from viewsphere.recipe.cameras.tracks import MOST_POINTS
from viewsphere.recipe.recipe import Recipe


def tracks_of(recipe: Recipe, rig: Rig) -> Tracks | None:
    """The points that every sequence's sensors follow, None if the recipe has no tracks; random ones have no seed yet.

    Raises RecipeError without a time, for instants beyond the sequences, for too many points, and for files that are unreadable
    or have a position outside a picture.
    """
    entry = recipe.tracks
    if entry is None:
        return None
    if recipe.time is None:
        raise RecipeError("tracks: expected time beside tracks, which go through sequences; found none: set time")
    count = recipe.time.count
    if entry.points is not None:
        points = tuple(_read(recipe.folder / written_path(entry.points)))
        _check_points(points, rig, count)
        return Tracks(at=tuple(sorted({at for at, _, _ in points})), points=points)
    at = tuple(range(count)) if entry.at == "each" else tuple(sorted(set(entry.at)))
    if at[-1] >= count:
        raise RecipeError(f"tracks.at: expected instants of 0 to {count - 1}, as sequences have; found {at[-1]}")
    most = max(entry.count or _grid(entry.grid or 1, *_size(rig, i)) for i in range(len(rig.sensors))) * len(at)
    if most > MOST_POINTS:
        raise RecipeError(
            f"tracks: expected at most {MOST_POINTS:,} points in a sequence; found {most:,}: ask for fewer, or less often"
        )
    return Tracks(at=at, grid=entry.grid, count=entry.count, on=entry.on)


def _size(rig: Rig, sensor: int) -> tuple[int, int]:
    return rig.sensors[sensor].intrinsics.width, rig.sensors[sensor].intrinsics.height


def _grid(step: int, width: int, height: int) -> int:
    """Number of points of a grid."""
    return math.ceil(max(width - step / 2, 0) / step) * math.ceil(max(height - step / 2, 0) / step)


def _read(path: Path) -> Iterator[Query]:
    """The queries of a CSV file; a first line of words is a heading."""
    try:
        rows = list(csv.reader(read_text(path, "MAX_TABLE_BYTES", encoding="utf-8-sig").splitlines()))
    except (OSError, ValueError, csv.Error) as error:
        problem = (error.strerror if isinstance(error, OSError) else None) or error
        raise RecipeError(f"tracks.points: {path}: expected a CSV file of instant, x, y; found: {problem}") from None
    if len(rows) > MOST_POINTS + 1:
        raise RecipeError(f"tracks.points: {path}: expected at most {MOST_POINTS:,} points; found {len(rows):,} lines")
    for number, row in enumerate(rows, 1):
        if not row or (number == 1 and row[0].strip() == "instant"):
            continue
        try:
            at, x, y = row
            yield int(at), float(x), float(y)
        except ValueError:
            found = f"{len(row)} cells" if number == 1 or len(row) != 3 else repr(",".join(row))
            raise RecipeError(
                f"tracks.points: {path}:{number}: expected instant, x, y, the first a whole number; found {found}"
            ) from None


def _check_points(points: tuple[Query, ...], rig: Rig, count: int) -> None:
    if not points:
        raise RecipeError("tracks.points: expected a point at least; found none")
    for at, x, y in points:
        if not 0 <= at < count:
            raise RecipeError(f"tracks.points: expected instants of 0 to {count - 1}, as sequences have; found {at}")
        for sensor in rig.sensors:
            width, height = sensor.intrinsics.width, sensor.intrinsics.height
            if not (0 <= x < width and 0 <= y < height):
                raise RecipeError(
                    f"tracks.points: expected positions inside the picture of {sensor.name}, {width} x {height} pixels; found "
                    f"({x:g}, {y:g})"
                )


def tracks_digest(tracks: Tracks | None) -> str:
    """SHA-256 of points listed in a file; empty if there are none."""
    listed = tracks is not None and tracks.points
    return hashlib.sha256(repr(listed).encode()).hexdigest() if listed else ""
