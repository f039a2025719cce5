"""A face at a NaN or infinite vertex is refused in every format, with the vertex's or the triangle's number."""

import struct
import zipfile

import numpy as np
import pytest

from viewsphere.assets.load import load_model
from viewsphere.errors import ModelError

POINTS = ["0 0 0", "1 0 0", "0 1 0", "0 0 1"]
FACES = [[0, 1, 2], [0, 2, 3]]


def ply(path, points, faces):
    head = f"ply\nformat ascii 1.0\nelement vertex {len(points)}\nproperty float x\nproperty float y\nproperty float z\n"
    head += f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    path.write_text(head + "\n".join([*points, *(f"3 {a} {b} {c}" for a, b, c in faces)]) + "\n")


def off(path, points, faces):
    path.write_text("\n".join([f"OFF\n{len(points)} {len(faces)} 0", *points, *(f"3 {a} {b} {c}" for a, b, c in faces)]) + "\n")


def stl(path, points, faces):
    corners = np.array([[points[i].split() for i in face] for face in faces]).astype(np.float32)
    facets = (struct.pack("<12fH", 0, 0, 0, *corner.reshape(-1), 0) for corner in corners)
    path.write_bytes(b"\0" * 80 + struct.pack("<I", len(faces)) + b"".join(facets))


def text_stl(path, points, faces):
    facets = ("".join(f"vertex {points[i]}\n" for i in face) for face in faces)
    path.write_text(
        "solid a\n" + "".join(f"facet normal 0 0 1\nouter loop\n{f}endloop\nendfacet\n" for f in facets) + "endsolid a\n"
    )


def dae(path, points, faces):
    count = len(points)
    path.write_text(f"""<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><library_geometries>
<geometry id="g"><mesh><source id="p"><float_array id="a" count="{3 * count}">{" ".join(points)}</float_array>
<technique_common><accessor source="#a" count="{count}" stride="3">
<param name="X"/><param name="Y"/><param name="Z"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="{len(faces)}">
<input semantic="VERTEX" source="#v" offset="0"/><p>{" ".join(str(i) for face in faces for i in face)}</p></triangles>
</mesh></geometry></library_geometries><library_visual_scenes><visual_scene id="w">
<node><instance_geometry url="#g"/></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#w"/></scene></COLLADA>""")


def threemf(path, points, faces):
    vertices = "".join('<vertex x="{}" y="{}" z="{}"/>'.format(*point.split()) for point in points)
    triangles = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in faces)
    model = f"""<model unit="meter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources><object id="1">
<mesh><vertices>{vertices}</vertices><triangles>{triangles}</triangles></mesh></object></resources>
<build><item objectid="1"/></build></model>"""
    relation = 'Target="/3D/a.model" Id="r" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"'
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("3D/a.model", model)
        space = "http://schemas.openxmlformats.org/package/2006/relationships"
        archive.writestr("_rels/.rels", f'<Relationships xmlns="{space}"><Relationship {relation}/></Relationships>')


def usda(path, points, faces):
    pytest.importorskip("pxr")
    places = ", ".join(f"({point.replace(' ', ', ')})" for point in points)
    path.write_text(f"""#usda 1.0
def Mesh "m" {{ int[] faceVertexCounts = {[3] * len(faces)}
int[] faceVertexIndices = {[i for face in faces for i in face]}
point3f[] points = [{places}]
}}""")


WRITERS = {"ply": ply, "off": off, "stl": stl, "text.stl": text_stl, "dae": dae, "3mf": threemf, "usda": usda}


@pytest.mark.parametrize("word", ["nan", "inf", "-inf", "1e35"])
@pytest.mark.parametrize("suffix", WRITERS)
def test_a_face_at_a_vertex_that_is_nowhere_is_refused_with_its_number(tmp_path, suffix, word):
    path = tmp_path / f"a.{suffix}"
    WRITERS[suffix](path, [*POINTS[:3], f"0 {word} 1"], FACES)
    number = "triangle 2 of 2" if "stl" in suffix else "vertex 4 of 4"
    with pytest.raises(ModelError, match=f"{number} has a NaN or infinite coordinate .*; export the model again") as error:
        load_model(path)
    assert str(error.value).count(str(path)) == 1 and "\n" not in str(error.value)


@pytest.mark.parametrize("suffix", [suffix for suffix in WRITERS if "stl" not in suffix])
def test_a_vertex_of_no_face_may_be_anywhere(tmp_path, suffix):
    WRITERS[suffix](tmp_path / f"a.{suffix}", [*POINTS, "nan nan nan"], FACES)
    mesh, _ = load_model(tmp_path / f"a.{suffix}")
    assert len(mesh.triangles) == 2 and np.isfinite(mesh.vertices).all() and mesh.warnings == ()
