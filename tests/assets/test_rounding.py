"""Numbers that reach labels and exported files: right, and the same whatever vector instructions a processor has."""

import hashlib
import math
import os
import subprocess
import sys
from decimal import Decimal, localcontext
from pathlib import Path

import numpy as np
import pytest

from viewsphere.assets.exporting.export import export_obj
from viewsphere.assets.mesh import Image, Material, Mesh, Texture
from viewsphere.assets.primitive import Primitive
from viewsphere.assets.readers.shared import polygon
from viewsphere.assets.readers.shared.smoothing import angle_of, creased
from viewsphere.codecs.srgb import encoded, linear

PROGRAM = """
import sys
import numpy as np
sys.path.insert(0, sys.argv[1])
from test_rounding import digest
print(digest())
"""


def spread(count):
    """Numbers in [0, 1] with digits of all kinds, from integers alone."""
    return (np.arange(1, count + 1, dtype=np.int64) * 2654435761 % 4294967296) / 4294967296


def bowl():
    """A sphere's cap of 20 x 20 quadrilaterals' halves."""
    x, y = (axis.reshape(-1) / 20.0 for axis in np.mgrid[0:21, 0:21])
    corner = (np.arange(20)[:, None] * 21 + np.arange(20)).reshape(-1, 1)
    triangles = corner + np.array([[0, 21, 22, 0, 22, 1]])
    return Primitive("bowl", 0, np.column_stack([x, y, np.sqrt(3.0 - x * x - y * y)]), triangles.reshape(-1, 3))


def digest():
    numbers = spread(30_000)
    normal = np.array([0.3, -0.5, 0.7])
    arrays = (
        linear(numbers),
        encoded(numbers),
        angle_of(numbers, numbers[::-1] - 0.5),
        creased(bowl()).normals,
        polygon.flattened(numbers.reshape(-1, 3), normal),
    )
    return hashlib.sha256(b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)).hexdigest()


@pytest.mark.slow
def test_the_same_bits_without_vector_instructions():
    from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__

    found = [name for name in __cpu_dispatch__ if __cpu_features__.get(name)]
    if not found:
        pytest.skip("this processor has no instructions beyond numpy's baseline")
    plain = os.environ | {"NPY_DISABLE_CPU_FEATURES": " ".join(found), "OPENBLAS_CORETYPE": "Prescott"}
    command = [sys.executable, "-c", PROGRAM, str(Path(__file__).parent)]
    done = subprocess.run(command, env=plain, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == digest()


def test_srgb_of_all_bytes_is_right_to_the_last_digits():
    values = np.arange(256) / 255
    with localcontext() as context:
        context.prec = 40
        light = [
            float(
                s / Decimal("12.92")
                if s <= Decimal("0.04045")
                else ((s + Decimal("0.055")) / Decimal("1.055")) ** Decimal("2.4")
            )
            for s in map(Decimal, values.tolist())
        ]
    np.testing.assert_allclose(linear(values), light, rtol=1e-15)
    np.testing.assert_allclose(encoded(light), values, rtol=0, atol=1e-15)


def test_angles():
    angles = np.linspace(0, math.pi, 10_001)
    lengths = 10.0 ** np.linspace(-6, 6, len(angles))
    exact = [math.atan2(math.sin(angle), math.cos(angle)) for angle in angles]
    found = angle_of(lengths * np.maximum(np.sin(angles), 0), lengths * np.cos(angles))
    np.testing.assert_allclose(found[:-1], exact[:-1], rtol=0, atol=1e-11)
    assert angle_of(np.array([0.0, np.nan]), np.array([0.0, 1.0])).tolist() == [0, 0]


@pytest.mark.parametrize("cut", [[[0, 1, 2], [0, 2, 3]], [[1, 2, 3], [1, 3, 0]]])
def test_a_quadrilateral_counts_the_same_however_it_is_cut(cut):
    """At the corner of a dent the normal is the same with either diagonal."""
    points = np.array([[0, 0, 0], [1, 0, 0.1], [1, 1, 0.2], [0, 1, 0.1], [-1, 0, 0.1], [-1, 1, 0.2]])
    other = [[0, 3, 5], [0, 5, 4]]
    piece = creased(Primitive("dent", 0, points, np.array(cut + other)))
    at = np.flatnonzero((piece.positions == 0).all(axis=1))
    flat_left, flat_right = np.array([0.1, -0.1, 1]), np.array([-0.1, -0.1, 1])
    mean = flat_left / np.linalg.norm(flat_left) + flat_right / np.linalg.norm(flat_right)
    assert len(at) == 1
    np.testing.assert_allclose(piece.normals[at[0]], mean / np.linalg.norm(mean), atol=1e-9)


def test_a_polygon_lies_flat_with_its_lengths():
    points = np.array([[1, 2, 3], [4, 2, 3], [4, 6, 3], [1, 6, 3.0]])
    flat = polygon.flattened(points, np.array([0, 0, 5.0]))
    sides = np.roll(flat, -1, axis=0) - flat
    np.testing.assert_array_equal((sides * sides).sum(axis=1), [9, 16, 9, 16])
    assert sides[0, 0] * sides[1, 1] - sides[0, 1] * sides[1, 0] == 12


def test_a_turned_texture_is_turned_in_the_exported_coordinates(tmp_path):
    turn = Texture(0, rotation=0.3, offset=(0.1, 0.2), scale=(2.0, 3.0))
    mesh = Mesh(
        vertices=np.eye(3, dtype=np.float32),
        triangles=np.array([[0, 1, 2]], np.int32),
        normals=np.eye(3, dtype=np.float32),
        triangle_material=np.zeros(1, np.int32),
        triangle_part=np.zeros(1, np.int32),
        materials=(Material(base_color_texture=turn),),
        uv0=np.full((3, 2), 0.25, np.float32),
        images=(Image("t", np.zeros((1, 1, 4), np.uint8)),),
    )
    lines = export_obj(mesh, tmp_path, "a").read_text().splitlines()
    u, v = (float(word) for word in next(line for line in lines if line.startswith("vt ")).split()[1:])
    sine, cosine = math.sin(0.3), math.cos(0.3)
    assert u == pytest.approx(cosine * 0.5 + sine * 0.75 + 0.1, abs=1e-7)
    assert v == pytest.approx(1 - (cosine * 0.75 - sine * 0.5 + 0.2), abs=1e-7)
