"""The speed of this machine, measured in a second."""

from __future__ import annotations

import statistics
import time
from dataclasses import dataclass

from viewsphere.recipe.recipe import Recipe
from viewsphere.run.memory import render
from viewsphere.run.shots.precompile import is_precompiled, sketched

RECIPE = Recipe.model_validate(
    {
        "models": [{"source": "zoo:car"}],
        "viewpoints": {"azimuth": {"start": 0, "stop": 345, "step": 15}, "elevation": [20], "distance": 4},
        "camera": {"size": [640, 480]},
    }
)
REFERENCE_MS = 63.0
"""CPU milliseconds of a frame on the machine of docs/performance.md, an AMD EPYC, idle: the upper of five calls, 59 to 63,
2026-11.
"""

ENOUGH_S = 1.0
"""Seconds after which no frame is begun: beside imports and the first frame, the command stays below three."""


@dataclass(frozen=True)
class Speed:
    """CPU milliseconds of a frame, and how many times as many frames this machine makes as the reference."""

    frame_ms: float
    relative: float


def measure_speed() -> Speed | None:
    """The median over some frames, without the first; None where kernels would have to be compiled."""
    if not is_precompiled(sketched(RECIPE)):
        return None
    begun, before, spent = time.monotonic(), 0.0, list[float]()
    for number, _ in enumerate(render(RECIPE)):
        now = time.process_time()
        if number:
            spent.append(now - before)
        if number > 1 and time.monotonic() > begun + ENOUGH_S:
            break
        before = now
    frame_ms = 1000 * statistics.median(spent)
    return Speed(frame_ms, REFERENCE_MS / frame_ms)
