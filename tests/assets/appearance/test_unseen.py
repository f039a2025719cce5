"""Models of which nothing can be seen."""

import io

import numpy as np
import pytest
from PIL import Image

from viewsphere.assets.load import load_model

CLEAR = "nothing of the model can be seen: all of it is clear (opacity 0)"
CARD = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 0.4 0\nvt 0 0.4\nusemtl m\nf 1/1 2/2 3/3\n"


def warnings_of(write, materials, text=CARD):
    write("m.mtl", materials)
    mesh, _ = load_model(write("a.obj", text))
    return [warning for warning in mesh.warnings if CLEAR in warning]


@pytest.mark.parametrize(
    ("materials", "count"),
    [
        ("newmtl m\nd 0\n", 1),
        ("newmtl m\nd 0.001\n", 1),
        ("newmtl m\nd 0.2\n", 0),
        ("newmtl m\nd 1\n", 0),
        ("newmtl m\nTr 1\n", 0),
        ("newmtl m\nd 0\nmap_Kd t.png\n", 1),
        ("newmtl m\nmap_Kd t.png\nmap_d t.png\n", 1),
    ],
)
def test_a_clear_model_is_a_warning(write, materials, count):
    """The picture is clear in its lower left, which is all that the triangle shows."""
    pixels = np.full((64, 64, 4), 255, np.uint8)
    pixels[32:, :32, 3] = 0
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "PNG")
    write("t.png", file.getvalue())
    assert len(warnings_of(write, materials)) == count


def test_one_visible_triangle_is_enough(write):
    text = CARD + "usemtl n\nf 1/1 3/3 2/2\n"
    assert warnings_of(write, "newmtl m\nd 0\nnewmtl n\nd 1\n", text) == []
    assert len(warnings_of(write, "newmtl m\nd 0\nnewmtl n\nd 0\n", text)) == 1


@pytest.mark.parametrize(
    ("mode", "alpha", "count"), [("OPAQUE", 0.0, 0), ("MASK", 0.4, 1), ("MASK", 0.6, 0), ("BLEND", 0.0, 1)]
)
def test_the_modes_of_gltf_count(gltf, mode, alpha, count):
    gltf.root["materials"] = [{"alphaMode": mode, "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, alpha]}}]
    gltf.node(mesh=gltf.mesh(np.eye(3, dtype=np.float32), None, material=0))
    gltf.root["scenes"] = [{"nodes": [0]}]
    mesh, _ = load_model(gltf.write())
    assert sum(CLEAR in warning for warning in mesh.warnings) == count
