"""A model whose vertices change over time: a mesh at each time step, of arrays that are shared where they are equal."""

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
    """Gives a normalised model at a time step (None: as it rests); raises ModelError if its file cannot be used."""

    def __call__(self, spec: ModelSpec, step: TimeStep | None = None, /) -> Mesh:
        """The mesh in object axes, metres."""
        ...


@dataclass(frozen=True, eq=False)
class DeformingMesh:
    """`meshes` by the frame of their model's file, ascending; what is equal at one frame and the next is one object.

    A model whose triangles change has them at each frame; most change vertices and normals alone.
    """

    meshes: Mapping[int, Mesh]

    @staticmethod
    def of(meshes: Mapping[int, Mesh]) -> DeformingMesh:
        """These meshes by frame."""
        shared = accumulate(sorted(meshes.items()), lambda last, now: (now[0], sharing(now[1], last[1])))
        return DeformingMesh(dict(shared))


def sharing(mesh: Mesh, other: Mesh) -> Mesh:
    """The mesh with the arrays, materials and images of another where they are equal."""
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
