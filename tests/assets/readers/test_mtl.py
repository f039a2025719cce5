"""MTL libraries: where they lie, in which encoding, and what their maps become."""

import io

import pytest
from PIL import Image

from viewsphere.assets.load import load_model

CARD = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl {name}\nf 1/1 2/2 3/3\n"
RED, GREY = (200, 30, 30), (128, 128, 128)


def png(color):
    file = io.BytesIO()
    Image.new("RGB" if len(color) == 3 else "RGBA", (4, 4), color).save(file, "PNG")
    return file.getvalue()


def model(write, library, name="m", folder="", head="mtllib m.mtl\n", encoding="utf-8"):
    """The mesh of a card and its material."""
    write(f"{folder}m.mtl", library.encode(encoding))
    mesh, _ = load_model(write("a.obj", (head + CARD.format(name=name)).encode(encoding)))
    return mesh, mesh.materials[0]


def texel(mesh, texture):
    return tuple(mesh.images[texture.image].pixels[0, 0].tolist())


@pytest.mark.parametrize(
    "line",
    [
        "map_Kd t.png # the picture",
        "map_Kd t.png -clamp on",
        "map_Kd t.png -o 0.5 0.5 -s 2 2 1 # moved",
        "map_Kd -clamp on t.png -s 2 2",
        'map_Kd "t.png"',
        "map_Kd\tt.png\t# tab",
        "map_Kd T.PNG",
        "map_Kd .\\t.png",
    ],
)
def test_what_stands_around_a_files_name_is_no_part_of_it(write, line):
    write("t.png", png(RED))
    mesh, material = model(write, f"newmtl m\n{line}\n")
    assert texel(mesh, material.base_color_texture) == (*RED, 255)
    assert (material.base_color_texture.wrap_s == "clamp") == ("-clamp" in line)
    assert (material.base_color_texture.scale == (2, 2)) == ("-s" in line)
    assert mesh.warnings == ()


@pytest.mark.parametrize("name", ["a # b.png", "wood -s 2.png", "#1.png"])
def test_a_files_name_may_look_like_a_comment_or_an_option(write, name):
    write(name, png(RED))
    mesh, material = model(write, f"newmtl m\nmap_Kd {name}\n")
    assert texel(mesh, material.base_color_texture) == (*RED, 255)


@pytest.mark.parametrize("line", ["Kd 1 0 0 # red", "Kd\t1\t0 0", "Kd 1 0 0#", "Kd 1 0 0 1"])
def test_a_colour_may_have_a_comment(write, line):
    _, material = model(write, f"newmtl m\n{line}\n")
    assert material.base_color == (1, 0, 0, 1)


def test_a_colour_that_is_no_number_is_a_warning(write):
    mesh, material = model(write, "newmtl m\nKd 0,5 0,5 0,5\nNs 1,5\n")
    assert (material.base_color, material.roughness) == ((0.8, 0.8, 0.8, 1), 1.0)
    assert mesh.warnings == tuple(
        f"a.obj: material 'm': {what} is no number, not read" for what in ("kd '0,5 0,5 0,5'", "ns '1,5'")
    )


@pytest.mark.parametrize("name", ["red", "Material #25", "red # of 3ds Max"])
def test_names_of_materials_may_hold_comments(write, name):
    _, material = model(write, f"newmtl {name}\nKd 1 0 0\n", name)
    assert material.base_color == (1, 0, 0, 1)
    _, material = model(write, "newmtl red\nKd 1 0 0\n", "red # used")
    assert material.base_color == (1, 0, 0, 1)


@pytest.mark.parametrize(
    ("encoding", "name", "picture"),
    [
        ("gbk", "材质", "贴图.png"),
        ("gbk", "玻", "木 纹 -s.png"),
        ("shift_jis", "ガラス", "木目.png"),
        ("big5", "玻璃", "木紋.png"),
        ("euc_kr", "유리", "나무.png"),
        ("cp1251", "стекло", "дерево.png"),
        ("latin-1", "Größe", "Maß.png"),
    ],
)
def test_model_and_library_have_one_encoding(write, encoding, name, picture):
    """The file that exists shows the encoding of short texts, of which a guess by their bytes is often wrong."""
    write(picture, png(RED))
    mesh, material = model(write, f"newmtl {name}\nmap_Kd {picture}\n", name, encoding=encoding)
    assert (material.name, texel(mesh, material.base_color_texture)) == (name, (*RED, 255))
    assert mesh.warnings == ()


def test_a_library_in_another_encoding_than_the_model(write):
    write("木目.png", png(RED))
    write("ガラス.mtl", "newmtl m\nmap_Kd 木目.png\n".encode("shift_jis"))
    mesh, _ = load_model(write("a.obj", ("mtllib ガラス.mtl\n" + CARD.format(name="m")).encode("shift_jis")))
    assert texel(mesh, mesh.materials[0].base_color_texture) == (*RED, 255)


def test_pictures_are_named_from_the_library_or_the_model(write):
    write("mats/near.png", png(RED))
    write("far.png", png(GREY))
    library = "newmtl m\nmap_Kd near.png\nmap_Ke far.png\n"
    mesh, material = model(write, library, folder="mats/", head="mtllib mats/m.mtl\n")
    assert texel(mesh, material.base_color_texture) == (*RED, 255)
    assert texel(mesh, material.emissive_texture) == (*GREY, 255)
    assert mesh.warnings == ()


@pytest.mark.parametrize(
    ("head", "file", "reason"),
    [
        ("", "a.mtl", "no mtllib line names a material library"),
        ("", "A.MTL", "no mtllib line names a material library"),
        ("", "a.obj.mtl", "no mtllib line names a material library"),
        ("mtllib gone.mtl\n", "a.mtl", "material library 'gone.mtl' does not exist"),
    ],
)
def test_the_library_that_bears_the_models_name_stands_in(write, head, file, reason):
    write(file, "newmtl m\nKd 1 0 0\n")
    mesh, _ = load_model(write("a.obj", head + CARD.format(name="m")))
    assert mesh.materials[0].base_color == (1, 0, 0, 1)
    assert len(mesh.warnings) == 1
    assert mesh.warnings[0].startswith(f"a.obj: {reason}")
    assert mesh.warnings[0].lower().endswith(f"{file.lower()!r} was read instead")


def test_materials_without_any_library_are_a_warning(write):
    mesh, _ = load_model(write("a.obj", CARD.format(name="m")))
    assert mesh.warnings == ("a.obj: no mtllib line names a material library, and there is no a.mtl; all is plain white",)


@pytest.mark.parametrize(("level", "shininess"), [(255, 400), (0, 0), (51, 80)])
def test_map_ns_is_the_roughness_of_its_texels(write, level, shininess):
    write("k.png", png((level,) * 3))
    mesh, material = model(write, "newmtl m\nNs 400\nmap_Ns k.png\n")
    green = texel(mesh, material.metallic_roughness_texture)[1]
    assert (material.roughness, material.metallic) == (1, 0)
    assert green / 255 == pytest.approx((2 / (shininess + 2)) ** 0.25, abs=1 / 255)
    _, even = model(write, f"newmtl m\nNs {shininess}\n")
    assert even.roughness == pytest.approx(green / 255, abs=1 / 255)


@pytest.mark.parametrize(("level", "specular"), [(255, 0.8), (0, 0), (51, 0.16)])
def test_map_ks_is_the_specular_factor_of_its_texels(write, level, specular):
    write("k.png", png((level,) * 3))
    mesh, material = model(write, "newmtl m\nKs 0.4 0.4 0.4\nmap_Ks k.png\n")
    assert material.specular == 1
    assert texel(mesh, material.specular_texture)[3] / 255 == pytest.approx(specular, abs=1 / 255)


def test_a_lost_map_leaves_the_factor(write):
    mesh, material = model(write, "newmtl m\nKs 0.25 0.25 0.25\nNs 48\nmap_Ks gone.png\nmap_Ns gone.png\n")
    assert (material.specular, material.roughness**2) == (0.5, pytest.approx(0.2))
    assert len(mesh.warnings) == 1


@pytest.mark.parametrize(
    ("statement", "picture", "alpha"),
    [
        ("map_d", (51, 51, 51), 51),
        ("map_Tr", (51, 51, 51), 204),
        ("map_Tr", (9, 9, 9, 51), 51),  # an alpha channel is opacity, whoever names it
        ("map_opacity", (51, 51, 51), 51),
    ],
)
def test_maps_of_opacity_and_of_transparency(write, statement, picture, alpha):
    write("t.png", png(RED))
    write("o.png", png(picture))
    mesh, material = model(write, f"newmtl m\nmap_Kd t.png\n{statement} o.png\n")
    assert texel(mesh, material.base_color_texture) == (*RED, alpha)
    assert material.alpha_mode == "BLEND"


def test_maps_that_are_not_read_are_a_warning(write):
    write("t.png", png(RED))
    mesh, _ = model(write, "newmtl m\nmap_Kd t.png\nmap_Ka t.png\ndisp t2.png\nrefl -type sphere s.png\n")
    assert mesh.warnings == ("a.obj: material 'm' has maps that are not read: disp, refl",)
