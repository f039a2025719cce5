"""The metadata of a model, from its sidecar or its own file, or else computed from its surface if the spec requests it."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from typing import cast

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.animation.skin import grouped
from viewsphere.assets.cache import frame_of, readers_digest
from viewsphere.assets.mesh import Mesh
from viewsphere.assets.metadata.sidecars import said_of
from viewsphere.assets.metadata.surface import Surface
from viewsphere.assets.metadata.symmetries import find, lacking
from viewsphere.assets.primitive import FileFacts
from viewsphere.caches.arrays import Content
from viewsphere.caches.entries import cached
from viewsphere.errors import ModelError
from viewsphere.geometry.diameter import diameter
from viewsphere.model.annotations.keypoints import Keypoints, Place
from viewsphere.model.annotations.metadata import ModelMetadata
from viewsphere.model.annotations.symmetries import Symmetries
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.thing import TimeStep
from viewsphere.recipe.reading.sidecar import Sidecar
from viewsphere.validation.errors import nearest, shown

Float = NDArray[np.float64]


BEYOND = 0.1
"""Distance, as a share of the diameter, by which a named point may be outside of the model's box."""


def metadata_of(spec: ModelSpec, mesh: Mesh, facts: FileFacts, step: TimeStep | None = None) -> ModelMetadata:
    """Return the metadata of a normalised model at a time step (None: at rest); `facts` are its file's facts.

    Raises ModelError, which names the sidecar and the field, for an unreadable sidecar, for a symmetry that the surface does
    not have, and for points far outside of its box.
    """
    across = diameter(mesh.corners)
    path, sidecar = said_of(spec)
    said = _in_object_axes(sidecar, facts)
    color, material = spec.color or said.color, spec.material or said.material
    if spec.parts is not None:
        return ModelMetadata(across, color=color, material=material)
    if step is not None and step.frame != frame_of(spec, None):
        return ModelMetadata(across, keypoints=_own(mesh, across, facts), color=color, material=material)
    if said.symmetries is not None and (problem := next(lacking(Surface.from_mesh(mesh), said.symmetries), None)):
        raise ModelError(f"{path}: {problem}")
    if said.keypoints is not None and (problem := next(far_points(mesh, across, said.keypoints), None)):
        raise ModelError(f"{path}: keypoints.{problem}")
    symmetries = said.symmetries
    if symmetries is None and spec.symmetries == "found":
        symmetries = found_symmetries(mesh)
    return ModelMetadata(
        across, symmetries, said.keypoints or _own(mesh, across, facts) or _spread(spec, mesh), color=color, material=material
    )


def with_body_parts(mesh: Mesh, spec: ModelSpec) -> Mesh:
    """The mesh with the body parts that its sidecar names. Raises ModelError for bones that its skin does not have."""
    path, sidecar = said_of(spec)
    parts = sidecar.body_parts
    if parts is None:
        return mesh
    bones = mesh.body_parts
    for name, own in parts.items():
        for bone in own:
            if bone not in bones:
                found = f"{shown(bone)}{nearest(bone, bones)}" if bones else "a model that has none"
                raise ModelError(f"{path}: body_parts.{name}: expected bones of the model's skin; found {found}")
    return grouped(mesh, parts)


def found_symmetries(mesh: Mesh) -> Symmetries:
    """The symmetries of a mesh's surface, from the cache if they were computed before."""
    digest = hashlib.sha256(readers_digest().encode())
    for array in (mesh.vertices, mesh.triangles):
        digest.update(repr(array.shape).encode() + array.tobytes())
    return cached(
        "models",
        digest.hexdigest(),
        lambda: find(Surface.from_mesh(mesh)),
        lambda found: Content(found.model_dump(mode="json"), {}),
        lambda content: Symmetries.model_validate(content.about),
    )


def far_points(mesh: Mesh, across: float, keypoints: Keypoints) -> Iterator[str]:
    """Yield an error message for each point outside of a mesh's box by more than `BEYOND` of its diameter."""
    low, high = mesh.bounds
    for name, place in keypoints.points.items():
        off = float(np.maximum(low - place, np.array(place) - high).max())
        if off > BEYOND * across:
            where = ", ".join(f"{value:.4g}" for value in place)
            yield (
                f"points.{name}: expected a point of the model, at most {BEYOND:.0%} of its diameter ({BEYOND * across:.3g} m) "
                f"outside of its box; found ({where}) in the object's axes, {off:.3g} m outside: see axes, and the file's unit"
            )


def _in_object_axes(said: Sidecar, facts: FileFacts) -> Sidecar:
    if said.axes == "object":
        return said
    symmetries = said.symmetries and said.symmetries.moved(facts.object_from_file)
    keypoints = said.keypoints and said.keypoints.moved(facts.object_from_file)
    return said.model_copy(update={"symmetries": symmetries, "keypoints": keypoints})


def _own(mesh: Mesh, across: float, facts: FileFacts) -> Keypoints | None:
    """The points that the model's file names, except those far outside of the model."""
    if facts.keypoints is None:
        return None
    found = facts.keypoints.moved(facts.object_from_file)
    far = {line.split(": ", 1)[0].removeprefix("points.") for line in far_points(mesh, across, found)}
    return found.only(found.points.keys() - far)


def _spread(spec: ModelSpec, mesh: Mesh) -> Keypoints | None:
    if spec.keypoints is None:
        return None
    places = spread_points(mesh.corners, spec.keypoints)
    return Keypoints(points={f"point_{i}": cast("Place", tuple(place)) for i, place in enumerate(places.tolist())})


def spread_points(vertices: Float, count: int) -> Float:
    """Up to `count` of the vertices (N, 3), each the farthest from those before it and from the middle of the box.

    Farthest-point sampling, with the middle as its start, as PVNet picks its keypoints (Peng et al. 2019, section 3.1). Equal
    vertices give equal points, regardless of their order. Among equally far vertices, the first by x, y, z counts.
    """
    vertices = np.unique(vertices, axis=0)
    away = _squares(vertices - (vertices.min(axis=0) + vertices.max(axis=0)) / 2)
    chosen: list[int] = []
    while len(chosen) < min(count, len(vertices)):
        chosen.append(int(away.argmax()))
        away = np.minimum(away, _squares(vertices - vertices[chosen[-1]]))
    return vertices[chosen]


def _squares(vectors: Float) -> Float:
    x, y, z = vectors.T
    return x * x + y * y + z * z
