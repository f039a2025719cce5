"""Tables of points as PLY files, binary, little-endian (http://paulbourke.net/dataformats/ply)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

TYPES = {"f4": "float", "f8": "double", "u1": "uchar", "i4": "int"}
"""PLY's names for numpy's types."""


def ply_head(kind: np.dtype[Any], count: int, comments: Iterable[str] = ()) -> bytes:
    """The header of a file of this many vertices; the fields of a structured dtype are their properties."""
    head = ["ply", "format binary_little_endian 1.0", *(f"comment {line}" for line in comments), f"element vertex {count}"]
    head += [f"property {TYPES[kind[name].str[1:]]} {name}" for name in kind.names or ()]
    return "\n".join([*head, "end_header\n"]).encode("ascii")


def encode_ply(vertices: NDArray[Any], comments: Iterable[str] = ()) -> bytes:
    """A file of vertices alone, a structured array (N,) whose fields are their properties; comments have no line breaks."""
    kind = vertices.dtype
    packed = np.dtype([(name, "<" + kind[name].str[1:]) for name in kind.names or ()])
    return ply_head(kind, len(vertices), comments) + vertices.astype(packed).tobytes()
