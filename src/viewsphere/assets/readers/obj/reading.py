"""Wavefront OBJ: our own reader, to keep parts, several materials and smoothing groups.

http://www.martinreddy.net/gfx/3d/OBJ.spec; vertex colours as `v x y z r g b` (sRGB) by common use.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from itertools import islice

import numpy as np

from viewsphere.assets.appearance.alpha import with_alpha_modes
from viewsphere.assets.mesh import Material, Mesh
from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.primitive import FileFacts, Float, Int, Primitive, assemble, compact
from viewsphere.assets.readers.obj.mtl import read_materials
from viewsphere.assets.readers.obj.text import Library, read_texts
from viewsphere.assets.readers.shared.coordinates import check_coordinates
from viewsphere.assets.readers.shared.polygon_proof import cut_polygons
from viewsphere.assets.readers.shared.smoothing import creased
from viewsphere.assets.readers.shared.text import number_of, numeric_words, statements, uncommented
from viewsphere.codecs.srgb import linear
from viewsphere.errors import ModelError

LEFT_OUT = {"l": "line", "p": "point", "curv": "curve", "curv2": "curve", "surf": "surface"}
"""Elements that are not read, by keyword."""


def read_obj(folder: ModelFolder) -> tuple[Mesh, FileFacts]:
    """The file as one mesh: up +Y, front +Z, unit 1 (OBJ has no rule for either).

    Parts are the objects (`o`) if there are several, else the groups (`g`). If normals are missing, edges are smoothed by the
    file's smoothing groups, or without groups by their angle. Curves, surfaces, lines and points are left out. Malformed
    numbers are refused with their line. Raises ModelError.
    """
    text, libraries = read_texts(folder)
    source = _Source(statements(text))
    source.read()
    for what, count in source.left_out.items():
        folder.leave_out(count, what)
    if not source.counts:
        raise _without_faces(folder, source)
    whole, owner = _whole(folder, source)
    materials, stated, material_of = _materials(folder, source, libraries)
    parts = np.array(source.parts())[owner]
    material = np.array([material_of[name] for name in source.materials])[np.array(source.face_material)[owner]]
    facts = FileFacts(folder.model, "obj", "+y", "+z", 1.0)
    pieces = _pieces(whole, parts, source.part_names(), material)
    return assemble(folder, pieces, with_alpha_modes(folder, pieces, materials, stated), facts)


@dataclass(eq=False)
class _Source:
    """The file's statements by kind; faces hold indices into `materials`, `objects` and `groups`."""

    lines: list[str]
    v: list[str] = field(default_factory=list[str])
    vt: list[str] = field(default_factory=list[str])
    vn: list[str] = field(default_factory=list[str])
    corners: list[str] = field(default_factory=list[str])
    counts: list[int] = field(default_factory=list[int])
    materials: dict[str, int] = field(default_factory=lambda: {"": 0})
    objects: dict[str, int] = field(default_factory=lambda: {"": 0})
    groups: dict[str, int] = field(default_factory=lambda: {"": 0})
    face_material: list[int] = field(default_factory=list[int])
    face_object: list[int] = field(default_factory=list[int])
    face_group: list[int] = field(default_factory=list[int])
    face_smoothing: list[int] = field(default_factory=list[int])
    smoothing_stated: bool = False
    left_out: dict[str, int] = field(default_factory=dict[str, int])

    def read(self) -> None:
        """Collect all statements by kind."""
        state = {"usemtl": 0, "o": 0, "g": 0, "s": 0}
        names = {"usemtl": self.materials, "o": self.objects, "g": self.groups}
        plain = {"v": self.v, "vt": self.vt, "vn": self.vn}
        for line in self.lines:
            keyword, _, rest = line.partition(" ")
            if keyword in plain:
                plain[keyword].append(rest)
            elif keyword in {"f", "fo"}:
                self._face(rest, state)
            elif keyword in names:
                table = names[keyword]
                state[keyword] = table.setdefault(rest.strip(), len(table))
            elif keyword == "s":
                self.smoothing_stated = True
                state["s"] = int(rest) if rest.strip().isdecimal() and len(rest) < 10 else 0
            elif keyword in LEFT_OUT:
                self.leave_out(LEFT_OUT[keyword])

    def leave_out(self, what: str) -> None:
        """Count an element that is not read."""
        self.left_out[what] = self.left_out.get(what, 0) + 1

    def where(self, keyword: str, number: int) -> int:
        """The line of the statement of this kind with this number, counted from 0."""
        places = (i for i, line in enumerate(self.lines, 1) if line.partition(" ")[0] == keyword)
        return next(islice(places, number, None))

    def _face(self, rest: str, state: dict[str, int]) -> None:
        tokens = rest.partition("#")[0].split()
        if "-" in rest:
            tokens = [self._absolute(token) for token in tokens]
        if len(tokens) < 3:
            self.leave_out("face of fewer than three corners")
            return
        self.corners.extend(tokens)
        self.counts.append(len(tokens))
        self.face_material.append(state["usemtl"])
        self.face_object.append(state["o"])
        self.face_group.append(state["g"])
        self.face_smoothing.append(state["s"])

    def _absolute(self, token: str) -> str:
        """A face's corner with its relative indices (-1 is the last element so far) made absolute."""
        totals = (len(self.v), len(self.vt), len(self.vn))
        return "/".join(
            str(total + 1 + int(index)) if index.startswith("-") and index[1:].isdecimal() else index
            for index, total in zip(token.split("/"), totals, strict=False)
        )

    def face_with(self, token: str) -> int | None:
        """The first line of a face with this corner."""
        return next((i for i, line in enumerate(self.lines, 1) if line.startswith("f") and token in line.split()), None)

    def parts(self) -> list[int]:
        """The part of each face: its object if the file has several, else its group."""
        return self.face_object if len(set(self.face_object)) > 1 else self.face_group

    def part_names(self) -> list[str]:
        """Names of the parts that `parts` counts."""
        if len(set(self.face_object)) > 1:
            return [name or "object" for name in self.objects]
        whole = next((name for name, index in self.objects.items() if index == self.face_object[0]), "") or "object"
        if len(set(self.face_group)) > 1:
            return [name or whole for name in self.groups]
        return [whole if whole != "object" else name or whole for name in self.groups]


def _whole(folder: ModelFolder, source: _Source) -> tuple[Primitive, Int]:
    """Return every triangle as one piece, and the face of each."""
    positions, colors = _vertices(folder, source)
    uv = np.nan_to_num(_padded(_rows(folder, source, "vt", 1, 2), 2, 0.0))
    vectors = _padded(_rows(folder, source, "vn", 3, 3), 3, np.nan)
    table: dict[str, int] = {}
    corners = np.array([table.setdefault(token, len(table)) for token in source.corners])
    indices = _corner_indices(folder, source, list(table), (len(positions), len(uv), len(vectors)))
    at, uv_at, normal_at = indices.T
    check_coordinates(folder, positions, at, line_of=lambda row: source.where("v", row))
    cut, owner = cut_polygons(folder, positions[at], corners, np.array(source.counts))
    whole = Primitive(
        part="",
        material=0,
        positions=positions[at],
        triangles=corners[cut],
        normals=_taken(vectors, normal_at),
        uv0=_flipped(_taken(uv, uv_at)),
        colors=None if colors is None else colors[at],
    )
    if whole.normals is None:
        groups = np.array(source.face_smoothing)[owner] if source.smoothing_stated else None
        whole = creased(whole, groups)
    return whole, owner


def _taken(values: Float, at: Int) -> Float | None:
    """Rows of the values at these indices, zero where the index is -1; None if all indices are -1."""
    if not len(values) or (at < 0).all():
        return None
    return np.where(at[:, None] < 0, 0.0, values[at])


def _flipped(uv: Float | None) -> Float | None:
    """Texture coordinates with v flipped: OBJ's v runs upwards, glTF's downwards."""
    return None if uv is None else np.column_stack([uv[:, 0], 1.0 - uv[:, 1]])


def _corner_indices(folder: ModelFolder, source: _Source, tokens: list[str], totals: tuple[int, int, int]) -> Int:
    """Position, uv and normal index of each distinct corner, (N, 3), from 0; -1 where a corner has none."""
    indices = np.full((len(tokens), 3), -1, np.int64)
    for row, token in enumerate(tokens):
        for column, text in enumerate(token.split("/")[:3]):
            if text:
                if not text.isdecimal() or len(text) > 12 or not text.isascii():
                    expected = f"expected a face corner like 1/2/3, found {token[:40]!r}; export the model again"
                    raise folder.error(expected, source.face_with(token))
                indices[row, column] = int(text) - 1
    for column, (name, total) in enumerate(zip(("vertex", "texture coordinate", "normal"), totals, strict=True)):
        if column and not total and (indices[:, column] >= 0).any():
            folder.warn(f"faces name {name}s, but the file holds none; they are read without")
            indices[:, column] = -1
        # A missing position, index 0 and an index beyond the last are all outside.
        used = indices[:, column] if column == 0 else indices[indices[:, column] >= 0, column]
        wrong = used[(used < 0) | (used >= total)]
        if wrong.size:
            raise folder.error(f"a face names {name} {wrong[0] + 1}, expected 1 to {total}; the file may be truncated")
        if column and total and not used.size:
            folder.warn(f"{total} {name}s are not used: no face names one")
    return indices


def _without_faces(folder: ModelFolder, source: _Source) -> ModelError:
    """Return the error of a file without faces."""
    if not source.v:
        return folder.error("no triangles found: no line begins with 'v', so this is no OBJ file; name a model file")
    folder.leave_out(len(source.v), "vertex")
    return folder.nothing_left()


def _vertices(folder: ModelFolder, source: _Source) -> tuple[Float, Float | None]:
    """Positions (V, 3) and linear colours (V, 4) or None; a single fourth number is a weight for curves."""
    values = _padded(_rows(folder, source, "v", 3, 6), 6, np.nan)
    given = np.isfinite(values[:, 3:6]).all(axis=1, keepdims=True)
    if any(line.startswith("#MRGB") for line in source.lines):
        folder.warn("colours of ZBrush (#MRGB) are not read; export colours as `v x y z r g b`")
    if not given.any():
        return values[:, :3], None
    srgb = np.where(given, values[:, 3:6], 1.0)
    srgb = np.clip(srgb / (255.0 if srgb.max() > 1.0 else 1.0), 0.0, 1.0)
    return values[:, :3], np.column_stack([linear(srgb), np.ones(len(values))])


def _rows(folder: ModelFolder, source: _Source, keyword: str, least: int, width: int) -> Float:
    """Numbers of each line of a kind, (N, at most `width`), NaN for missing numbers beyond the `least`."""
    lines: list[str] = getattr(source, keyword)
    rows = [line.split()[:width] for line in lines]
    most = max(map(len, rows), default=0)
    if all(len(row) == most for row in rows) and most >= least and not any("_" in line for line in lines):
        try:
            return np.fromiter((float(token) for row in rows for token in row), np.float64).reshape(-1, max(most, 1))
        except ValueError:
            pass  # a comment after numbers, or a word that is not a number
    values = np.full((len(rows), width), np.nan)
    for row, line in enumerate(lines):
        tokens = numeric_words(line)[:width]
        numbers = [number_of(token) for token in tokens]
        if None in numbers or len(numbers) < least:
            wrong = tokens[numbers.index(None)] if None in numbers else line
            raise folder.error(_no_number(wrong, keyword, least), source.where(keyword, row))
        values[row, : len(numbers)] = numbers
    return values


def _no_number(text: str, keyword: str, least: int) -> str:
    """Return the reason why a statement's text cannot be read, and the fix."""
    if re.fullmatch(r"[+-]?\d+,\d+(?:[eE][+-]?\d+)?", text):
        return f"{text!r} has a decimal comma; export the model with decimal points"
    return f"expected {least} or more numbers behind {keyword!r}, found {text[:40]!r}; the file may be truncated or damaged"


def _padded(values: Float, width: int, empty: float) -> Float:
    """The first `width` columns; missing columns are filled with `empty`."""
    missing = max(width - values.shape[1], 0)
    return np.pad(values[:, :width], ((0, 0), (0, missing)), constant_values=empty)


def _materials(
    folder: ModelFolder, source: _Source, libraries: list[Library]
) -> tuple[list[Material], set[int], dict[str, int]]:
    """Materials, the indices of those that state their opacity, and the index of each by the name in faces; the first replaces
    unknown ones.
    """
    materials, stated = [Material(name="default")], set[int]()
    known = read_materials(folder, libraries, set(source.materials) | set(map(uncommented, source.materials)))
    index: dict[str, int] = {}
    for name in source.materials:
        entry = known.get(name) or known.get(uncommented(name))
        index[name] = 0 if entry is None else len(materials)
        if entry is not None:
            materials.append(entry.material)
            stated |= {index[name]} if entry.states_opacity else set()
        elif name and libraries:
            folder.warn(f"material {name!r} is in no material library; it is plain white")
    return materials, stated, index


def _pieces(whole: Primitive, part: Int, names: list[str], material: Int) -> list[Primitive]:
    """The piece `whole` cut by part and material, in order of the file's first face of each."""
    key = part * (int(material.max()) + 1) + material
    _, first, run = np.unique(key, return_index=True, return_inverse=True)
    rank = np.empty(len(first), np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    run = rank[run.reshape(-1)]
    order = np.argsort(run, kind="stable")
    pieces: list[Primitive] = []
    for members in np.split(order, np.flatnonzero(np.diff(run[order])) + 1):
        run_piece = replace(whole, triangles=whole.triangles[members], material=int(material[members[0]]))
        pieces.append(compact(replace(run_piece, part=names[int(part[members[0]])])))
    return pieces
