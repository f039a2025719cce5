"""The cost of physics: CPU seconds of one process until 20 zoo models lie still, three draws each; and how well they lie.

    benchmarks/bench --physics

Overlap is the deepest contact at rest; drift what one more second of gravity does to the farthest. Meshes and
hulls are made before.
"""

from __future__ import annotations

import time
from functools import lru_cache
from typing import Any

import numpy as np

from viewsphere import Recipe, plan
from viewsphere.assets.cache import load_normalised
from viewsphere.composing.physics import STEP_S, World
from viewsphere.geometry.box3d import Box3d
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.thing import TimeStep
from viewsphere.planning.samplers.shared.random import scene_laid

MODELS = [
    {"source": "zoo:hair_drier", "count": 6},
    {"source": "zoo:car", "count": 3, "scale": {"length": 0.3}},
    {"source": "zoo:boat", "count": 3, "scale": {"length": 0.3}},
    {"source": "zoo:chair", "count": 3, "scale": {"length": 0.25}},
]
TABLE = {"size": [1.4, 1.0], "height": 0.75}
LAYOUTS: dict[str, dict[str, Any]] = {
    "floor": {"layout": "fall"},
    "table": {"layout": "fall", "surface": TABLE},
    "box": {"layout": {"kind": "container", "size": [1.1, 0.9, 0.45]}},
    "piles of 3": {"layout": {"kind": "stack", "friction": 0.9}, "orientation": "stable"},
}


@lru_cache
def box_of(spec: ModelSpec, step: TimeStep | None = None) -> Any:
    """The box of a model."""
    return Box3d.between(*load_normalised(spec).bounds).corners


def main() -> None:
    """Print a table."""
    ends: list[tuple[float, float]] = []
    settled = World.settle

    def watched(self: World, *args: Any, **more: Any) -> bool:
        calm = settled(self, *args, **more)
        before, overlap = np.array(self.poses), 1000 * self.deepest
        kept = self._data.qpos.copy(), self._data.qvel.copy(), self._steps
        begun = time.process_time()
        self.step(round(self._scale**0.5 / STEP_S))
        way = 1000 * np.linalg.norm(np.array(self.poses)[:, :3, 3] - before[:, :3, 3], axis=1).max()
        self._data.qpos[:], self._data.qvel[:], self._steps = kept
        ends.append((overlap, float(way)))
        lost[0] += time.process_time() - begun
        return calm

    World.settle, lost = watched, [0.0]  # type: ignore[method-assign]
    print("| 20 models on | CPU s | overlap, mm | drift in one more second, mm |\n|---|---|---|---|")
    for name, scenes in LAYOUTS.items():
        asked = {"count": 3, "objects": 20, "repeat": True, "orientation": "any", **scenes}
        planned = plan(Recipe(models=MODELS, scenes=asked, viewpoints={"distance": 3}, seed=1, splits={"by": "scene"}))
        took, overlaps, ways = [], [], []
        for subject in planned.subjects:
            laid = scene_laid(planned, subject, None, box_of)
            _ = [shape.hull for shape in laid.shapes]
            lost[0], begun = 0.0, time.process_time()
            _ = laid.poses
            took.append(time.process_time() - begun - lost[0])
            overlaps.append(ends[-1][0])
            ways.append(ends[-1][1])
        row = (took, overlaps, ways)
        print(f"| {name} | " + " | ".join(f"{min(each):.2f} to {max(each):.2f}" for each in row) + " |", flush=True)


if __name__ == "__main__":
    main()
