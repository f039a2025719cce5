"""OFF: the headers of Geomview, ModelNet and MeshLab, polygons, and colours of vertices and faces."""

import numpy as np
import pytest

from polygons import triangle_areas
from viewsphere.assets.load import load_model
from viewsphere.codecs.srgb import linear
from viewsphere.errors import ModelError

SQUARE = ["-1 0 -1", "1 0 -1", "1 0 1", "-1 0 1"]
RED = linear(np.array([220, 30, 30]) / 255)


def off(header="OFF\n4 1 0", more="", face="4 0 1 2 3", points=SQUARE):
    return "\n".join([header, *(point + more for point in points), face, ""])


@pytest.mark.parametrize(
    "text",
    [
        off(),
        off("OFF 4 1 4"),
        off("OFF4 1 4"),
        off("4 1 4"),
        off("# by hand\nOFF # comment\n\n4 1 0  # counts\n"),
        off().replace("\n", "\r\n"),
        off().replace("\n", "\r"),
        off("OFF\n4 1"),
        off("NOFF\n4 1 0", " 0 -1 0"),
        off("STOFF\n4 1 0", " 0.5 0.5"),
        off("4OFF\n4 1 0", points=[" ".join(str(2 * int(x)) for x in p.split()) + " 2" for p in SQUARE]),
    ],
)
def test_headers(write, text):
    mesh, facts = load_model(write("a.off", text))
    assert triangle_areas(mesh).sum() == pytest.approx(4)
    assert (facts.up, facts.forward, facts.unit) == ("+z", "-y", 1)
    assert not mesh.warnings


@pytest.mark.parametrize(
    "text",
    [
        off("COFF\n4 1 0", " 220 30 30 255"),
        off("COFF\n4 1 0", " 220 30 30"),
        off("COFF\n4 1 0", f" {220 / 255} {30 / 255} {30 / 255} 1"),
        off("OFF\n4 1 0", " 220 30 30"),
        off("STCNOFF\n4 1 0", " 0 -1 0 220 30 30 255 0.25 0.75"),
        off(face="4 0 1 2 3 220 30 30"),
        off(face="4 0 1 2 3 220 30 30 255"),
        off(face=f"4 0 1 2 3 {220 / 255} {30 / 255} {30 / 255}"),
    ],
)
def test_colours(write, text):
    mesh, _ = load_model(write("a.off", text))
    np.testing.assert_allclose(mesh.colors, np.tile([*RED, 1], (len(mesh.vertices), 1)), atol=1e-6)
    assert triangle_areas(mesh).sum() == pytest.approx(4)


def test_colours_of_some_faces(write):
    """Faces without a colour are white; the others keep theirs, and their opacity."""
    text = "OFF\n5 2 0\n" + "\n".join([*SQUARE, "0 0 3"]) + "\n4 0 1 2 3\n3 3 2 4 0 0 1 0.25\n"
    mesh, _ = load_model(write("a.off", text))
    colors = mesh.colors[mesh.triangles].mean(axis=1)
    np.testing.assert_allclose(colors, [[1, 1, 1, 1], [1, 1, 1, 1], [0, 0, 1, 0.25]], atol=1e-6)


def test_normals_and_texture_coordinates(write):
    mesh, _ = load_model(write("a.off", off("STNOFF\n4 1 0", " 0.6 -0.8 0 0.25 0.75")))
    np.testing.assert_allclose(mesh.normals, [[0.6, -0.8, 0]] * 4, atol=1e-6)
    np.testing.assert_allclose(mesh.uv0, [[0.25, 0.25]] * 4)


def test_polygons_are_filled_exactly(write):
    points = ["-1 0 1", "-1 0 -1", "1 0 -1", "1 0 1", "0 0 -.5"]
    mesh, _ = load_model(write("a.off", off("OFF 5 1 0", face="5 0 1 2 3 4", points=points)))
    assert len(mesh.triangles) == 3
    assert triangle_areas(mesh).sum() == pytest.approx(2.5)


def test_edges_and_points_are_left_out_with_a_warning(write):
    mesh, _ = load_model(write("a.off", off("OFF 4 3 0", face="2 0 1\n4 0 1 2 3\n1 0")))
    assert len(mesh.triangles) == 2
    assert "2 faces of fewer than three corners left out" in mesh.warnings[0]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (off(face="4 0 1 2 4"), "names vertex 4, expected 0 to 3"),
        (off(face="4 0 1 2"), "face 1: expected a number of corners and as many vertices, found 4 numbers, the first 4"),
        (off(face=""), "found 4 lines"),
        (off(face="3 0 1 1.5"), "not whole"),
        (off(points=["0 0", *SQUARE[1:]]), "vertex 1: expected 3 numbers, found 2"),
        (off(points=["-1 0 -1,5", *SQUARE[1:]]), "line 3: expected a number, found '-1,5'"),
        (off("OFF\n4 0 0", face=""), "4 points and no faces"),
        (off("OFF\n9000 9000 0"), "promises 18,000 elements"),
        (off("OFF BINARY\n4 1 0"), "binary"),
        ("solid", "expected an OFF file"),
    ],
)
def test_a_refusal_names_the_reason(write, text, reason):
    with pytest.raises(ModelError, match=reason):
        load_model(write("a.off", text))
