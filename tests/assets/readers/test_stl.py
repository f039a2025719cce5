"""STL: binary and text, whatever the header says."""

import struct

import numpy as np
import pytest

from viewsphere.assets.load import load_model
from viewsphere.errors import ModelError

TRIANGLES = np.array([[[0, 0, 0], [2, 0, 0], [0, 3, 0]], [[0, 0, 1], [2, 0, 1], [0, 3, 1]]], np.float32)


def binary(header=b"", attributes=(0, 0)):
    facets = [struct.pack("<12fH", 0, 0, 1, *t.ravel(), a) for t, a in zip(TRIANGLES, attributes, strict=True)]
    return header.ljust(80, b" ") + struct.pack("<I", len(facets)) + b"".join(facets)


def text(name="", words="vertex", number="{:.9g}", triangles=TRIANGLES):
    lines = [f"solid {name}"]
    for triangle in triangles:
        rows = "".join(f"  {words} {' '.join(map(number.format, point))}\n" for point in triangle)
        lines.append(f" facet normal 0 0 1\n outer loop\n{rows} endloop\n endfacet")
    return "\n".join([*lines, f"endsolid {name}\n"])


@pytest.mark.parametrize(
    "data",
    [
        binary(),
        binary(b"\0" * 80),
        binary(b"solid made by a program"),
        binary(b"solid facet normal vertex"),
        binary(b"solid made by a program") + b"\r\n\0 trailing",
        binary(b"  SOLID") + b"endsolid",
        text(),
        text("facet vertex 1 2 3"),
        text("a name").replace("\n", "\r\n"),
        text("A").upper(),
        text("a").replace("\n", "\r"),
        "\ufeff" + text(),
        "# a comment\n" + text("A # b").replace("\n", " # solid facet vertex 1 2 3\n"),
        "\n " + text(number="{:.3e}"),
    ],
)
def test_both_kinds_are_told_apart_by_their_content(write, data):
    mesh, facts = load_model(write("a.stl", data))
    np.testing.assert_array_equal(mesh.vertices[mesh.triangles], TRIANGLES)
    assert (facts.up, facts.forward, facts.unit) == ("+z", "-y", 1)
    assert mesh.warnings == ()


def test_the_solids_of_a_text_are_parts(write):
    mesh, _ = load_model(write("a.stl", text("leg", triangles=TRIANGLES[:1]) + text("", triangles=TRIANGLES[1:])))
    assert mesh.parts == ("leg", "a")


def test_colours_of_magics_are_kept(write):
    own, whole = 31 << 5, 0x8000
    mesh, _ = load_model(write("a.stl", binary(b"COLOR=\xff\x00\x00\xff,MATERIAL=", (own, whole))))
    np.testing.assert_allclose(mesh.colors[mesh.triangles[:, 0]], [[0, 1, 0, 1], [1, 0, 0, 1]])
    assert load_model(write("b.stl", binary(attributes=(own, whole))))[0].colors is None


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (binary()[:-1], "promises 2 triangles, has bytes for 1: truncated"),
        (binary(b"solid")[:-60], "promises 2 triangles"),
        (b"solid", "no triangles"),
        (b"\0" * 50, "80|84 bytes"),
        (text(number="{:.1f}").replace(".0", ",0"), "decimal commas"),
        (text()[:-80], "damaged"),
        (text(words="vertex 1"), "damaged"),
        (text().replace("vertex 2 0 0", "vertex 2 x 0"), "no row of three numbers"),
    ],
)
def test_damaged_files_are_one_clear_error(write, data, said):
    with pytest.raises(ModelError, match=said) as error:
        load_model(write("hurt.stl", data))
    assert "hurt.stl" in str(error.value)
    assert "\n" not in str(error.value)
