"""STL, binary and text: triangles; in text files each solid is a part."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.primitive import FileFacts, Float, Primitive, assemble
from viewsphere.assets.readers.shared.coordinates import check_coordinates
from viewsphere.assets.readers.shared.smoothing import creased
from viewsphere.codecs.srgb import linear

HEADER = 84
BOM = b"\xef\xbb\xbf"
FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
LOOKED_AT = 1024
"""Number of leading bytes without a NUL in a text file: a binary file has NULs in its count and its first numbers."""

OWN_COLOR = 0x8000
"""Bit of a facet's attribute. In files of Materialise Magics, with COLOR= in the header, it means that the facet has no colour
of its own.
"""

START = re.compile(rb"(?i)\s*(#[^\r\n]*\s+)*solid\b")
COMMENT = re.compile(rb"(?m)(^|(?<=[ \t]))#.*$")
SOLID = re.compile(rb"(?im)^[ \t]*solid\b[ \t]*(.*)$")
END = re.compile(rb"(?im)^[ \t]*endsolid\b.*$")
FACETS = re.compile(rb"(?i)\bfacet\b")
VERTEX = re.compile(rb"(?i)\bvertex[ \t]+([^\n]*)")


def read_stl(folder: ModelFolder) -> tuple[Mesh, FileFacts]:
    """The file's triangles, edges smooth up to a crease. Raises ModelError for a truncated or damaged file.

    Bytes after the declared facets are ignored. Facet colours are kept if the header announces them (Materialise Magics).
    """
    data = folder.read_model()
    pieces = _text_solids(folder, data) if _is_text(data) else [_binary(folder, data)]
    return assemble(folder, [creased(p) for p in pieces], [Material(name="default")], _facts(folder))


def _facts(folder: ModelFolder) -> FileFacts:
    return FileFacts(folder.model, "stl", "+z", "-y", 1.0)


def _is_text(data: bytes) -> bool:
    """Return whether the file is text; many binary files begin with "solid", too."""
    head = data[:LOOKED_AT].removeprefix(BOM)
    return START.match(head) is not None and b"\0" not in head


def _binary(folder: ModelFolder, data: bytes) -> Primitive:
    if len(data) < HEADER:
        raise folder.error(
            f"expected the {HEADER} bytes of an STL header, found {len(data)}: truncated, or another kind of file"
        )
    count = int.from_bytes(data[80:84], "little")
    room = (len(data) - HEADER) // FACET.itemsize
    if count > room:
        raise folder.error(f"promises {count:,} triangles, has bytes for {room:,}: truncated or damaged")
    folder.check("MAX_TRIANGLES", count, "triangles")
    facets = np.frombuffer(data, FACET, count, HEADER)
    return _piece(
        folder, folder.model.stem, facets["corners"].astype(np.float64), _magics_colors(data[:80], facets["attribute"])
    )


def _magics_colors(header: bytes, attribute: NDArray[np.uint16]) -> Float | None:
    """Linear colours (T, 4) of the facets in a file of Materialise Magics, None in all others."""
    at = header.find(b"COLOR=")
    if at < 0 or len(header) < at + 10:
        return None
    whole = np.frombuffer(header, np.uint8, 4, at + 6) / 255
    fifths = np.stack([(attribute >> shift) & 31 for shift in (0, 5, 10)], axis=1) / 31
    color = np.where((attribute & OWN_COLOR).astype(bool)[:, None], whole[:3], fifths)
    return np.column_stack([linear(color), np.full(len(color), whole[3])])


def _text_solids(folder: ModelFolder, data: bytes) -> list[Primitive]:
    text = END.sub(b"", COMMENT.sub(b"", data.removeprefix(BOM).replace(b"\r", b"\n")))
    solids = list(SOLID.finditer(text))
    ends = [*(solid.start() for solid in solids[1:]), len(text)]
    pieces = [
        _piece(folder, _name(solid[1]) or folder.model.stem, _text_corners(folder, text[solid.end() : end]), None)
        for solid, end in zip(solids, ends, strict=True)
    ]
    folder.check("MAX_TRIANGLES", sum(len(piece.triangles) for piece in pieces), "triangles")
    return [piece for piece in pieces if len(piece.triangles)]


def _name(words: bytes) -> str:
    return words.decode("utf-8", "replace").strip()[:80]


def _text_corners(folder: ModelFolder, text: bytes) -> Float:
    """Corners (T, 3, 3) of one solid's facets."""
    rows = VERTEX.findall(text)
    facets = len(FACETS.findall(text))
    try:
        numbers = np.array(b" ".join(rows).split(), dtype=bytes).astype(np.float64) if rows else np.zeros(0)
    except ValueError as error:
        raise folder.error(f"a vertex is no row of three numbers ({error}): damaged, or written with decimal commas") from None
    if numbers.size != 3 * len(rows) or len(rows) != 3 * facets:
        raise folder.error(
            f"expected 3 vertices of 3 numbers for each of {facets} facets, found {len(rows)}: truncated or damaged"
        )
    return numbers.reshape(-1, 3, 3)


def _piece(folder: ModelFolder, name: str, corners: Float, colors: Float | None) -> Primitive:
    positions, triangles = corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3)
    check_coordinates(folder, positions, triangles, f"solid {name!r}: ", corners=3)
    return Primitive(
        part=name,
        material=0,
        positions=positions,
        triangles=triangles,
        colors=None if colors is None else np.repeat(colors, 3, axis=0),
    )
