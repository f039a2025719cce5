"""Tables of points as PLY files, binary, little-endian (http://paulbourke.net/dataformats/ply)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

TYPES = {"f4": "float", "f8": "double", "u1": "uchar", "i4": "int"}
"""PLY's names of numpy's types."""


def encode_ply(vertices: NDArray[Any], comments: Iterable[str] = ()) -> bytes:
    """A file of vertices alone, a structured array (N,) whose fields are their properties; comments have no line breaks."""
    names = vertices.dtype.names or ()
    head = ["ply", "format binary_little_endian 1.0", *(f"comment {line}" for line in comments)]
    head.append(f"element vertex {len(vertices)}")
    head += [f"property {TYPES[vertices.dtype[name].str[1:]]} {name}" for name in names]
    packed = np.dtype([(name, "<" + vertices.dtype[name].str[1:]) for name in names])
    return "\n".join([*head, "end_header\n"]).encode("ascii") + vertices.astype(packed).tobytes()
