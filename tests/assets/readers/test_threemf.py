"""3MF: build items, components and model files of an archive, with colours and textures."""

import io
import zipfile

import numpy as np
import pytest
from PIL import Image

from viewsphere.assets.load import load_model
from viewsphere.errors import ModelError

CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
PRODUCTION = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06"
MATERIALS = "http://schemas.microsoft.com/3dmanufacturing/material/2015/02"
RELATIONS = """<?xml version="1.0"?><Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
<Relationship Target="/{target}" Id="r" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>"""
VERTICES = '<vertices><vertex x="0" y="0" z="0"/><vertex x="2" y="0" z="0"/><vertex x="0" y="3" z="0"/></vertices>'


def triangle(id="1", name="leg", more="", corner=""):
    triangles = f'<triangles><triangle v1="0" v2="1" v3="2" {corner}/></triangles>'
    return f'<object id="{id}" name="{name}" type="model" {more}><mesh>{VERTICES}{triangles}</mesh></object>'


def group(id, *components):
    parts = "".join(f"<component {c}/>" for c in components)
    return f'<object id="{id}" type="model"><components>{parts}</components></object>'


def model(resources, build="", unit="millimeter"):
    return (
        f'<?xml version="1.0"?><model unit="{unit}" xmlns="{CORE}" xmlns:p="{PRODUCTION}" xmlns:m="{MATERIALS}">'
        f"<resources>{resources}</resources><build>{build}</build></model>"
    )


def archive(files, target="3D/3dmodel.model"):
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_DEFLATED) as made:
        made.writestr("[Content_Types].xml", "<Types/>")
        made.writestr("_rels/.rels", RELATIONS.format(target=target))
        for name, content in files.items():
            made.writestr(name, content)
    return data.getvalue()


def load(write, root, **files):
    return load_model(write("a.3mf", archive({"3D/3dmodel.model": root, **files})))[0]


def boxes(mesh):
    return {
        name: mesh.vertices[mesh.triangles[mesh.triangle_part == i]].reshape(-1, 3).min(axis=0).tolist()
        for i, name in enumerate(mesh.parts)
    }


@pytest.mark.parametrize(("unit", "metres"), [("inch", 0.0254), ("micron", 1e-6), ("none", 1e-3)])
def test_units(write, unit, metres):
    path = write("a.3mf", archive({"3D/3dmodel.model": model(triangle(), '<item objectid="1"/>', unit)}))
    assert load_model(path)[1].unit == metres


def test_items_and_components_multiply_their_transforms(write):
    turned = "0 1 0 -1 0 0 0 0 1 10 0 0"  # x becomes y, y becomes -x, then 10 along x
    resources = triangle() + group("2", f'objectid="1" transform="{turned}"', 'objectid="1"') + group("3", 'objectid="2"')
    mesh = load(write, model(resources, '<item objectid="3" transform="1 0 0 0 1 0 0 0 1 0 0 5"/><item objectid="1"/>'))
    assert boxes(mesh) == {"leg": [7, 0, 5], "leg_2": [0, 0, 5], "leg_3": [0, 0, 0]}


def test_items_and_components_of_other_model_files(write):
    """Ids are those of each file: both files have an object 1, and the root's is made of the other's."""
    inner = model(triangle() + triangle("7", "arm"))
    resources = group("1", 'objectid="1" p:path="/3D/Objects/inner.model" transform="1 0 0 0 1 0 0 0 1 4 0 0"')
    build = '<item objectid="1"/><item objectid="7" p:path="/3D/Objects/inner.model"/>'
    mesh = load(write, model(resources, build), **{"3D/Objects/inner.model": inner})
    assert boxes(mesh) == {"leg": [4, 0, 0], "arm": [0, 0, 0]}


def test_the_root_is_where_the_package_says(write):
    files = {"3D/other.model": model(triangle(name="no"), '<item objectid="1"/>')}
    files["deep/real.model"] = model(triangle(name="yes"), '<item objectid="1"/>')
    assert load_model(write("a.3mf", archive(files, "deep/real.model")))[0].parts == ("yes",)


def test_an_empty_build_shows_all_objects(write):
    mesh = load(write, model(triangle() + group("2", 'objectid="1"')))
    assert mesh.parts == ("leg",)
    assert "its build is empty" in mesh.warnings[0]


def test_base_materials_and_colour_groups(write):
    resources = (
        '<basematerials id="5"><base name="red" displaycolor="#FF0000"/><base name="glass" displaycolor="#0000FF80"/>'
        '</basematerials><m:colorgroup id="6"><m:color color="#00FF00"/><m:color color="#FFFFFF"/></m:colorgroup>'
        + triangle("1", "default", 'pid="5" pindex="1"')
        + triangle("2", "own", 'pid="5" pindex="1"', 'pid="5" p1="0"')
        + triangle("3", "corners", "", 'pid="6" p1="0" p2="1" p3="0"')
        + triangle("4", "white")
    )
    mesh = load(write, model(resources, "".join(f'<item objectid="{i}"/>' for i in "1234")))
    names = [mesh.materials[i].name for i in mesh.triangle_material]
    assert dict(zip((mesh.parts[i] for i in mesh.triangle_part), names, strict=True)) == {
        "default": "glass", "own": "red", "corners": "default", "white": "default",
    }  # fmt: skip
    by_name = {material.name: material for material in mesh.materials}
    assert by_name["red"].base_color == (1, 0, 0, 1)
    assert by_name["glass"].base_color[3] == pytest.approx(128 / 255)
    assert by_name["glass"].alpha_mode == "BLEND"
    corners = mesh.colors[mesh.triangles[mesh.triangle_part == mesh.parts.index("corners")][0]]
    np.testing.assert_allclose(corners, [[0, 1, 0, 1], [1, 1, 1, 1], [0, 1, 0, 1]])


def test_textures_of_the_archive(write):
    picture = io.BytesIO()
    Image.new("RGB", (2, 2), "blue").save(picture, "PNG")
    resources = (
        '<m:texture2d id="8" path="/3D/Textures/blue.png" contenttype="image/png" tilestyleu="clamp"/>'
        '<m:texture2dgroup id="9" texid="8"><m:tex2coord u="0" v="0"/><m:tex2coord u="1" v="0.25"/></m:texture2dgroup>'
        + triangle("1", "leg", "", 'pid="9" p1="0" p2="1" p3="1"')
    )
    files = {"3D/Textures/blue.png": picture.getvalue()}
    mesh = load(write, model(resources, '<item objectid="1"/>'), **files)
    texture = mesh.materials[0].base_color_texture
    assert (texture.wrap_s, texture.wrap_t) == ("clamp", "repeat")
    assert tuple(mesh.images[texture.image].pixels[0, 0]) == (0, 0, 255, 255)
    np.testing.assert_array_equal(mesh.uv0[mesh.triangles[0]], [[0, 1], [1, 0.75], [1, 0.75]])


def test_what_is_not_read_is_a_warning(write):
    resources = '<m:multiproperties id="5" pids="1"/>' + triangle("1", "leg", 'pid="5" pindex="0"')
    assert "multiproperties" in load(write, model(resources, '<item objectid="1"/>')).warnings[0]


@pytest.mark.parametrize(
    ("root", "said"),
    [
        (model(triangle(), '<item objectid="9"/>'), "has no object '9'"),
        (model(triangle(), '<item objectid="1" p:path="/3D/gone.model"/>'), "has no '3D/gone.model'"),
        (model(group("1", 'objectid="1"'), '<item objectid="1"/>'), "part of itself"),
        (model(triangle(corner='v3="9"').replace('v3="2" v3', "v3"), '<item objectid="1"/>'), "vertex 9"),
        (model(triangle().replace('x="2"', 'x="2,5"'), '<item objectid="1"/>'), "three numbers"),
        (model(triangle(corner='pid="5" p1="3"') + '<basematerials id="5"/>', '<item objectid="1"/>'), "base material 3"),
        ("<model", "not well-formed XML"),
        ("<html/>", "expected <model>, found <html>"),
        (model(""), "no triangles"),
    ],
)
def test_damaged_files_are_one_clear_error(write, root, said):
    with pytest.raises(ModelError, match=said) as error:
        load(write, root)
    assert "\n" not in str(error.value)


def test_a_damaged_archive_is_one_clear_error(write):
    whole = archive({"3D/3dmodel.model": model(triangle(), '<item objectid="1"/>')})
    for data in (whole[:200], whole[:300] + b"\0" * 60 + whole[360:], b"PK\x03\x04"):
        with pytest.raises(ModelError, match=r"a\.3mf: "):
            load_model(write("a.3mf", data))
