"""Finite groups of rigid motions, reconstructed from motions that only approximate a group."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.rotation import Float, product, rotation_about

Ints = NDArray[np.intp]
Holds = Callable[[Float], NDArray[np.bool_]]
"""A function that returns a mask of the symmetries among motions (N, 4, 4)."""

SAME = 1 / 3
"""Tolerance for identifying a product with an element, as a share of the least angle between two elements. It is below a half,
so that the match is unique.
"""

CLOSED = 1e-6
"""Greatest difference between the entries of a product and of the listed motion, which has nine digits."""

LARGEST = 64
"""Greatest number of elements of a completed group. The largest groups in the search are the icosahedron's with 60 and a
16-sided prism's with 32.
"""

ROUNDS = 20
"""Averaging rounds of a group's elements. Each squares the distance from an exact group, so few are needed."""


def largest_group(motions: Float, holds: Holds, nearly: Holds, axes: Float, snap: float) -> Float:
    """The largest group (N, 4, 4) of symmetries among motions and their products, without the identity.

    Motions that already form a group are unchanged. Others become an exact group, rotated so that its axes equal those `axes`
    (M, 3) that are at most `snap` radians away. `nearly` allows for inexact products.
    """
    listed = np.concatenate([np.eye(4)[None], motions])
    if is_group(listed) and holds(listed).all():
        return motions
    elements = _completed(listed, nearly)
    table = _table(elements)
    for members in _subgroups(table):
        group = _exact(elements[members], _table(elements[members]))
        if group is not None:
            group = _aligned(group, axes, snap)
            if holds(group).all():
                return group[1:]
    return motions[:0]


def is_group(motions: Float) -> bool:
    """Return whether motions (N, 4, 4), which include the identity, contain all their products."""
    table, turns = _table(motions), motions[:, :3, :3]
    return bool((table >= 0).all() and np.abs(_products(turns) - turns[table]).max() <= CLOSED)


def _products(turns: Float) -> Float:
    """The products (N, N, 3, 3) of rotations (N, 3, 3)."""
    return product(turns[:, None], turns[None])


def _separation(turns: Float) -> float:
    """The least angle between two of rotations (N, 3, 3), radians."""
    traces = np.einsum("mij,nij->mn", turns, turns) - 4 * np.eye(len(turns))
    return math.acos(min(max((float(traces.max()) - 1) / 2, -1.0), 1.0))


def _nearest(turns: Float, to: Float, same: float) -> Ints:
    """For rotations (..., 3, 3), the index of the rotation in `to` (N, 3, 3) within `same` radians; -1 if there is none."""
    traces = np.einsum("...ij,nij->...n", turns, to)
    return np.where(traces.max(axis=-1) >= 1 + 2 * math.cos(same), traces.argmax(axis=-1), -1)


def _table(motions: Float) -> Ints:
    """The indices (N, N) of the products of motions; -1 where the product is not listed."""
    turns = motions[:, :3, :3]
    return _nearest(_products(turns), turns, SAME * _separation(turns))


def _completed(elements: Float, holds: Holds) -> Float:
    """The elements with all products that are symmetries as well; unchanged if these are too many for a group."""
    grown = elements
    while len(grown) <= LARGEST:
        missing = _missing(grown)
        added = missing[holds(missing)] if len(missing) else missing
        if not len(added):
            return grown
        grown = np.concatenate([grown, added])
    return elements


def _missing(elements: Float) -> Float:
    """The products (M, 4, 4) that are not listed, each once."""
    found, same = list[Float](), SAME * _separation(elements[:, :3, :3])
    for i, j in np.argwhere(_table(elements) < 0):
        motion = np.eye(4)
        motion[:3] = product(elements[i, :3, :3], elements[j, :3])
        motion[:3, 3] += elements[i, :3, 3]
        if not found or _nearest(motion[:3, :3], np.array(found)[:, :3, :3], same) < 0:
            found.append(motion)
    return np.array(found).reshape(-1, 4, 4)


def _subgroups(table: Ints) -> Iterator[Ints]:
    """Yield the indices of the members of each subgroup, the identity first; the largest subgroup comes first.

    Two elements generate every finite group of rotations, so pairs of elements find them all.
    """
    pairs = ((i, j) for i in range(len(table)) for j in range(i + 1))
    found = {_generated(table, *pair) for pair in pairs} - {()}
    for members in sorted(found, key=lambda members: (-len(members), members)):
        yield np.array(members)


def _generated(table: Ints, *generators: int) -> tuple[int, ...]:
    """The indices of all products of generators; empty if a product is not listed."""
    members = np.unique([0, *generators])
    while True:
        products = np.unique(table[np.ix_(members, members)])
        if products[0] < 0:
            return ()
        if len(products) == len(members):
            return tuple(members.tolist())
        members = products


def _exact(elements: Float, table: Ints) -> Float | None:
    """The exact group near the elements; None if their products do not form a group.

    Each rotation is the mean of all products that equal it. The centre is the mean of a point's images under all elements, so
    every element leaves it fixed.
    """
    if (table < 0).any() or (np.sort(table, axis=1) != np.arange(len(table))).any():
        return None
    turns = elements[:, :3, :3]
    for _ in range(ROUNDS):
        turns = _rotations(product(turns[table], turns.transpose(0, 2, 1)[None]).mean(axis=1))
    if np.abs(_products(turns) - turns[table]).max() > 1e-12:
        return None
    center = _places(elements, elements[:, :3, 3].mean(axis=0)).mean(axis=0)
    return _about(turns, center)


def _places(motions: Float, point: Float) -> Float:
    """The images (N, 3) of a point under motions (N, 4, 4)."""
    return (motions[:, :3, :3] * point).sum(axis=2) + motions[:, :3, 3]


def _about(turns: Float, center: Float) -> Float:
    """Motions (N, 4, 4) that turn around a point."""
    motions = np.tile(np.eye(4), (len(turns), 1, 1))
    motions[:, :3, :3], motions[:, :3, 3] = turns, center - (turns * center).sum(axis=2)
    return motions


def _rotations(matrices: Float) -> Float:
    """The rotations nearest to matrices (N, 3, 3)."""
    u, _, v = np.linalg.svd(matrices)
    return np.einsum("nij,njk->nik", u, v)


def _aligned(group: Float, axes: Float, snap: float) -> Float:
    """The group turned around its centre, so that its rotation axes equal the given axes that they are near."""
    center, fixed = _places(group, np.zeros(3)).mean(axis=0), list[Float]()
    turns = group[:, :3, :3]
    for axis in axes:
        own = np.array([_axis(turn, axis) for turn in turns[1:]]).reshape(-1, 3)
        near = [one for one in own if np.abs(one - axis).max() < snap]
        if near and len(fixed) < 2:
            turn = _shortest(near[0], axis)
            turns = product(product(turn, turns), turn.T)
            fixed.append(axis)
    return _about(turns, center)


def _axis(turn: Float, near: Float) -> Float:
    """The axis of a rotation, with the sign that is nearer to the direction `near`."""
    axis = np.linalg.svd(turn - np.eye(3))[2][2]
    return axis * np.sign(float((axis * near).sum()) or 1.0)


def _shortest(one: Float, other: Float) -> Float:
    """The shortest rotation from one direction to another."""
    cross = np.cross(one, other)
    sine = math.sqrt(float((cross * cross).sum()))
    return rotation_about(cross * (math.asin(min(sine, 1.0)) / sine)) if sine > 1e-15 else np.eye(3)
