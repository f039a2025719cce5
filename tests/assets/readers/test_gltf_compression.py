"""Compressed glTF files decode to the data that was compressed; without its package each is refused with the remedy."""

import base64
import importlib.util
import json
import zlib

import numpy as np
import pytest

from viewsphere.assets.load import load_model
from viewsphere.errors import ModelError

DracoPy = pytest.importorskip("DracoPy")
meshopt = pytest.importorskip("meshopt")
pytest.importorskip("opengl_basisu")

QUARTERS = zlib.decompress(base64.b64decode(
    "eNpb7R0SoWBksJuXS4qLAQgYgZgDimGAEYpBIAOIdYB4CpRGBwegtAMaDVPLxKDBsIyRiYGZmYFBAK6rHs76DwTyQBrorPKizJLUIganxOLMYoXQvMyy1KLi"
    "xBwFIz1DAwYGFpAuoLbv8gwP5KsQ9os/kH8gz8SP4DM8+C/P9ADmfIbv/4HyNQh5AAmsIf8="
))  # fmt: skip
"""8 x 8 texels as KTX 2 (UASTC), a plain colour a quarter: red, green above blue, yellow."""


def load(gltf):
    return load_model(gltf.write())[0]


def meshopt_view(gltf, array, mode, name, kind="NONE"):
    """A view that only holds an array as meshoptimizer compresses it."""
    rows = np.ascontiguousarray(array).reshape(len(array), -1)
    packed = meshopt.encode_gltf_buffer(rows if mode == "ATTRIBUTES" else array, mode)
    plain = gltf.view(packed)
    fields = {key: gltf.root["bufferViews"][plain][key] for key in ("buffer", "byteOffset", "byteLength")}
    size = len(rows) * rows.shape[1] * rows.itemsize
    fields |= {"count": len(rows), "byteStride": rows.shape[1] * rows.itemsize, "mode": mode, "filter": kind}
    gltf.root["bufferViews"][plain] = {"buffer": 1, "byteLength": size, "extensions": {name: fields}}
    gltf.root["buffers"] = [{"byteLength": 0}, {"byteLength": 10**6, "extensions": {name: {"fallback": True}}}]
    return plain


def write_with_fallback(gltf):
    """Write the file, whose second buffer has no bytes."""
    buffers = gltf.root.pop("buffers")
    path = gltf.write()
    buffers[0]["byteLength"] = len(gltf.data)
    data = base64.b64encode(gltf.data).decode()
    buffers[0]["uri"] = f"data:application/octet-stream;base64,{data}"

    file = path.with_suffix(".gltf")
    file.write_text(json.dumps({k: v for k, v in gltf.root.items() if v} | {"buffers": buffers}))
    return file


@pytest.mark.parametrize("name", ["EXT_meshopt_compression", "KHR_meshopt_compression"])
def test_meshopt_views_decode_to_the_same_mesh(gltf, cube, name):
    points, triangles = cube
    gltf.root["accessors"] = [
        {"bufferView": meshopt_view(gltf, points, "ATTRIBUTES", name), "componentType": 5126, "count": 8, "type": "VEC3"},
        {"bufferView": meshopt_view(gltf, triangles.reshape(-1), "TRIANGLES", name), "componentType": 5123, "count": 36,
         "type": "SCALAR"},
    ]  # fmt: skip
    gltf.root["meshes"] = [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}]
    gltf.root["extensionsRequired"] = [name]
    gltf.node(mesh=0)
    mesh, _ = load_model(write_with_fallback(gltf))
    corners = {tuple(sorted(map(tuple, face))) for face in mesh.vertices[mesh.triangles].tolist()}
    assert corners == {tuple(sorted(map(tuple, face))) for face in points[triangles].tolist()}


def draco(gltf, points, triangles, uv):
    packed = DracoPy.encode(points, triangles, tex_coord=uv, preserve_order=True, quantization_bits=16)
    ids = {a["attribute_type"]: a["unique_id"] for a in DracoPy.decode(packed).attributes}
    extension = {"bufferView": gltf.view(packed), "attributes": {"POSITION": ids[0], "TEXCOORD_0": ids[3]}}
    gltf.root["accessors"] = [
        {"componentType": 5126, "count": len(points), "type": "VEC3"},
        {"componentType": 5126, "count": len(points), "type": "VEC2"},
        {"componentType": 5123, "count": triangles.size, "type": "SCALAR"},
    ]
    primitive = {"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2}
    gltf.root["meshes"] = [{"primitives": [primitive | {"extensions": {"KHR_draco_mesh_compression": extension}}]}]
    gltf.root["extensionsRequired"] = ["KHR_draco_mesh_compression"]
    gltf.node(mesh=0)


def test_draco_decodes_to_the_same_mesh(gltf, cube, volume):
    uv = cube[0][:, :2].astype(np.float64)
    draco(gltf, cube[0], cube[1], uv)
    mesh = load(gltf)
    assert len(mesh.triangles) == 12
    assert volume(mesh) == pytest.approx(1, abs=1e-4)
    np.testing.assert_allclose(mesh.uv0, mesh.vertices[:, :2], atol=1e-3)


def test_damaged_draco_data_is_one_clear_error(gltf, cube):
    draco(gltf, cube[0], cube[1], cube[0][:, :2].astype(np.float64))
    gltf.root["bufferViews"][0]["byteLength"] -= 20
    with pytest.raises(ModelError, match=r"hand.glb: .*primitives\[0\].*KHR_draco_mesh_compression cannot be decoded"):
        load(gltf)


def with_picture(gltf, cube, texture):
    gltf.root["images"] = [{"bufferView": gltf.view(QUARTERS), "mimeType": "image/ktx2"}]
    gltf.root["textures"] = [texture]
    gltf.root["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    gltf.node(mesh=gltf.mesh(*cube, material=0, TEXCOORD_0=cube[0][:, :2].copy()))


def test_basisu_textures_have_their_texels(gltf, cube):
    with_picture(gltf, cube, {"extensions": {"KHR_texture_basisu": {"source": 0}}})
    gltf.root["extensionsRequired"] = ["KHR_texture_basisu"]
    mesh = load(gltf)
    pixels = mesh.images[mesh.materials[0].base_color_texture.image].pixels
    assert pixels.shape == (8, 8, 4)
    colors = {"red": (0, 0), "green": (0, 7), "blue": (7, 0), "yellow": (7, 7)}
    expected = {"red": (255, 0, 0), "green": (0, 255, 0), "blue": (0, 0, 255), "yellow": (255, 255, 0)}
    assert {name: tuple(pixels[at][:3].tolist()) for name, at in colors.items()} == expected


def test_a_damaged_ktx2_picture_is_a_warning(gltf, cube):
    with_picture(gltf, cube, {"extensions": {"KHR_texture_basisu": {"source": 0}}})
    gltf.root["bufferViews"][0]["byteLength"] -= 40
    mesh = load(gltf)
    assert mesh.materials[0].base_color_texture is None
    assert "cannot be decoded" in mesh.warnings[0]


@pytest.fixture
def no_packages(monkeypatch):
    find = importlib.util.find_spec
    absent = {"DracoPy", "meshopt", "opengl_basisu"}
    monkeypatch.setattr(
        "viewsphere.assets.readers.gltf.document.find_spec", lambda name: None if name in absent else find(name)
    )


@pytest.mark.usefixtures("no_packages")
@pytest.mark.parametrize("name", ["KHR_draco_mesh_compression", "KHR_texture_basisu", "EXT_meshopt_compression"])
def test_without_its_package_a_file_is_refused_with_the_remedy(gltf, cube, name):
    if name == "KHR_draco_mesh_compression":
        draco(gltf, cube[0], cube[1], cube[0][:, :2].astype(np.float64))
        path = gltf.write()
    elif name == "KHR_texture_basisu":
        with_picture(gltf, cube, {"extensions": {name: {"source": 0}}})
        path = gltf.write()
    else:
        view = meshopt_view(gltf, cube[0], "ATTRIBUTES", name)
        gltf.root["accessors"] = [{"bufferView": view, "componentType": 5126, "count": 6, "type": "VEC3"}]
        gltf.root["meshes"] = [{"primitives": [{"attributes": {"POSITION": 0}}]}]
        gltf.node(mesh=0)
        path = write_with_fallback(gltf)
    with pytest.raises(ModelError, match=rf"{name} needs the package .*pip install 'viewsphere\[gltf\]'"):
        load_model(path)


@pytest.mark.usefixtures("no_packages")
def test_plain_copies_are_read_without_packages(gltf, cube):
    with_picture(gltf, cube, {"source": 1, "extensions": {"KHR_texture_basisu": {"source": 0}}})
    gltf.root["images"].append({"uri": "data:image/bmp;base64," + base64.b64encode(BLUE).decode()})
    mesh = load(gltf)
    assert tuple(mesh.images[0].pixels[0, 0]) == (0, 0, 255, 255)


BLUE = (
    b"BM" + (58).to_bytes(4, "little") + bytes(4) + (54).to_bytes(4, "little") + (40).to_bytes(4, "little")
    + (1).to_bytes(4, "little") + (1).to_bytes(4, "little") + b"\x01\0\x18\0" + bytes(24) + b"\xff\0\0\0"
)  # fmt: skip
"""A bitmap of one blue pixel."""
