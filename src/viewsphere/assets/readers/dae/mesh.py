"""The meshes of a COLLADA file: polygons, with holes, strips and fans, and the data that their corners refer to."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.primitive import Float, Int
from viewsphere.assets.readers.shared.coordinates import check_coordinates
from viewsphere.assets.readers.shared.polygon import flattened
from viewsphere.assets.readers.shared.polygon_proof import cut_polygons
from viewsphere.assets.readers.shared.smoothing import row_numbers
from viewsphere.codecs.srgb import linear

LINES = frozenset({"lines", "linestrips"})
WIDEST = 64
"""Greatest number of values in a source's row, and of indices in a corner: real files have up to 16."""

FACES = frozenset({"polylist", "polygons", "triangles", "trifans", "tristrips"})


@dataclass(frozen=True, eq=False)
class DaeFaces:
    """Triangles (T, 3) of one material `symbol`, and the data of their vertices; `uvs` by set number, v downwards."""

    symbol: str
    positions: Float
    triangles: Int
    normals: Float | None
    colors: Float | None
    uvs: dict[int, Float]
    vertex: Int
    """The file's own number of each vertex, to which a skin assigns weights."""


def read_mesh(folder: ModelFolder, mesh: Any) -> Iterator[DaeFaces]:
    """The faces of a `<mesh>` whose tags have no namespace, one for each of its elements in order; lines cost a warning."""
    sources = {str(source.get("id")): source for source in mesh.iterfind("source")}
    shared = {str(vertices.get("id")): vertices.findall("input") for vertices in mesh.iterfind("vertices")}
    for element in mesh:
        if element.tag in LINES:
            folder.warn("lines are left out")
        elif element.tag in FACES:
            faces = _faces(folder, element, _inputs(folder, element, sources, shared))
            if faces is not None:
                yield faces


@dataclass(frozen=True, eq=False)
class _Input:
    """Values (N, width) that corners refer to, and the column of their indices."""

    semantic: str
    set: int
    offset: int
    values: Float
    source: str


def _inputs(folder: ModelFolder, element: Any, sources: dict[str, Any], shared: dict[str, list[Any]]) -> list[_Input]:
    inputs: list[_Input] = []
    for entry in element.iterfind("input"):
        offset, name = _whole(folder, entry, "offset"), _target(entry)
        below = shared.get(name) if entry.get("semantic") == "VERTEX" else None
        for inner in [entry] if below is None else below:
            source = sources.get(_target(inner))
            if source is None:
                raise folder.error(f"the source {_target(inner)[:80]!r} of a mesh does not exist; export the model again")
            semantic = str(inner.get("semantic"))
            before = sum(one.semantic == semantic for one in inputs)
            number = _whole(folder, inner, "set", _whole(folder, entry, "set", before))
            kind = "POSITION" if semantic == "VERTEX" else semantic
            inputs.append(_Input(kind, number, offset, _values(folder, source), str(source.get("id"))[:80]))
    return inputs


def _whole(folder: ModelFolder, element: Any, attribute: str, default: int = 0) -> int:
    """A whole number of at least 0 in an attribute; `default` if it is missing or empty."""
    text = str(element.get(attribute) or default).strip()
    if not (text.isascii() and text.isdecimal() and len(text) < 12):
        raise folder.error(f"<{element.tag}> has {attribute} {text[:40]!r}: expected a whole number; the file may be damaged")
    return int(text)


def _target(element: Any) -> str:
    return str(element.get("source", "")).removeprefix("#")


def _values(folder: ModelFolder, source: Any) -> Float:
    """The rows that a source's accessor selects from its array."""
    array, accessor = source.find("float_array"), source.find("technique_common/accessor")
    numbers = numbers_of(folder, array, np.float64)
    params = [] if accessor is None else accessor.findall("param")
    stride = 3 if accessor is None else _whole(folder, accessor, "stride", 1)
    offset = 0 if accessor is None else _whole(folder, accessor, "offset")
    # A column without a name is skipped, unless a program omits all names.
    named = [i for i, param in enumerate(params) if param.get("name")] or list(range(len(params) or stride))
    if not 1 <= stride <= WIDEST or max(named) >= stride:
        raise folder.error(f"the source {str(source.get('id'))[:80]!r} has an accessor that is damaged; export the model again")
    rows = (len(numbers) - offset) // stride
    count = rows if accessor is None else min(_whole(folder, accessor, "count", rows), rows)
    return numbers[offset : offset + max(count, 0) * stride].reshape(-1, stride)[:, named]


def numbers_of(folder: ModelFolder, element: Any, kind: type[np.generic]) -> NDArray[Any]:
    """The numbers in an element's text; empty if there is no element."""
    if element is None or not (element.text or "").strip():
        return np.empty(0, kind)
    text = str(element.text)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # older numpy only warns, and keeps the numbers before an error
            return np.fromstring(text, kind, sep=" ")
    except (ValueError, DeprecationWarning):
        wrong = next((word for word in text.split() if not _is_number(word)), text.strip()[:40])
        raise folder.error(f"<{element.tag}> holds {wrong[:40]!r}: expected numbers with a decimal point") from None


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _faces(folder: ModelFolder, element: Any, inputs: Sequence[_Input]) -> DaeFaces | None:
    position = next((one for one in inputs if one.semantic == "POSITION" and one.values.shape[1] == 3), None)
    if position is None:
        raise folder.error(f"a <{element.tag}> has no positions of three coordinates; export the model again")
    width = 1 + max(_whole(folder, entry, "offset") for entry in element.iterfind("input"))
    if width > WIDEST:
        raise folder.error(f"a <{element.tag}> has an input of offset {width - 1:,}; the file may be damaged")
    index, counts = _corners(folder, element, width, position)
    if not len(counts):
        return None
    _check(folder, index, inputs)
    check_coordinates(folder, position.values, index[:, position.offset], f"source {position.source!r}: ")
    key = row_numbers(*index.T)
    _, first, corners = np.unique(key, return_index=True, return_inverse=True)
    rows = index[first]
    positions = position.values[rows[:, position.offset]]
    folder.check("MAX_TRIANGLES", int((counts - 2).sum()), "triangles")
    cut, _ = cut_polygons(folder, positions, corners.reshape(-1), counts)
    taken = [(one.semantic, one.set, one.values[rows[:, one.offset]]) for one in inputs]
    normals = next((values for kind, _, values in taken if kind == "NORMAL" and values.shape[1] == 3), None)
    colors = next((_colors(values) for kind, _, values in taken if kind == "COLOR"), None)
    uvs = {number: _uv(values) for kind, number, values in reversed(taken) if kind == "TEXCOORD" and values.shape[1] >= 2}
    return DaeFaces(
        str(element.get("material") or ""),
        positions,
        corners.reshape(-1)[cut],
        normals,
        colors,
        dict(sorted(uvs.items())),
        rows[:, position.offset],
    )


def _uv(values: Float) -> Float:
    return np.column_stack([values[:, 0], 1.0 - values[:, 1]])


def _colors(values: Float) -> Float | None:
    """Linear colours with alpha, from sRGB."""
    if values.shape[1] not in (3, 4):
        return None
    unit = np.clip(np.nan_to_num(values), 0.0, 1.0)
    return np.column_stack([linear(unit[:, :3]), unit[:, 3] if values.shape[1] == 4 else np.ones(len(values))])


def _check(folder: ModelFolder, index: Int, inputs: Sequence[_Input]) -> None:
    for one in inputs:
        column = index[:, one.offset]
        if column.min() < 0 or column.max() >= len(one.values):
            wrong = column.min() if column.min() < 0 else column.max()
            total = len(one.values)
            raise folder.error(f"a face names {one.semantic} {wrong}, expected 0 to {total - 1}; the file may be truncated")


def _corners(folder: ModelFolder, element: Any, width: int, position: _Input) -> tuple[Int, Int]:
    """Indices (C, width) of all polygons' corners one after another, and the number of corners of each, at least 3."""
    runs = [_rows(folder, p, width) for p in element.iterfind("p")]
    if element.tag == "polygons":
        runs.extend(_without_holes(folder, ph, width, position) for ph in element.iterfind("ph"))
    elif element.tag == "polylist":
        return _split(folder, runs, numbers_of(folder, element.find("vcount"), np.int64))
    elif element.tag == "triangles":
        index = np.concatenate([run[: len(run) // 3 * 3] for run in runs]) if runs else np.empty((0, width), np.int64)
        return index, np.full(len(index) // 3, 3)
    elif element.tag == "trifans":
        runs = [run[_fan(len(run))] for run in runs if len(run) > 2]
        return _split(folder, runs, np.full(sum(map(len, runs)) // 3, 3))
    elif element.tag == "tristrips":
        runs = [run[_strip(len(run))] for run in runs if len(run) > 2]
        return _split(folder, runs, np.full(sum(map(len, runs)) // 3, 3))
    return _split(folder, runs, np.array([len(run) for run in runs], np.int64))


def _rows(folder: ModelFolder, p: Any, width: int) -> Int:
    numbers = numbers_of(folder, p, np.int64)
    return numbers[: len(numbers) // width * width].reshape(-1, width)


def _split(folder: ModelFolder, runs: Sequence[Int], counts: Int) -> tuple[Int, Int]:
    """The corners and counts without polygons of fewer than three corners."""
    if not runs or not len(counts):
        return np.empty((0, 1), np.int64), np.empty(0, np.int64)
    index = np.concatenate(runs)
    if counts.min() < 0 or counts.sum() > len(index):
        raise folder.error(f"polygons need {counts.sum():,} corners, found {len(index):,}; the file may be truncated")
    small = counts < 3
    if small.any():
        folder.warn(f"{np.count_nonzero(small):,} faces of fewer than three corners left out")
    return index[: counts.sum()][np.repeat(~small, counts)], counts[~small]


def _fan(count: int) -> Int:
    step = np.arange(count - 2)
    return np.column_stack([np.zeros_like(step), step + 1, step + 2]).reshape(-1)


def _strip(count: int) -> Int:
    """Places of the corners (3 (count - 2),) of a strip's triangles, every other one turned."""
    step = np.arange(count - 2)
    odd = step % 2
    return np.column_stack([step, step + 1 + odd, step + 2 - odd]).reshape(-1)


def _without_holes(folder: ModelFolder, ph: Any, width: int, position: _Input) -> Int:
    """The corners of a polygon with holes, which are joined to its outline."""
    runs = [_rows(folder, ring, width) for ring in (*ph.findall("p")[:1], *ph.findall("h"))]
    index = np.concatenate(runs) if runs else np.empty((0, width), np.int64)
    if not len(index):
        return index
    _check(folder, index, [position])
    ends = np.cumsum([0, *map(len, runs)])
    rings = [np.arange(start, end) for start, end in pairwise(ends.tolist())]
    return index[without_holes(position.values[index[:, position.offset]], rings)]


def without_holes(points: Float, rings: Sequence[Int]) -> Int:
    """One ring (N,) of the corners of an outline, the first of `rings`, and of its holes; `points` (P, 3) are the corners'
    positions.

    The first and the last corner of each cut appear twice. Holes may have either orientation. If the outline has no area, no
    hole is joined.
    """
    outline, holes = rings[0], [ring for ring in rings[1:] if len(ring) > 2]
    local = points[outline] - points[outline[0]]
    normal = np.cross(local, np.roll(local, -1, axis=0)).sum(axis=0)
    flat = flattened(points[np.concatenate([outline, *holes])], normal)
    if flat is None or not holes:
        return outline
    ends = np.cumsum([len(outline), *map(len, holes)])
    places = [_clockwise(flat, np.arange(start, end)) for start, end in pairwise(ends.tolist())]
    places.sort(key=lambda ring: -float(flat[ring, 0].max()))
    ring = np.arange(len(outline))
    for i, hole in enumerate(places):
        ring = _joined(flat, ring, hole, places[i:])
    return np.concatenate([outline, *holes])[ring]


def _clockwise(flat: Float, ring: Int) -> Int:
    x, y = flat[ring].T
    return ring[::-1] if (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() > 0 else ring


def _joined(flat: Float, ring: Int, hole: Int, holes: Sequence[Int]) -> Int:
    """The ring with the hole: cut from the hole's corner of the largest x to the nearest visible corner."""
    hole = np.roll(hole, -int(np.argmax(flat[hole, 0])))
    start = flat[hole[0]]
    starts = np.concatenate([ring, *holes])
    ends = np.concatenate([np.roll(part, -1) for part in (ring, *holes)])
    nearest = np.argsort(((flat[ring] - start) ** 2).sum(axis=1), kind="stable")
    edges = flat[starts], flat[ends]
    seen = (i for i in nearest.tolist() if _opens_to(flat, ring, i, start) and not _is_cut(start, flat[ring[i]], *edges))
    at = next(seen, int(nearest[0]))
    return np.concatenate([ring[: at + 1], hole, hole[:1], ring[at:]])


def _opens_to(flat: Float, ring: Int, i: int, point: Float) -> bool:
    """Return whether a point is within the angle at a corner of a counter-clockwise ring."""
    before, corner, after = (flat[ring[k % len(ring)]] for k in (i - 1, i, i + 1))
    sides = _turn(before, corner, point) > 0, _turn(corner, after, point) > 0
    return bool(all(sides) if _turn(before, corner, after) >= 0 else any(sides))


def _is_cut(start: Float, end: Float, firsts: Float, seconds: Float) -> bool:
    """Return whether the line from start to end meets any edge that does not share an endpoint with it."""
    apart = _turn(start, end, firsts) * _turn(start, end, seconds) <= 0
    across = _turn(firsts, seconds, start) * _turn(firsts, seconds, end) <= 0
    shared: NDArray[np.bool_] = np.zeros(len(firsts), bool)
    for point in (start, end):
        for others in (firsts, seconds):
            shared |= (others == point).all(axis=1)
    return bool((apart & across & ~shared).any())


def _turn(a: Float, b: Float, c: Float) -> Float:
    """Twice the signed area of the triangles a b c."""
    return (b[..., 0] - a[..., 0]) * (c[..., 1] - b[..., 1]) - (b[..., 1] - a[..., 1]) * (c[..., 0] - b[..., 0])
