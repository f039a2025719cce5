import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewsphere.geometry.rotation import (
    compose,
    matrix_from_quaternion,
    quaternion_from_matrix,
    rigid,
    transform,
)

coordinates = st.floats(-1, 1, allow_subnormal=False)
quaternions = st.tuples(coordinates, coordinates, coordinates, coordinates).filter(lambda q: np.linalg.norm(q) > 1e-3)


@given(quaternions)
def test_matrix_and_quaternion_are_inverse(q):
    matrix = matrix_from_quaternion(q)
    np.testing.assert_allclose(matrix @ matrix.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(matrix) == pytest.approx(1)
    back = quaternion_from_matrix(matrix)
    assert back[0] >= 0
    unit = np.array(q) / np.linalg.norm(q)
    np.testing.assert_allclose(min(np.abs(unit - back).max(), np.abs(unit + back).max()), 0, atol=1e-14)


@pytest.mark.parametrize(
    ("quaternion", "image_of_x", "image_of_y"),
    [
        ((1, 0, 0, 0), (1, 0, 0), (0, 1, 0)),
        ((0, 1, 0, 0), (1, 0, 0), (0, -1, 0)),
        ((0, 0, 1, 0), (-1, 0, 0), (0, 1, 0)),
        ((0, 0, 0, 1), (-1, 0, 0), (0, -1, 0)),
        ((np.sqrt(0.5), 0, 0, np.sqrt(0.5)), (0, 1, 0), (-1, 0, 0)),  # a quarter turn about z
    ],
)
def test_quaternions_turn_as_named(quaternion, image_of_x, image_of_y):
    matrix = matrix_from_quaternion(quaternion)
    np.testing.assert_allclose(matrix[:, 0], image_of_x, atol=1e-15)
    np.testing.assert_allclose(matrix[:, 1], image_of_y, atol=1e-15)
    np.testing.assert_allclose(quaternion_from_matrix(matrix), quaternion, atol=1e-15)


def test_half_turns_have_one_name():
    for q in ([0, -1, 0, 0], [0, 0, -1, 0], [0, 0, 0, -1], [0, -0.6, 0.8, 0], [0, 0, -0.6, 0.8]):
        back = np.array(quaternion_from_matrix(matrix_from_quaternion(q)))
        assert back[np.flatnonzero(np.abs(back) > 1e-9)[0]] > 0


@pytest.mark.parametrize("bad", [np.zeros((3, 3)), np.diag([1, 1, -1]), 2 * np.eye(3), np.eye(4), np.full((3, 3), np.nan)])
def test_what_is_no_rotation_is_refused(bad):
    with pytest.raises(ValueError, match="rotation"):
        quaternion_from_matrix(bad)
    with pytest.raises(ValueError, match="not all zero"):
        matrix_from_quaternion([0, 0, 0, 0])


def test_rigid_motions_compose_and_move_points():
    rng = np.random.default_rng(1)
    a, b = (rigid(matrix_from_quaternion(rng.normal(size=4)), rng.normal(size=3)) for _ in range(2))
    np.testing.assert_allclose(compose(a, b), a @ b, atol=1e-15)
    points = rng.normal(size=(4, 5, 3))
    np.testing.assert_allclose(transform(a, points), points @ a[:3, :3].T + a[:3, 3], atol=1e-15)
    np.testing.assert_allclose(transform(a[:3, :3], points), points @ a[:3, :3].T, atol=1e-15)
