"""Convex parts of models whose hulls are too coarse."""

from __future__ import annotations

import hashlib
import json
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.cache import keep
from viewsphere.caches import cache_of
from viewsphere.files import read_text
from viewsphere.sampling.physics import needed
from viewsphere.sampling.placing import Shape

Float = NDArray[np.float64]

SETTINGS = {
    "threshold": 0.08,
    "max_convex_hull": 16,
    "preprocess_resolution": 30,
    "mcts_nodes": 10,
    "mcts_iterations": 60,
    "mcts_max_depth": 2,
    "resolution": 1000,
    "seed": 1,
}
"""coacd's own settings take up to thirty times as long, and nothing comes to rest better."""


def convex_parts(shape: Shape) -> list[Float]:
    """Corners (N, 3) of the convex parts of a model, by CoACD (Wei et al. 2022), which together cover it: they are kept in the
    cache by the mesh's digest. Raises ModelError if the model's file cannot be used, MissingExtraError without coacd.
    """
    if shape.surface is None:
        return [shape.hull]
    vertices, triangles = shape.surface()
    digest = hashlib.sha256(json.dumps(SETTINGS).encode() + vertices.tobytes() + triangles.tobytes()).hexdigest()
    entry = cache_of("parts") / f"{digest}.json"
    with suppress(OSError, ValueError):
        return [np.array(part) for part in json.loads(read_text(entry))]
    parts = _parted(vertices, triangles)
    keep(entry, json.dumps([part.tolist() for part in parts]))
    return parts


def _parted(vertices: Float, triangles: NDArray[np.int32]) -> list[Float]:
    coacd = needed("coacd")
    trimesh = needed("trimesh")

    coacd.set_log_level("error")
    mesh = trimesh.Trimesh(vertices, triangles, process=False)
    mesh.merge_vertices(merge_tex=True, merge_norm=True)  # else every seam of a texture is an open edge
    found = coacd.run_coacd(coacd.Mesh(mesh.vertices, mesh.faces), **SETTINGS)
    return [np.round(np.asarray(corners, np.float64), 9) for corners, _ in found]
