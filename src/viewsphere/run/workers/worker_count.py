"""The number of worker processes for a run whose caller sets none."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from viewsphere.model.model_spec import ModelSpec
    from viewsphere.recipe.recipe import Recipe
    from viewsphere.run.missing import Missing

SHORT_S = 3.0
"""Seconds of work below which workers do not pay: two of them take 2 CPU-seconds to start."""

MODEL_S, MODEL_S_PER_MB = 0.2, 0.4
"""Seconds to read, measure and export a model: a zoo chair and car take 0.15 to 0.2, a 3 MB GLB 1.2."""

SHOT_S = 0.15
"""Seconds for the stage of a shot: a ground, a sky and one model take 0.1."""

FRAME_S, FRAME_S_PER_MEGAPIXEL = 0.02, 0.15
"""Seconds for a frame with all labels and files: 640 x 480 takes 0.03 to 0.06, 4K 0.9."""


def cores() -> int:
    """The number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def default_workers(work: Missing) -> int:
    """One worker per core; 0, so that this process renders, if one shot or less than SHORT_S of work is left."""
    return 0 if _is_short(work) else cores()


def _is_short(work: Missing) -> bool:
    """True if one shot or less than SHORT_S of work is left, counting the models to be made."""
    shots = sum(count for _, count in work.lines())
    seconds, models = _frame_seconds(work, shots), 0
    for cost in _model_seconds(work):
        models, seconds = models + 1, seconds + cost
        if seconds > SHORT_S and (models > 1 or shots > 1):
            return False
    return shots <= 1 or seconds <= SHORT_S


def _frame_seconds(work: Missing, shots: int) -> float:
    """Seconds for the remaining frames; infinite if the cost of a scene is unbounded, as for a place or a simulation."""
    if shots > 1 and not _is_plain(work.portion.plan.recipe):
        return float("inf")
    sensors = [sensor.intrinsics for sensor in work.portion.plan.rig.sensors]
    megapixels = sum(lens.width * lens.height for lens in sensors) / len(sensors) / 1e6
    return shots * SHOT_S + (work.total - work.resumed) * (FRAME_S + FRAME_S_PER_MEGAPIXEL * megapixels)


def _is_plain(recipe: Recipe) -> bool:
    """True if models appear alone and the raster engine paints them."""
    return recipe.engine.name == "raster" and recipe.scenes is None and not recipe.scene.is_composed


def _model_seconds(work: Missing) -> Iterator[float]:
    """Seconds for each model to be made, or to be compared with the stored one."""
    from viewsphere.plugins.source import is_versioned  # loads pydantic

    store = work.store
    for spec, steps in work.portion.models:
        is_trusted = is_versioned(spec.source) and not steps and store.model_folder(spec.key).is_dir()
        if not is_trusted:
            yield (MODEL_S + MODEL_S_PER_MB * _megabytes(spec)) * max(1, len(steps))


def _megabytes(spec: ModelSpec) -> float:
    """Size of a model's file in megabytes; 0 if it is not a file on this machine."""
    with suppress(OSError):
        return Path(spec.source).stat().st_size / 1e6
    return 0.0
