"""A box's corners, and what follows from them."""

import numpy as np

from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.rotation import rigid, rotation_about, transform

LOW, HIGH = (-1.0, -2.0, -3.0), (4.0, 5.0, 6.0)
BOX = Box3d.between(LOW, HIGH)


def test_a_box_along_the_axes():
    assert BOX.low.tolist() == list(LOW) and BOX.high.tolist() == list(HIGH)
    assert BOX.center.tolist() == [1.5, 1.5, 1.5] and BOX.diagonal.tolist() == [5, 7, 9] and BOX.size == (5, 9, 7)
    assert np.array_equal(Box3d.around(np.array([HIGH, LOW, (0, 0, 0)])).corners, BOX.corners)


def test_faces_lie_in_the_planes_of_their_names():
    planes = {"bottom": (2, -3), "top": (2, 6), "right": (0, -1), "front": (1, -2), "left": (0, 4), "back": (1, 5)}
    assert list(BOX.faces) == list(planes)
    for name, (axis, value) in planes.items():
        corners = BOX.faces[name]
        assert (corners[:, axis] == value).all() and len(np.unique(corners, axis=0)) == 4
        steps = np.roll(corners, -1, axis=0) - corners
        assert ((steps != 0).sum(axis=1) == 1).all()  # each next corner is one edge away


def test_edges_join_corners_that_differ_in_one_axis():
    ends = BOX.edges
    assert ends.shape == (12, 2, 3) and ((ends[:, 0] != ends[:, 1]).sum(axis=1) == 1).all()
    assert len({tuple(map(tuple, np.sort(edge, axis=0))) for edge in ends}) == 12


def test_corners_are_found_by_their_sides_wherever_the_box_is():
    motion = rigid(rotation_about(np.array([0.0, 0.0, 0.7])), np.array([1.0, 2.0, 3.0]))
    moved = Box3d(transform(motion, BOX.corners))
    sides = [(-1, -1, 1), (1, 1, -1)]
    expected = transform(motion, np.array([(-1.0, -2.0, 6.0), (4.0, 5.0, -3.0)]))
    assert np.array_equal(moved.corners_at(sides), expected)
    np.testing.assert_allclose(moved.center, transform(motion, BOX.center[None])[0], atol=1e-12)
