"""What models look like, in words: of surfaces that are made for it."""

from dataclasses import replace

import numpy as np
import pytest

from truth_scenes import cube
from viewsphere.assets.appearance.color_names import NAMES, nearest_names, oklab
from viewsphere.assets.appearance.description import appearance_of, is_alike, words
from viewsphere.assets.mesh import Image, Material, Mesh, Texture
from viewsphere.codecs.srgb import linear
from viewsphere.model.thing import Repaint

RED, BLACK, GREEN = (0.6, 0.02, 0.02, 1.0), (0.01, 0.01, 0.01, 1.0), (0.02, 0.3, 0.05, 1.0)


def painted(*materials, mesh=None):
    """A cube whose triangles have these materials in turn."""
    mesh = cube(1.0) if mesh is None else mesh
    number = np.arange(len(mesh.triangles)) % len(materials)
    return replace(mesh, materials=materials, triangle_material=number.astype(np.int32))


def together(one, other):
    """Two meshes, of one material each."""
    return Mesh(
        vertices=np.concatenate([one.vertices, other.vertices]),
        triangles=np.concatenate([one.triangles, other.triangles + len(one.vertices)]).astype(np.int32),
        normals=np.concatenate([one.normals, other.normals]),
        triangle_material=np.repeat(np.int32([0, 1]), [len(one.triangles), len(other.triangles)]),
        triangle_part=np.zeros(len(one.triangles) + len(other.triangles), np.int32),
        materials=(*one.materials, *other.materials),
    )


NAMED = {
    "black": ["#000000", "#101418"],
    "gray": ["#808080", "#6c757d", "#a9a9a9"],
    "white": ["#ffffff", "#fffaf0"],
    "red": ["#ff0000", "#b22222", "#800000"],
    "orange": ["#ff8c00", "#ffa500"],
    "yellow": ["#ffff00", "#ffd700"],
    "green": ["#008000", "#00ff00", "#2e8b57", "#556b2f"],
    "blue": ["#0000ff", "#000080", "#87ceeb"],
    "purple": ["#800080", "#4b0082", "#8a2be2"],
    "pink": ["#ffc0cb", "#ff69b4"],
    "brown": ["#8b4513", "#a0522d"],
}


@pytest.mark.parametrize(("name", "text"), [(name, text) for name, texts in NAMED.items() for text in texts])
def test_well_known_colours_have_their_names(name, text):
    rgb = [int(text[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    assert NAMES[nearest_names(linear([rgb]))[0]] == name


def test_oklab_has_the_values_of_its_author():
    """White is (1, 0, 0); https://bottosson.github.io/posts/oklab/ lists colours of CIE XYZ, of which D65's white is one."""
    np.testing.assert_allclose(oklab([[1.0, 1.0, 1.0]]), [[1, 0, 0]], atol=1e-4)
    np.testing.assert_allclose(oklab([[1.0, 0.0, 0.0]]), [[0.62796, 0.22486, 0.12585]], atol=1e-4)
    np.testing.assert_allclose(oklab([[0.0, 0.0, 1.0]]), [[0.45201, -0.03246, -0.31153]], atol=1e-4)


@pytest.mark.parametrize(
    ("material", "expected"),
    [
        (Material("m", RED), ("red", "matte")),
        (Material("m", RED, roughness=0.5), ("red", None)),
        (Material("m", RED, roughness=0.2), ("red", "glossy")),
        (Material("m", RED, roughness=0.5, clearcoat=1.0, clearcoat_roughness=0.1), ("red", "glossy")),
        (Material("m", (0.5, 0.5, 0.5, 1.0), metallic=1.0, roughness=0.2), ("gray", "metal")),
        (Material("m", transmission=0.9, roughness=0.0), (None, "glass")),
        (Material("m", (1.0, 1.0, 1.0, 0.2), alpha_mode="BLEND"), (None, "glass")),
    ],
)
def test_materials_have_their_words(material, expected):
    assert words(appearance_of(painted(material))) == expected


def test_most_of_a_surface_has_to_have_the_colour():
    two = painted(Material("a", RED), Material("b", BLACK))
    assert words(appearance_of(two)) == (None, "matte")
    three = painted(Material("a", RED), Material("b", RED), Material("c", BLACK))
    assert words(appearance_of(three))[0] == "red"


def test_what_is_inside_or_below_does_not_count():
    inner = replace(cube(0.8), materials=(Material("inner", BLACK),))
    outer = replace(cube(1.0), materials=(Material("outer", RED),))
    looks = appearance_of(together(outer, inner))
    assert words(looks)[0] == "red"
    assert sum(patch.share for patch in looks.patches if patch.material == "outer") > 0.97
    below = replace(cube(1.0), materials=(Material("below", BLACK),))
    below = replace(below, vertices=below.vertices * np.float32([1, 1, 0.01]) - np.float32([0, 0, 1.1]))
    assert words(appearance_of(together(outer, below)))[0] == "red"


def chequered(one, other, size=8):
    at = np.add.outer(np.arange(size), np.arange(size)) % 2 == 0
    pixels = np.where(at[..., None], np.uint8(one), np.uint8(other)).astype(np.uint8)
    mesh = cube(1.0)
    uv = np.zeros((len(mesh.vertices), 2), np.float32)
    uv[:] = mesh.vertices[:, :2] * 0.5 + 0.5 + mesh.vertices[:, 2:] * 0.25
    return replace(
        mesh,
        uv0=uv,
        images=(Image("chequered", pixels),),
        materials=(Material("m", base_color_texture=Texture(0)),),
    )


def test_a_texture_s_colours_are_told_apart():
    looks = appearance_of(chequered((200, 20, 20, 255), (20, 20, 20, 255)))
    assert len(looks.patches) == 2 and words(looks)[0] is None
    assert appearance_of(chequered((200, 20, 20, 255), (140, 20, 20, 255))).patches[0].share == 1
    reds = [patch for patch in looks.patches if patch.color[0] > 0.3]
    np.testing.assert_allclose(reds[0].color, linear(np.array([200, 20, 20]) / 255), atol=1e-4)


def test_vertex_colours_count():
    mesh = painted(Material("m"))
    colors = np.tile(np.float32(GREEN), (len(mesh.vertices), 1))
    assert words(appearance_of(replace(mesh, colors=colors)))[0] == "green"


def test_clear_texels_of_cut_outs_are_no_surface():
    mesh = chequered((200, 20, 20, 255), (20, 20, 20, 0))
    cut = replace(mesh, materials=(replace(mesh.materials[0], alpha_mode="MASK"),))
    assert words(appearance_of(cut))[0] == "red"


def test_paint_changes_words():
    looks = appearance_of(painted(Material("paint", (0.9, 0.9, 0.9, 1.0)), Material("paint2", (0.9, 0.9, 0.9, 1.0))))
    assert words(looks) == ("white", "matte")
    assert words(looks, [Repaint(material="paint*", tint=(0.7, 0.02, 0.02))])[0] == "red"
    assert words(looks, [Repaint(material="paint", tint=(0.7, 0.02, 0.02))])[0] is None
    assert words(looks, [Repaint(material="other", tint=(0.7, 0.02, 0.02))])[0] == "white"
    assert words(looks, [Repaint(metallic=1.0, roughness=0.2)]) == ("white", "metal")
    assert words(looks, [Repaint(image="a.png")])[0] is None
    said = looks.model_copy(update={"color": "ivory", "material": "wooden"})
    assert words(said) == ("ivory", "wooden")
    assert words(said, [Repaint(tint=(0.7, 0.02, 0.02))]) == ("red", "matte")


def test_rounding_is_no_difference_but_another_share_is():
    looks = appearance_of(painted(Material("a", RED), Material("b", BLACK)))
    one, other = looks.patches
    near = looks.model_copy(update={"patches": (one.model_copy(update={"share": one.share + 1e-4}), other)})
    far = looks.model_copy(update={"patches": (one.model_copy(update={"share": one.share + 1e-3}), other)})
    assert (
        is_alike(looks, near) and not is_alike(looks, far) and not is_alike(looks, appearance_of(painted(Material("a", RED))))
    )


def test_a_model_without_surface_looks_like_nothing():
    looks = appearance_of(cube(1.0).emptied(), color="red")
    assert looks.patches == () and words(looks) == ("red", None)
