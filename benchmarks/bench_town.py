"""The cost of a frame of a drive through the town: recipes/town.yaml with 20 things that move, stage by stage, and its memory.

CPU milliseconds over all threads of one process, the median over frames but for the first two, which bake what is kept. Files
are not written. The floor is one ray a pixel by Embree, cast at the same instants from the same cameras, its tree built before.
Memory is the most that this process held until then: the plan, the kernels, and all that a worker holds.
"""

from __future__ import annotations

import resource
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from bench_parts import timed

from viewsphere import Recipe, plan
from viewsphere.engines.raster import staging
from viewsphere.model.shot import Shot
from viewsphere.run.shots import stages
from viewsphere.truth import view
from viewsphere.truth.raster.geometry import Geometry

RECIPE = Path(__file__).parent.parent / "recipes" / "town.yaml"
MOVING, LANE, APART, SHORT = 20, 1.7, 4.3, 3.8
"""Things that move; where lanes are, how far apart things are in them at first, and how long cars are so that all have room
there, metres.
"""

WARM = 2
"""Frames that are not counted."""

PARTS = (
    (stages, "_arrange", "triangles of this instant and the next"),
    (view, "homogeneous", "truth: vertices in the picture"),
    (view, "rasterize", "truth: raster"),
    (stages, "observe", "truth: depth, flow, instances"),
    (staging, "bake", "colour: shadows and occlusion of what moves"),
    (staging, "paint", "colour: edges, shading"),
)


def town_recipe(frames: int) -> Recipe:
    """The recipe with as many cars and motorcycles as shall move."""
    told: dict[str, Any] = yaml.safe_load(RECIPE.read_text("utf-8"))
    places = APART * (np.arange(MOVING // 2) - (MOVING // 2 - 1) / 2)
    motion = told["models"][0]["motion"]
    cars = {"source": "zoo:car", "count": 14, "scale": {"length": SHORT}, "motion": motion}
    told["models"] = [cars, {"source": "zoo:motorcycle", "count": MOVING - 14, "motion": motion}]
    told["scenes"] |= {"objects": MOVING, "layout": [[x, float(y), 0] for x in (-LANE, LANE) for y in places]}
    return Recipe(**{**told, "time": {"frames": frames, "fps": 10}, "shot_frames": frames, "formats": []})


def drive(shot: Shot, known: stages.Stages) -> tuple[dict[str, float], float]:
    """Medians by part, and CPU seconds until the first counted frame."""
    every: dict[str, list[float]] = {}
    begun = last = time.process_time()
    parts: dict[str, float] = {}
    started = 0.0
    with timed(PARTS, parts):
        for number, _ in enumerate(known.render(shot)):
            now = time.process_time()
            if number >= WARM:
                whole = 1e3 * (now - last)
                for label, took in (*parts.items(), ("all else", whole - sum(parts.values())), ("whole frame", whole)):
                    every.setdefault(label, []).append(took)
            else:
                started = now - begun
            parts.clear()
            last = time.process_time()
    return {label: float(np.median(took)) for label, took in every.items()}, started


def floor_of(shot: Shot, geometry: Geometry, embree: Callable[[Geometry], Any]) -> float:
    """Median CPU milliseconds of Embree's rays."""
    _, cast = embree(geometry)
    times: list[float] = []
    for instant in range(min(len(shot.instants), 12)):
        camera = shot.camera(instant)
        begun = time.process_time()
        cast(camera)
        times.append(1e3 * (time.process_time() - begun))
    return float(np.median(times[1:]))


def town(frames: int, embree: Callable[[Geometry], Any]) -> None:
    """Print the table."""
    known = stages.Stages()
    begun = time.process_time()
    shot = next(plan(town_recipe(frames)).shots(known.box))
    stage = known.stage(shot)
    planned = time.process_time() - begun
    found, started = drive(shot, known)
    held = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    geometry = stage.at(0)
    models = sum(len(mesh.triangles) for mesh in {id(m): m for m in map(known.model, (t.model for t in shot.things))}.values())
    moving = sum(not thing.motion.is_still for thing in shot.things)
    print(f"{len(geometry.triangles):,} triangles of {len(shot.things)} things, {models:,} held once; {moving} of them move")
    print("| | CPU ms |\n|---|---:|")
    for label, took in found.items():
        print(f"| {label} | {took:.1f} |")
    with suppress(ImportError):
        print(f"| Embree, one ray a pixel | {floor_of(shot, geometry, embree):.1f} |")
    print(f"planning and models: {planned:.1f} s; first frames: {started:.1f} s; most memory: {held:,.0f} MB")
