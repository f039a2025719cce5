"""PLY, STL, OFF, DAE and 3MF: what a file holds arrives in the mesh; broken files are one clear error."""

import io
import struct
import zipfile

import numpy as np
import pytest
from PIL import Image

from viewsphere.assets.load import load_model
from viewsphere.errors import ModelError

TRIANGLE = np.array([[0, 0, 0], [2, 0, 0], [0, 3, 0]], np.float32)
DAE = """<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="inch" meter="0.0254"/><up_axis>{up}</up_axis></asset>
<library_images><image id="i"><init_from>{image}</init_from></image></library_images>
<library_effects><effect id="e"><profile_COMMON>
<newparam sid="s"><surface type="2D"><init_from>i</init_from></surface></newparam>
<newparam sid="t"><sampler2D><source>s</source></sampler2D></newparam>
<technique sid="c"><lambert><diffuse><texture texture="t" texcoord="UV"/></diffuse></lambert></technique>
</profile_COMMON></effect></library_effects>
<library_materials><material id="m"><instance_effect url="#e"/></material></library_materials>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="9">0 0 0 2 0 0 0 3 0</float_array><technique_common>
<accessor source="#pa" count="3" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<source id="u"><float_array id="ua" count="6">0 0 1 0 0 0.25</float_array><technique_common>
<accessor source="#ua" count="3" stride="2"><param name="S" type="float"/><param name="T" type="float"/></accessor>
</technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles material="x" count="1"><input semantic="VERTEX" source="#v" offset="0"/>
<input semantic="TEXCOORD" source="#u" offset="1" set="0"/><p>0 0 1 1 2 2</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="w"><node><translate>0 0 5</translate><scale>1 -1 1</scale>
<instance_geometry url="#g"><bind_material><technique_common><instance_material symbol="x" target="#m"/>
</technique_common></bind_material></instance_geometry></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#w"/></scene></COLLADA>"""
MODEL_3MF = """<?xml version="1.0"?><model unit="{unit}" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">
<resources><object id="1" name="leg" type="model"><mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="2" y="0" z="0"/>
<vertex x="0" y="3" z="0"/></vertices><triangles><triangle v1="0" v2="1" v3="2"/></triangles></mesh></object></resources>
<build><item objectid="1"/><item objectid="1" transform="1 0 0 0 1 0 0 0 1 10 0 0"/></build></model>"""


def png(color):
    file = io.BytesIO()
    Image.new("RGB", (3, 2), color).save(file, "PNG")
    return file.getvalue()


def ply(colors="", texture="", faces="3 0 1 2", count=3):
    rows = "\n".join(" ".join(map(str, point)) + " 255 0 51" * bool(colors) for point in TRIANGLE)
    colors = "property uchar red\nproperty uchar green\nproperty uchar blue\n" if colors else ""
    return (
        f"ply\nformat ascii 1.0\n{texture}element vertex {count}\nproperty float x\nproperty float y\nproperty float z\n"
        f"{colors}element face 1\nproperty list uchar int vertex_indices\nend_header\n{rows}\n{faces}\n"
    )


def stl(triangles):
    body = b"".join(struct.pack("<12fH", 0, 0, 1, *points.ravel(), 0) for points in triangles)
    return b"\0" * 80 + struct.pack("<I", len(triangles)) + body


def archive(**files):
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_DEFLATED) as target:
        target.writestr("[Content_Types].xml", "<Types/>")
        for name, content in files.items():
            target.writestr(f"3D/{name}.model", content)
    return data.getvalue()


def check_triangle(mesh):
    np.testing.assert_array_equal(mesh.vertices[mesh.triangles[0]], TRIANGLE)


def test_ply_keeps_vertex_colours(write):
    mesh, facts = load_model(write("a.ply", ply(colors="yes")))
    check_triangle(mesh)
    np.testing.assert_allclose(mesh.colors, [[1, 0, ((0.2 + 0.055) / 1.055) ** 2.4, 1]] * 3, rtol=1e-6)
    assert (facts.up, facts.forward, facts.unit) == ("+z", "-y", 1)


def test_stl_and_its_padding(write):
    for data in (stl([TRIANGLE]), stl([TRIANGLE]) + b"\0" * 7):
        check_triangle(load_model(write("a.stl", data))[0])
    solid = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 2 0 0\nvertex 0 3 0\nendloop\nendfacet\nendsolid s\n"
    check_triangle(load_model(write("b.STL", solid))[0])


def test_off(write):
    check_triangle(load_model(write("a.off", "OFF\n3 1 0\n0 0 0\n2 0 0\n0 3 0\n3 0 1 2\n"))[0])


@pytest.mark.parametrize(
    ("up", "axes"), [("Y_UP", ("+y", "+z")), ("Z_UP", ("+z", "-y")), ("X_UP", ("+x", "+z")), ("", ("+y", "+z"))]
)
def test_dae_axes_unit_transform_and_texture(write, up, axes):
    write("red.png", png("red"))
    mesh, facts = load_model(write("a.dae", DAE.format(up=up, image="red.png")))
    assert (facts.up, facts.forward, facts.unit) == (*axes, 0.0254)
    np.testing.assert_array_equal(mesh.vertices[mesh.triangles[0]], [[0, -3, 5], [2, 0, 5], [0, 0, 5]])
    np.testing.assert_array_equal(mesh.uv0[mesh.triangles[0]], [[0, 0.75], [1, 1], [0, 1]])
    assert tuple(mesh.images[mesh.materials[0].base_color_texture.image].pixels[0, 0]) == (255, 0, 0, 255)
    assert mesh.materials[0].double_sided


def test_a_texture_outside_the_folder_needs_consent(write):
    write("elsewhere/blue.png", png("blue"))
    path = write("meshes/a.dae", DAE.format(up="Z_UP", image="../elsewhere/blue.png"))
    mesh, _ = load_model(path)
    assert mesh.materials[0].base_color_texture is None
    assert "outside the model's folder, not read; set confined: false to allow" in mesh.warnings[0]
    mesh, facts = load_model(path, confined=False)
    assert tuple(mesh.images[0].pixels[0, 0]) == (0, 0, 255, 255)
    assert "blue.png" in {file.name for file in facts.files}


def test_3mf_instances_and_unit(write):
    mesh, facts = load_model(write("a.3mf", archive(**{"3dmodel": MODEL_3MF.format(unit="inch")})))
    assert facts.unit == 0.0254
    assert len(mesh.parts) == 2
    np.testing.assert_array_equal(mesh.bounds, [[0, 0, 0], [12, 3, 0]])


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("a.ply", b"solid nothing"),
        ("b.ply", ply(count=10**9)),
        ("c.ply", ply(faces="3 0 1 7")),
        ("d.stl", stl([TRIANGLE])[:-10]),
        ("e.stl", b"\0" * 80 + struct.pack("<I", 4 * 10**9)),
        ("f.off", "OFF\n1000000000000 2 0\n"),
        ("g.off", "hello"),
        ("h.dae", "<COLLADA"),
        ("i.3mf", b"PK\x03\x04 no"),
        ("j.3mf", archive(other="<model/>")),
        ("k.stl", b""),
    ],
)
def test_broken_files_are_one_clear_error(write, name, data):
    with pytest.raises(ModelError, match=name) as error:
        load_model(write(name, data))
    assert "\n" not in str(error.value)
