"""OFF with normals, colours, texture coordinates and polygons (http://www.geomview.org/docs/html/OFF.html)."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.primitive import FileFacts, Float, Int, assemble
from viewsphere.assets.readers.shared.numbers import numbers_in
from viewsphere.assets.readers.shared.polygon_pieces import (
    Polygons,
    brightest_of,
    linear_colors,
    pieces_of,
    upright,
    with_alpha,
)

PREFIXES = ("ST", "C", "N", "4", "n")
HEADER = re.compile(rb"\s*(ST)?(C)?(N)?(4)?(n)?(?:OFF|off)(?![A-Za-z])")
COMMENT = re.compile(rb"#[^\r\n]*")


def read_off(folder: ModelFolder) -> tuple[Mesh, FileFacts]:
    """The file as one mesh of one part: up +Z, front -Y, unit 1 (OFF has no rule for any).

    Colours of vertices or faces are read as sRGB. Without normals, edges are smooth up to a crease. Raises ModelError.
    """
    polygons = _Off.parsed(folder, folder.read_model()).polygons()
    pieces, materials = with_alpha(folder, pieces_of(folder, polygons), [Material(name="default")])
    facts = FileFacts(folder.model, "off", "+z", "-y", 1.0)
    return assemble(folder, pieces, materials, facts)


@dataclass(frozen=True, eq=False)
class _Off:
    """All numbers of a file after its counts, and for each line with numbers the index of its first number and their count."""

    folder: ModelFolder
    has: dict[str, bool]
    vertices: int
    faces: int
    numbers: Float
    starts: Int
    widths: Int

    @classmethod
    def parsed(cls, folder: ModelFolder, data: bytes) -> _Off:
        """The file's numbers, checked to be enough for its declared counts."""
        text = COMMENT.sub(b"", data)
        header = HEADER.match(text)
        if header is None and not re.match(rb"\s*\d+\s+\d+(\s+\d+)?\s", text):
            raise folder.error("expected an OFF file, which begins with 'OFF' and the numbers of its vertices and faces")
        begin = 0 if header is None else header.end()
        has: dict[str, bool] = {prefix: header is not None and bool(header[i]) for i, prefix in enumerate(PREFIXES, 1)}
        if has["n"] or re.match(rb"\s*BINARY", text[begin:]):
            raise folder.error("is an OFF file of more than three dimensions, or a binary one; export it as text or as PLY")
        body = text[begin:]
        counts = re.match(rb"\s*(\d{1,12})\s+(\d{1,12})[^\S\r\n]*(?:-?\d{1,12})?(?=\s|$)", body)
        if counts is None:
            raise folder.error("expected the numbers of its vertices and faces behind 'OFF'; the file may be damaged")
        vertices, faces = int(counts[1]), int(counts[2])
        if vertices + faces > len(data):
            raise folder.error(f"promises {vertices + faces:,} elements in {len(data):,} bytes: truncated or damaged")
        rest = body[counts.end() :]
        numbers = numbers_in(folder, rest, data.count(b"\n") - rest.count(b"\n"))
        return cls(folder, has, vertices, faces, numbers, *_lines(rest))

    def polygons(self) -> Polygons:
        """The faces, with the data in their lines and in the vertices' lines."""
        if not self.faces:
            raise self.folder.error(f"holds {self.vertices:,} points and no faces; export a mesh of faces")
        if len(self.starts) < self.vertices + self.faces:
            wanted = f"{self.vertices:,} lines of vertices and {self.faces:,} of faces"
            raise self.folder.error(f"promises {wanted}, found {len(self.starts):,} lines: truncated or damaged")
        columns = self._vertex_columns()
        positions = self._taken(columns, 4 if self.has["4"] else 3)
        normals = self._taken(columns, 3) if self.has["N"] else None
        uv = columns.pop() if self.has["ST"] else None
        coordinates = None if uv is None else upright(np.column_stack([columns.pop(), uv]))
        corners, counts, face_colors = self._faces()
        return Polygons(
            positions=positions[:, :3] / positions[:, 3:] if self.has["4"] else positions,
            corners=corners,
            counts=counts,
            material=np.zeros(len(counts), np.int64),
            normals=normals,
            colors=self._vertex_colors(columns),
            uv=coordinates,
            face_colors=None if len(columns) >= 3 else face_colors,
        )

    def _vertex_columns(self) -> list[Float]:
        """Columns of the vertices' lines, which all have the same number of numbers."""
        least = 4 if self.has["4"] else 3
        least += 3 * self.has["N"] + 3 * self.has["C"] + 2 * self.has["ST"]
        widths = self.widths[: self.vertices]
        width = int(widths[0]) if len(widths) else least
        wrong = np.flatnonzero((widths != width) | (widths < least))
        if wrong.size:
            expected = f"expected {max(width, least)} numbers, found {widths[wrong[0]]}"
            raise self.folder.error(f"vertex {wrong[0] + 1:,}: {expected}; export the model again")
        table = self.numbers[: self.vertices * width].reshape(-1, width)
        return [table[:, i] for i in range(width)]

    @staticmethod
    def _taken(columns: list[Float], count: int) -> Float:
        """The first columns, which are removed."""
        taken, columns[:] = columns[:count], columns[count:]
        return np.column_stack(taken)

    def _vertex_colors(self, columns: list[Float]) -> Float | None:
        """Linear colours of three or four columns; some programs write them although the header does not declare them."""
        if len(columns) in (3, 4):
            return linear_colors(columns, brightest_of(columns, None))
        if columns:
            self.folder.warn(f"{len(columns)} more numbers of each vertex are not read")
        return None

    def _faces(self) -> tuple[Int, Int, Float | None]:
        """Corners of all faces, their number per face, and the faces' colours, white for faces without one."""
        starts = self.starts[self.vertices :][: self.faces]
        widths = self.widths[self.vertices :][: self.faces]
        counts = self.numbers[starts].astype(np.int64)
        wrong = np.flatnonzero((counts < 0) | (counts + 1 > widths) | (counts != self.numbers[starts]))
        if wrong.size:
            at = wrong[0]
            expected = f"expected a number of corners and as many vertices, found {widths[at]} numbers"
            raise self.folder.error(f"face {at + 1:,}: {expected}, the first {self.numbers[starts[at]]:g}")
        corners = self.numbers[_ranges(starts + 1, counts)]
        if (corners != np.trunc(corners)).any():
            raise self.folder.error("a face names a vertex by a number that is not whole")
        return corners.astype(np.int64), counts, self._face_colors(starts + 1 + counts, widths - 1 - counts)

    def _face_colors(self, starts: Int, widths: Int) -> Float | None:
        colors = np.ones((len(starts), 4))
        given = widths >= 3
        if (widths[~given] > 0).any():
            self.folder.warn("colours of faces by the number of a colour map are not read")
        if not given.any():
            return None
        first = [self.numbers[starts[given] + i] for i in range(3)]
        alpha = np.full(len(first[0]), np.nan)
        alpha[widths[given] > 3] = self.numbers[(starts + 3)[given & (widths > 3)]]
        brightest = brightest_of([*first, alpha], None)
        colors[given] = linear_colors([*first, np.where(np.isnan(alpha), brightest, alpha)], brightest)
        return colors


def _lines(text: bytes) -> tuple[Int, Int]:
    """For each line with numbers, the index of its first number among all numbers, and their count."""
    octets = np.frombuffer(text, np.uint8)
    is_blank = octets <= 32
    begins = ~is_blank
    begins[1:] &= is_blank[:-1]
    is_end = (octets == 10) | ((octets == 13) & np.append(octets[1:] != 10, True))
    line = np.cumsum(is_end)[np.flatnonzero(begins)]
    _, starts, widths = np.unique(line, return_index=True, return_counts=True)
    return starts, widths


def _ranges(starts: Int, counts: Int) -> NDArray[np.int64]:
    """Runs of whole numbers one after another: `counts` of them from each start."""
    before = np.cumsum(counts) - counts
    return np.repeat(starts - before, counts) + np.arange(int(counts.sum()))
