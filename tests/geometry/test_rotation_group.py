"""Motions that are only near to a group's become the largest exact group of symmetries among them."""

import itertools
import math

import numpy as np
import pytest

from viewsphere.assets.metadata.rotation_group import is_group, largest_group
from viewsphere.geometry.rotation import compose, random_rotation, rotation_about

CENTER = np.array([0.3, -0.2, 0.5])


def around(turns, center=CENTER):
    motions = np.tile(np.eye(4), (len(turns), 1, 1))
    motions[:, :3, :3] = turns
    motions[:, :3, 3] = center - np.array(turns) @ center
    return motions


def dihedral(order):
    cyclic = [rotation_about((0, 0, 2 * math.pi * i / order)) for i in range(order)]
    return [turn @ flip for flip in (np.eye(3), np.diag([1.0, -1, -1])) for turn in cyclic]


def cube():
    signed = (np.eye(3)[list(p)] * s for p in itertools.permutations(range(3)) for s in itertools.product((1, -1), repeat=3))
    return sorted((turn for turn in signed if np.linalg.det(turn) > 0), key=lambda turn: -np.trace(turn))


GROUPS = {"prism of 4": dihedral(4), "prism of 16": dihedral(16), "cube": cube(), "two": dihedral(1)}


def all_hold(motions):
    return np.ones(len(motions), np.bool_)


def largest(motions, holds=all_hold):
    return largest_group(np.asarray(motions), holds, holds, np.eye(3), 1e-3)


@pytest.mark.parametrize("name", GROUPS)
def test_exact_groups_stay_as_they_are(name):
    motions = around(GROUPS[name])[1:]
    np.testing.assert_array_equal(largest(motions), motions)


@pytest.mark.parametrize("name", GROUPS)
@pytest.mark.parametrize("off", [1e-4, 0.02])
def test_inexact_motions_become_an_exact_group_near_to_them(name, off):
    rng = np.random.default_rng(5)
    axes = random_rotation(rng)
    exact = around([axes @ turn @ axes.T for turn in GROUPS[name]])[1:]
    noisy = np.array([compose(motion, around([rotation_about(rng.normal(size=3) * off / 2)])[0]) for motion in exact])
    group = largest(noisy)
    assert len(group) == len(exact)
    assert is_group(np.concatenate([np.eye(4)[None], group]))
    assert np.abs(group - exact).max() < 4 * off
    fixed = np.einsum("nij,j->ni", group[:, :3, :3], CENTER) + group[:, :3, 3]
    assert np.abs(fixed - fixed.mean(axis=0)).max() < 4 * off


def test_a_set_without_some_products_is_completed():
    motions = around(cube())[1:]
    assert len(largest(motions[3:])) == 23


def test_products_that_are_no_symmetries_leave_the_largest_subgroup():
    prism = around(dihedral(4))

    def holds(motions):
        return np.array([np.abs(prism[:, :3, :3] - motion[:3, :3]).max(axis=(1, 2)).min() < 0.01 for motion in motions])

    group = largest(around(cube())[1:], holds)
    assert len(group) == 7 and holds(group).all()


def test_axes_next_to_the_given_ones_become_these():
    tilt = rotation_about((3e-4, -2e-4, 1e-4))
    noise = np.random.default_rng(2)
    turns = [tilt @ turn @ tilt.T @ rotation_about(noise.normal(size=3) * 1e-5) for turn in dihedral(4)[1:]]
    group = largest(around(turns))
    expected = np.array(dihedral(4)[1:])
    np.testing.assert_allclose(group[:, :3, :3], expected, atol=1e-12)
