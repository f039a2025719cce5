"""COLLADA: polygons of every element, and the scene that holds them."""

import numpy as np
import pytest

from dae_files import document, faces, geometry, p, source
from polygons import triangle_areas
from viewsphere.assets.load import load_model
from viewsphere.errors import ModelError

SQUARE = np.array([[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0], [1, 1, 0], [2, 1, 0], [2, 3, 0], [1, 3, 0]], float)
"""An outline of area 16, and a hole of area 2 that turns the same way."""
NOTCHED = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [0, 0, -0.5], [-1, 0, 1]], float)
"""Concave, of area 2.5; its fan from the first corner folds."""


@pytest.mark.parametrize(
    ("points", "element", "triangles", "area"),
    [
        (NOTCHED, faces("polylist", "<vcount>5</vcount>" + p(range(5))), 3, 2.5),
        (NOTCHED, faces("polygons", p([0, 1, 2, 3, 4])), 3, 2.5),
        (SQUARE, faces("polygons", f"<ph>{p([0, 1, 2, 3])}{p([4, 5, 6, 7], 'h')}</ph>"), 8, 14.0),
        (SQUARE, faces("polygons", f"<ph>{p([0, 1, 2, 3])}{p([7, 6, 5, 4], 'h')}</ph>"), 8, 14.0),
        (SQUARE, faces("polygons", p([0, 1, 2]) + f"<ph>{p([0, 2, 3])}</ph>"), 2, 16.0),
        (SQUARE, faces("tristrips", p([0, 1, 3, 2])), 2, 16.0),
        (SQUARE, faces("trifans", p([0, 1, 2, 3])), 2, 16.0),
        (SQUARE, faces("triangles", p([0, 1, 2, 0, 2, 3])), 2, 16.0),
        (SQUARE, faces("polylist", "<vcount>3 2 3</vcount>" + p([0, 1, 2, 0, 1, 0, 2, 3])), 2, 16.0),
    ],
)
def test_polygons_are_filled_exactly(write, points, element, triangles, area):
    mesh, _ = load_model(write("a.dae", document(geometry(points, element))))
    assert len(mesh.triangles) == triangles
    assert triangle_areas(mesh).sum() == pytest.approx(area)
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    fronts = np.cross(b - a, c - a)
    assert (fronts @ fronts[0] > 0).all()


def test_a_polygon_that_crosses_itself_is_a_warning(write):
    mesh, _ = load_model(write("a.dae", document(geometry(SQUARE, faces("polygons", p([0, 1, 3, 2]))))))
    assert any("crosses or overlaps itself (face 1)" in warning for warning in mesh.warnings)


def test_a_bent_polygon_is_a_warning(write):
    bent = np.array([[0, 0, 0], [1, 0, 1], [1, 1, 0], [0, 1, 1]], float)
    mesh, _ = load_model(write("a.dae", document(geometry(bent, faces("polygons", p(range(4)))))))
    assert any("is far from flat" in warning for warning in mesh.warnings)


def test_the_set_that_a_material_binds_reaches_the_mesh(write):
    """Without any binding the lowest set does, however the sets are ordered; a third coordinate is left out."""
    sets = source("g-t", [[0.0, 0.25, 7]] * 3, "STP") + source("g-u", [[0.5, 1.0]] * 3, "ST")
    inputs = '<input semantic="TEXCOORD" source="#g-u" offset="0" set="4"/>'
    inputs += '<input semantic="TEXCOORD" source="#g-t" offset="0" set="2"/>'
    text = document(geometry(SQUARE[:3], faces("triangles", p([0, 1, 2]), more=inputs), more=sets))
    mesh, _ = load_model(write("a.dae", text))
    np.testing.assert_array_equal(mesh.uv0, [[0, 0.75]] * 3)
    np.testing.assert_array_equal(mesh.uv1, [[0.5, 0]] * 3)


def test_nodes_are_moved_and_repeated(write):
    """By rotate, then scale, then translate of the inner node; instances share a geometry."""
    inner = '<node id="n"><translate>1 0 0</translate><instance_geometry url="#g"/></node>'
    nodes = f'<node><rotate>0 0 1 90</rotate><scale>2 1 1</scale>{inner}</node><node><instance_node url="#n"/></node>'
    mesh, _ = load_model(write("a.dae", document(geometry(SQUARE[:3], faces("triangles", p([0, 1, 2]))), nodes)))
    np.testing.assert_allclose(
        mesh.vertices[mesh.triangles], [[[0, 2, 0], [0, 10, 0], [-4, 10, 0]], [[1, 0, 0], [5, 0, 0], [5, 4, 0]]], atol=1e-6
    )
    assert mesh.parts == ("g", "g_1")


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (document(geometry(SQUARE, faces("triangles", p([0, 1, 9])))), "names POSITION 9, expected 0 to 7"),
        (document(geometry(SQUARE, faces("polylist", "<vcount>5</vcount>" + p([0, 1, 2])))), "5 corners, found 3"),
        (document(geometry(SQUARE, faces("triangles", p([0, 1, 2]))).replace("4.0 ", "4,0 ")), "'4,0': expected numbers"),
        (document(geometry(SQUARE, faces("lines", p([0, 1])))), "no triangles found"),
        ("<x3d/>", "found XML of <x3d>"),
        (document("")[:-40], "not well-formed XML"),
    ],
)
def test_a_refusal_names_the_reason(write, text, reason):
    with pytest.raises(ModelError, match=reason):
        load_model(write("a.dae", text))
