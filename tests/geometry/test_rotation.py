from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewsphere.geometry.rotation import (
    compose,
    matrix_from_quaternion,
    quaternion_from_matrix,
    quaternion_product,
    rigid,
    rotation_about,
    slerp,
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


def test_slerp_turns_evenly_and_the_shorter_way():
    rng = np.random.default_rng(2)
    for _ in range(50):
        a, b = (q / np.linalg.norm(q) for q in rng.normal(size=(2, 4)))
        steps = [slerp(a, b, share) for share in np.linspace(0, 1, 11)]
        between = [abs(float(p @ q)) for p, q in pairwise(steps)]
        np.testing.assert_allclose(between, np.cos(np.arccos(min(abs(a @ b), 1)) / 10), atol=1e-12)
        np.testing.assert_allclose(np.linalg.norm(steps, axis=1), 1, atol=1e-14)
        np.testing.assert_allclose(matrix_from_quaternion(steps[0]), matrix_from_quaternion(a), atol=1e-14)
        np.testing.assert_allclose(matrix_from_quaternion(steps[-1]), matrix_from_quaternion(b), atol=1e-14)


def test_slerp_between_equal_and_nearly_equal_rotations():
    a = np.array([1.0, 0, 0, 0])
    assert slerp(a, -a, 0.3).tolist() == a.tolist()
    near = np.array([np.cos(1e-7), np.sin(1e-7), 0, 0])
    np.testing.assert_allclose(slerp(a, near, 0.25)[1], 2.5e-8, rtol=1e-12)


def test_rotation_about_a_vector():
    np.testing.assert_allclose(rotation_about([0, 0, np.pi / 2]) @ [1, 0, 0], [0, 1, 0], atol=1e-15)
    assert (rotation_about([0, 0, 0]) == np.eye(3)).all()
    rng = np.random.default_rng(4)
    for vector in rng.normal(size=(50, 3)) * 3:
        k = np.array([[0, -vector[2], vector[1]], [vector[2], 0, -vector[0]], [-vector[1], vector[0], 0]])
        angle = np.linalg.norm(vector)
        rodrigues = np.eye(3) + np.sin(angle) / angle * k + (1 - np.cos(angle)) / angle**2 * k @ k
        np.testing.assert_allclose(rotation_about(vector), rodrigues, atol=1e-14)


def test_the_product_of_quaternions_is_one_turn_after_the_other():
    for a, b in np.random.default_rng(6).normal(size=(50, 2, 4)):
        both = matrix_from_quaternion(a) @ matrix_from_quaternion(b)
        np.testing.assert_allclose(matrix_from_quaternion(quaternion_product(a, b)), both, atol=1e-14)
