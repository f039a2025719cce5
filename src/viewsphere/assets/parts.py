"""Selected parts of a mesh as a separate mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import Mesh
from viewsphere.assets.primitive import used_images
from viewsphere.errors import ModelError
from viewsphere.geometry.rotation import transform
from viewsphere.model.model_spec import ModelSpec, Parts
from viewsphere.model.thing import TimeStep

VERTEX = ("uv0", "uv1", "colors")

OWN_SLASH = "\u2215"
"""The character that replaces a slash in an object's name in the part names of Blender's worker."""


def selected_parts(mesh: Mesh, spec: ModelSpec, step: TimeStep | None = None) -> Mesh:
    """Return the parts of a whole model's mesh that `spec.parts` selects at a time step, with the materials and images that
    they use.

    Raises ModelError if the selection is empty.
    """
    assert spec.parts is not None
    chosen = is_taken(mesh.parts, spec.parts)[mesh.triangle_part]
    if not chosen.any():
        wanted = ", ".join(spec.parts.only or ("anything",))
        raise ModelError(f"{spec.source}: expected triangles of {wanted}, found none that a render would show")
    used, corners = np.unique(mesh.triangles[chosen], return_inverse=True)
    parts, part = np.unique(mesh.triangle_part[chosen], return_inverse=True)
    materials, material = np.unique(mesh.triangle_material[chosen], return_inverse=True)
    kept, images = used_images([mesh.materials[i] for i in materials], mesh.images)
    axes = np.array((step and step.file_from_axes) or spec.parts.file_from_axes)
    vertices, normals = _turned(mesh.vertices[used], mesh.normals[used], axes)
    rest = {name: None if values is None else values[used] for name in VERTEX for values in [getattr(mesh, name)]}
    return replace(
        mesh,
        **rest,
        vertices=vertices,
        normals=normals,
        triangles=corners.reshape(-1, 3).astype(np.int32),
        triangle_part=part.astype(np.int32),
        triangle_material=material.astype(np.int32),
        triangle_body_part=None if mesh.triangle_body_part is None else mesh.triangle_body_part[chosen],
        parts=tuple(mesh.parts[i] for i in parts),
        materials=kept,
        images=images,
    )


def is_taken(names: Sequence[str], parts: Parts) -> NDArray[np.bool_]:
    """A mask (N,) of the part names that the selection includes."""
    only = None if parts.only is None else frozenset(map(own_part, parts.only))
    without = frozenset(map(own_part, parts.without))
    return np.array([(only is None or _is_of(name, only)) and not _is_of(name, without) for name in names], np.bool_)


def own_part(name: str) -> str:
    """Name of the part for an object of this name; slashes would separate it from the objects it instances."""
    return name.replace("/", OWN_SLASH)


def _is_of(part: str, objects: frozenset[str]) -> bool:
    """Return whether a part belongs to one of the objects: it is the object, or one that it instances."""
    pieces = part.split("/")
    return any("/".join(pieces[: i + 1]) in objects for i in range(len(pieces)))


def _turned(
    vertices: NDArray[np.float32], normals: NDArray[np.float32], axes: NDArray[np.float64]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Vertices and normals in the parts' axes (file from axes)."""
    if (axes == np.eye(4)).all():
        return vertices, normals
    turn = axes[:3, :3].T
    moved = transform(turn, vertices.astype(np.float64) - axes[:3, 3])
    return moved.astype(np.float32), transform(turn, normals.astype(np.float64)).astype(np.float32)
