"""Models that deform: what is shared between time steps, and what their files give back."""

import json
import struct

import numpy as np
import pytest

from animated import TORN, walker
from viewsphere.assets.animation.deforming import DeformingMesh, sharing
from viewsphere.assets.exporting.export import export_deforming
from viewsphere.assets.exporting.exported import read_exported
from viewsphere.assets.load import load_model
from viewsphere.assets.mesh_file import ARRAYS
from viewsphere.errors import ModelError

FRAMES = (1, 13, 25, TORN, 49)
SECONDS = {frame: (frame - 1) / 24 for frame in FRAMES}
OBJECT_FROM_GLTF = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])


@pytest.fixture(scope="module")
def model():
    return DeformingMesh.from_meshes({frame: walker(frame) for frame in reversed(FRAMES)})


@pytest.fixture(scope="module")
def folder(model, tmp_path_factory):
    folder = tmp_path_factory.mktemp("models") / "walker"
    export_deforming(model, folder, "walker", SECONDS)
    return folder


@pytest.fixture(scope="module")
def gltf(folder):
    data = (folder / "walker.glb").read_bytes()
    (size,) = struct.unpack_from("<I", data, 12)
    return json.loads(data[20 : 20 + size])


def runs_of(mesh):
    """Corners (T, 3, 3) of the triangles, which files may keep by vertices of their own."""
    return mesh.vertices[mesh.triangles]


def test_what_stays_is_one_object_and_what_changes_is_exact(model):
    assert list(model.meshes) == sorted(FRAMES)
    for frame, mesh in model.meshes.items():
        for name in ARRAYS:
            np.testing.assert_array_equal(getattr(mesh, name), getattr(walker(frame), name), err_msg=name)
    first, second = model.meshes[1], model.meshes[13]
    shared = {name for name in (*ARRAYS, "materials", "images", "parts") if getattr(first, name) is getattr(second, name)}
    assert shared == {*ARRAYS, "materials", "images", "parts"} - {"vertices"}
    torn = model.meshes[TORN]
    assert torn.triangles is not second.triangles
    assert torn.materials is not second.materials
    assert torn.images is second.images
    assert torn.triangles is model.meshes[49].triangles


def test_meshes_with_nothing_in_common_share_nothing():
    one, other = walker(1), walker(49)
    other = sharing(other, one)
    assert other.triangles is not one.triangles
    np.testing.assert_array_equal(other.triangles, walker(49).triangles)


@pytest.mark.parametrize("frame", FRAMES)
def test_every_time_step_of_the_glb_reads_back_to_the_same_bytes(model, folder, frame):
    mesh, back = model.meshes[frame], read_exported(folder / "walker.glb", ("legs", "body"), f"walker-f{frame:04d}")
    assert runs_of(back).tobytes() == runs_of(mesh).tobytes()
    assert back.normals[back.triangles].tobytes() == mesh.normals[mesh.triangles].tobytes()
    assert back.uv0[back.triangles].tobytes() == mesh.uv0[mesh.triangles].tobytes()
    for name in ("triangle_material", "triangle_part", "parts"):
        np.testing.assert_array_equal(getattr(back, name), getattr(mesh, name))
    assert len(back.materials) == len(mesh.materials)


@pytest.mark.parametrize("frame", FRAMES)
def test_every_time_step_has_an_obj_with_the_same_numbers(model, folder, frame):
    mesh, back = model.meshes[frame], load_model(folder / f"walker-f{frame:04d}.obj")[0]
    assert runs_of(back).tobytes() == runs_of(mesh).tobytes()
    assert [m.name for m in back.materials if m.name in ("whole", "torn")] == ["torn" if frame >= TORN else "whole"]
    assert any(m.base_color_texture for m in back.materials)


def test_materials_and_textures_are_written_once_as_long_as_they_stay(folder):
    libraries = {f: (folder / f"walker-f{f:04d}.obj").read_text().splitlines()[1] for f in FRAMES}
    assert set(libraries.values()) == {"mtllib walker.mtl", f"mtllib walker-f{TORN:04d}.mtl"}
    assert {f for f, line in libraries.items() if line == "mtllib walker.mtl"} == {1, 13, 25}
    assert sorted(p.name for p in folder.glob("*.mtl")) == [f"walker-f{TORN:04d}.mtl", "walker.mtl"]


def test_all_but_vertices_is_shared_in_the_glb(gltf):
    def used(node, name):
        meshes = [gltf["meshes"][gltf["nodes"][child]["mesh"]] for child in gltf["nodes"][node]["children"]]
        return [p["attributes"].get(name, p.get(name)) for mesh in meshes for p in mesh["primitives"]]

    assert [node["name"] for node in gltf["nodes"][: len(FRAMES)]] == [f"walker-f{frame:04d}" for frame in FRAMES]
    for name in ("indices", "TEXCOORD_0", "material"):
        assert used(0, name) == used(1, name) == used(2, name)
    assert set(used(0, "POSITION")).isdisjoint(used(1, "POSITION"))
    assert used(0, "indices") != used(3, "indices")
    assert len(gltf["images"]) == 1
    assert [m["name"] for m in gltf["materials"]] == ["paint", "whole", "paint", "torn"]


def test_the_animation_shows_one_time_step_after_another(gltf, folder):
    """Sampled as glTF 2.0 says: STEP keeps a key's value until the next, and the ends before and after."""
    data = (folder / "walker.glb").read_bytes()
    begin = 20 + struct.unpack_from("<I", data, 12)[0] + 8

    def values(number):
        accessor = gltf["accessors"][number]
        at = begin + gltf["bufferViews"][accessor["bufferView"]]["byteOffset"]
        return np.frombuffer(data, "<f4", accessor["count"] * {"SCALAR": 1, "VEC3": 3}[accessor["type"]], at)

    (animation,) = gltf["animations"]
    assert {sampler["interpolation"] for sampler in animation["samplers"]} == {"STEP"}
    for frame in range(1, 50):
        shown = []
        for channel in animation["channels"]:
            sampler = animation["samplers"][channel["sampler"]]
            times, scales = values(sampler["input"]), values(sampler["output"]).reshape(-1, 3)
            assert (np.diff(times) > 0).all()
            key = max(int(np.searchsorted(times, np.float32((frame - 1) / 24), "right")) - 1, 0)
            if scales[key].any():
                shown.append(gltf["nodes"][channel["target"]["node"]]["name"])
        assert shown == [f"walker-f{max(f for f in FRAMES if f <= frame):04d}"]


def test_at_rest_the_first_time_step_is_shown_and_any_may_be_read(model, folder):
    at_rest, _ = load_model(folder / "walker.glb")
    assert len(at_rest.triangles) == len(model.meshes[1].triangles)
    for frame in FRAMES:
        back, _ = load_model(folder / "walker.glb", node=f"walker-f{frame:04d}")
        np.testing.assert_array_equal(runs_of(back) @ OBJECT_FROM_GLTF.T, runs_of(model.meshes[frame]))
    np.testing.assert_array_equal(runs_of(at_rest) @ OBJECT_FROM_GLTF.T, runs_of(model.meshes[1]))


def test_a_time_step_that_is_not_there_is_said(folder):
    for read in (lambda: read_exported(folder / "walker.glb", ("legs", "body"), "walker-f0002"),
                 lambda: load_model(folder / "walker.glb", node="walker-f0002")):  # fmt: skip
        with pytest.raises(ModelError, match="expected a node 'walker-f0002', found none"):
            read()


def test_equal_models_give_equal_bytes(model, folder, tmp_path):
    export_deforming(
        DeformingMesh.from_meshes({frame: walker(frame) for frame in FRAMES}), tmp_path / "walker", "walker", SECONDS
    )
    assert {p.name: p.read_bytes() for p in folder.iterdir()} == {
        p.name: p.read_bytes() for p in (tmp_path / "walker").iterdir()
    }
