"""PLY: faces and strips with colours, normals and textures, as scanners, MeshLab, Blender and BOP write them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.appearance.alpha import with_alpha_modes
from viewsphere.assets.mesh import Material, Mesh, Texture
from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.primitive import FileFacts, Float, Int, Primitive, assemble
from viewsphere.assets.readers.ply.data import Columns, Lists, PlyFile, read_elements
from viewsphere.assets.readers.shared.polygon_pieces import (
    Polygons,
    brightest_of,
    linear_colors,
    pieces_of,
    upright,
    with_alpha,
)
from viewsphere.errors import ModelError

COLORS = (
    ("red", "green", "blue", "alpha"),
    ("r", "g", "b", "a"),
    ("diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha"),
)
COORDINATES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"), ("texture_s", "texture_t"))
INDICES = ("vertex_indices", "vertex_index", "vertex_ids", "vertex_indexes")
WEDGES = ("texcoord", "texcoords")
DEPTHS = {
    "u1": 255.0,
    "i1": 255.0,
    "u2": 65535.0,
    "i2": 32767.0,
    "u4": 2.0**32 - 1,
    "i4": 2.0**31 - 1,
    "u8": 2.0**64,
    "i8": 2.0**63,
}
"""The values of full colour in integer channels, by type."""

LOOKS = re.compile(r"colou?r|rgb|red|green|blue|texcoord|normal")
"""Names of columns that affect a surface's appearance: unread ones cause a warning."""

TEXTURE = re.compile(r"texturefile[\s:=]+(.+)", re.IGNORECASE)


def read_ply(folder: ModelFolder) -> tuple[Mesh, FileFacts]:
    """The file as one mesh of one part: up +Z, front -Y, unit 1 (PLY has no rule for any).

    Colours are read as sRGB; a face's colour is used if vertices have none. A picture on the surface replaces these colours.
    Without normals, edges are smooth up to a crease. Raises ModelError.
    """
    file = _Ply(folder, read_elements(folder, folder.read_model()))
    polygons, materials = file.polygons()
    pieces = _coloured_once(folder, pieces_of(folder, polygons), materials)
    pieces, materials = with_alpha(folder, pieces, materials)
    facts = FileFacts(folder.model, "ply", "+z", "-y", 1.0)
    return assemble(folder, pieces, with_alpha_modes(folder, pieces, materials), facts)


@dataclass(frozen=True, eq=False)
class _Ply:
    folder: ModelFolder
    file: PlyFile

    def polygons(self) -> tuple[Polygons, list[Material]]:
        """The faces and strips of the file, and the materials that they use."""
        vertex, face = (self.file.columns.get(name, {}) for name in ("vertex", "face"))
        positions = self._rows(vertex, ("x", "y", "z"))
        if positions is None and "vertex" in self.file.elements and not self.file.elements["vertex"].rows:
            raise self.folder.error("holds no vertices; export the model again")
        if positions is None:
            raise self.folder.error("has no element vertex with x, y and z; export the model as a mesh")
        self.folder.check("MAX_VERTICES", len(positions), "vertices")
        corners, counts = self._corners(vertex, face)
        corner_uv, uv = self._wedges(face, counts), self._first(vertex, COORDINATES, 2)
        uv = None if uv is None else upright(np.column_stack(uv))
        pictures = self._pictures(has_uv=uv is not None or corner_uv is not None)
        material = self._numbers(face, counts, corner_uv, len(pictures))
        colors, face_colors = self._colors("vertex", len(positions)), self._colors("face", len(counts))
        if colors is not None and face_colors is not None:
            self.folder.warn("has colours of vertices and of faces; those of its vertices are used")
            face_colors = None
        self._warn_unread()
        polygons = Polygons(positions, corners, counts, material, self._normals(vertex), colors, uv, corner_uv, face_colors)
        return polygons, [Material(name="default"), *pictures]

    def _corners(self, vertex: Columns, face: Columns) -> tuple[Int, Int]:
        """Corners of all faces, then of the triangles of strips, and the number of corners of each."""
        lists = [face.get(name) for name in INDICES]
        faces = next((column for column in lists if isinstance(column, Lists)), None)
        if faces is None:
            faces = next((c for name, c in face.items() if isinstance(c, Lists) and name not in WEDGES), None)
        strips = next((c for c in self.file.columns.get("tristrips", {}).values() if isinstance(c, Lists)), None)
        parts = [] if faces is None else [(self._whole(faces.values), faces.counts)]
        if strips is not None:
            triangles = _triangles(self._whole(strips.values), strips.counts)
            parts.append((triangles.reshape(-1), np.full(len(triangles), 3)))
        if not sum(len(counts) for _, counts in parts):
            raise self._no_faces(vertex)
        return np.concatenate([corners for corners, _ in parts]), np.concatenate([counts for _, counts in parts])

    def _no_faces(self, vertex: Columns) -> ModelError:
        count = self.file.elements["vertex"].rows
        if "f_dc_0" in vertex:
            return self.folder.error(f"holds {count:,} Gaussian splats and no faces; export a mesh of the scene instead")
        remedy = "make a mesh of it (in MeshLab: Filters > Remeshing > Screened Poisson) and use that"
        return self.folder.error(f"holds {count:,} points and no faces (a point cloud); {remedy}")

    def _whole(self, values: NDArray[np.generic]) -> Int:
        """Indices as integers; in text files they are read as floats."""
        indices = values.astype(np.int64)
        if values.dtype.kind == "f" and (indices != values).any():
            wrong = values[indices != values][0]
            raise self.folder.error(f"a face names vertex {wrong}: expected a whole number")
        return indices

    def _rows(self, columns: Columns, names: Sequence[str]) -> Float | None:
        """Columns of single numbers side by side; None if any is missing."""
        found = [columns.get(name) for name in names]
        arrays = [column.astype(np.float64) for column in found if isinstance(column, np.ndarray)]
        return np.column_stack(arrays) if len(arrays) == len(names) else None

    def _first(self, columns: Columns, sets: Iterable[Sequence[str]], least: int) -> list[Float] | None:
        """The first of several sets of columns that has at least its first `least` columns."""
        for names in sets:
            needed = self._rows(columns, names[:least])
            if needed is not None:
                more = [column for name in names[least:] if isinstance(column := columns.get(name), np.ndarray)]
                return [*needed.T, *(column.astype(np.float64) for column in more)]
        return None

    def _normals(self, vertex: Columns) -> Float | None:
        normals = self._rows(vertex, ("nx", "ny", "nz"))
        return normals if normals is not None and normals.any() else None

    def _colors(self, element: str, count: int) -> Float | None:
        """Linear colours of an element's rows."""
        channels = self._first(self.file.columns.get(element, {}), COLORS, 3)
        if channels is None or len(channels[0]) != count:
            return None
        types = {p.name: p.type for p in self.file.elements[element].properties}
        kind = next(types[names[0]] for names in COLORS if all(name in types for name in names[:3]))
        if kind == "i1":  # written by programs with signed bytes
            channels = [np.where(channel < 0, channel + 256, channel) for channel in channels]
        return linear_colors(channels, brightest_of(channels, DEPTHS.get(kind)))

    def _pictures(self, *, has_uv: bool) -> list[Material]:
        """A material for each picture that the comments name; white if it cannot be used."""
        names = [match[1].strip() for comment in self.file.comments if (match := TEXTURE.match(comment))]
        if names and not has_uv:
            self.folder.warn(f"names the picture {names[0][:80]!r} but has no texture coordinates; it is not used")
            return []
        indices = [self.folder.image(name, name) for name in names]
        textures = [None if index is None else Texture(index) for index in indices]
        return [Material(name=f"texture {i}", base_color_texture=texture) for i, texture in enumerate(textures)]

    def _wedges(self, face: Columns, counts: Int) -> Float | None:
        """Texture coordinates of all corners, (C, 2), NaN for faces without any; None if the file has none."""
        column = next((c for name in WEDGES if isinstance(c := face.get(name), Lists)), None)
        if column is None or not column.counts.any():
            return None
        lengths = np.concatenate([column.counts, np.zeros(len(counts) - len(column.counts), np.int64)])
        wrong = (lengths != 2 * counts) & (lengths != 0)
        if wrong.any():
            at = int(np.argmax(wrong))
            expected = f"{2 * counts[at]} texture coordinates for its {counts[at]} corners"
            raise self.folder.error(f"face {at + 1:,}: expected {expected}, found {lengths[at]}; export the model again")
        uv = np.full((int(counts.sum()), 2), np.nan)
        uv[np.repeat(lengths > 0, counts)] = upright(column.values.astype(np.float64).reshape(-1, 2))
        return uv

    def _numbers(self, face: Columns, counts: Int, corner_uv: Float | None, pictures: int) -> Int:
        """The material of each face: 1 and up for the pictures, 0 for faces without a picture."""
        number = face.get("texnumber")
        given = np.zeros(len(counts), np.int64)
        if isinstance(number, np.ndarray):
            given[: len(number)] = number.astype(np.int64)
        if corner_uv is not None:
            owner = np.repeat(np.arange(len(counts)), counts)
            given[owner[np.isnan(corner_uv[:, 0])]] = -1
        if pictures and (given >= pictures).any():
            self.folder.warn(f"faces name texture {given.max()}, of {pictures} in the file (from 0); they are plain")
        return np.where((given < 0) | (given >= pictures), 0, given + 1)

    def _warn_unread(self) -> None:
        used = {*INDICES, *WEDGES, *(name for names in COLORS for name in names)}
        for name, element in self.file.elements.items():
            unread = [p.name for p in element.properties if p.name not in used and LOOKS.search(p.name)]
            if element.rows and name in {"vertex", "face", "material"} and unread:
                self.folder.warn(f"{', '.join(unread[:4])} of element {name} are not read")


def _coloured_once(folder: ModelFolder, pieces: list[Primitive], materials: Sequence[Material]) -> list[Primitive]:
    """The pieces without vertex colours if they have a picture: scans and BOP's models store a surface's colour in both."""
    single: list[Primitive] = []
    for piece in pieces:
        is_twice = piece.colors is not None and materials[piece.material].base_color_texture is not None
        if is_twice and (piece.colors != 1.0).any():
            folder.warn("has a picture and colours; the colours are used only where no picture lies")
        single.append(replace(piece, colors=None) if is_twice else piece)
    return single


def _triangles(indices: Int, counts: Int) -> Int:
    """Triangles (T, 3) of strips: each list holds several, separated by -1. Degenerate triangles, which only turn a strip, are
    left out.
    """
    place = np.arange(len(indices))
    starts = np.zeros(len(indices), np.int64)
    starts[np.cumsum(counts)[:-1][counts[1:] > 0]] = np.cumsum(counts)[:-1][counts[1:] > 0]
    ends = np.flatnonzero(indices < 0)
    starts[ends] = ends + 1
    first = np.maximum.accumulate(starts)
    last = place[(place - first >= 2) & (indices >= 0)]
    turned = (last - first[last]) % 2
    triangles = np.column_stack([indices[last - 2], indices[last - 1 + turned], indices[last - turned]])
    a, b, c = triangles.T
    return triangles[(a != b) & (b != c) & (c != a)]
