"""PLY: all encodings, faces of any shape, strips, and colours and textures under all their names."""

import io
import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from ply_files import FORMATS, ply
from polygons import triangle_areas
from viewsphere.assets.load import load_model
from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.readers.ply.data import Lists, read_elements
from viewsphere.codecs.srgb import linear
from viewsphere.errors import ModelError

XYZ = ["float x", "float y", "float z"]
FACES = ["list uchar int vertex_indices"]
SQUARE = [(-1, 0, -1), (1, 0, -1), (1, 0, 1), (-1, 0, 1)]
QUAD = ("face", FACES, [([0, 1, 2, 3],)])
RED = (220, 30, 30)


def png(color, size=(2, 2)):
    file = io.BytesIO()
    Image.new("RGB", size, color).save(file, "PNG")
    return file.getvalue()


def mean_color(mesh):
    """Mean linear colour by area, of vertices times the mean of the picture."""
    areas = triangle_areas(mesh)
    colors = np.ones((len(areas), 3)) if mesh.colors is None else mesh.colors[mesh.triangles].mean(axis=1)[:, :3]
    pictures = [None if m.base_color_texture is None else mesh.images[m.base_color_texture.image] for m in mesh.materials]
    means = [np.ones(3) if p is None else linear(p.pixels[..., :3] / 255).mean(axis=(0, 1)) for p in pictures]
    return (colors * np.array(means)[mesh.triangle_material] * areas[:, None]).sum(axis=0) / areas.sum()


def with_color(kinds, color):
    """A square whose vertices have all the same colour."""
    return [("vertex", [*XYZ, *kinds], [(*corner, *color) for corner in SQUARE]), QUAD]


@pytest.mark.parametrize("encoding", FORMATS)
@pytest.mark.parametrize(
    ("kinds", "color"),
    [
        (["uchar red", "uchar green", "uchar blue"], RED),
        (["uchar r", "uchar g", "uchar b"], RED),
        (["uchar diffuse_red", "uchar diffuse_green", "uchar diffuse_blue"], RED),
        (["ushort red", "ushort green", "ushort blue"], [257 * c for c in RED]),
        (["float red", "float green", "float blue"], [c / 255 for c in RED]),
        (["float red", "float green", "float blue"], RED),
        (["int red", "int green", "int blue"], RED),
        (["uchar red", "uchar green", "uchar blue", "uchar alpha"], (*RED, 255)),
    ],
)
def test_colours_of_vertices(write, encoding, kinds, color):
    mesh, _ = load_model(write("a.ply", ply(with_color(kinds, color), encoding)))
    np.testing.assert_allclose(mean_color(mesh), linear(np.array(RED) / 255), atol=1e-6)
    assert not mesh.warnings


def test_alpha_makes_a_surface_clear(write):
    kinds = ["uchar red", "uchar green", "uchar blue", "uchar alpha"]
    mesh, _ = load_model(write("a.ply", ply(with_color(kinds, (*RED, 102)))))
    np.testing.assert_allclose(mesh.colors[:, 3], 0.4, atol=1e-6)
    assert mesh.materials[0].alpha_mode == "BLEND"


def test_alpha_of_zero_everywhere_is_a_mistake_of_its_writer(write):
    kinds = ["uchar red", "uchar green", "uchar blue", "uchar alpha"]
    mesh, _ = load_model(write("a.ply", ply(with_color(kinds, (*RED, 0)))))
    np.testing.assert_allclose(mesh.colors[:, 3], 1)
    assert mesh.materials[0].alpha_mode == "OPAQUE"
    assert "alpha 0" in mesh.warnings[0]


@pytest.mark.parametrize("encoding", FORMATS)
def test_colours_of_mixed_faces(write, encoding):
    faces = [([0, 1, 2, 3], 220, 30, 30), ([3, 2, 4], 30, 200, 30), ([0, 5, 1], 30, 30, 220)]
    elements = [
        ("vertex", XYZ, [*SQUARE, (0, 0, 2), (0, 0.5, 0)]),
        ("face", [*FACES, "uchar red", "uchar green", "uchar blue"], faces),
    ]
    mesh, _ = load_model(write("a.ply", ply(elements, encoding)))
    areas = triangle_areas(mesh)
    assert len(areas) == 4
    assert areas.sum() == pytest.approx(4 + 1 + 1.25**0.5)
    expected = sum(a * linear(np.array(f[1:]) / 255) for a, f in zip((4, 1, 1.25**0.5), faces, strict=True))
    np.testing.assert_allclose(mean_color(mesh), expected / areas.sum(), atol=1e-6)


def test_colours_of_faces_give_way_to_those_of_vertices(write):
    color = ["uchar red", "uchar green", "uchar blue"]
    elements = [with_color(color, RED)[0], ("face", [*FACES, *color], [([0, 1, 2, 3], 0, 0, 255)])]
    mesh, _ = load_model(write("a.ply", ply(elements)))
    np.testing.assert_allclose(mean_color(mesh), linear(np.array(RED) / 255), atol=1e-6)
    assert "those of its vertices are used" in mesh.warnings[0]


@pytest.mark.parametrize("names", [("s", "t"), ("u", "v"), ("texture_u", "texture_v")])
@pytest.mark.parametrize("comment", ["TextureFile skin.png", "texturefile: skin.png"])
def test_texture_coordinates_of_vertices(write, names, comment):
    write("skin.png", png(RED))
    uv = [(0, 0), (1, 0), (1, 0.75), (0, 1)]
    kinds = [*XYZ, *(f"float {name}" for name in names)]
    rows = [(*corner, *at) for corner, at in zip(SQUARE, uv, strict=True)]
    mesh, _ = load_model(write("a.ply", ply([("vertex", kinds, rows), QUAD], comments=[comment])))
    np.testing.assert_allclose(mesh.uv0, [(0, 1), (1, 1), (1, 0.25), (0, 0)])
    np.testing.assert_allclose(mean_color(mesh), linear(np.array(RED) / 255), atol=1e-6)


def test_coordinates_without_a_picture_leave_the_files_colours(write):
    kinds = ["float s", "float t", "uchar red", "uchar green", "uchar blue"]
    mesh, _ = load_model(write("a.ply", ply(with_color(kinds, (0.5, 0.5, *RED)))))
    assert mesh.materials[0].base_color == (1, 1, 1, 1)
    np.testing.assert_allclose(mean_color(mesh), linear(np.array(RED) / 255), atol=1e-6)


def test_a_picture_takes_the_place_of_colours(write):
    """BOP's models hold the surface's colour twice: the product would be too dark."""
    write("skin.png", png(RED))
    kinds = ["float texture_u", "float texture_v", "uchar red", "uchar green", "uchar blue"]
    elements = with_color(kinds, (0.5, 0.5, *RED))
    mesh, _ = load_model(write("a.ply", ply(elements, comments=["TextureFile skin.png"])))
    np.testing.assert_allclose(mean_color(mesh), linear(np.array(RED) / 255), atol=1e-6)
    assert any("has a picture and colours" in warning for warning in mesh.warnings)


@pytest.mark.parametrize("encoding", FORMATS)
def test_several_pictures_on_corners(write, encoding):
    write("red.png", png("red"))
    write("green.png", png("lime"))
    kinds = [*FACES, "list uchar float texcoord", "int texnumber"]
    faces = [([0, 1, 2], (0, 0, 1, 0, 1, 1), 0), ([0, 2, 3], (0, 0, 1, 1, 0, 1), 1), ([0, 3, 4, 5], (), 0)]
    points = [*SQUARE, (-2, 0, 1), (-2, 0, -1)]
    data = ply([("vertex", XYZ, points), ("face", kinds, faces)], encoding, ["TextureFile red.png", "TextureFile green.png"])
    mesh, _ = load_model(write("a.ply", data))
    assert len(mesh.triangles) == 4
    np.testing.assert_allclose(mean_color(mesh), np.array([2 + 2, 2 + 2, 2]) / 6, atol=1e-6)
    np.testing.assert_array_equal(mesh.uv0[mesh.triangles[mesh.triangle_material == 2][0]], [(0, 1), (1, 0), (0, 0)])


def test_normals_stay_where_corners_are_split(write):
    kinds = [*FACES, "list uchar float texcoord"]
    normal = np.array([0.6, -0.8, 0.0])
    vertices = ("vertex", [*XYZ, "float nx", "float ny", "float nz"], [(*corner, *normal.tolist()) for corner in SQUARE])
    faces = ("face", kinds, [([0, 1, 2], (0, 0, 1, 0, 1, 1)), ([0, 2, 3], (0, 1, 1, 1, 0, 1))])
    mesh, _ = load_model(write("a.ply", ply([vertices, faces])))
    assert len(mesh.vertices) == 6
    np.testing.assert_allclose(mesh.normals, np.tile(normal, (6, 1)), atol=1e-6)


@pytest.mark.parametrize("encoding", FORMATS)
@pytest.mark.parametrize("list_type", ["uchar int", "char uint", "short ushort", "uint short", "int uchar", "ushort char"])
@pytest.mark.parametrize("name", ["vertex_indices", "vertex_index", "vertex_ids"])
def test_lists_of_any_integer_type(write, encoding, list_type, name):
    faces = ("face", [f"list {list_type} {name}"], [([0, 1, 2],), ([0, 2, 3],)])
    mesh, _ = load_model(write("a.ply", ply([("vertex", XYZ, SQUARE), faces], encoding)))
    assert triangle_areas(mesh).sum() == pytest.approx(4)


@pytest.mark.parametrize("encoding", FORMATS)
@pytest.mark.parametrize(
    ("strips", "triangles"),
    [([0, 1, 3, 2], 2), ([0, 1, 3, -1, 2, 3, 1], 2), ([0, 1, 3, 3, 2, 1, -1], 2), ([-1, 0, 1, 3, -1, -1, 1, 2, 3], 2)],
)
def test_strips(write, encoding, strips, triangles):
    """Fronts all turn the same way, on the side of the strip's first triangle."""
    data = ply([("vertex", XYZ, SQUARE), ("tristrips", ["list int int vertex_indices"], [(strips,)])], encoding)
    mesh, _ = load_model(write("a.ply", data))
    assert len(mesh.triangles) == triangles
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    assert (np.cross(b - a, c - a)[:, 1] < 0).all()


def test_concave_polygons_are_filled_exactly(write):
    points = [(-1, 0, 1), (-1, 0, -1), (1, 0, -1), (1, 0, 1), (0, 0, -0.5)]
    mesh, _ = load_model(write("a.ply", ply([("vertex", XYZ, points), ("face", FACES, [(range(5),)])])))
    assert triangle_areas(mesh).sum() == pytest.approx(2.5)
    assert not mesh.warnings


@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
def test_a_body_may_begin_with_any_byte(write, newline):
    """The first byte of the body is that of a line's end."""
    data = ply([("pad", ["uchar a"], [(10,)]), ("vertex", XYZ, SQUARE), QUAD], "binary_little_endian", newline=newline)
    mesh, _ = load_model(write("a.ply", data))
    assert triangle_areas(mesh).sum() == pytest.approx(4)


def test_lines_that_hold_more_than_the_header_promises(write):
    """As MeshLab once wrote them: colours of corners as a list for the promised colour of the face."""
    faces = ("face", [*FACES, "uchar red", "uchar green", "uchar blue"], [([0, 1, 2], 9, 1, 1), ([0, 2, 3], 9, 1, 1)])
    data = ply([("vertex", XYZ, SQUARE), faces]).replace(b" 9 1 1", b" 9 1 1 1 1 1 1 1 1 1")
    mesh, _ = load_model(write("a.ply", data))
    assert triangle_areas(mesh).sum() == pytest.approx(4)
    assert mesh.colors is None
    assert "holds 14 numbers for 7 in the header; the last columns of element 'face'" in mesh.warnings[0]


def test_remarks_between_rows_and_in_the_header(write):
    data = ply([("vertex", XYZ, SQUARE), QUAD], comments=["by hand"])
    data = data.replace(b"comment by", b"Made by").replace(b"1 0 1", b"comment, and another 3 1\n\n1 0 1", 1)
    mesh, _ = load_model(write("a.ply", data))
    assert triangle_areas(mesh).sum() == pytest.approx(4)
    assert "line 3 of its PLY header is ignored: 'Made by hand'" in mesh.warnings[0]


KINDS = {"char": (-128, 127), "uchar": (0, 255), "short": (-(2**15), 2**15 - 1), "ushort": (0, 2**16 - 1)}
KINDS |= {"int": (-(2**31), 2**31 - 1), "uint": (0, 2**32 - 1)}
NUMBERS = {kind: st.integers(*ends) for kind, ends in KINDS.items()}
NUMBERS |= {"float": st.floats(-1e6, 1e6, width=32), "double": st.floats(-1e9, 1e9)}


@st.composite
def tables(draw):
    """An element of random columns and rows; every other one has lists of equal length."""
    columns = draw(st.lists(st.tuples(st.sampled_from(sorted(NUMBERS)), st.sampled_from([None, "uchar", "int"])), max_size=4))
    length = draw(st.one_of(st.none(), st.integers(0, 4)))
    properties = [f"{f'list {count} ' if count else ''}{kind} p{i}" for i, (kind, count) in enumerate(columns)]
    cells = [
        NUMBERS[kind]
        if count is None
        else st.lists(NUMBERS[kind], min_size=length or 0, max_size=4 if length is None else length)
        for kind, count in columns
    ]
    return properties, draw(st.lists(st.tuples(*cells), min_size=1, max_size=6)) if columns else []


@given(st.lists(tables(), min_size=1, max_size=3), st.sampled_from(sorted(FORMATS)))
def test_whatever_is_written_is_read_back(tmp_path_factory, made, encoding):
    elements = [(f"e{i}", properties, rows) for i, (properties, rows) in enumerate(made)]
    file = read_elements(ModelFolder(tmp_path_factory.getbasetemp() / "a.ply"), ply(elements, encoding))
    for name, properties, rows in elements:
        for i, kind in enumerate(properties if rows else []):
            column, written = file.columns[name][f"p{i}"], [row[i] for row in rows]
            if kind.startswith("list"):
                assert isinstance(column, Lists)
                assert column.counts.tolist() == [len(cell) for cell in written]
                assert column.values.tolist() == [value for cell in written for value in cell]
            else:
                assert column.tolist() == written


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (ply([("vertex", XYZ, SQUARE)]), "4 points and no faces"),
        (ply([("vertex", [*XYZ, "float f_dc_0"], [(0, 0, 0, 1)])]), "1 Gaussian splats"),
        (ply([("vertex", XYZ, SQUARE), ("face", FACES, [([0, 1, 4],)])]), "names vertex 4, expected 0 to 3"),
        (ply([("vertex", XYZ, SQUARE), ("face", FACES, [([0, 1, -2],)])]), "names vertex -2, expected 0 to 3"),
        (ply([("vertex", XYZ, SQUARE), QUAD]).replace(b"-1 0 -1", b"-1 0 -1,5"), "line 10: .*'-1,5': decimals need a point"),
        (ply([("vertex", XYZ, SQUARE), QUAD]) + b"7", "holds 6 lines of numbers, its header promises 5"),
        (ply([("vertex", XYZ, []), ("face", FACES, [])]), "holds no vertices"),
        (ply([("vertex", XYZ, SQUARE), QUAD])[:-4], "promises 1 rows of element 'face'"),
        (ply([("vertex", XYZ, SQUARE), QUAD], "binary_big_endian")[:-4], "promises 1 rows of element 'face'"),
        (ply([("vertex", XYZ, SQUARE), QUAD]).replace(b"vertex 4", b"vertex 4000"), "promises 4,000 rows of element 'vertex'"),
        (ply([("vertex", XYZ, SQUARE), QUAD]).replace(b"float x", b"quad x"), "line 4 of its PLY header .*'property quad x'"),
        (ply([("vertex", XYZ, SQUARE), QUAD]).replace(b"end_header", b"end"), "header does not end"),
        (
            ply([("vertex", XYZ, SQUARE), ("face", [*FACES, "list uchar float texcoord"], [([0, 1, 2], (0, 0, 1))])]),
            "face 1: expected 6 texture coordinates for its 3 corners, found 3",
        ),
    ],
)
def test_a_refusal_names_the_reason(write, data, reason):
    with pytest.raises(ModelError, match=reason):
        load_model(write("a.ply", data))


@pytest.mark.slow
def test_five_million_triangles_take_two_seconds_of_processor_time(tmp_path):
    """Positions and faces; shading normals and the checks of any model come on top."""
    side = 1583
    grid = np.arange(side * side).reshape(side, side)
    a, b, c, d = (corner.ravel() for corner in (grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]))
    rows = np.zeros(2 * len(a), [("count", "u1"), ("corners", "<i4", 3)])
    rows["count"], rows["corners"] = 3, np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    points = np.column_stack([grid.ravel() % side, grid.ravel() // side, np.zeros(side * side)]).astype("<f4")
    head = ply([("vertex", XYZ, []), ("face", FACES, [])], "binary_little_endian").decode()
    head = head.replace("vertex 0", f"vertex {len(points)}").replace("face 0", f"face {len(rows)}")
    path = tmp_path / "a.ply"
    path.write_bytes(head.encode() + points.tobytes() + rows.tobytes())
    start = time.process_time()
    folder = ModelFolder(path)
    columns = read_elements(folder, folder.read_model()).columns
    corners = columns["face"]["vertex_indices"].values.astype(np.int64)
    positions = np.column_stack([columns["vertex"][axis] for axis in "xyz"])
    assert time.process_time() - start < 2
    assert len(corners) == 3 * len(rows) > 15_000_000
    np.testing.assert_array_equal(positions[corners[-1]], [side - 2, side - 1, 0])
