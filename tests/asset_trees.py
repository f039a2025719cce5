"""Folders of models in the layouts of public sets, for tests."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np

from viewsphere import Recipe, plan
from viewsphere.assets.cache import load_normalised
from viewsphere.model.model_spec import ModelSpec
from viewsphere.planning.plan import Plan

AXES = {"x": 0, "y": 1, "z": 2}


def pointer(up: str, forward: str, size: float = 1.0) -> str:
    """An OBJ file: a cube of this side with a thin spike, a tenth as long, from its top edge towards the front."""
    low, ends = -size / 2, np.zeros((2, 3))
    for axis, place in ((up, 0), (forward, 1)):
        ends[place, AXES[axis[1]]] = (size / 2) * (1 if axis[0] == "+" else -1)
    tip = ends[0] + ends[1] * 1.2
    corners = [[low + size * bit for bit in bits] for bits in product((0, 1), repeat=3)]
    quads = ((1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4))
    edge = ends.sum(axis=0)
    side = np.cross(ends[0], ends[1]) * 0.1 / size
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in [*corners, tip, edge + side, edge - side]]
    return "\n".join([*lines, *(f"f {' '.join(map(str, quad))}" for quad in quads), "f 9 10 11", ""])


def put(file: Path, text: str) -> Path:
    """Write a file, and the folders that it is in."""
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)
    return file


def planned(source: str, folder: Path | None = None, splits: dict[str, object] | None = None, **entry: object) -> Plan:
    """The plan of one picture of each model of a source."""
    data: dict[str, object] = {} if splits is None else {"splits": splits}
    data |= {"models": [{"source": source, **entry}], "viewpoints": {"distance": 3.0, "azimuth": [0]}, "channels": ["rgb"]}
    return plan(Recipe.model_validate(data, context={"folder": folder} if folder else None))


def faces_front(spec: ModelSpec, size: float = 1.0) -> bool:
    """Return whether a loaded `pointer` of this size in metres points to -Y at its top."""
    vertices = load_normalised(spec).vertices.astype(float)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    ahead = np.unique(vertices[vertices[:, 1] < low[1] + 0.01 * size].round(6), axis=0)  # the tip; of a cube, four corners
    is_tip = len(ahead) == 1 and abs(ahead[0, 2] - high[2]) < 1e-4 * size
    return bool(is_tip and np.allclose(high - low, (size, 1.1 * size, size), rtol=1e-4))
