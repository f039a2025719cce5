"""Each limit has a file that goes beyond it, refused by the limit's name, its value and what was found."""

import json
import struct
import zipfile
import zlib

import numpy as np
import pytest
import trimesh
from PIL import Image

from viewsphere.assets.cache import load_normalised
from viewsphere.assets.load import load_model
from viewsphere.errors import ModelError, UserError
from viewsphere.limits import limits, table
from viewsphere.model.model_spec import ModelSpec

LIMITS = table().keys()
TESTED = {
    "MAX_READ_SECONDS": "test_isolated",
    "MAX_READ_BYTES": "test_isolated",
    "MAX_BLENDER_TRIANGLES": "test_formats",
    "MAX_RECIPE_VALUES": "test_file",
    "MAX_STORED_PIXELS": "test_strangers",
    "MAX_RECIPE_BYTES": "test_file",
    "MAX_POSES_BYTES": "test_pose_files",
    "MAX_RIG_BYTES": "test_rig_files",
    **dict.fromkeys(("MAX_STREAMED_BYTES", "MAX_TABLE_BYTES", "MAX_PICTURE_BYTES", "MAX_RECORD_BYTES"), "test_files"),
    "MAX_REPAIRED_SHOTS": "test_endless_plans",
    "MAX_REMOTE_TRIES": "test_places",
    "MAX_FETCHED_BYTES": "test_fetched",
    "MAX_MODELS": "test_models",
    "MAX_ENTRIES": "test_entries_walked",
    "MAX_REDRAWS": "test_framing",
    "CACHE_LIMIT": "test_cache_entries",
    "MAX_VOXELS": "test_voxels",
    "MAX_LISTED_OBJECTS": "test_listed_sampler",
    "MAX_ANNOTATION_BYTES": "test_kitti_reading",
    "MAX_IMPORTED_OBJECTS": "test_kitti_reading",
    "MAX_MAT_ARRAYS": "test_mat",
    **dict.fromkeys(
        (
            "MAX_FILE_BYTES", "MAX_FILES", "MAX_TRIANGLES", "MAX_VERTICES", "MAX_PICTURE_PIXELS",
            "MAX_TEXTURES", "MAX_ALL_TEXTURE_PIXELS", "MAX_ZEROS", "MAX_INSTANCES", "MAX_NESTING", "MAX_ARCHIVE_BYTES",
            "MAX_SIZE", "MIN_SIZE", "MAX_LAYERS",
        ),
        "here",
    ),
}  # fmt: skip
DAE = (
    '<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset/>{library}'
    '<library_visual_scenes><visual_scene id="s">{nodes}</visual_scene></library_visual_scenes>'
    '<scene><instance_visual_scene url="#s"/></scene></COLLADA>'
)
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"


def test_no_limit_is_forgotten():
    assert TESTED.keys() == LIMITS


@pytest.fixture
def refused(monkeypatch):
    """Assert that a file is refused by this limit once it is as small as `value`, and not before."""

    def check(path, name, value, found, loads=True):
        if loads:
            load_model(path)
        monkeypatch.setenv(f"VIEWSPHERE_{name}", str(value))
        with pytest.raises(ModelError, match=name) as error:
            load_model(path)
        text = str(error.value)
        assert path.name in text
        assert f"at most {value:,} " in text
        assert f"found {found}" in text or f"{found} bytes long" in text
        assert "\n" not in text

    return check


def png_header(width, height):
    """A PNG that promises so many pixels and has none."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", zlib.compress(b"")) + chunk(b"IEND", b"")


def textured(write, *sizes):
    """An OBJ with one material and one texture a size."""
    for i, size in enumerate(sizes):
        Image.new("RGB", size, (i, 0, 0)).save(write(f"t{i}.png", b""))
    write("t.mtl", "".join(f"newmtl m{i}\nmap_Kd t{i}.png\n" for i in range(len(sizes))))
    faces = "".join(f"usemtl m{i}\nf 1 2 3\n" for i in range(len(sizes)))
    return write("t.obj", "mtllib t.mtl\n" + TRIANGLE + faces)


def test_file_bytes(write, refused, monkeypatch):
    path = write("a.obj", TRIANGLE + "f 1 2 3\n")
    size = path.stat().st_size
    refused(path, "MAX_FILE_BYTES", 20, size)
    with pytest.raises(ModelError, match="MAX_FILE_BYTES"):
        load_normalised(ModelSpec(key="a", source=str(path), category="x", category_id=1))
    monkeypatch.setenv("VIEWSPHERE_MAX_FILE_BYTES", str(2 * size))
    write("m.mtl", "#" * 3 * size)
    mesh, _ = load_model(write("b.obj", "mtllib m.mtl\n" + TRIANGLE + "f 1 2 3\n"))
    assert "MAX_FILE_BYTES" in mesh.warnings[0]


def test_files(write, refused):
    names = "".join(f"mtllib {i}.mtl\n" for i in range(20))
    refused(write("a.obj", names + TRIANGLE + "f 1 2 3\n"), "MAX_FILES", 10, 11)


@pytest.mark.parametrize("kind", ["obj", "stl", "glb", "3mf"])
@pytest.mark.parametrize(("name", "found"), [("MAX_TRIANGLES", 24), ("MAX_VERTICES", 16)])
def test_triangles_and_vertices(kind, name, found, refused, tmp_path):
    boxes = [trimesh.creation.box(), trimesh.creation.box(transform=trimesh.transformations.translation_matrix([3, 0, 0]))]
    path = tmp_path / f"boxes.{kind}"
    (trimesh.util.concatenate(boxes) if kind == "stl" else trimesh.Scene(boxes)).export(path)
    # Vertices are those of the mesh in the making, flat faces apart.
    refused(path, name, 7 if name == "MAX_VERTICES" else found - 1, "" if name == "MAX_VERTICES" else found)


def test_layers(write, refused):
    refused(write("a.obj", TRIANGLE + "f 1 2 3\n" * 50), "MAX_LAYERS", 10, 12)


def test_instances_count_as_triangles(gltf, cube, refused):
    mesh = gltf.mesh(*cube)
    for i in range(9):
        gltf.node(mesh=mesh, translation=[i, 0, 0])
    refused(gltf.write(), "MAX_TRIANGLES", 100, 108)


def test_instances(gltf, cube, refused):
    shifts = gltf.accessor(np.eye(3, dtype=np.float32))
    gltf.node(mesh=gltf.mesh(*cube), extensions={"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": shifts}}})
    refused(gltf.write(), "MAX_INSTANCES", 2, 3)


def test_instances_of_dae_and_3mf(write, refused, tmp_path):
    twice = '<node id="n{}"><instance_node url="#n{}"/><instance_node url="#n{}"/></node>'
    nodes = '<node id="n0"/>' + "".join(twice.format(i, i - 1, i - 1) for i in range(1, 4))
    text = DAE.format(library=f"<library_nodes>{nodes}</library_nodes>", nodes='<node><instance_node url="#n3"/></node>')
    refused(write("a.dae", text), "MAX_INSTANCES", 16, 17, loads=False)
    path = tmp_path / "a.3mf"
    objects = '<object id="0"/><object id="1"><components>' + '<component objectid="0"/>' * 9 + "</components></object>"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(
            "3D/3dmodel.model", f'<model><resources>{objects}</resources><build><item objectid="1"/></build></model>'
        )
    refused(path, "MAX_INSTANCES", 10, 11, loads=False)


def test_nesting(gltf, cube, write, refused, tmp_path):
    gltf.node(mesh=gltf.mesh(*cube))
    for i in range(400):
        gltf.node(children=[i])
    refused(gltf.write(), "MAX_NESTING", 400, 401)
    text = DAE.format(library="", nodes="<node>" * 7 + "</node>" * 7)
    refused(write("a.dae", text), "MAX_NESTING", 7, 8, loads=False)
    objects = '<object id="0"/>' + "".join(
        f'<object id="{i}"><components><component objectid="{i - 1}"/></components></object>' for i in range(1, 9)
    )
    path = tmp_path / "a.3mf"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(
            "3D/3dmodel.model", f'<model><resources>{objects}</resources><build><item objectid="8"/></build></model>'
        )
    refused(path, "MAX_NESTING", 9, 10, loads=False)


def test_zeros(gltf, cube, refused):
    gltf.root["accessors"] = [{"componentType": 5126, "type": "VEC3", "count": 8}]
    gltf.node(mesh=gltf.mesh(*cube, TEXCOORD_0=np.zeros((8, 2), np.float32), NORMAL=np.ones((8, 3), np.float32)))
    gltf.root["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = 0
    refused(gltf.write(), "MAX_ZEROS", 7, 8)


def test_archive(tmp_path, refused):
    path = tmp_path / "a.3mf"
    trimesh.creation.box().export(path)
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("3D/zeros.bin", b"0" * 10**6)
        size = sum(entry.file_size for entry in archive.infolist())
    assert path.stat().st_size < 10_000
    refused(path, "MAX_ARCHIVE_BYTES", 10**5, f"{size:,}")


@pytest.mark.parametrize("size", [(100_000, 100_000), (16_000, 16_000), (10_001, 10_000)])
def test_a_huge_texture_is_refused_before_it_is_decoded(write, size):
    path = textured(write, (2, 2))
    write("t0.png", png_header(*size))
    mesh, _ = load_model(path)
    assert mesh.images == ()
    assert "expected at most 100,000,000 pixels (limit MAX_PICTURE_PIXELS)" in mesh.warnings[0]
    assert "many more" in mesh.warnings[0] or f"{size[0]} x {size[1]}" in mesh.warnings[0]


def test_a_long_narrow_texture_is_reduced(write):
    path = textured(write, (2, 2))
    Image.new("L", (40_000, 2), 200).save(write("t0.png", b""))
    assert load_model(path)[0].warnings[0].endswith("40,000 x 2 pixels are reduced to 4,000 x 1 (at most 4,096 a side)")


def test_textures(write, refused):
    refused(textured(write, (2, 2), (2, 2), (2, 2)), "MAX_TEXTURES", 2, 3)


def test_all_texture_pixels(write, refused):
    refused(textured(write, (8, 8), (8, 9)), "MAX_ALL_TEXTURE_PIXELS", 100, 136)


@pytest.mark.parametrize(("unit", "name"), [(1e9, "MAX_SIZE"), (1e-9, "MIN_SIZE")])
def test_sizes(write, unit, name):
    path = write("a.obj", TRIANGLE + "f 1 2 3\n")
    spec = ModelSpec(key="a", source=str(path), category="x", category_id=1, unit=unit)
    with pytest.raises(ModelError, match=rf"a\.obj.*{name}.*found {unit:.3g} m".replace("+", r"\+")):
        load_normalised(spec)


@pytest.mark.parametrize("name", table())
def test_the_environment_sets_every_limit_anew(monkeypatch, name):
    limit = table()[name]
    assert getattr(limits, name) == limit.default
    monkeypatch.setenv(f"VIEWSPHERE_{name}", "7")
    assert getattr(limits, name) == 7
    wrong = ["long", "-1", "0", "nan", "inf", *(["7.5"] if isinstance(limit.default, int) else [])]
    for text in wrong:
        monkeypatch.setenv(f"VIEWSPHERE_{name}", text)
        with pytest.raises(UserError, match=f"VIEWSPHERE_{name}: expected a .*number above 0, found '{text}'"):
            getattr(limits, name)
    monkeypatch.setenv(f"VIEWSPHERE_{name}", "")
    assert getattr(limits, name) == limit.default


def test_a_deep_json_is_refused(write):
    text = json.dumps({"asset": {"version": "2.0"}})[:-1] + ', "extras": ' + "[" * 200_000 + "]" * 200_000 + "}"
    with pytest.raises(ModelError, match=r"a\.gltf.*nested too deeply"):
        load_model(write("a.gltf", text))
