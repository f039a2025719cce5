"""Cells of meshes: overlap against clipped polygons, insides against Embree's rays, pieces that are closed or not."""

import itertools

import numpy as np
import pytest
import trimesh

from viewsphere.geometry import voxels

SIZE = (9, 11, 10)


def clipped(polygon, axis, value, sign):
    """What of a polygon lies on one side of a plane (Sutherland and Hodgman)."""
    out = []
    for p, q in zip(polygon, [*polygon[1:], *polygon[:1]], strict=True):
        a, b = sign * (p[axis] - value), sign * (q[axis] - value)
        if a >= 0:
            out.append(p)
        if (a > 0 > b) or (a < 0 < b):
            out.append(p + (q - p) * a / (a - b))
    return out


def overlaps(triangle, cell):
    """Return whether a triangle has a part in a closed cell."""
    polygon = list(triangle)
    for axis in range(3):
        for value, sign in ((cell[axis], 1), (cell[axis] + 1, -1)):
            polygon = clipped(polygon, axis, value, sign)
    return bool(polygon)


def touched(points, triangles, size=SIZE):
    owner, filled = np.full(size, -1, np.int32), np.zeros(size, np.uint8)
    rows = np.arange(len(triangles))
    voxels.touch(points, triangles.astype(np.int32), rows, owner, filled, 1)
    assert ((owner >= 0) == (filled == 1)).all()
    return owner


@pytest.mark.parametrize("seed", range(4))
def test_a_cell_is_touched_where_a_part_of_a_triangle_is_left_in_it(seed):
    rng = np.random.default_rng(seed)
    reach = (0.5, 3, 12, 300)[seed]
    points = rng.uniform(0, SIZE, (6, 1, 3)) + rng.uniform(-reach, reach, (6, 3, 3))
    points[1, 2] = points[1, 1]  # a line
    points[2] *= (1, 0, 1)
    points[2] += (0, 4.25, 0)  # flat
    owner = touched(points.reshape(-1, 3), np.arange(18).reshape(6, 3))
    for cell in itertools.product(*map(range, SIZE)):
        expected = next((t for t in range(6) if overlaps(points[t], cell)), -1)
        assert owner[cell] == expected, cell


def test_cells_are_half_open():
    points = np.array([[2.0, 1, 1], [2.0, 4, 1], [2.0, 1, 4]])
    owner = touched(points, np.array([[0, 1, 2]]))
    assert set(np.unique(np.nonzero(owner >= 0)[0])) == {2}


@pytest.mark.parametrize("corner", [(0.6, 0.6, 0.6), (0.1, 0.7, 0.9), (0.9, 0.1, 0.2)])
def test_the_last_cells_of_a_grid_are_like_all_others(corner):
    small = np.array([[0, 0, 0], [0.05, 0, 0.02], [0.01, 0.06, 0]]) + corner
    for cell in itertools.product(*((0, count - 1) for count in SIZE)):
        owner = touched(small + cell, np.array([[0, 1, 2]]))
        assert owner[cell] == 0 and (owner >= 0).sum() == 1


def inside(mesh, size=SIZE, rows=None):
    owner, filled = np.full(size, -1, np.int32), np.zeros(size, np.uint8)
    rows = np.arange(len(mesh.faces)) if rows is None else rows
    voxels.fill(np.array(mesh.vertices, float), np.array(mesh.faces, np.int32), rows, owner, filled, 2)
    return filled == 2


SOLIDS = {
    "ball": lambda: trimesh.creation.icosphere(3, 3.9),
    "torus": lambda: trimesh.creation.torus(3.0, 1.2),
    "box": lambda: trimesh.creation.box((5, 7, 3)),
    "pipe": lambda: trimesh.creation.annulus(1.5, 4.0, 7),
    "inverted": lambda: trimesh.creation.icosphere(2, 3),
}


@pytest.mark.parametrize("name", SOLIDS)
@pytest.mark.parametrize("seed", range(3))
def test_insides_are_those_of_embree_s_rays(name, seed):
    pytest.importorskip("embreex")
    mesh, rng = SOLIDS[name](), np.random.default_rng(seed)
    if name == "inverted":
        mesh.invert()
    mesh.apply_transform(trimesh.transformations.random_rotation_matrix(rng.random(3)))
    mesh.apply_translation(np.array(SIZE) / 2 + rng.uniform(-3, 3, 3))  # often beyond the grid
    centers = np.argwhere(np.ones(SIZE)) + 0.5
    expected = mesh.contains(centers).reshape(SIZE)
    assert expected.any() and not expected.all()
    assert (inside(mesh) == expected).all()


def test_what_reaches_into_one_another_is_full():
    one, other = trimesh.creation.box((4, 4, 4)), trimesh.creation.box((4, 4, 4))
    one.apply_translation((3.1, 4.2, 4.3))
    other.apply_translation((5.1, 5.2, 5.3))
    both = trimesh.util.concatenate([one, other])
    assert (inside(both) == (inside(one) | inside(other))).all()
    assert inside(both).sum() < inside(one).sum() + inside(other).sum()


def test_closed_pieces():
    ball, box, sheet = trimesh.creation.icosphere(1), trimesh.creation.box(), trimesh.creation.box()
    box.apply_translation((5, 0, 0))
    sheet.apply_translation((9, 0, 0))
    sheet.update_faces(np.arange(11))  # a triangle of the last box is missing
    soup = np.concatenate([mesh.vertices[mesh.faces] for mesh in (ball, box, sheet)]).reshape(-1, 3).astype(np.float32)
    found = voxels.closed(soup, np.arange(len(soup), dtype=np.int32).reshape(-1, 3))
    assert found.tolist() == [True] * (len(ball.faces) + 12) + [False] * 11
    flipped = box.copy()
    flipped.faces[0] = flipped.faces[0][::-1]
    assert not voxels.closed(flipped.vertices.astype(np.float32), flipped.faces.astype(np.int32)).any()
    assert len(voxels.closed(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32))) == 0
