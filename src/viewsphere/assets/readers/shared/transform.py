"""Pieces under affine transforms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from viewsphere.assets.primitive import Float, Primitive
from viewsphere.geometry.rotation import transform


def moved(piece: Primitive, matrix: Float) -> Primitive:
    """The piece under an affine matrix (4, 4); the winding of a mirrored piece is reversed to keep its fronts."""
    linear = matrix[:3, :3]
    mirrored = bool(np.linalg.det(linear) < 0)
    # The cofactor matrix is det times the inverse transpose, and exists for singular matrices, too.
    cofactor = np.cross(linear[[1, 2, 0]], linear[[2, 0, 1]]) * (-1.0 if mirrored else 1.0)
    positions = transform(matrix, piece.positions)
    normals = None if piece.normals is None else unit(transform(cofactor, piece.normals))
    triangles = piece.triangles[:, ::-1] if mirrored else piece.triangles
    return replace(piece, positions=positions, normals=normals, triangles=triangles)


def unit(vectors: Float) -> Float:
    """Vectors (N, 3) of length one; vectors without a direction become zero."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(lengths > 0, vectors / np.where(lengths > 0, lengths, 1.0), 0.0)
