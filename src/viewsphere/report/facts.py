"""The origin of a data set: its recipe, versions, and the times at which its frames were made."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from typing import Any

import numpy as np

from viewsphere.report.paths import only_names
from viewsphere.store import Dataset, Part

PAUSE = 600.0
"""Seconds without a finished shot that count as a break between two runs."""


@dataclass(frozen=True)
class _Timing:
    """The times at which frames were finished, from the times of their files.

    `first` and `last` are in ISO 8601 (UTC). `seconds` is the working time between them, without breaks; `frames` were finished
    in this time; `runs` is the number of runs.
    """

    first: str
    last: str
    seconds: float
    frames: int
    runs: int


def finished(dataset: Dataset) -> list[tuple[float, int]]:
    """Return the time at which each finished shot was written, in seconds since 1970, and its number of frames."""
    moments: list[tuple[float, int]] = []
    for row in dataset.rows:
        try:
            moments.append(((dataset.store.shot_folder(row.key) / "frames.json").stat().st_mtime, row.count))
        except OSError:
            continue
    return moments


def _timing(found: list[tuple[float, int]]) -> _Timing | None:
    """Return the times at which shots were written, from the result of `finished`; None if no shot is finished."""
    if not found:
        return None
    found = sorted(found)
    times, counts = np.array([t for t, _ in found]), np.array([n for _, n in found])
    gaps = np.diff(times)
    working = gaps < PAUSE
    return _Timing(
        first=_iso(times[0]),
        last=_iso(times[-1]),
        seconds=round(float(gaps[working].sum()), 3),
        frames=int(counts[1:][working].sum()),
        runs=int((~working).sum()) + 1,
    )


def facts(dataset: Dataset, times: list[tuple[float, int]]) -> dict[str, Any]:
    """Recipe (YAML), plan, versions, timing (from what `finished` gives) and the folder's name, as plain data."""
    plan = dataset.plan
    rendering = _timing(times)
    return {
        "name": dataset.name,
        "folder": dataset.root.resolve().name,
        "recipe": "\n".join(_recipe(part) for part in plan.parts),
        "digest": plan.digest,
        "madeBy": plan.version,
        "reportBy": version("viewsphere"),
        "reported": _iso(datetime.now(UTC).timestamp()),
        "channels": list(plan.channels),
        "poses": plan.poses,
        "plannedModels": len(plan.models),
        "leftOut": dataset.store.skipped(),
        "warnings": {info.key: list(info.warnings) for info in dataset.models if info.warnings},
        "exports": sorted(p.name for p in dataset.root.iterdir() if p.is_dir() and p.name != "store"),
        "timing": None if rendering is None else rendering.__dict__,
    }


def _recipe(part: Part) -> str:
    """The recipe of a part as YAML, after a line with the frames that the part added."""
    import yaml

    frames = f"{part.frames:,} frames from {part.first:,}" if part.frames else "no frames of its own"
    text = yaml.safe_dump(only_names(part.recipe), sort_keys=False, allow_unicode=True, width=100)
    return f"# {part.name}: {frames}, made by viewsphere {part.version}\n{text}"


def _iso(seconds: float) -> str:
    return datetime.fromtimestamp(float(seconds), UTC).isoformat(timespec="seconds")
