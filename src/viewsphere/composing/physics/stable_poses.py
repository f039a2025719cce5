"""The stable poses of models on a floor."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.composing.physics.packages import check_packages
from viewsphere.geometry.rotation import rotation_about

Float = NDArray[np.float64]

NEEDS = ("trimesh", "networkx", "scipy")
"""Packages of the extra physics."""

RAREST = 0.02
"""Share of its falls after which a model comes to lie in a way, below which it is taken for one on which it tips over."""


def stable_turn(hull: Float, rng: np.random.Generator) -> Float:
    """A rotation (3, 3) of a model with these corners of its convex hull (N, 3) that lets it lie on z = 0: each way to lie is
    as likely as the model, let go at random, is to come to rest so (Goldberg et al. 1999, by trimesh's `compute_stable_poses`).
    Turned about the vertical at random.

    Raises MissingExtraError without the packages that it needs.
    """
    ways, chances = stable_ways(hull)
    way = ways[int(rng.choice(len(ways), p=chances))]
    return rotation_about((0.0, 0.0, 2 * np.pi * rng.random())) @ way


def stable_ways(hull: Float) -> tuple[Float, Float]:
    """Return the stable poses as rotations (N, 3, 3), the likeliest first, and their probabilities (N,); the rarest are left
    out.
    """
    return _stable_ways(hull.tobytes())


@lru_cache(maxsize=256)
def _stable_ways(corners: bytes) -> tuple[Float, Float]:
    check_packages(NEEDS, "physics", "orientation: stable")
    import trimesh

    hull = np.frombuffer(corners).reshape(-1, 3)
    solid: Any = trimesh.convex.convex_hull(hull, repair=True) if np.linalg.matrix_rank(hull - hull[0], 1e-9) == 3 else None
    if solid is None:  # flat, or a line
        return np.eye(3)[None], np.ones(1)
    with np.errstate(invalid="ignore"):  # of triangles so thin that rounding makes their chance no number; such are passed over
        found, chances = solid.compute_stable_poses(n_samples=1, seed=0)
    turns, chances = found[:, :3, :3], np.round(chances, 6)
    order = np.lexsort([*np.round(turns[:, 2], 6).T, -chances]).tolist()  # the same where two are as likely
    kept = [i for i in order if chances[i] >= min(RAREST, chances.max())]
    return turns[kept], chances[kept] / chances[kept].sum()
