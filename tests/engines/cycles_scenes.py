"""Shots that both engines render, and what Blender is asked for directly."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from shots import camera_of
from viewsphere import Recipe, plan
from viewsphere.engines import cycles
from viewsphere.engines.shared.blender.staging import Arrangement, camera_request
from viewsphere.model.shot import Shot
from viewsphere.run.shots.stages import Stages

DRAFT = {"name": "cycles", "quality": "draft"}
HAIR_DRIER = {"source": "zoo:hair_drier", "category": "hair drier", "scale": {"length": 0.3}}


def recipe_of(engine=DRAFT, camera=None, **changed) -> Recipe:
    """One model of the zoo from two sides, without ground."""
    given = {
        "name": "cycles",
        "models": [HAIR_DRIER],
        "viewpoints": {"azimuth": [20, 140], "elevation": [25], "distance": 0.9},
        "camera": {"size": [96, 96], "fov_deg": 40, **(camera or {})},
        "scene": {"ground": False},
        "engine": engine,
        "channels": ["rgb"],
        "formats": [],
    }
    return Recipe(**(given | changed))


@cache
def stages() -> Stages:
    return Stages()


def stage_of(recipe: Recipe) -> Arrangement:
    """What Blender has of the first shot."""
    known = stages()
    return cycles.stage(next(plan(recipe).shots(known.box)), known.model).arrangement(0)


def moved_camera(shot: Shot, offset):
    """The camera of the shot's first instant, looking beside its focus."""
    now = shot.instants[0]
    return camera_of(shot.rig.sensors[0].intrinsics, now.viewpoint, now.focus + np.array(offset))


def asked(stage: Arrangement, camera, passes=(), **changed) -> dict[str, np.ndarray]:
    """A picture of the stage as Cycles gives it, and passes."""
    process = stage.keeper.process_for(stage)
    out = str(process.folder / "asked.npy")
    told = {"camera": camera_request(camera), "transparent": True, "border": None, "passes": list(passes), "out": out}
    process.ask("render", **(told | changed))
    found = {name: np.load(out.replace(".npy", f".{name}.npy"))[..., 0] for name in passes}
    return found | {"picture": np.load(out)}


def shift_between(first, second) -> np.ndarray:
    """Pixels, across and down, by which two grey pictures (H, W) are moved against one another: phase correlation of the lower
    frequencies.

    The slope of the phases of what both have, weighted by how much of it there is.
    """
    window = np.hanning(first.shape[0])[:, None] * np.hanning(first.shape[1])[None]
    a, b = (np.fft.fft2((p - p.mean()) * window) for p in (first, second))
    down, across = np.fft.fftfreq(first.shape[0])[:, None], np.fft.fftfreq(first.shape[1])[None]
    cross = a * np.conj(b)
    weight = np.abs(cross) * (np.hypot(down, across) < 0.2)
    rows = np.stack(np.broadcast_arrays(across, down), axis=-1).reshape(-1, 2) * 2 * math.pi
    phase, weight = np.angle(cross).reshape(-1), np.sqrt(weight.reshape(-1))
    moved, *_ = np.linalg.lstsq(rows * weight[:, None], phase * weight, rcond=None)
    return moved
