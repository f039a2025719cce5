"""A model whose vertices change over time: a mesh at each time step; equal arrays are shared."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from itertools import accumulate
from typing import Any, Protocol

import numpy as np

from viewsphere.assets.mesh import Image, Mesh
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.thing import TimeStep


class Load(Protocol):
    """Loads a normalised model at a time step (None: at rest); raises ModelError if its file cannot be used."""

    def __call__(self, spec: ModelSpec, step: TimeStep | None = None, /) -> Mesh:
        """The mesh in object axes, metres."""
        ...


@dataclass(frozen=True, eq=False)
class DeformingMesh:
    """`meshes` by the frame of their model's file, ascending; data that is equal at successive frames is one object.

    If a model's triangles change, each frame has its own. In most models, only vertices and normals change.
    """

    meshes: Mapping[int, Mesh]

    @staticmethod
    def from_meshes(meshes: Mapping[int, Mesh]) -> DeformingMesh:
        """These meshes by frame."""
        shared = accumulate(sorted(meshes.items()), lambda last, now: (now[0], sharing(now[1], last[1])))
        return DeformingMesh(dict(shared))


def sharing(mesh: Mesh, other: Mesh) -> Mesh:
    """The mesh with those arrays, materials and images replaced by another mesh's that are equal to them."""
    same = {f.name: getattr(other, f.name) for f in fields(Mesh) if _equal(getattr(mesh, f.name), getattr(other, f.name))}
    return replace(mesh, **same)


def _equal(one: Any, other: Any) -> bool:
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
        return one.shape == other.shape and one.tobytes() == other.tobytes()
    if isinstance(one, tuple) and one and isinstance(one[0], Image):
        return len(one) == len(other) and all(
            a.name == b.name and _equal(a.pixels, b.pixels) for a, b in zip(one, other, strict=True)
        )
    return one is None if other is None else not isinstance(other, np.ndarray) and one == other
