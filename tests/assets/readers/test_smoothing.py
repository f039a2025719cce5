"""Shading normals of files that give none: block by block the same as all at once, to the last bit."""

import math

import numpy as np
import pytest

from viewsphere.assets import primitive
from viewsphere.assets.primitive import Primitive, face_normals, used_numbers
from viewsphere.assets.readers.shared import smoothing
from viewsphere.assets.readers.shared.smoothing import CREASE_DEG, MAX_VALENCE, creased, row_numbers
from viewsphere.assets.readers.shared.transform import unit


def at_once(piece, groups):
    """The normals of corners, one after another; those around its point count in the order next, one before, next but one."""
    corners = piece.triangles.reshape(-1)
    directions = unit(face_normals(piece.positions, piece.triangles))
    turned = np.repeat(directions, 3, axis=0) * smoothing._angles(piece.positions, piece.triangles)[:, None]
    _, point = np.unique(piece.positions + 0.0, axis=0, return_inverse=True)
    point = point.reshape(-1)[corners]
    normals = turned.copy()
    for i in range(len(corners)):
        around = np.flatnonzero(point == point[i])
        own = int(np.flatnonzero(around == i)[0])
        for shift in range(1, min(MAX_VALENCE, len(around))):
            for place in (own + shift, own - shift):
                if not 0 <= place < len(around) or around[place] // 3 == i // 3:
                    continue
                a, b = i // 3, around[place] // 3
                close = np.einsum("ij,ij->i", directions[[a]], directions[[b]])[0] > math.cos(math.radians(CREASE_DEG))
                if close if groups is None else groups[a] == groups[b] != 0:
                    normals[i] += turned[around[place]]
    return unit(normals)


def random_piece(seed):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(4, 40))
    positions = rng.integers(0, 3, (count, 3)) * 0.5 if seed % 2 else rng.normal(size=(count, 3))
    piece = Primitive(
        "a", 0, positions * (-1.0) ** seed, rng.integers(0, count, (int(rng.integers(1, 80)), 3)), uv0=rng.random((count, 2))
    )
    return piece, rng.integers(0, 3, len(piece.triangles)) if seed % 3 == 0 else None


@pytest.mark.parametrize("seed", range(12))
def test_smooth_normals_are_those_of_all_corners_at_once(seed, monkeypatch):
    piece, groups = random_piece(seed)
    for module in (primitive, smoothing):
        monkeypatch.setattr(module, "BLOCK", 7)
    made = creased(piece, groups)
    corners, normals = piece.triangles.reshape(-1), at_once(piece, groups)
    assert made.normals[made.triangles.reshape(-1)].astype(np.float32).tobytes() == normals.astype(np.float32).tobytes()
    assert np.array_equal(made.positions[made.triangles.reshape(-1)], piece.positions[corners])
    assert np.array_equal(made.uv0[made.triangles.reshape(-1)], piece.uv0[corners])
    rows = np.column_stack([corners, np.ascontiguousarray(normals.astype(np.float32)).view(np.int32)])
    _, first, inverse = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    assert np.array_equal(made.triangles.reshape(-1), inverse.reshape(-1))
    assert np.array_equal(made.normals, normals[first])


def test_a_vertex_of_many_sharp_faces_has_a_normal_of_each(monkeypatch):
    turns = np.arange(40) * 2.0
    rim = np.column_stack([np.cos(turns), np.sin(turns), turns])
    piece = Primitive("fan", 0, np.vstack([np.zeros(3), rim]), np.array([[0, i, i + 1] for i in range(1, 40)]))
    wanted = creased(piece, np.zeros(39, np.int64))
    assert len(np.unique(wanted.triangles[:, 0])) == 39
    monkeypatch.setattr(smoothing, "ROUNDS", 1000)
    assert np.array_equal(creased(piece, np.zeros(39, np.int64)).triangles, wanted.triangles)


def test_nothing_is_smooth_without_triangles():
    assert len(creased(Primitive("none", 0, np.zeros((3, 3)), np.zeros((0, 3), np.int64))).triangles) == 0


def test_rows_are_numbered_in_their_order():
    rng = np.random.default_rng(0)
    rows = rng.integers(-2, 2, (200, 3)).astype(float)
    assert np.array_equal(row_numbers(*rows.T), np.unique(rows, axis=0, return_inverse=True)[1].reshape(-1))
    assert row_numbers(np.array([0.0, -0.0])).tolist() == [0, 0]


def test_used_numbers_are_those_of_unique():
    numbers = np.random.default_rng(0).integers(0, 50, (30, 3))
    used, places = used_numbers(numbers, 60)
    wanted, inverse = np.unique(numbers, return_inverse=True)
    assert np.array_equal(used, wanted) and np.array_equal(places, inverse.reshape(-1, 3))
