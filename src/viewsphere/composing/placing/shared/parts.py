"""Convex parts of models whose hulls are too coarse."""

from __future__ import annotations

import hashlib
import json

import numpy as np
from numpy.typing import NDArray

from viewsphere.caches.arrays import Content
from viewsphere.caches.entries import kept
from viewsphere.composing.physics import needed
from viewsphere.composing.placing import Shape

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
    return kept("parts", digest, lambda: _parted(vertices, triangles), _plain, lambda content: list(content.arrays.values()))


def _plain(parts: list[Float]) -> Content:
    return Content(None, {f"{i}": part for i, part in enumerate(parts)})


def _parted(vertices: Float, triangles: NDArray[np.int32]) -> list[Float]:
    coacd = needed("coacd")
    trimesh = needed("trimesh")

    coacd.set_log_level("error")
    mesh = trimesh.Trimesh(vertices, triangles, process=False)
    mesh.merge_vertices(merge_tex=True, merge_norm=True)  # else every seam of a texture is an open edge
    found = coacd.run_coacd(coacd.Mesh(mesh.vertices, mesh.faces), **SETTINGS)
    return [np.round(np.asarray(corners, np.float64), 9) for corners, _ in found]
