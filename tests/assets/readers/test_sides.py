"""Every reader keeps the sides that its format states, for `faces: as_file`; of formats that state none, both are seen."""

import json

import numpy as np
import pytest

from viewsphere.assets.load import load_model

DAE = """<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<library_effects><effect id="e"><profile_COMMON><technique><lambert/></technique>{profile}</profile_COMMON>{effect}</effect>
</library_effects>
<library_materials><material id="m"><instance_effect url="#e"/>{material}</material></library_materials>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="9">0 0 0 1 0 0 0 1 0</float_array><technique_common>
<accessor source="#a" count="3" stride="3"><param name="X"/><param name="Y"/><param name="Z"/></accessor></technique_common>
</source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles material="s" count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles></mesh>{geometry}
</geometry></library_geometries>
<library_visual_scenes><visual_scene id="w"><node><instance_geometry url="#g"><bind_material><technique_common>
<instance_material symbol="s" target="#m"/></technique_common></bind_material></instance_geometry></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#w"/></scene></COLLADA>"""


def extra(value, profile):
    return f'<extra><technique profile="{profile}"><double_sided>{value}</double_sided></technique></extra>'


def sides(path):
    """A mask of the triangles of a file that are double-sided."""
    mesh, _ = load_model(path)
    return [mesh.materials[i].double_sided for i in mesh.triangle_material]


@pytest.mark.parametrize("profile", ["GOOGLEEARTH", "MAX3D", "MAYA", "anything"])
@pytest.mark.parametrize("at", ["profile", "effect", "material", "geometry"])
@pytest.mark.parametrize(("value", "is_double"), [("0", False), ("1", True), ("false", False), (" true ", True)])
def test_the_double_sided_of_collada(tmp_path, profile, at, value, is_double):
    places = dict.fromkeys(("profile", "effect", "material", "geometry"), "")
    (tmp_path / "a.dae").write_text(DAE.format(**places | {at: extra(value, profile)}))
    assert sides(tmp_path / "a.dae") == [is_double]


def test_collada_that_states_nothing_is_seen_from_both_sides_and_a_geometry_overrides_its_material(tmp_path):
    places = {"profile": "", "effect": "", "material": "", "geometry": ""}
    (tmp_path / "a.dae").write_text(DAE.format(**places))
    assert sides(tmp_path / "a.dae") == [True]
    (tmp_path / "b.dae").write_text(DAE.format(**places | {"effect": extra(0, "MAYA"), "geometry": extra(1, "MAYA")}))
    assert sides(tmp_path / "b.dae") == [True]


@pytest.mark.parametrize("stated", [None, "0", "1"])
@pytest.mark.parametrize("orientation", ["rightHanded", "leftHanded"])
def test_the_double_sided_and_the_orientation_of_usd(tmp_path, stated, orientation):
    """Without a statement, USD's own default holds: single-sided."""
    pytest.importorskip("pxr")
    line = "" if stated is None else f"uniform bool doubleSided = {stated}"
    (tmp_path / "a.usda").write_text(f"""#usda 1.0
def Mesh "m" {{ int[] faceVertexCounts = [3]
int[] faceVertexIndices = [0, 1, 2]
point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
uniform token orientation = "{orientation}"
{line}
}}""")
    mesh, _ = load_model(tmp_path / "a.usda")
    assert [mesh.materials[i].double_sided for i in mesh.triangle_material] == [stated == "1"]
    a, b, c = mesh.vertices[mesh.triangles[0]]
    assert np.sign(np.cross(b - a, c - a)[2]) == (1 if orientation == "rightHanded" else -1)


def test_a_gltf_primitive_without_a_material_is_single_sided(tmp_path):
    """The specification's default material has doubleSided false."""
    import base64

    data = base64.b64encode(np.array([0, 0, 0, 1, 0, 0, 0, 1, 0], "<f4").tobytes()).decode()
    accessor = {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}
    file = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": 36, "uri": f"data:application/octet-stream;base64,{data}"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [accessor],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
    }
    (tmp_path / "a.gltf").write_text(json.dumps(file))
    assert sides(tmp_path / "a.gltf") == [False]


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
        ("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"),
        (
            "a.stl",
            "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n",
        ),
    ],
)
def test_formats_that_state_no_sides_are_seen_from_both(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    assert sides(tmp_path / name) == [True]
