"""Conversion of a raw mesh to an object: +Z up, front -Y, metres, centred."""

from __future__ import annotations

from dataclasses import replace
from typing import cast

import numpy as np

from viewsphere.assets.mesh import Mesh
from viewsphere.assets.primitive import FileFacts, Float, face_normals, unit_normals
from viewsphere.errors import ModelError
from viewsphere.geometry.rotation import rigid, transform
from viewsphere.limits import limits
from viewsphere.model.model_spec import Axis, Measure, ModelSpec, ScaledTo, Size
from viewsphere.model.scene import Matrix4

PROPORTION_TOLERANCE = 0.1
"""Largest relative difference between a model's and its real size without a warning; chosen, not measured."""


def normalise(mesh: Mesh, facts: FileFacts, spec: ModelSpec, first: tuple[Mesh, FileFacts] | None = None) -> Mesh:
    """The mesh in object axes and metres: rotated, scaled and centred according to the model's settings.

    Axes: `spec.up` becomes +Z and `spec.forward` -Y, by an exact permutation and change of signs; unset axes default to the
    file's. Scale: `as_is` keeps the file's unit (or `spec.unit` metres); `real_size` scales uniformly until the length (along
    Y) is the real one's: the model keeps its proportions, and a warning says when they differ from the real ones by more than
    10 %; a number is the length in metres. Centring: `box` puts the box's centre at the origin, `area` the area-weighted
    centroid of the surface, `floor` the box's centre in x and y and its lowest point at z = 0; `as_is` keeps the file's own
    origin.

    Computed in float64, stored as float32; triangles are sorted by part and material, otherwise in the file's order. `first`,
    the mesh and facts of an animation's first frame, sets scale and centre for all frames, so that motion is kept. Raises
    ModelError for parallel axes and for a result smaller or larger than `limits` allows.
    """
    turn, factor, center, warnings = _placing_of(mesh, facts, spec, first)
    origin = facts.origin if first is None else first[1].origin
    shift = factor * (np.subtract(facts.origin, origin) @ turn.T) - center
    stored = (factor * (mesh.vertices.astype(np.float64) @ turn.T) + shift).astype(np.float32)
    mesh = sorted_by_part(mesh)
    return replace(
        mesh,
        vertices=stored,
        normals=unit_normals(stored, mesh.triangles, (mesh.normals.astype(np.float64) @ turn.T).astype(np.float32)),
        warnings=mesh.warnings + warnings,
    )


def sorted_by_part(mesh: Mesh) -> Mesh:
    """The mesh with its triangles sorted by part and material, otherwise in their order; the same object if they already
    are.
    """
    order = np.lexsort((mesh.triangle_material, mesh.triangle_part))
    if (order[1:] > order[:-1]).all():  # the cache's arrays remain shared by all processes
        return mesh
    return replace(
        mesh,
        triangles=mesh.triangles[order],
        triangle_material=mesh.triangle_material[order],
        triangle_part=mesh.triangle_part[order],
        triangle_body_part=None if mesh.triangle_body_part is None else mesh.triangle_body_part[order],
    )


def placed(mesh: Mesh, facts: FileFacts, spec: ModelSpec, first: tuple[Mesh, FileFacts] | None = None) -> FileFacts:
    """The facts with the transform from the file's coordinates to the normalised mesh; arguments and errors as for
    `normalise`.
    """
    turn, factor, center, _ = _placing_of(mesh, facts, spec, first)
    origin = facts.origin if first is None else first[1].origin
    matrix = rigid(factor * turn, -factor * transform(turn, origin) - center).tolist()
    return replace(facts, object_from_file=cast("Matrix4", tuple(map(tuple, matrix))))


def _placing_of(
    mesh: Mesh, facts: FileFacts, spec: ModelSpec, first: tuple[Mesh, FileFacts] | None
) -> tuple[Float, float, Float, tuple[str, ...]]:
    """Return the rotation (3, 3) of the file's axes, and the result of `_placing` for the file's first frame."""
    turn = rotation(*axes(spec, facts), str(facts.path))
    return turn, *_placing(mesh if first is None else first[0], turn, facts, spec)


def _placing(mesh: Mesh, turn: Float, facts: FileFacts, spec: ModelSpec) -> tuple[float, Float, tuple[str, ...]]:
    """Metres in one unit of the file, the point (3,) that becomes the origin (metres, turned axes), and warnings."""
    low, high = np.sort(mesh.bounds @ turn.T, axis=0)
    factor, warnings = _factor(high - low, facts, spec)
    low, high = low * factor, high * factor
    _check_size(float((high - low).max()), facts)
    if spec.centring == "area":
        return factor, _area_centroid(factor * (mesh.vertices.astype(np.float64) @ turn.T), mesh), warnings
    if spec.centring == "as_is":
        return factor, np.zeros(3), warnings
    center = (low + high) / 2
    if spec.centring == "floor":
        center[2] = low[2]
    return factor, center, warnings


def axes(spec: ModelSpec, facts: FileFacts) -> tuple[Axis, Axis]:
    """Up and forward axes of a model, from its settings, else from the file. An `up` along the file's forward axis rotates both
    axes of the file.

    Raises ModelError for a `forward` along the file's up axis, because the up direction is then undefined.
    """
    up, forward = spec.up or facts.up, spec.forward or facts.forward
    if up[1] != forward[1] or (spec.up and spec.forward):
        return up, forward
    if not spec.up:
        raise ModelError(
            f"{facts.path}: `forward: {forward}` lies along {facts.up}, which is up in this file. Set `up:`, too, or another "
            "`forward:`"
        )
    return up, _opposite(facts.up) if up == facts.forward else facts.up


def _opposite(axis: Axis) -> Axis:
    return cast("Axis", ("-" if axis[0] == "+" else "+") + axis[1])


def rotation(up: Axis, forward: Axis, where: str) -> Float:
    """The rotation (3, 3) that takes `up` to +Z and `forward` to -Y: entries 0, 1 and -1 only.

    Raises ModelError, beginning with `where`, when the two are parallel.
    """
    z, front = _direction(up), _direction(forward)
    if abs(float(z @ front)) > 0.5:
        raise ModelError(f"{where}: expected up and forward axes at right angles, found up {up} and forward {forward}")
    return np.array([np.cross(-front, z), -front, z])


def _direction(axis: Axis) -> Float:
    vector = np.zeros(3)
    vector["xyz".index(axis[1])] = 1.0 if axis[0] == "+" else -1.0
    return vector


def _factor(size: Float, facts: FileFacts, spec: ModelSpec) -> tuple[float, tuple[str, ...]]:
    """Metres in one unit of the file, and warnings."""
    real, scale = spec.real_size, spec.scale
    unit = facts.unit if spec.unit is None else spec.unit
    if scale == "real_size" and real is None:
        raise ModelError(f"{facts.path}: scale real_size needs the model's real_size (width, height, length in metres)")
    if scale == "as_is" or (scale == "real_size" and isinstance(real, str)):
        return unit, ()
    goal = scale if isinstance(scale, ScaledTo) else ScaledTo(measure="length", metres=_real_length(scale, real))
    found = _measured(size, goal.measure)
    if not (found > 0 and goal.metres > 0):
        raise ModelError(
            f"{facts.path}: cannot scale a {goal.measure} of {found:g} to {goal.metres:g} m; check forward or use as_is"
        )
    factor = goal.metres / found
    if scale == "real_size" and isinstance(real, tuple):
        return factor, _proportion_warnings(size * factor, facts, real)
    return factor, ()


def _real_length(scale: str | float, real: Size | str | None) -> float:
    return real[2] if isinstance(scale, str) and isinstance(real, tuple) else float(scale)


def _measured(size: Float, measure: Measure) -> float:
    """A measure of a box of this width, length and height."""
    match measure:
        case "longest":
            return float(size.max())
        case "diagonal":
            return float(np.linalg.norm(size))
        case _:
            return float(size[("width", "length", "height").index(measure)])


def _proportion_warnings(size: Float, facts: FileFacts, real_size: Size) -> tuple[str, ...]:
    width, height, _ = real_size
    off = [
        f"{name} {found:.3g} m instead of {real:.3g} m"
        for name, found, real in (("width", size[0], width), ("height", size[2], height))
        if abs(found - real) > PROPORTION_TOLERANCE * real
    ]
    if not off:
        return ()
    return (f"{facts.path.name}: scaled to its real length it has {' and '.join(off)}: check axes and real_size",)


def _check_size(size: float, facts: FileFacts) -> None:
    if not limits.MIN_SIZE <= size <= limits.MAX_SIZE:
        raise ModelError(
            f"{facts.path}: expected a model between {limits.MIN_SIZE:g} m (limit MIN_SIZE) and {limits.MAX_SIZE:g} m (limit "
            f"MAX_SIZE) across, found {size:.3g} m; set unit (metres in one unit of the file) or scale"
        )


def _area_centroid(vertices: Float, mesh: Mesh) -> Float:
    areas = np.linalg.norm(face_normals(vertices, mesh.triangles), axis=1)
    # Not @: BLAS rounds by processor.
    return (areas[:, None] * vertices[mesh.triangles].mean(axis=1)).sum(axis=0) / areas.sum()
