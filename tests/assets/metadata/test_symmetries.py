"""The rotations of known shapes are found, wherever these lie, and no others; shapes without any have none."""

import itertools
import math
import time

import numpy as np
import pytest
import trimesh
from trimesh.transformations import rotation_matrix, translation_matrix

from quick import quick
from viewsphere.assets.metadata.rotation_group import is_group
from viewsphere.assets.metadata.surface import Surface
from viewsphere.assets.metadata.symmetries import find, lacking
from viewsphere.geometry.rotation import rotation_about
from viewsphere.model.annotations.symmetries import Continuous, Symmetries
from viewsphere_zoo import build

solid = trimesh.creation
ANYHOW = rotation_matrix(1.1, (0.3, 0.7, -0.4)) @ translation_matrix((0.4, -0.2, 0.7))
"""Axes in which nothing lies along them, and a place beside the origin."""


ALONG = [pytest.param(np.eye(4), id="straight"), pytest.param(ANYHOW, id="anyhow", marks=pytest.mark.slow)]


def at(x=0.0, y=0.0, z=0.0):
    return translation_matrix((x, y, z))


def joined(*parts):
    return trimesh.util.concatenate(parts)


def stretched(mesh, *sides):
    mesh.apply_scale(sides)
    return mesh


def surface(mesh):
    return Surface(np.array(mesh.triangles, np.float64))


def cyclic(order):
    """Turns around z."""
    return [rotation_about((0, 0, 2 * math.pi * i / order)) for i in range(order)]


def dihedral(order):
    """Turns around z, each also after a half turn around x."""
    return [turn @ other for turn in cyclic(order) for other in (np.eye(3), np.diag([1.0, -1, -1]))]


def octahedral():
    """The 24 turns of a cube."""
    signed = (np.eye(3)[list(p)] * s for p in itertools.permutations(range(3)) for s in itertools.product((1, -1), repeat=3))
    return [turn for turn in signed if np.linalg.det(turn) > 0]


def tetrahedral():
    """Those that take every second corner of the cube to one of these."""
    return [turn for turn in octahedral() if np.prod(turn @ np.ones(3)) > 0]


def tetrahedron():
    return trimesh.Trimesh([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])


def propeller():
    """A hub with three blades, of which each is bent."""
    blade = [solid.box((1, 0.2, 0.1), at(0.6)), solid.box((0.2, 0.5, 0.1), at(1.1, 0.2))]
    blades = [part.copy() for part in blade for _ in range(3)]
    for i, part in enumerate(blades):
        part.apply_transform(rotation_matrix(2 * math.pi * i / 3, (0, 0, 1)))
    return joined(solid.box((0.1, 0.1, 0.5), at(z=0.2)), *blades)


def step():
    """Two boxes, the upper one to the right: a half turn around y takes one to the other."""
    return joined(solid.box((2, 1, 0.5), at(-0.5, 0, -0.25)), solid.box((2, 1, 0.5), at(0.5, 0, 0.25)))


def turned_to_z(mesh):
    mesh.apply_transform(rotation_matrix(math.pi / 2, (1, 0, 0)))
    return mesh


FINITE = {
    "cube": (lambda: solid.box((1, 1, 1)), octahedral()),
    "box of three lengths": (lambda: solid.box((1, 2, 3)), dihedral(2)),
    "square prism": (lambda: solid.box((1, 1, 2)), dihedral(4)),
    "hexagonal prism": (lambda: solid.cylinder(1, 3, sections=6), dihedral(6)),
    "triangular prism": (lambda: solid.cylinder(1, 1.5, sections=3), dihedral(3)),
    "prism of 13 sides": (lambda: solid.cylinder(1, 0.6, sections=13), dihedral(13)),
    "pyramid": (lambda: solid.cone(1, 1.5, sections=4), cyclic(4)),
    "tetrahedron": (tetrahedron, tetrahedral()),
    "propeller": (propeller, cyclic(3)),
    "step": (lambda: turned_to_z(step()), cyclic(2)),
}

ROUND = {
    "cylinder": (lambda: solid.cylinder(1, 3, sections=40), True),
    "disc": (lambda: solid.cylinder(1, 0.1, sections=48), True),
    "cylinder whose moments are alike": (lambda: solid.cylinder(1, 1.37, sections=40), True),
    "cone": (lambda: solid.cone(1, 2, sections=40), False),
    "torus": (lambda: solid.torus(1, 0.3), True),
    "egg": (lambda: stretched(solid.icosphere(3), 1, 1, 1.6), True),
    "bottle": (
        lambda: joined(solid.cylinder(1, 3, sections=40), solid.cylinder(0.4, 1, sections=40, transform=at(z=2))),
        False,
    ),
}


def apart(motion, turn):
    return np.abs(np.array(motion)[:3, :3] - turn).max()


@pytest.mark.parametrize("axes", ALONG)
@pytest.mark.parametrize("name", quick(FINITE, *(FINITE.keys() - {"cube"})))
@pytest.mark.slow
def test_rotations_of_shapes_with_finitely_many(name, axes):
    make, turns = FINITE[name]
    mesh = make()
    mesh.apply_transform(axes)
    shape = surface(mesh)
    found = find(shape)
    to = axes[:3, :3]
    expected = [to @ turn @ to.T for turn in turns if not np.allclose(turn, np.eye(3))]
    if name not in {"prism of 13 sides", "triangular prism"}:  # whose sides are where the library puts them
        assert max(min(apart(motion, turn) for motion in found.discrete) for turn in expected) < 1e-6
    assert len(found.discrete) == len(expected) and not found.continuous
    assert not list(lacking(shape, found))
    for motion in np.array(found.discrete):
        assert np.linalg.norm(motion[:3, :3] @ shape.center + motion[:3, 3] - shape.center) < 1e-6


@pytest.mark.parametrize("axes", ALONG)
@pytest.mark.parametrize("name", quick(ROUND, *list(ROUND)[::2]))
def test_axes_of_round_shapes(name, axes):
    make, has_like_ends = ROUND[name]
    mesh = make()
    mesh.apply_transform(axes)
    shape = surface(mesh)
    found = find(shape)
    assert len(found.continuous) == 1 and len(found.discrete) == has_like_ends
    axis, offset = np.array(found.continuous[0].axis), np.array(found.continuous[0].offset)
    assert abs(abs(axis @ axes[:3, 2]) - 1) < 1e-6
    assert np.linalg.norm(np.cross(offset - axes[:3, 3], axis)) < 1e-3
    assert not list(lacking(shape, found))
    assert all(abs(np.array(flip)[:3, :3] @ axis + axis).max() < 1e-6 for flip in found.discrete)


@pytest.mark.slow
def test_a_ball_has_the_three_axes_of_the_object():
    found = find(surface(solid.icosphere(3)))
    assert [one.axis for one in found.continuous] == [(1, 0, 0), (0, 1, 0), (0, 0, 1)] and not found.discrete


def mug():
    handle = solid.torus(0.6, 0.12, transform=at(1.0) @ rotation_matrix(math.pi / 2, (1, 0, 0)))
    return joined(solid.cylinder(1, 2.4, sections=48), handle, solid.box((0.1, 0.1, 0.3), at(0, 0, -1.3)))


def arrow():
    """Two mirrors, but no turn."""
    return joined(solid.box((2, 0.2, 0.1)), solid.box((0.2, 1, 0.1), at(0.9)), solid.box((0.1, 0.1, 0.4), at(z=0.2)))


NONE = {
    "mug": mug,
    "L": lambda: joined(solid.box((3, 1, 1)), solid.box((1, 1, 2), at(1, 0, 1.5)), solid.box((0.4, 0.3, 0.3), at(-1, 0.6))),
    "prism with three unlike sides": lambda: trimesh.Trimesh(
        [[0, 0, 0], [3, 0, 0], [1, 1, 0], [0, 0, 1], [3, 0, 1], [1, 1.2, 1.3]],
        [[0, 2, 1], [3, 4, 5], [0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [2, 0, 3], [2, 3, 5]],
    ),
    "arrow": arrow,
    "cube with a lump": lambda: joined(solid.box((1, 1, 1)), solid.box((0.2, 0.2, 0.1), at(0.2, 0.3, 0.55))),
    "tall box": lambda: joined(solid.box((1, 1.2, 3)), solid.box((0.3, 0.3, 0.3), at(0.4, 0.5, 1.5))),
    "heap": lambda: joined(solid.icosphere(2), solid.box((2, 1, 1), at(1, 0.3, -0.5)), solid.box((1, 1, 1), at(0, 1, 0.7))),
    "irregular tetrahedron": lambda: tetrahedron().apply_transform(
        np.array([[1, 0.3, 0, 0], [0, 1.2, 0.5, 0], [0.2, 0, 0.8, 0], [0, 0, 0, 1.0]])
    ),
    "ball with two lumps": lambda: joined(
        solid.icosphere(3), solid.icosphere(2, 0.4).apply_translation((0.9, 0, 0)), solid.box((0.3, 0.4, 0.5), at(0, 0.95, 0.3))
    ),
}


@pytest.mark.parametrize("axes", ALONG)
@pytest.mark.parametrize("name", NONE)
def test_shapes_without_symmetries(name, axes):
    mesh = NONE[name]()
    mesh.apply_transform(axes)
    assert find(surface(mesh)) == Symmetries()


@pytest.mark.slow
@pytest.mark.parametrize(
    "family", ["bench", "bicycle", "boat", "car", "chair", "hair_drier", "post_box", "tree", "wheelie_bin"]
)
def test_the_zoo_has_mirrors_alone(family):
    assert find(Surface.from_mesh(build(family, np.random.default_rng(1)))) == Symmetries()


@pytest.mark.slow
def test_declared_ones_that_are_not_there_are_told():
    shape = surface(solid.box((1, 1, 2)))
    quarter = tuple(tuple(row) for row in rotation_matrix(math.pi / 2, (0, 0, 1)).tolist())
    aside = tuple(tuple(row) for row in rotation_matrix(math.pi, (0, 0, 1), (0.1, 0, 0)).tolist())
    tilted = tuple(tuple(row) for row in rotation_matrix(math.pi / 2, (1, 0, 0)).tolist())
    assert not list(lacking(shape, Symmetries(discrete=(quarter,))))
    (first, second, third) = lacking(
        shape, Symmetries(discrete=(quarter, aside, tilted), continuous=(Continuous(axis=(0.0, 0.0, 1.0)),))
    )
    assert first.startswith("symmetries.discrete[1]: expected") and "about 0.2" in first
    assert second.startswith("symmetries.discrete[2]") and third.startswith("symmetries.continuous[0]")


@pytest.mark.slow
def test_how_much_a_symmetry_may_be_off():
    """A lump of half a tolerance is none; one of three is."""
    across = math.sqrt(3)

    def lump(high):
        return surface(joined(solid.box((1, 1, 1)), solid.box((0.3, 0.3, high), at(0.1, 0.2, 0.5 + high / 2))))

    assert len(find(lump(0.004 * across)).discrete) == 23
    assert not find(lump(0.03 * across)).discrete


def test_all_motions_of_a_round_thing():
    flip = ((1.0, 0, 0, 0), (0, -1, 0, 0), (0, 0, -1, 0), (0, 0, 0, 1))
    found = [*Symmetries(discrete=(flip,), continuous=(Continuous(axis=(0, 0, 1), offset=(1, 0, 0)),)).motions(4)]
    assert len(found) == 8 and np.array_equal(found[0], np.eye(4))
    np.testing.assert_allclose(found[1] @ (1, 0, 3, 1), (1, 0, 3, 1), atol=1e-15)
    np.testing.assert_allclose(found[1] @ (2, 0, 0, 1), (1, 1, 0, 1), atol=1e-15)
    np.testing.assert_allclose(found[7] @ (2, 0, 5, 1), found[3] @ (2, 0, -5, 1), atol=1e-15)


def test_distances_equal_those_to_every_triangle():
    mesh = joined(solid.icosphere(2), solid.box((0.5, 3, 0.1)))
    shape = surface(mesh)
    rng = np.random.default_rng(3)
    points = rng.uniform(-2, 2, (200, 3))
    squares, there, normals = shape.closest(points, np.eye(4), 9.0)
    for point, square, near in zip(points, squares, there, strict=True):
        every = trimesh.triangles.closest_point(mesh.triangles, np.broadcast_to(point, (len(mesh.triangles), 3)))
        assert math.isclose(((every - point) ** 2).sum(axis=1).min(), square, rel_tol=1e-9)
        assert math.isclose(((near - point) ** 2).sum(), square, rel_tol=1e-9)
    np.testing.assert_allclose((normals**2).sum(axis=1), 1)
    far = shape.closest(points, np.eye(4), 0.2)[0]
    np.testing.assert_array_equal(np.isinf(far), squares > 0.04)


def near_cube(side, height):
    return solid.box((side, side, height))


def group_of(found):
    return np.array([np.eye(4), *found.discrete])


@pytest.mark.parametrize("height", quick([1.4, 1.41, 1.39, 1.37, 1.43], 1.4))
def test_the_rotations_of_a_prism_that_is_nearly_a_cube_are_a_group(height):
    shape = surface(near_cube(1.41421356, height))
    found = find(shape)
    assert len(found.discrete) in {7, 23} and found.unlisted() is None and is_group(group_of(found))
    assert not list(lacking(shape, found))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(24))
def test_rotations_of_inexact_shapes_are_a_group(seed):
    """Boxes and prisms of which each corner is a little off, turned anyhow."""
    rng = np.random.default_rng(seed)
    make = (
        lambda: solid.box(1 + 0.03 * rng.random(3)),
        lambda: solid.cylinder(1, rng.uniform(0.3, 3), sections=int(rng.integers(3, 17))),
        tetrahedron,
    )[seed % 3]
    mesh = make()
    mesh.vertices = mesh.vertices + rng.normal(size=mesh.vertices.shape) * rng.choice([1e-4, 0.003, 0.008])
    mesh.apply_transform(rotation_matrix(rng.uniform(0, 3), rng.normal(size=3)) @ at(*rng.normal(size=3)))
    shape = surface(mesh)
    found = find(shape)
    assert found.continuous or (found.unlisted() is None and is_group(group_of(found)))
    assert not list(lacking(shape, found))


def noisy_ball(noise, rings=160, sectors=158):
    """A ball of two triangles for each of its quads, each of whose vertices is off by a share of the radius."""
    along, around = np.linspace(0, math.pi, rings + 1)[:, None], np.arange(sectors) * (2 * math.pi / sectors)
    points = np.stack([np.sin(along) * np.cos(around), np.sin(along) * np.sin(around), np.cos(along) + 0 * around], axis=-1)
    vertices = points.reshape(-1, 3) * (1 + noise * np.random.default_rng(0).standard_normal((points[..., 0].size, 1)))
    row = np.arange(rings * sectors).reshape(rings, sectors)
    right = np.roll(row, -1, axis=1)
    quads = np.stack([row, row + sectors, right, right, row + sectors, right + sectors], axis=-1)
    return trimesh.Trimesh(vertices, quads.reshape(-1, 3), process=False)


@pytest.mark.slow
@pytest.mark.parametrize("noise", [1e-3, 3e-3, 5e-3, 7e-3, 1e-2, 3e-2])
def test_nearly_round_surfaces_take_a_bounded_time(noise):
    """Of 50,000 triangles: at most 3 CPU-seconds on the machine where this was measured, and a group of true symmetries."""
    shape = surface(noisy_ball(noise))
    begun = time.process_time()
    found = find(shape)
    assert time.process_time() - begun < 10
    assert bool(found.continuous) == (noise < 4e-3) and is_group(group_of(found))
    assert not list(lacking(shape, found))


@pytest.mark.slow
@pytest.mark.parametrize("height", [0.05, 0.1])
@pytest.mark.parametrize(
    ("solid_of", "count"), [(solid.icosahedron, 59), (lambda: solid.box((1, 1, 1)), 23), (tetrahedron, 11)]
)
def test_a_ball_with_bumps_has_the_rotations_of_the_solid_that_these_are_at(solid_of, count, height):
    """All moments are alike, and the ball between the bumps has every turn."""
    mesh = solid.icosphere(4)
    places = solid_of().vertices / np.linalg.norm(solid_of().vertices, axis=1)[:, None]
    mesh.vertices *= 1 + height * np.exp(-(1 - (mesh.vertices @ places.T).max(axis=1, keepdims=True)) / 0.06)
    shape = surface(mesh)
    found = find(shape)
    assert is_group(group_of(found)) and not list(lacking(shape, found))
    assert len(found.discrete) == count
