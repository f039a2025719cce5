"""What a texture's alpha is for: decided by what triangles show of it, not by what an atlas holds besides."""

import io

import numpy as np
import pytest
from PIL import Image as Pillow

from viewsphere.assets.appearance.shown import shown_texels
from viewsphere.assets.load import load_model
from viewsphere.assets.mesh import Texture


def png(pixels):
    file = io.BytesIO()
    Pillow.fromarray(np.asarray(pixels, np.uint8)).save(file, "PNG")
    return file.getvalue()


def holds(triangle, x, y):
    """Return whether points lie inside a triangle, by the signs of three areas."""
    signs = []
    for (ax, ay), (bx, by) in zip(triangle, np.roll(triangle, -1, axis=0), strict=True):
        signs.append((bx - ax) * (y - ay) - (by - ay) * (x - ax))
    return np.all(np.greater(signs, 0), axis=0) | np.all(np.less(signs, 0), axis=0)


@pytest.mark.parametrize("seed", range(20))
def test_shown_texels_are_those_whose_centres_triangles_hold(seed):
    rng = np.random.default_rng(seed)
    height, width = (int(n) for n in rng.integers(1, 24, 2))
    uv = rng.uniform(-3, 3, (4, 1, 2)) + rng.uniform(0, 1, (4, 3, 2))
    shown = shown_texels(Texture(0), uv, (height, width))
    expected = np.zeros((height, width), bool)
    rows, columns = np.mgrid[-4 * height : 5 * height, -4 * width : 5 * width]
    for triangle in uv:
        inside = holds(triangle * (width, height), columns + 0.5, rows + 0.5)
        expected[rows[inside] % height, columns[inside] % width] = True
        u, v = triangle.mean(axis=0)
        expected[int(np.floor(v * height)) % height, int(np.floor(u * width)) % width] = True
    np.testing.assert_array_equal(shown, expected)


@pytest.mark.parametrize(
    ("wrap", "corners", "shown"),
    [
        ("repeat", [[0, 0], [7, 0.1], [5, 0.3]], [[1, 1, 1, 1], [0, 0, 0, 0]]),  # wider than the picture
        ("clamp", [[0.5, 0.1], [7, 0.1], [7, 0.4]], [[0, 0, 1, 1], [0, 0, 0, 0]]),  # beyond its right edge
        ("clamp", [[3, 3], [4, 3], [4, 4]], [[0, 0, 0, 0], [0, 0, 0, 1]]),  # wholly beyond
        ("repeat", [[1, 1], [1, 1], [1, 1]], [[1, 0, 0, 0], [0, 0, 0, 0]]),  # a point
        ("repeat", [[np.nan, 1], [1, 1], [1, 1]], [[0, 0, 0, 0], [0, 0, 0, 0]]),
        ("repeat", [[1e30, 0], [-1e30, 0.6], [0, 1]], [[1, 1, 1, 1], [1, 1, 1, 1]]),
    ],
)
def test_shown_texels_beyond_the_picture(wrap, corners, shown):
    texture = Texture(0, wrap_s=wrap, wrap_t=wrap)
    np.testing.assert_array_equal(shown_texels(texture, np.array([corners], float), (2, 4)), shown)


def test_offset_and_scale_apply():
    texture = Texture(0, offset=(0.5, 0.0), scale=(0.5, 0.25))
    shown = shown_texels(texture, np.array([[[0, 0], [1, 0], [1, 2]], [[0, 0], [1, 2], [0, 2.0]]]), (8, 8))
    assert np.argwhere(shown).min(axis=0).tolist() == [0, 4]
    assert np.argwhere(shown).max(axis=0).tolist() == [3, 7]
    assert shown.sum() == 16


def atlas(island):
    """A picture of 64 x 64 texels, clear but for an island in the middle with this alpha (32, 32)."""
    pixels = np.full((64, 64, 4), 200)
    pixels[..., 3] = 0
    pixels[16:48, 16:48, 3] = island
    return png(pixels)


def card(*, low, high):
    """A square that shows the picture between these coordinates, as OBJ."""
    corners = [(low, low), (high, low), (high, high), (low, high)]
    lines = [f"v {u} {v} 0\nvt {u} {v}" for u, v in corners]
    return "mtllib m.mtl\nusemtl m\n" + "\n".join(lines) + "\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"


SOLID = np.full((32, 32), 255)
HOLES = np.where(np.add.outer(np.arange(32), np.arange(32)) % 16 < 8, 0, 255)
GLASS = np.full((32, 32), 90)
SPECK = np.where(np.arange(1024).reshape(32, 32) == 500, 0, 255)
DISTANCE = np.hypot(*np.mgrid[-15.5:16, -15.5:16])
SOFT_LEAF = np.clip((10 - DISTANCE) * 80, 0, 255)  # a disc, its edge three texels wide
GLOSS = np.linspace(30, 220, 1024).reshape(32, 32)
SOFT_RIM = np.pad(np.full((30, 30), 255), 1, constant_values=128)


@pytest.mark.parametrize(
    ("island", "low", "high", "mode"),
    [
        (SOLID, 0.25, 0.75, "OPAQUE"),
        (SOLID, 0.24, 0.76, "OPAQUE"),  # half a texel into the gap
        (SOFT_RIM, 0.25, 0.75, "OPAQUE"),
        (SPECK, 0.25, 0.75, "MASK"),  # more than a thousandth
        (HOLES, 0.25, 0.75, "MASK"),
        (GLASS, 0.25, 0.75, "OPAQUE"),
        (SOFT_LEAF, 0.25, 0.75, "MASK"),
        (GLOSS, 0.25, 0.75, "OPAQUE"),
        (SOLID, 0.0, 1.0, "MASK"),  # a card that shows the clear surroundings too
        (SOLID, 1.25, 1.75, "OPAQUE"),  # the next copy of the picture
    ],
)
def test_only_what_is_shown_counts(write, island, low, high, mode):
    write("t.png", atlas(island))
    write("m.mtl", "newmtl m\nmap_Kd t.png\n")
    mesh, _ = load_model(write("a.obj", card(low=low, high=high)))
    assert mesh.materials[0].alpha_mode == mode
    chosen = {"OPAQUE": "no cut-out, so it is ignored", "MASK": "mostly clear or solid, so it cuts holes"}[mode]
    warned = [f"a.obj: the file does not state that the alpha of texture 't.png' is opacity; it is {chosen}"]
    assert list(mesh.warnings) == (warned if mode == "MASK" or any(island is gloss for gloss in (GLASS, GLOSS)) else [])


@pytest.mark.parametrize(
    ("island", "mode"), [("HOLES", "MASK"), ("GLASS", "BLEND"), ("SOFT_LEAF", "BLEND"), ("GLOSS", "BLEND"), ("SOLID", "OPAQUE")]
)
@pytest.mark.parametrize("statement", ["map_d t.png", "map_Tr t.png", "map_opacity t.png"])
def test_stated_opacity_is_taken_as_it_is(write, island, mode, statement):
    write("t.png", atlas(globals()[island]))
    write("m.mtl", f"newmtl m\nmap_Kd t.png\n{statement}\n")
    mesh, _ = load_model(write("a.obj", card(low=0.25, high=0.75)))
    assert (mesh.materials[0].alpha_mode, mesh.warnings) == (mode, ())


def test_a_speck_among_many_texels_is_no_shape(write):
    pixels = np.full((128, 128, 4), 255)
    pixels[60:64, 60:64, 3] = 0
    write("t.png", png(pixels))
    write("m.mtl", "newmtl m\nmap_Kd t.png\n")
    mesh, _ = load_model(write("a.obj", card(low=0, high=1)))
    assert mesh.materials[0].alpha_mode == "OPAQUE"


def test_each_material_of_one_picture_is_judged_by_its_own_triangles(write):
    write("t.png", atlas(HOLES))
    write("m.mtl", "newmtl m\nmap_Kd t.png\nnewmtl n\nmap_Kd t.png\n")
    text = card(low=0.25, high=0.75) + "vt 0.26 0.26\nvt 0.28 0.26\nvt 0.28 0.28\nusemtl n\nf 1/5 2/6 3/7\n"
    holes, solid = load_model(write("a.obj", text))[0].materials
    assert (holes.name, holes.alpha_mode) == ("m", "MASK")
    assert (solid.name, solid.alpha_mode) == ("n", "OPAQUE")


def test_without_coordinates_nothing_is_shown(write):
    write("t.png", atlas(HOLES))
    write("m.mtl", "newmtl m\nmap_Kd t.png\n")
    mesh, _ = load_model(write("a.obj", "mtllib m.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"))
    assert mesh.materials[0].alpha_mode == "OPAQUE"


def test_what_a_gltf_says_stands(gltf):
    """Its alphaMode is explicit: a picture clear between its islands stays what the file calls it."""
    view = gltf.view(atlas(SOLID))
    gltf.root |= {"images": [{"bufferView": view, "mimeType": "image/png"}], "textures": [{"source": 0}]}
    color = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
    gltf.root["materials"] = [color | {"alphaMode": mode} for mode in ("OPAQUE", "MASK", "BLEND")]
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    for material in range(3):
        uv = points[:, :2] if material == 0 else points[:, :2] / 4 + 0.3
        gltf.node(mesh=gltf.mesh(points, None, material=material, TEXCOORD_0=uv.astype(np.float32)))
    gltf.root["scenes"] = [{"nodes": [0, 1, 2]}]
    mesh, _ = load_model(gltf.write())
    assert [material.alpha_mode for material in mesh.materials] == ["OPAQUE", "MASK", "BLEND"]
