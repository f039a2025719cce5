"""Axes, units, scale and centring, in closed form."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from viewsphere.assets.mesh import Mesh
from viewsphere.assets.normalise import normalise, rotation, sorted_by_part
from viewsphere.assets.primitive import FileFacts
from viewsphere.errors import ModelError
from viewsphere.model.model_spec import ModelSpec, ScaledTo

AXES = ("+x", "-x", "+y", "-y", "+z", "-z")
VECTORS = dict(zip(AXES, [s * e for e in np.eye(3) for s in (1, -1)], strict=True))
GLTF = FileFacts(Path("a.glb"), "glb", "+y", "+z", 1.0)
NATIVE = FileFacts(Path("a.stl"), "stl", "+z", "-y", 1.0)


def spec(**values):
    return ModelSpec(key="a", source="a.glb", category="car", category_id=1, **values)


def box(size=(1, 2, 3), low=(0, 0, 0), cube=None):
    """A box of this size from this corner, with a spike that leaves its box alone."""
    vertices, triangles = cube
    return Mesh(
        vertices=(vertices * np.float32(size) + np.float32(low)).astype(np.float32),
        triangles=triangles.astype(np.int32),
        normals=np.tile(np.float32([0, 0, 1]), (len(vertices), 1)),
        triangle_material=np.zeros(len(triangles), np.int32),
        triangle_part=np.zeros(len(triangles), np.int32),
    )


@pytest.mark.parametrize("up", AXES)
@pytest.mark.parametrize("forward", AXES)
def test_every_pair_of_axes(up, forward):
    if up[1] == forward[1]:
        with pytest.raises(ModelError, match="right angles"):
            rotation(up, forward, "a.obj")
        return
    turn = rotation(up, forward, "a.obj")
    assert set(np.abs(turn).ravel()) == {0, 1}
    assert np.linalg.det(turn) == 1
    np.testing.assert_array_equal(turn @ VECTORS[up], [0, 0, 1])
    np.testing.assert_array_equal(turn @ VECTORS[forward], [0, -1, 0])


def test_axes_permute_exactly(cube, volume):
    mesh = box((0.1, 0.7, 0.3), cube=cube)
    found = normalise(mesh, GLTF, spec(centring="floor"))
    np.testing.assert_array_equal(found.bounds[1] - found.bounds[0], np.float32([0.1, 0.3, 0.7]))
    np.testing.assert_array_equal(found.normals, np.tile([0, -1, 0], (8, 1)))
    assert volume(found) > 0


def test_settings_win_over_the_file(cube):
    mesh = box((1, 2, 3), cube=cube)
    found = normalise(mesh, GLTF, spec(up="+z", forward="-y", unit=0.5))
    np.testing.assert_array_equal(found.bounds, [[-0.25, -0.5, -0.75], [0.25, 0.5, 0.75]])


def test_centring(cube):
    mesh = box((1, 2, 3), (5, 6, 7), cube)
    np.testing.assert_array_equal(normalise(mesh, NATIVE, spec()).bounds, [[-0.5, -1, -1.5], [0.5, 1, 1.5]])
    np.testing.assert_array_equal(normalise(mesh, NATIVE, spec(centring="floor")).bounds[:, 2], [0, 3])


def test_area_centring_is_the_surface_centroid(cube):
    mesh = box((2, 2, 2), cube=cube)
    open_top = Mesh(
        vertices=mesh.vertices,
        triangles=mesh.triangles[:-2],  # two triangles of the z = 2 face are gone
        normals=mesh.normals,
        triangle_material=mesh.triangle_material[:-2],
        triangle_part=mesh.triangle_part[:-2],
    )
    found = normalise(open_top, NATIVE, spec(centring="area"))
    # Four sides have their centroid at z = 1, the bottom at 0.
    np.testing.assert_allclose(found.bounds[0], [-1, -1, -0.8], atol=1e-7)


def test_scale_to_a_length_and_to_the_real_size(cube):
    mesh = box((1, 2, 3), cube=cube)
    np.testing.assert_allclose(np.ptp(normalise(mesh, NATIVE, spec(scale=1.8)).bounds, axis=0), [0.9, 1.8, 2.7], rtol=1e-7)
    fits = normalise(mesh, NATIVE, spec(scale="real_size", real_size=(2.1, 6.2, 4)))
    np.testing.assert_array_equal(np.ptp(fits.bounds, axis=0), [2, 4, 6])
    assert fits.warnings == ()
    off = normalise(mesh, NATIVE, spec(scale="real_size", real_size=(2, 9, 4)))
    assert "height 6 m instead of 9 m" in off.warnings[0]
    assert np.ptp(normalise(mesh, NATIVE, spec(scale="real_size", real_size="file")).bounds, axis=0)[1] == 2
    with pytest.raises(ModelError, match="needs the model's real_size"):
        normalise(mesh, NATIVE, spec(scale="real_size"))


@pytest.mark.parametrize("size", [1e9, 1e-9])
def test_absurd_sizes_say_what_was_found(cube, size):
    with pytest.raises(ModelError, match=rf"found {size:.3g} m; set unit".replace("+", r"\+")):
        normalise(box((size, size, size), cube=cube), NATIVE, spec())


MEASURES = {"width": 1, "length": 2, "height": 3, "longest": 3, "diagonal": 14**0.5}


@pytest.mark.parametrize(("measure", "before"), MEASURES.items())
def test_each_measure_of_the_box_can_be_scaled_to(cube, measure, before):
    scaled = normalise(box((1, 2, 3), cube=cube), NATIVE, spec(scale=ScaledTo(measure=measure, metres=0.6)))
    np.testing.assert_allclose(np.ptp(scaled.bounds, axis=0), np.array([1, 2, 3]) * 0.6 / before, rtol=1e-6)


def test_a_flat_model_has_no_length_to_scale(cube):
    mesh = box((1, 0, 1), cube=cube)
    with pytest.raises(ModelError, match="length of 0"):
        normalise(mesh, NATIVE, spec(scale=1.0))


def test_triangles_come_sorted_by_part_and_material(cube):
    mesh = box(cube=cube)
    rng = np.random.default_rng(5)
    part, material = rng.integers(0, 3, 12).astype(np.int32), rng.integers(0, 2, 12).astype(np.int32)
    mixed = Mesh(
        vertices=mesh.vertices,
        triangles=mesh.triangles,
        normals=mesh.normals,
        triangle_material=material,
        triangle_part=part,
        materials=mesh.materials * 2,
        parts=("a", "b", "c"),
    )
    found = normalise(mixed, NATIVE, spec())
    order = sorted(range(12), key=lambda i: (part[i], material[i], i))
    np.testing.assert_array_equal(found.triangles, mesh.triangles[order])
    np.testing.assert_array_equal(found.triangle_part, part[order])
    np.testing.assert_array_equal(found.triangle_material, material[order])


def test_sorted_triangles_stay_the_arrays_that_processes_share(cube):
    whole = replace(box(cube=cube), triangle_part=np.arange(12, dtype=np.int32) % 3, parts=("a", "b", "c"))
    once = sorted_by_part(whole)
    assert once.triangle_part.tolist() == [0] * 4 + [1] * 4 + [2] * 4
    assert np.array_equal(once.triangles, np.concatenate([whole.triangles[part::3] for part in range(3)]))
    assert sorted_by_part(once) is once
    for mesh, are_shared in ((once, True), (whole, False)):
        made = normalise(mesh, NATIVE, spec())
        assert np.array_equal(made.triangles, once.triangles)
        assert np.shares_memory(made.triangles, mesh.triangles) == are_shared
