"""Meshes of a USD file: polygons with their primvars, material subsets and skins."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np

from viewsphere.assets.animation.skin import strongest
from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.primitive import Float, Int, Primitive, compact
from viewsphere.assets.readers.shared.coordinates import check_coordinates
from viewsphere.assets.readers.shared.polygon_proof import cut_polygons
from viewsphere.assets.readers.usd.library import UsdGeom

_AROUND, _RINGS = 48, 24
"""Segments around an axis, and from pole to pole: a sphere's volume is then 1.1 % too small."""

_AXES = {"X": [2, 0, 1], "Y": [1, 2, 0], "Z": [0, 1, 2]}
"""Columns of the coordinates that turn a shape about z into one about another axis, right-handed."""

_CUBE = [[0, 2, 6, 4], [1, 5, 7, 3], [0, 4, 5, 1], [2, 3, 7, 6], [0, 1, 3, 2], [4, 6, 7, 5]]

PER_CORNER = "faceVarying"
ROWS = {"constant": "one", "uniform": "face", "vertex": "point", "varying": "point", PER_CORNER: "corner"}
"""The kind of element with one value each, by interpolation."""


@dataclass(frozen=True, eq=False)
class Influences:
    """The skin of a mesh's points: joints (V, K) of `names`, and their weights (V, K)."""

    names: tuple[str, ...]
    joints: Int
    weights: Float


@dataclass(frozen=True, eq=False)
class _Shape:
    """A prim's triangles (T, 3) of corners, the point (C,) and the face (C,) of each corner, and its primvars' values by name
    and kind of row.
    """

    points: Float
    point: Int
    face: Int
    triangles: Int
    owner: Int
    normals: Float | None
    values: Mapping[str, tuple[str, Float]]
    subsets: Sequence[tuple[Any, Int]] = field(default_factory=tuple[Any, ...])

    def at_corners(self, name: str, width: int) -> Float | None:
        """A primvar's value at each corner, (C, width); None if the prim has none of that width."""
        kind, values = self.values.get(name, ("", np.zeros((0, 0))))
        return None if values.shape[1:] != (width,) else _spread(kind, values, self.point, self.face)


def read_shape(folder: ModelFolder, prim: Any, time: Any) -> _Shape | None:
    """The polygons of a mesh or an implicit shape; None if it has none."""
    found = _polygons(folder, prim, time)
    if found is None or not len(found[2]):
        return None
    points, corners, counts, face = found
    starts = np.repeat(face, counts)
    folder.check("MAX_VERTICES", len(corners), "corners of polygons")
    folder.check("MAX_TRIANGLES", int((counts - 2).sum()), "triangles")
    triangles, owner = cut_polygons(folder, points, corners, counts)
    if UsdGeom.Gprim(prim).GetOrientationAttr().Get(time) == UsdGeom.Tokens.leftHanded:
        triangles = triangles[:, ::-1]
    kept, values = _kept_corners(folder, prim, time), _primvars(folder, prim, time, len(points))
    if kept is not None:
        values = {name: (kind, rows[kept] if kind == "corner" else rows) for name, (kind, rows) in values.items()}
    normals = values.get("normals", ("", np.zeros((0, 0))))
    return _Shape(
        points,
        corners,
        starts,
        triangles,
        face[owner],
        _spread(*normals, corners, starts) if normals[1].shape[1:] == (3,) else None,
        values,
        _subsets(prim, time),
    )


def _polygons(folder: ModelFolder, prim: Any, time: Any) -> tuple[Float, Int, Int, Int] | None:
    """Points, corners, corners of each polygon, and its number in the file."""
    if not prim.IsA(UsdGeom.Mesh):
        shape = _polygons_of(prim, time)
        return None if shape is None else (*shape, np.arange(len(shape[2])))
    mesh = UsdGeom.Mesh(prim)
    points = _array(mesh.GetPointsAttr().Get(time), np.float64, 3)
    corners = _array(mesh.GetFaceVertexIndicesAttr().Get(time), np.int64)
    counts = _array(mesh.GetFaceVertexCountsAttr().Get(time), np.int64)
    if counts.size and (counts.min() < 0 or counts.sum() > len(corners)):
        raise folder.error(f"{prim.GetPath()}: polygons need {counts.sum():,} corners, found {len(corners):,}: damaged")
    if corners.size and (corners.min() < 0 or corners.max() >= len(points)):
        raise folder.error(f"{prim.GetPath()}: a face names point {corners.max()}, expected 0 to {len(points) - 1}")
    check_coordinates(folder, points, corners, f"{prim.GetPath()}: ")
    kept = _is_kept(mesh, counts, time)
    if not kept.all():
        corners = corners[: counts.sum()][np.repeat(kept, counts)]
    return points, corners, counts[kept], np.flatnonzero(kept)


def _is_kept(mesh: Any, counts: Int, time: Any) -> Any:
    """A mask (F,) of the faces that are polygons and not holes."""
    kept = counts > 2
    holes = _array(mesh.GetHoleIndicesAttr().Get(time), np.int64)
    kept[holes[(holes >= 0) & (holes < len(kept))]] = False
    return kept


def _kept_corners(folder: ModelFolder, prim: Any, time: Any) -> Any:
    """A mask of the file's corners that belong to kept faces; None if all do."""
    if not prim.IsA(UsdGeom.Mesh):
        return None
    mesh = UsdGeom.Mesh(prim)
    counts = _array(mesh.GetFaceVertexCountsAttr().Get(time), np.int64)
    kept = _is_kept(mesh, counts, time)
    return None if kept.all() else np.flatnonzero(np.repeat(kept, counts))


def _primvars(folder: ModelFolder, prim: Any, time: Any, points: int) -> dict[str, tuple[str, Float]]:
    """The values of primvars, inherited ones too, and of the mesh's normals, with the kind of their rows."""
    values: dict[str, tuple[str, Float]] = {}
    if prim.IsA(UsdGeom.PointBased):
        based = UsdGeom.PointBased(prim)
        _add(values, "normals", based.GetNormalsAttr().Get(time), based.GetNormalsInterpolation())
    for primvar in UsdGeom.PrimvarsAPI(prim).FindPrimvarsWithInheritance():
        try:
            _add(values, str(primvar.GetPrimvarName()), primvar.ComputeFlattened(time), primvar.GetInterpolation())
        except (TypeError, ValueError):
            folder.warn(f"{prim.GetPath()}: primvar {primvar.GetPrimvarName()} cannot be read; it is left out")
    return {name: (kind, rows) for name, (kind, rows) in values.items() if kind != "point" or len(rows) == points}


def _add(values: dict[str, tuple[str, Float]], name: str, value: Any, interpolation: Any) -> None:
    if value is None or isinstance(value, str) or str(interpolation) not in ROWS:
        return
    rows = np.asarray(value)
    if rows.dtype.kind in "fiu" and rows.size:
        rows = np.atleast_1d(rows).astype(np.float64)
        single = str(interpolation) == "constant" and rows.ndim == 1 and not hasattr(value, "__len__")
        rows = rows.reshape(1, 1) if single else rows.reshape(len(rows), -1) if rows.ndim > 1 else rows[:, None]
        values[name] = ROWS[str(interpolation)], rows


def _spread(kind: str, values: Float, point: Int, face: Int) -> Float | None:
    """Values at corners; None if there are too few."""
    if kind == "one":
        return np.repeat(values[:1], len(point), axis=0)
    rows = {"point": point, "face": face, "corner": np.arange(len(point))}[kind]
    return values[rows] if rows.size and rows.max() < len(values) else None


def _subsets(prim: Any, time: Any) -> list[tuple[Any, Int]]:
    """The prims of material subsets, and their faces."""
    if not prim.IsA(UsdGeom.Imageable):
        return []
    subsets = UsdGeom.Subset.GetGeomSubsets(UsdGeom.Imageable(prim), UsdGeom.Tokens.face, "materialBind")
    return [(subset.GetPrim(), _array(subset.GetIndicesAttr().Get(time), np.int64)) for subset in subsets]


def _array(value: Any, kind: type[np.generic], width: int = 0) -> Any:
    array = np.zeros(0, kind) if value is None else np.asarray(value).astype(kind)
    return array.reshape(-1, width) if width else array.reshape(-1)


def pieces_of(
    shape: _Shape, material: int, uvs: Sequence[str], color: str | None, influences: Influences | None, triangles: Int
) -> Primitive:
    """Some of a shape's triangles; `uvs` are the primvars of their texture coordinates, `color` is the primvar of their
    colours.
    """
    rows = shape.triangles[triangles]
    coordinates = [_downwards(shape.at_corners(name, 2)) for name in uvs[:2]]
    piece = Primitive(
        part="",
        material=material,
        positions=shape.points[shape.point],
        triangles=rows,
        normals=shape.normals,
        uv0=coordinates[0] if coordinates else None,
        uv1=coordinates[1] if len(coordinates) > 1 else None,
        colors=None if color is None else _colors(shape, color),
    )
    if influences is None:
        return compact(piece)
    joints, weights = influences.joints[shape.point], influences.weights[shape.point]
    return compact(replace(piece, bone=strongest(joints, weights, rows), bones=influences.names))


def _downwards(uv: Float | None) -> Float | None:
    return None if uv is None else np.column_stack([uv[:, 0], 1.0 - uv[:, 1]])


def _colors(shape: _Shape, name: str) -> Float | None:
    """Linear colours (C, 4) with the opacity that the prim displays."""
    colors, opacity = shape.at_corners(name, 3), shape.at_corners("displayOpacity", 1)
    if colors is None:
        return None
    return np.column_stack([np.clip(colors, 0.0, 1.0), np.ones(len(colors)) if opacity is None else opacity])


def by_material(shape: _Shape) -> Iterator[tuple[Any, Int]]:
    """The prim of each material subset, None for the rest, and the triangles of its faces."""
    left = np.ones(len(shape.triangles), bool)
    for prim, faces in shape.subsets:
        chosen = np.isin(shape.owner, faces) & left
        left &= ~chosen
        if chosen.any():
            yield prim, np.flatnonzero(chosen)
    if left.any():
        yield None, np.flatnonzero(left)


def _polygons_of(prim: Any, time: Any) -> tuple[Float, Int, Int] | None:
    """Points, corners and corners of each polygon, outward; None for other prims."""
    kind = str(prim.GetTypeName())

    def value(name: str) -> float:
        return float(prim.GetAttribute(name).Get(time))

    if kind == "Cube":
        half = value("size") / 2
        points = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * 2.0 - 1
        return points * half, np.array(_CUBE).reshape(-1), np.full(6, 4)
    if kind == "Plane":
        width, length = value("width") / 2, value("length") / 2
        points = np.array([[-width, -length, 0], [width, -length, 0], [width, length, 0], [-width, length, 0]])
        return _about(points, np.arange(4), np.array([4]), prim, time)
    profile = _profile(kind, value)
    return None if profile is None else _about(*_turned(profile), prim, time)


def _profile(kind: str, value: Any) -> Float | None:
    """Radii and heights of a shape's outline, from bottom to top; its first and last radius is 0."""
    if kind == "Sphere":
        return _arc(value("radius"), -0.5, 0.5, 0.0, _RINGS)
    if kind == "Cylinder":
        radius, half = value("radius"), value("height") / 2
        return np.array([[0, -half], [radius, -half], [radius, half], [0, half]])
    if kind == "Cone":
        radius, half = value("radius"), value("height") / 2
        return np.array([[0, -half], [radius, -half], [0, half]])
    if kind == "Capsule":
        radius, half = value("radius"), value("height") / 2
        arcs = _arc(radius, -0.5, 0, -half, _RINGS // 2), _arc(radius, 0, 0.5, half, _RINGS // 2)
        return np.concatenate(arcs)
    return None


def _arc(radius: float, start: float, end: float, height: float, steps: int) -> Float:
    """A circle's arc between two angles in half turns from the horizontal."""
    angle = np.linspace(start, end, steps + 1) * np.pi
    arc = np.column_stack([np.cos(angle), np.sin(angle)]) * radius + [0, height]
    arc[np.abs(arc[:, 0]) < radius * 1e-12, 0] = 0
    return arc


def _turned(profile: Float) -> tuple[Float, Int, Int]:
    """The polygons of an outline turned about z: triangles at poles, quadrilaterals elsewhere."""
    angle = np.arange(_AROUND) * (2 * np.pi / _AROUND)
    around = np.column_stack([np.cos(angle), np.sin(angle)])
    rings = [np.column_stack([around * radius, np.full(_AROUND, height)]) for radius, height in profile]
    points, corners, counts = np.concatenate(rings), list[list[int]](), list[int]()
    for ring, (low, high) in enumerate(pairwise(profile[:, 0].tolist())):
        for i in range(_AROUND):
            a, b = ring * _AROUND + i, ring * _AROUND + (i + 1) % _AROUND
            face = [*([a] if low == 0 else [a, b]), *([b + _AROUND] if high == 0 else [b + _AROUND, a + _AROUND])]
            corners.append(face)
            counts.append(len(face))
    return points, np.array([corner for face in corners for corner in face]), np.array(counts)


def _about(points: Float, corners: Int, counts: Int, prim: Any, time: Any) -> tuple[Float, Int, Int]:
    axis = prim.GetAttribute("axis")  # for all shapes except spheres
    return points[:, _AXES[str(axis.Get(time)) if axis else "Z"]], corners, counts
