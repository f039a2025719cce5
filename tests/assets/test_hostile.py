"""Files made to do harm: each is one clear error or a harmless mesh, in little time, and none reaches beyond its folder."""

import base64
import io
import json
import os
import struct
import sys
import time
import zipfile

import numpy as np
import pytest
from PIL import Image

from viewsphere.assets.cache import load_normalised
from viewsphere.assets.load import load_model
from viewsphere.errors import ModelError
from viewsphere.model.model_spec import ModelSpec

LAUGHS = "<!DOCTYPE x [<!ENTITY a0 'haha'>" + "".join(
    f"<!ENTITY a{i} '{f'&a{i - 1};' * 10}'>" for i in range(1, 20)
) + "]>"  # fmt: skip
OUTSIDE = "<!DOCTYPE x [<!ENTITY a19 SYSTEM '{}'>]>"
DAE = (
    '<?xml version="1.0"?>{head}<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset/>'
    '<library_geometries><geometry id="g"><mesh><source id="p"><float_array id="pa" count="9">0 0 0 2 0 0 0 3 0</float_array>'
    '<technique_common><accessor source="#pa" count="3" stride="3"><param name="X" type="float"/>'
    '<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>'
    '<vertices id="v"><input semantic="POSITION" source="#p"/></vertices><triangles count="1">'
    '<input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles></mesh></geometry></library_geometries>'
    '<library_visual_scenes><visual_scene id="s"><node id="n" name="{name}"><instance_geometry url="#g"/></node>'
    '<extra>&a19;</extra></visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>'
)
MODEL_3MF = (
    '<?xml version="1.0"?>{head}<model unit="meter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">'
    '<metadata name="Title">&a19;</metadata><resources><object id="1" name="leg" type="model"><mesh><vertices>'
    '<vertex x="0" y="0" z="0"/><vertex x="2" y="0" z="0"/><vertex x="0" y="3" z="0"/></vertices><triangles>'
    '<triangle v1="0" v2="1" v3="2"/></triangles></mesh></object></resources><build><item objectid="1"/></build></model>'
)
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"


def spec_of(path):
    return ModelSpec(key="a", source=str(path), category="thing", category_id=1)


def outcome(path, seconds=15.0):
    """The mesh, or the one line by which the file is refused."""
    start = time.process_time()
    try:
        result = load_model(path)[0]
    except ModelError as error:
        result = str(error)
        assert path.name in result
        assert "\n" not in result
        assert len(result) < 600 + len(str(path))
    assert time.process_time() - start < seconds
    return result


def archive(**entries):
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_DEFLATED) as target:
        for name, content in entries.items():
            target.writestr(name, content)
    return data.getvalue()


@pytest.mark.parametrize("head", [LAUGHS, OUTSIDE])
@pytest.mark.parametrize("kind", ["dae", "3mf"])
def test_xml_entities_neither_explode_nor_read_files(write, tmp_path, kind, head):
    secret = write("outside/secret.txt", "treasure" * 3)
    head = head.replace("{}", secret.as_uri())
    text = (DAE if kind == "dae" else MODEL_3MF).format(head=head, name="n")
    path = write(f"a.{kind}", text if kind == "dae" else archive(**{"3D/3dmodel.model": text}))
    found = outcome(path)
    if not isinstance(found, str):
        assert len(found.triangles) == 1
        found = repr((found.parts, found.materials, found.warnings))
    assert "treasure" not in found


def test_an_archive_writes_nothing(write, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = ("../evil.model", "/tmp/viewsphere-evil.model", "..\\evil.model")
    text = MODEL_3MF.format(head="").replace("&a19;", "")
    path = write("in/a.3mf", archive(**{"3D/3dmodel.model": text}, **dict.fromkeys(names, "<model/>")))
    assert len(outcome(path).triangles) == 1
    assert {p.name for p in tmp_path.rglob("*")} == {"in", "a.3mf"}
    assert not os.path.exists("/tmp/viewsphere-evil.model")  # noqa: PTH110


def test_an_archive_that_lies_about_its_sizes(write):
    data = archive(**{"3D/3dmodel.model": MODEL_3MF.format(head="").replace("&a19;", "") + " " * 10**7})
    at = data.rindex(b"PK\x01\x02") + 24  # the uncompressed size in the central directory
    assert "damaged" in outcome(write("a.3mf", data[:at] + struct.pack("<I", 100) + data[at + 4 :]))


@pytest.mark.parametrize("name", ["../secret.bin", "%2e%2e/secret.bin", "{root}/secret.bin", "file://{root}/secret.bin"])
def test_buffers_stay_in_the_folder(gltf, cube, write, tmp_path, name):
    gltf.node(mesh=gltf.mesh(*cube))
    write("secret.bin", gltf.data)
    gltf.root["buffers"] = [{"byteLength": len(gltf.data), "uri": name.format(root=tmp_path)}]
    found = outcome(write("in/a.gltf", json.dumps(gltf.root)))
    assert "outside the model's folder" in found or "not fetched" in found


@pytest.mark.skipif(sys.platform == "win32", reason="named pipes are files elsewhere")
def test_pipes_are_not_waited_for(write, tmp_path):
    path = write("a.obj", "mtllib pipe.mtl\n" + TRIANGLE + "f 1 2 3\n")
    os.mkfifo(tmp_path / "pipe.mtl")
    os.mkfifo(tmp_path / "pipe.obj")
    for folder in ("one", "one"):
        mesh = load_normalised(spec_of(path), folder=tmp_path / folder)
        assert "does not exist" in mesh.warnings[0]
    with pytest.raises(ModelError, match=r"pipe\.obj: cannot be read: a pipe, not a regular file"):
        load_normalised(spec_of(tmp_path / "pipe.obj"), folder=tmp_path / "one")


def test_links_in_circles(write, tmp_path):
    path = write("a.obj", "mtllib loop.mtl\n" + TRIANGLE + "f 1 2 3\n")
    (tmp_path / "loop.mtl").symlink_to(tmp_path / "loop2.mtl")
    (tmp_path / "loop2.mtl").symlink_to(tmp_path / "loop.mtl")
    assert len(outcome(path).warnings) == 1


OBJ = {
    "zero": ("f 0 1 2\n", "names vertex 0"),
    "far back": ("f -9 -1 -2\n", "face"),
    "beyond": ("f 1 2 999999999999\n", "names vertex 999999999999"),
    "beyond int64": ("f 1 2 99999999999999999999999\n", "face corner"),
    "no number": ("f 1 2 x\n", "face corner"),
    "every corner NaN": ("v nan nan nan\nf 4 4 4\n", "NaN"),
    "infinite": ("v inf 1e400 0\nv 1e39 1e39 1e39\nf 1 4 5\n", "NaN or infinite"),
    "no faces": ("", "no triangles"),
    "zero bytes": ("\0" * 1000, "no triangles"),
    "one point": ("f 1 1 1\n", "zero area"),
}


@pytest.mark.parametrize("case", OBJ)
def test_obj(write, case):
    text, said = OBJ[case]
    assert said in outcome(write("a.obj", TRIANGLE + text))


@pytest.mark.slow
def test_many_names_cost_no_quadratic_time(write, gltf, cube, monkeypatch):
    monkeypatch.setenv("VIEWSPHERE_MAX_LAYERS", "10000")
    faces = "".join(f"usemtl m{i}\ng g{i}\nf 1 2 3\n" for i in range(8_000))
    write("a.mtl", "newmtl other\n")
    assert len(outcome(write("a.obj", "mtllib a.mtl\n" + TRIANGLE + faces), 20).parts) == 8_000
    mesh = gltf.mesh(*cube, name="same")
    for _ in range(8_000):
        gltf.node(mesh=mesh)
    found = outcome(gltf.write(), 20)
    assert len(set(found.parts)) == 8_000
    assert found.parts[:2] == ("same", "same_2")


def test_a_name_that_looks_numbered_stays_unique(gltf, cube):
    for name in ("a", "a_2", "a", "a", "a_2"):
        gltf.node(mesh=gltf.mesh(*cube), name=name)
    assert outcome(gltf.write()).parts == ("a", "a_2", "a_3", "a_4", "a_2_2")


@pytest.mark.slow
def test_a_polygon_of_very_many_corners(write):
    angle = np.linspace(0, 2 * np.pi, 40_000, endpoint=False)
    radius = np.where(np.arange(len(angle)) % 2, 1.0, 0.5)
    points = "".join(f"v {x:.6f} {y:.6f} 0\n" for x, y in zip(np.cos(angle) * radius, np.sin(angle) * radius, strict=True))
    mesh = outcome(write("a.obj", points + "f " + " ".join(map(str, range(1, len(angle) + 1)))), 40)
    assert len(mesh.triangles) > 36_000
    a, b, c = (mesh.vertices[mesh.triangles[:, i]].astype(float) for i in range(3))
    filled = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    assert filled == pytest.approx(len(angle) / 4 * np.sin(2 * np.pi / len(angle)), rel=1e-4)  # a fan would fill more


GLTF = {
    "NaN": (lambda r: r["nodes"][0].update(translation=[float("nan"), 0, 0]), "3 numbers"),
    "infinite": (lambda r: r["nodes"][0].update(scale=[float("inf"), 1, 1]), "3 numbers"),
    "huge integer": (lambda r: r["nodes"][0].update(translation=[10**400, 0, 0]), "3 numbers"),
    "own child": (lambda r: (r["nodes"][0].update(children=[0]), r.update(scenes=[{"nodes": [0]}])), "reached twice"),
    "negative offset": (lambda r: r["bufferViews"][0].update(byteOffset=-4), "not negative"),
    "tiny stride": (lambda r: r["bufferViews"][0].update(byteStride=1), "truncated"),
    "huge stride": (lambda r: r["bufferViews"][0].update(byteStride=1 << 62), "truncated"),
    "huge length": (lambda r: r["bufferViews"][0].update(byteLength=1 << 63), "the buffer has"),
    "huge count": (lambda r: r["accessors"][1].update(count=1 << 62), "limit MAX_VERTICES"),
    "text for a number": (lambda r: r["accessors"][0].update(componentType="5126"), "whole number"),
    "names for lists": (lambda r: r.update(meshes="cube", nodes={"0": {}}), "an array"),
    "null": (lambda r: r.update(meshes=[None]), "an object"),
    "sparse beyond": (
        lambda r: r["accessors"][0].update(
            sparse={
                "count": 1,
                "indices": {"bufferView": 1, "componentType": 5123, "byteOffset": 4},
                "values": {"bufferView": 0},
            },
            count=2,
        ),
        "sparse indices below 2",
    ),
    "skin without joints": (lambda r: (r["nodes"][0].update(skin=0), r.update(skins=[{"joints": []}])), "joints"),
    "joint outside": (lambda r: (r["nodes"][0].update(skin=0), r.update(skins=[{"joints": [7]}])), "joints"),
    "unknown mode": (lambda r: r["meshes"][0]["primitives"][0].update(mode=-1), "not negative"),
}  # fmt: skip


@pytest.mark.parametrize("case", GLTF)
def test_gltf(gltf, cube, case):
    change, said = GLTF[case]
    gltf.node(mesh=gltf.mesh(*cube))
    change(gltf.root)
    assert said in outcome(gltf.write())


def test_wrong_textures_cost_a_warning(gltf, cube):
    file = io.BytesIO()
    Image.fromarray(np.random.default_rng(0).integers(0, 255, (64, 64, 3), np.uint8)).save(file, "PNG")
    whole = file.getvalue()
    damaged = {
        "truncated": whole[: len(whole) // 2],
        "no pixels": whole[:50],
        "text": b"<svg/>",
        "empty": b"",
        "chunk of 4 GiB": whole[:33] + b"\xff\xff\xff\xffIDAT",
    }
    uris = ["data:image/png;base64," + base64.b64encode(data).decode() for data in damaged.values()]
    uris += ["data:image/png;base64,%%%", "data:image/png", "x" * 5000 + ".png", "\0.png", ".", "", "~/.profile"]
    gltf.root["images"] = [{"uri": uri} for uri in uris]
    gltf.root["textures"] = [{"source": i} for i in range(len(uris))]
    for i in range(len(uris)):
        gltf.root["materials"].append({"name": str(i), "pbrMetallicRoughness": {"baseColorTexture": {"index": i}}})
        gltf.node(mesh=gltf.mesh(*cube, material=i, TEXCOORD_0=np.zeros((8, 2), np.float32)))
    mesh = outcome(gltf.write())
    assert len(mesh.materials) == len(uris)
    assert mesh.images == ()
    assert len(mesh.warnings) == len(uris)
    assert all("\n" not in warning and len(warning) < 400 for warning in mesh.warnings)


PLY_HEAD = "ply\nformat {} 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n{}end_header\n"
FACES = "element face 1\nproperty list uchar int vertex_indices\n"
OTHERS = {
    "a.ply": PLY_HEAD.format("ascii", FACES) + "0 0 0\n1 0 0\n0 1 0\n255 0 1 2\n",
    "b.ply": PLY_HEAD.format("binary_little_endian", FACES).encode() + np.eye(3, dtype="<f4").tobytes() + b"\xff" * 10,
    "c.ply": PLY_HEAD.format("ascii", FACES) + "nan nan nan\n1 0 0\n0 1 0\n3 0 1 2\n",
    "d.ply": PLY_HEAD.format("ascii", FACES) + "0 0 0\n1 0 0\n0 1 0\n3 0 1 -2\n",
    "e.ply": PLY_HEAD.format("ascii", FACES).replace("uchar int", "float vertex") + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
    "f.ply": "ply\n" + "comment x\n" * 100_000,
    "a.stl": b"\0" * 80 + struct.pack("<I", 1) + struct.pack("<12fH", *[float("nan")] * 12, 0),
    "b.stl": b"solid " + b"\xff" * 5000,
    "c.stl": "solid\n" + "facet normal 0 0 1\nouter loop\nvertex 1e999 x y\nendloop\nendfacet\n" * 10,
    "a.off": "OFF\n-3 -1 0\n0 0 0\n",
    "b.off": "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n999999999 0 1 2\n",
    "c.off": "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 77\n",
    "a.dae": "<COLLADA>" * 5000,
    "b.dae": DAE.format(head="", name="n").replace("&a19;", "").replace("0 1 2</p>", "0 1 99999</p>"),
    "c.dae": DAE.format(head="", name="n").replace("&a19;", "").replace('count="9"', 'count="999999999999"'),
    "a.3mf": archive(**{"3D/3dmodel.model": "<model" * 5000}),
    "b.3mf": archive(**{"3D/3dmodel.model": MODEL_3MF.format(head="").replace("&a19;", "").replace('v3="2"', 'v3="-7"')}),
}  # fmt: skip


@pytest.mark.parametrize("name", OTHERS)
def test_other_formats(write, name):
    found = outcome(write(name, OTHERS[name]))
    if not isinstance(found, str):
        assert np.isfinite(found.vertices).all()
        assert found.triangles.max() < len(found.vertices)
        assert len(found.triangles) == 1
        assert name in {"a.ply", "b.off", "c.dae"}, "expected to be refused"
