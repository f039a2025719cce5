"""The OBJ and MTL readers: closed forms on hand-made files, and triangulation."""

import io
import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from viewsphere.assets.load import load_model
from viewsphere.assets.readers.shared.polygon import triangulate
from viewsphere.errors import ModelError

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


def png(pixels):
    file = io.BytesIO()
    Image.fromarray(np.asarray(pixels, np.uint8)).save(file, "PNG")
    return file.getvalue()


def areas(mesh):
    a, b, c = (mesh.vertices[mesh.triangles[:, i]].astype(np.float64) for i in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def test_relative_indices_count_back_from_their_line(write):
    mesh, _ = load_model(write("a.obj", SQUARE + "f -4 -3 -2\nv 9 9 9\nf -5 -3 -2\n"))
    np.testing.assert_array_equal(mesh.vertices[mesh.triangles[1]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]])


def test_objects_are_parts_else_groups(write):
    faces = "f 1 2 3\n", "f 1 3 4\n"
    by_object = load_model(write("o.obj", SQUARE + "o left side\ng x\n" + faces[0] + "o right\n" + faces[1]))[0]
    assert by_object.parts == ("left side", "right")
    by_group = load_model(write("g.obj", SQUARE + "o car\ng wheel\n" + faces[0] + "g\n" + faces[1]))[0]
    assert by_group.parts == ("wheel", "car")
    assert load_model(write("n.obj", SQUARE + faces[0]))[0].parts == ("object",)


def test_faces_of_a_part_gather_in_file_order(write):
    text = SQUARE + "usemtl a\ng one\nf 1 2 3\ng two\nf 1 3 4\ng one\nf 2 3 4\n"
    mesh, _ = load_model(write("a.obj", text))
    assert mesh.triangle_part.tolist() == [0, 0, 1]
    np.testing.assert_array_equal(mesh.vertices[mesh.triangles[1]], [[1, 0, 0], [1, 1, 0], [0, 1, 0]])


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "gbk", "latin-1"])
def test_any_encoding(write, encoding):
    name = "Rückfahrlicht" if encoding == "latin-1" else "车轮前左侧后视镜"
    text = f"# {name}\n{SQUARE}o a\nf 1 2 3\no {name}\nf 1 3 4\n"
    mesh, _ = load_model(write("a.obj", text.encode(encoding)))
    assert len(mesh.triangles) == 2
    if encoding.startswith("utf"):
        assert mesh.parts == ("a", name)


def test_vertex_colours_are_srgb(write):
    mesh, _ = load_model(write("a.obj", "v 0 0 0 1 0.5 0\nv 1 0 0 1 0.5 0\nv 0 1 0 1 0.5 0\nf 1 2 3\n"))
    expected = ((0.5 + 0.055) / 1.055) ** 2.4
    np.testing.assert_allclose(mesh.colors, [[1, expected, 0, 1]] * 3, rtol=1e-6)


def test_texture_coordinates_run_downwards(write):
    mesh, _ = load_model(write("a.obj", SQUARE + "vt 0.25 0.75\nvt 1 0\nvt 0 0\nf 1/1 2/2 3/3\n"))
    np.testing.assert_array_equal(mesh.uv0[mesh.triangles[0]], [[0.25, 0.25], [1, 1], [0, 1]])


def test_smoothing_groups_decide_the_normals(write):
    roof = "v 0 0 0\nv 1 0 0\nv 0 1 1\nv 1 1 1\nv 0 2 0\nv 1 2 0\n"
    faces = "f 1 2 4 3\n", "f 3 4 6 5\n"
    smooth = load_model(write("s.obj", roof + "s 1\n" + "".join(faces)))[0]
    ridge = smooth.normals[smooth.vertices[:, 2] == 1]
    np.testing.assert_allclose(ridge, np.tile([0, 0, 1], (len(ridge), 1)), atol=1e-6)
    for text in ("s off\n" + "".join(faces), "s 1\n" + faces[0] + "s 2\n" + faces[1], "".join(faces)):
        sharp = load_model(write("f.obj", roof + text))[0]
        slopes = np.unique(sharp.normals.round(4), axis=0)
        np.testing.assert_allclose(slopes, [[0, -0.7071, 0.7071], [0, 0.7071, 0.7071]], atol=1e-4)


def test_gentle_edges_are_smooth_without_normals(write):
    """A cylinder of 24 sides, 15 degrees apart: round on its side, sharp at its rims."""
    angles = np.arange(24) * 2 * np.pi / 24
    ring = [f"v {np.cos(a)} {np.sin(a)} {z}" for z in (0, 1) for a in angles]
    sides = [f"f {i + 1} {(i + 1) % 24 + 1} {(i + 1) % 24 + 25} {i + 25}" for i in range(24)]
    caps = ["f " + " ".join(str(i) for i in range(24, 0, -1)), "f " + " ".join(str(i) for i in range(25, 49))]
    mesh, _ = load_model(write("c.obj", "\n".join(ring + sides + caps)))
    assert len(mesh.triangles) == 24 * 2 + 2 * 22
    side = np.abs(mesh.normals[:, 2]) < 0.5
    radial = mesh.vertices[side] * [1, 1, 0]
    np.testing.assert_allclose(mesh.normals[side], radial, atol=0.07)
    np.testing.assert_allclose(np.abs(mesh.normals[~side]), np.tile([0, 0, 1], ((~side).sum(), 1)), atol=1e-6)


def test_numbers_may_have_comments_signs_and_exponents(write):
    mesh, _ = load_model(write("a.obj", "v 1. .5 3.1e+0 # first\nv +1e2 0 0#x y\nv -0 1E1 \\\n7\nf 1 2 3 # 4\n"))
    np.testing.assert_array_equal(mesh.vertices[mesh.triangles[0]], np.float32([[1, 0.5, 3.1], [100, 0, 0], [0, 10, 7]]))


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("v -12,75 0,00 0,00\n", 1, "'-12,75' has a decimal comma; export the model with decimal points"),
        ("# by hand\n\nv 0 0 0\nv 1,5e3 0 0\n", 4, "'1,5e3' has a decimal comma"),
        ("v 0 0 0\nv 1 \\\n0 0\nv 3.1+e2 0 0\n", 4, "found '3.1+e2'"),
        ("v 0 0 0\nv 0x 0 0\n", 2, "found '0x'"),
        ("v 0 0 0\nv 1_000 0 0\n", 2, "found '1_000'"),
        ("v 0 0 0\nv 1 2\n", 2, "expected 3 or more numbers behind 'v', found '1 2'"),
        ("v 0 0 0\nv 1,2,3\n", 2, "expected 3 or more numbers behind 'v', found '1,2,3'"),
        (SQUARE + "vt 0,5 0\n", 5, "'0,5' has a decimal comma"),
        (SQUARE + "vn 0 1\n", 5, "expected 3 or more numbers behind 'vn'"),
        (SQUARE + "f 1 2 x\n", 5, "expected a face corner like 1/2/3, found 'x'"),
        (SQUARE + "f 1,2,3 2 3\n", 5, "expected a face corner like 1/2/3, found '1,2,3'"),
    ],
)
def test_a_number_is_read_whole_or_refused_with_its_line(write, text, line, message):
    with pytest.raises(ModelError) as error:
        load_model(write("bad.obj", text + ("" if "f 1" in text else "f 1 1 2\n")))
    assert f"bad.obj:{line}: " in str(error.value)
    assert message in str(error.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "empty"),
        ("hello\n", "no triangles"),
        (SQUARE, "no triangles"),
        (SQUARE + "f 1 2 5\n", "vertex 5, expected 1 to 4"),
        (SQUARE + "f 0 1 2\n", "vertex 0"),
        ("vt 0 0\n" + SQUARE + "f 1/9 2/9 3/9\n", "texture coordinate 9"),
        (SQUARE + "f a b c\n", "'a'"),
        (SQUARE + "f 1 1 1\n", "zero area"),
        ("v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "NaN"),
        ("v 1e39 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "NaN or infinite"),
    ],
)
def test_broken_files_are_one_clear_error(write, text, message):
    with pytest.raises(ModelError) as error:
        load_model(write("bad.obj", text))
    assert message in str(error.value)
    assert "bad.obj" in str(error.value)


def test_a_model_far_from_the_origin_keeps_its_shape(write):
    lines = [f"v {1e7 + x} {-2e7 + y} 5e6" for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    mesh, facts = load_model(write("far.obj", "\n".join(lines) + "\nf 1 2 3 4\n"))
    np.testing.assert_array_equal(mesh.bounds[1] - mesh.bounds[0], [1, 1, 0])
    assert facts.origin == (1e7 + 0.5, -2e7 + 0.5, 5e6)


def test_materials(write):
    mtl = (
        "newmtl Hard Shiny White\nKd 0.1 0.2 0.3\nd 0.25\nPr 0.4\nPm 0.6\nKe 1 2 3\nPc 0.5\nPcr 0.2\n"
        "newmtl old\nKd 1 0 0\nNs 48\nKs 0 0 0\nTr 0\n"
    )
    write("two words.mtl", mtl)
    text = "mtllib two words.mtl\n" + SQUARE + "usemtl Hard Shiny White\nf 1 2 3\nusemtl old\nf 1 3 4\nusemtl gone\nf 2 3 4\n"
    mesh, _ = load_model(write("a.obj", text))
    unknown, shiny, old = mesh.materials
    assert (shiny.base_color, shiny.alpha_mode) == ((0.1, 0.2, 0.3, 0.25), "BLEND")
    assert (shiny.roughness, shiny.metallic, shiny.emissive) == (0.4, 0.6, (1, 2, 3))
    assert (shiny.clearcoat, shiny.clearcoat_roughness, shiny.double_sided) == (0.5, 0.2, True)
    assert (old.roughness**2, old.specular, old.alpha_mode) == (pytest.approx(0.2), 0, "OPAQUE")
    assert unknown.name == "default"
    assert mesh.triangle_material.tolist() == [0, 1, 2]
    assert any("'gone'" in warning for warning in mesh.warnings)


@pytest.mark.parametrize(
    ("lines", "opacity", "mode"),
    [
        ("Tr 1", 1.0, "OPAQUE"),
        ("Tr 0", 1.0, "OPAQUE"),
        ("Tr 0.25", 0.75, "BLEND"),
        ("Tr 1\nd 1", 1.0, "OPAQUE"),
        ("Tr 1\nd 0", 0.0, "BLEND"),
    ],
)
def test_tr_alone_hides_nothing(write, lines, opacity, mode):
    write("a.mtl", f"newmtl a\n{lines}\n")
    mesh, _ = load_model(write("a.obj", "mtllib a.mtl\nusemtl a\n" + SQUARE + "f 1 2 3\n"))
    assert (mesh.materials[0].base_color[3], mesh.materials[0].alpha_mode) == (opacity, mode)


def test_maps_and_their_options(write):
    clear = np.full((2, 2, 3), 200)
    write("skin.png", png(clear))
    write("holes.png", png([[0, 255], [255, 0]]))
    write("rough.png", png(np.full((2, 2), 51)))
    write("flat.png", png(np.full((2, 2, 3), (128, 128, 255))))
    mtl = (
        "newmtl m\nKd 0 0 0\nmap_Kd -s 2 4 1 -o 0.5 0.25 -clamp on skin.png\nmap_d holes.png\n"
        "map_Pr rough.png\nmap_Bump -bm 0.5 flat.png\n"
    )
    write("m.mtl", mtl)
    mesh, _ = load_model(write("a.obj", "mtllib m.mtl\nusemtl m\nvt 0 0\n" + SQUARE + "f 1/1 2/1 3/1\n"))
    (m,) = mesh.materials
    assert m.base_color == (1, 1, 1, 1)
    texture = m.base_color_texture
    assert (texture.scale, texture.offset, texture.wrap_s) == ((2, 4), (0.5, 1 - 4 - 0.25), "clamp")
    pixels = mesh.images[texture.image].pixels
    np.testing.assert_array_equal(pixels[..., 3], [[0, 255], [255, 0]])
    assert set(pixels[..., :3].reshape(-1)) == {200}
    assert m.alpha_mode == "MASK"
    assert mesh.images[m.metallic_roughness_texture.image].pixels[0, 0, 1] == 51
    assert (m.roughness, m.metallic, m.normal_scale) == (1, 0, 0.5)
    assert tuple(mesh.images[m.normal_texture.image].pixels[0, 0]) == (128, 128, 255, 255)


def test_texture_options_move_the_picture_as_obj_says(write):
    """A point's texel by OBJ's rule (v upwards) and by the kept transform (v downwards) must be the same."""
    write("t.png", png(np.zeros((2, 2, 3))))
    write("m.mtl", "newmtl m\nmap_Kd -o 0.1 0.2 -s 3 5 t.png\n")
    mesh, _ = load_model(write("a.obj", "mtllib m.mtl\nusemtl m\nvt 0.3 0.6\n" + SQUARE + "f 1/1 2/1 3/1\n"))
    texture = mesh.materials[0].base_color_texture
    u, v = mesh.uv0[0] * texture.scale + texture.offset
    assert u == pytest.approx(0.3 * 3 + 0.1)
    assert 1 - v == pytest.approx(0.6 * 5 + 0.2)


@pytest.mark.parametrize(
    ("alpha", "mode"),
    [(255, "OPAQUE"), ([[0, 255]], "MASK"), ([[100, 150]], "BLEND"), (0, "OPAQUE")],
)
def test_alpha_of_an_opacity_map(write, alpha, mode):
    pixels = np.full((1, 2, 4), 255)
    pixels[..., 3] = alpha
    write("t.png", png(pixels))
    write("m.mtl", "newmtl m\nmap_Kd t.png\nmap_d t.png\n")
    mesh, _ = load_model(write("a.obj", "mtllib m.mtl\nusemtl m\nvt 0 0\n" + SQUARE + "f 1/1 2/1 3/1\n"))
    assert mesh.materials[0].alpha_mode == mode


def bumpy(write, heights, options=""):
    """The material of a triangle with this height map, and its images."""
    write("h.png", png(heights))
    write("m.mtl", f"newmtl m\nmap_bump {options} h.png\n")
    mesh, _ = load_model(write("a.obj", "mtllib m.mtl\nusemtl m\nvt 0 0\n" + SQUARE + "f 1/1 2/1 3/1\n"))
    assert mesh.warnings == ()
    return mesh.materials[0], mesh.images


def test_heights_become_normals(write):
    """A slope that rises to the right and to the image's top leans left and down, by its gradient."""
    x, y = np.meshgrid(np.arange(64), np.arange(64))
    heights = 100 + 2 * x - 1 * y
    material, images = bumpy(write, heights, "-bm 2 -clamp on")
    assert material.normal_scale == 2
    expected = np.array([-2.0, -1.0, 255 / 0.64])  # 0.01 of 64 texels high
    expected /= np.linalg.norm(expected)
    normal = images[material.normal_texture.image].pixels[20, 30, :3] / 127.5 - 1
    np.testing.assert_allclose(normal, expected, atol=1 / 127)
    steep = np.where(np.arange(256) % 2, 255, 0)[None] * np.ones((4, 1), int)
    material, images = bumpy(write, np.repeat(steep, 2, axis=1))
    red = images[material.normal_texture.image].pixels[1, 1:9, 0].astype(int)
    assert (np.sign(red - 128) == [-1, -1, 1, 1, -1, -1, 1, 1]).all()


def test_an_even_height_map_is_none(write):
    material, images = bumpy(write, np.full((2, 2), 90))
    assert material.normal_texture is None
    assert images == ()


@given(
    st.lists(st.floats(0.2, 1.0), min_size=4, max_size=40),
    st.floats(0, 6.28),
    st.floats(-1.5, 1.5),
)
def test_star_shaped_polygons_keep_their_area(radii, turn, tilt):
    """However concave: n - 2 triangles, none folded, that fill exactly the polygon's area."""
    angles = turn + np.arange(len(radii)) * 2 * np.pi / len(radii)
    flat = np.column_stack([np.cos(angles), np.sin(angles)]) * np.array(radii)[:, None]
    x, y = flat.T
    area = (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2
    points = np.column_stack([x, y * np.cos(tilt), y * np.sin(tilt)])
    triangles, owner = triangulate(points, np.arange(len(points)), np.array([len(points)]))
    assert triangles.shape == (len(points) - 2, 3)
    assert set(owner) == {0}
    a, b, c = (points[triangles[:, i]] for i in range(3))
    normals = np.cross(b - a, c - a) @ np.array([0, -np.sin(tilt), np.cos(tilt)]) / 2
    assert normals.min() > -1e-9
    assert normals.sum() == pytest.approx(area, rel=1e-9)


def test_a_concave_quadrilateral_is_cut_along_its_inner_diagonal():
    points = np.array([[0, 0, 0], [2, -1, 0], [1, 0, 0], [2, 1, 0.0]])
    for shift in range(4):
        corners = np.roll(np.arange(4), shift)
        triangles, _ = triangulate(points, corners, np.array([4]))
        cut = corners[triangles]
        a, b, c = (points[cut[:, i]] for i in range(3))
        np.testing.assert_allclose(np.cross(b - a, c - a)[:, 2], [1, 1])


@pytest.mark.slow
def test_speed(write):
    side = 230
    grid = np.arange(side * side).reshape(side, side)
    lines = [f"v {i % side} {i // side} 0\nvt {i % side / side:.5f} 0.5\nvn 0 0 1" for i in range(side * side)]
    a, b, c, d = grid[:-1, :-1].ravel() + 1, grid[:-1, 1:].ravel() + 1, grid[1:, 1:].ravel() + 1, grid[1:, :-1].ravel() + 1
    lines += [f"f {p}/{p}/{p} {q}/{q}/{q} {r}/{r}/{r} {s}/{s}/{s}" for p, q, r, s in zip(a, b, c, d, strict=True)]
    path = write("big.obj", "\n".join(lines))
    start = time.process_time()
    mesh, _ = load_model(path)
    assert len(mesh.triangles) == 2 * (side - 1) ** 2
    assert areas(mesh).sum() == pytest.approx((side - 1) ** 2)
    assert time.process_time() - start < 8


def test_a_normal_without_direction_is_said(write):
    path = write("n.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 0\nvn 0 0 1\nf 1//1 2//2 3//2\n")
    mesh, _ = load_model(path)
    assert mesh.warnings == ("n.obj: 1 of 3 normals are missing, NaN or of no length: smooth ones take their place",)
    np.testing.assert_array_equal(mesh.normals, [[0, 0, 1]] * 3)


@pytest.mark.parametrize("word", ["nan", "-NaN", "inf", "-inf", "1e400", "1e39"])
@pytest.mark.parametrize("axis", range(3))
def test_a_vertex_that_is_nowhere_is_refused_with_its_line(tmp_path, word, axis):
    """Only where a face names it: organised scans mark missing points by NaN."""
    numbers = ["0", "0", "0"]
    numbers[axis] = word
    text = f"# cube\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv {' '.join(numbers)}\nf 1 2 3\n"
    (tmp_path / "a.obj").write_text(text)
    assert len(load_model(tmp_path / "a.obj")[0].triangles) == 1
    (tmp_path / "a.obj").write_text(f"{text}f 1 2 4\n")
    with pytest.raises(ModelError, match=r"a\.obj:5: vertex 4 of 4 has a NaN or infinite coordinate"):
        load_model(tmp_path / "a.obj")
