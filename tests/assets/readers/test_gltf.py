"""The glTF reader: closed forms on hand-made files."""

import base64
import io
import json
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from viewsphere.assets.load import load_model
from viewsphere.assets.mesh import HIGHEST_IOR, Texture
from viewsphere.errors import ModelError


def png(color=(255, 0, 0, 255), size=(4, 2)):
    file = io.BytesIO()
    Image.new("RGBA", size, color).save(file, "PNG")
    return file.getvalue()


def load(gltf):
    return load_model(gltf.write())[0]


def test_nodes_multiply_from_the_root(gltf, cube):
    mesh = gltf.mesh(*cube)
    half = float(np.sqrt(0.5))
    gltf.node(children=[1], translation=[10, 0, 0])
    gltf.node(children=[2], rotation=[0, 0, half, half])  # a quarter turn: x becomes y
    gltf.node(mesh=mesh, name="box", scale=[2, 1, 1])
    gltf.root["scenes"] = [{"nodes": [0]}]
    found = load(gltf)
    np.testing.assert_allclose(found.bounds, [[9, 0, 0], [10, 2, 1]], atol=1e-6)
    assert found.parts == ("box",)


def test_a_matrix_is_column_major(gltf, cube):
    gltf.node(mesh=gltf.mesh(*cube), matrix=[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1])
    np.testing.assert_array_equal(load(gltf).bounds[0], [5, 6, 7])


@pytest.mark.parametrize("scale", [[-1, 1, 1], [2, -3, 1], [-1, -1, -1], [-1, -1, 1], [1, 1, 1]])
def test_mirroring_keeps_the_outside_outside(gltf, cube, volume, scale):
    normals = (cube[0] - 0.5) / np.sqrt(0.75).astype(np.float32)
    gltf.node(mesh=gltf.mesh(*cube, NORMAL=normals.astype(np.float32)), scale=scale)
    mesh = load(gltf)
    assert volume(mesh) == pytest.approx(abs(np.prod(scale)))
    center = mesh.bounds.mean(axis=0)
    outward = np.einsum("ij,ij->i", mesh.normals, mesh.vertices - center)
    assert outward.min() > 0


def test_normals_follow_the_inverse_transpose(gltf):
    slope = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 1]], np.float32)  # plane y = z
    normal = np.tile(np.array([[0, -1, 1]], np.float32) / np.float32(np.sqrt(2)), (3, 1))
    mesh = gltf.mesh(slope, np.array([0, 1, 2], np.uint8), NORMAL=normal)
    gltf.node(mesh=mesh, scale=[1, 1, 3])
    found = load(gltf)
    face = np.cross(*np.diff(found.vertices[found.triangles[0]], axis=0))
    np.testing.assert_allclose(found.normals, np.tile(face / np.linalg.norm(face), (3, 1)), atol=1e-6)


def test_a_mesh_in_many_nodes_is_repeated_as_parts_of_its_own(gltf, cube):
    mesh = gltf.mesh(*cube, name="wheel")
    for x in range(3):
        gltf.node(mesh=mesh, translation=[2 * x, 0, 0])
    gltf.node(mesh=mesh, name="wheel", translation=[9, 0, 0])
    found = load(gltf)
    assert found.parts == ("wheel", "wheel_2", "wheel_3", "wheel_4")
    for part, x in enumerate((0, 2, 4, 9)):
        used = found.vertices[found.triangles[found.triangle_part == part]]
        assert (used[..., 0].min(), used[..., 0].max()) == (x, x + 1)


def test_gpu_instancing_repeats_the_mesh(gltf, cube):
    places = np.array([[0, 0, 0], [0, 5, 0]], np.float32)
    scales = np.array([[1, 1, 1], [2, 2, 2]], np.float32)
    attributes = {"TRANSLATION": gltf.accessor(places), "SCALE": gltf.accessor(scales)}
    gltf.node(mesh=gltf.mesh(*cube), extensions={"EXT_mesh_gpu_instancing": {"attributes": attributes}})
    gltf.root["extensionsRequired"] = ["EXT_mesh_gpu_instancing"]
    found = load(gltf)
    assert len(found.triangles) == 24
    np.testing.assert_array_equal(found.bounds, [[0, 0, 0], [2, 7, 2]])


@pytest.mark.parametrize(
    ("mode", "expected"),
    [
        (4, [[0, 1, 2]]),
        (5, [[0, 1, 2], [1, 3, 2], [2, 3, 4]]),
        (6, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]),
    ],
)
def test_strips_and_fans(gltf, mode, expected):
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 2, 0.5]], np.float32)
    normals = np.tile(np.array([0, 0, 1], np.float32), (5, 1))
    gltf.node(mesh=gltf.mesh(points, None, mode=mode, NORMAL=normals))
    found = load(gltf)
    np.testing.assert_array_equal(found.vertices[found.triangles], points[np.array(expected)])


def test_points_are_left_out_with_a_warning(gltf, cube):
    gltf.node(mesh=gltf.mesh(cube[0], None, mode=0))
    gltf.node(mesh=gltf.mesh(*cube))
    found = load(gltf)
    assert len(found.triangles) == 12
    assert "points and lines" in found.warnings[0]


def test_missing_normals_are_flat(gltf, cube):
    gltf.node(mesh=gltf.mesh(*cube))
    found = load(gltf)
    a, b, c = (found.vertices[found.triangles[:, i]] for i in range(3))
    for corner in range(3):
        np.testing.assert_array_equal(found.normals[found.triangles[:, corner]], np.cross(b - a, c - a))


@pytest.mark.parametrize("dtype", [np.int8, np.uint8, np.int16, np.uint16])
def test_quantised_and_normalised_integers(gltf, dtype):
    top = np.iinfo(dtype).max
    points = np.array([[0, 0, 0], [top, 0, 0], [0, top, 0]], dtype)
    gltf.root["extensionsRequired"] = ["KHR_mesh_quantization"]
    gltf.root["accessors"].append(
        {
            "bufferView": gltf.view(np.pad(points, ((0, 0), (0, 1))).tobytes(), stride=4 * points.itemsize),
            "componentType": {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123}[points.dtype.str[1:]],
            "normalized": True,
            "count": 3,
            "type": "VEC3",
        }
    )
    gltf.root["meshes"].append({"primitives": [{"attributes": {"POSITION": 0}}]})
    gltf.node(mesh=0, scale=[4, 4, 4])
    np.testing.assert_array_equal(load(gltf).bounds, [[0, 0, 0], [4, 4, 0]])


def test_sparse_accessors_replace_elements(gltf):
    base = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    at = gltf.view(np.array([2], np.uint8).tobytes())
    new = gltf.view(np.array([[0, 7, 0]], np.float32).tobytes())
    sparse = {
        "count": 1,
        "indices": {"bufferView": at, "componentType": 5121},
        "values": {"bufferView": new},
    }
    position = gltf.accessor(base, sparse=sparse)
    gltf.root["meshes"].append({"primitives": [{"attributes": {"POSITION": position}}]})
    gltf.node(mesh=0)
    assert load(gltf).bounds[1, 1] == 7


def test_interleaved_attributes(gltf):
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    uv = np.array([[0, 0], [0.25, 0], [0, 0.75]], np.float32)
    view = gltf.view(np.hstack([points, uv]).tobytes(), stride=20)
    for kind, offset in (("VEC3", 0), ("VEC2", 12)):
        gltf.root["accessors"].append(
            {"bufferView": view, "byteOffset": offset, "componentType": 5126, "count": 3, "type": kind}
        )
    gltf.root["meshes"].append({"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}}]})
    gltf.node(mesh=0)
    mesh = load(gltf)
    np.testing.assert_array_equal(mesh.vertices[mesh.triangles[0]], points)
    np.testing.assert_array_equal(mesh.uv0[mesh.triangles[0]], uv)


def test_vertex_colours_gain_an_alpha_of_one(gltf):
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    colors = gltf.accessor(np.array([[255, 0, 51]] * 3, np.uint8), normalized=True)
    attributes = {"POSITION": gltf.accessor(points), "COLOR_0": colors}
    gltf.root["meshes"].append({"primitives": [{"attributes": attributes}]})
    gltf.node(mesh=0)
    np.testing.assert_allclose(load(gltf).colors, [[1, 0, 0.2, 1]] * 3, atol=1e-7)


def full_material():
    texture = {"index": 0, "texCoord": 1}
    moved = {"offset": [0.1, 0.2], "rotation": 0.5, "scale": [2, 3], "texCoord": 0}
    return {
        "name": "everything",
        "pbrMetallicRoughness": {
            "baseColorFactor": [0.1, 0.2, 0.3, 0.4],
            "baseColorTexture": texture | {"extensions": {"KHR_texture_transform": moved}},
            "metallicFactor": 0.6,
            "roughnessFactor": 0.7,
            "metallicRoughnessTexture": texture,
        },
        "normalTexture": texture | {"scale": 0.5},
        "occlusionTexture": texture | {"strength": 0.25},
        "emissiveTexture": texture,
        "emissiveFactor": [0.5, 0.25, 0],
        "alphaMode": "MASK",
        "alphaCutoff": 0.3,
        "extensions": {
            "KHR_materials_clearcoat": {
                "clearcoatFactor": 0.9,
                "clearcoatRoughnessFactor": 0.8,
                "clearcoatTexture": texture,
                "clearcoatRoughnessTexture": texture,
                "clearcoatNormalTexture": texture,
            },
            "KHR_materials_transmission": {"transmissionFactor": 0.35, "transmissionTexture": texture},
            "KHR_materials_volume": {"thicknessFactor": 0.003, "attenuationDistance": 2.0},
            "KHR_materials_ior": {"ior": 1.33},
            "KHR_materials_specular": {
                "specularFactor": 0.45,
                "specularColorFactor": [0.9, 0.8, 0.7],
                "specularTexture": texture,
                "specularColorTexture": texture,
            },
            "KHR_materials_emissive_strength": {"emissiveStrength": 4},
            "KHR_materials_unlit": {},
        },
    }


@pytest.mark.parametrize(("told", "read"), [(0, 0.0), (2.4, 2.4), (1e20, HIGHEST_IOR)])
def test_no_material_refracts_more_than_any_there_is(gltf, told, read):
    gltf.root["materials"] = [{"extensions": {"KHR_materials_ior": {"ior": told}}}]
    gltf.node(mesh=gltf.mesh(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32), None, material=0))
    assert load(gltf).materials[0].ior == read


def test_every_material_field_is_read(gltf):
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    uv = points[:, :2].copy()
    gltf.root["materials"] = [full_material()]
    gltf.root["images"] = [{"bufferView": gltf.view(png()), "mimeType": "image/png", "name": "red"}]
    gltf.root["samplers"] = [{"wrapS": 33071, "wrapT": 33648, "magFilter": 9728}]
    gltf.root["textures"] = [{"source": 0, "sampler": 0}]
    gltf.node(mesh=gltf.mesh(points, None, TEXCOORD_0=uv, TEXCOORD_1=uv * 2, material=0))
    mesh = load(gltf)
    (m,) = mesh.materials
    plain = Texture(0, 1, "clamp", "mirror", True)
    assert m.base_color_texture == Texture(0, 0, "clamp", "mirror", True, (0.1, 0.2), 0.5, (2, 3))
    names = [n for n in m.__dataclass_fields__ if n.endswith("_texture") and n != "base_color_texture"]
    assert {getattr(m, name) for name in names} == {plain}
    assert (m.base_color, m.metallic, m.roughness) == ((0.1, 0.2, 0.3, 0.4), 0.6, 0.7)
    assert (m.normal_scale, m.occlusion_strength, m.emissive) == (0.5, 0.25, (2, 1, 0))
    assert (m.alpha_mode, m.alpha_cutoff, m.double_sided, m.unlit) == ("MASK", 0.3, False, True)
    assert (m.clearcoat, m.clearcoat_roughness, m.transmission, m.ior, m.thickness) == (0.9, 0.8, 0.35, 1.33, 0.003)
    assert (m.specular, m.specular_color) == (0.45, (0.9, 0.8, 0.7))
    assert (mesh.images[0].name, mesh.images[0].pixels.shape) == ("red", (2, 4, 4))
    np.testing.assert_array_equal(mesh.uv1, mesh.uv0 * 2)


def test_specular_glossiness_becomes_metallic_roughness(gltf, cube):
    glossy = {"diffuseFactor": [0, 0, 0, 1], "specularFactor": [1.0, 0.8, 0.3], "glossinessFactor": 0.75}
    dull = {"diffuseFactor": [0.5, 0.4, 0.3, 1], "specularFactor": [0, 0, 0], "glossinessFactor": 0}
    gltf.root["materials"] = [{"extensions": {"KHR_materials_pbrSpecularGlossiness": values}} for values in (glossy, dull)]
    for material in range(2):
        gltf.node(mesh=gltf.mesh(*cube, material=material))
    gold, plaster = load(gltf).materials
    assert gold.metallic == pytest.approx(1, abs=0.02)
    assert gold.roughness == 0.25
    np.testing.assert_allclose(gold.base_color[:3], [1, 0.8, 0.3], atol=0.03)
    assert (plaster.metallic, plaster.roughness) == (0, 1)
    np.testing.assert_allclose(plaster.base_color[:3], np.array([0.5, 0.4, 0.3]) / 0.96)


def test_a_skin_stands_where_its_joints_are(gltf):
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    joints = np.array([[0, 0, 0, 0], [1, 0, 0, 0], [0, 1, 0, 0]], np.uint8)
    weights = np.array([[1, 0, 0, 0], [1, 0, 0, 0], [0.5, 0.5, 0, 0]], np.float32)
    inverse = np.tile(np.eye(4, dtype=np.float32), (2, 1, 1))
    inverse[1, 3, 0] = -1  # column-major: moves by -1 along x
    mesh = gltf.mesh(points, None, JOINTS_0=joints, WEIGHTS_0=weights)
    gltf.node(mesh=mesh, skin=0, translation=[100, 0, 0])  # a skinned node's own place does not count
    gltf.node(translation=[0, 0, 2])
    gltf.node(translation=[4, 0, 0])
    gltf.root["skins"] = [{"joints": [1, 2], "inverseBindMatrices": gltf.accessor(inverse.reshape(2, 16))}]
    mesh = load(gltf)
    np.testing.assert_allclose(mesh.vertices[mesh.triangles[0]], [[0, 0, 2], [4, 0, 0], [1.5, 1, 1]], atol=1e-6)


def test_morph_targets_stand_at_their_default_weights(gltf):
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    shift = np.array([[0, 0, 0], [2, 0, 0], [0, 0, 0]], np.float32)
    mesh = gltf.mesh(points, None)
    gltf.root["meshes"][mesh]["primitives"][0]["targets"] = [{"POSITION": gltf.accessor(shift)}]
    gltf.root["meshes"][mesh]["weights"] = [0.5]
    gltf.node(mesh=mesh)
    assert load(gltf).bounds[1, 0] == 2


def test_buffers_and_images_as_files_and_data_uris(gltf, cube, write):
    gltf.node(mesh=gltf.mesh(*cube, material=0, TEXCOORD_0=cube[0][:, :2].copy()))
    data = "data:application/octet-stream;base64," + base64.b64encode(gltf.data).decode()
    gltf.root["materials"] = [
        {"pbrMetallicRoughness": {"baseColorTexture": {"index": i}}, "emissiveTexture": {"index": 1 - i}} for i in (0,)
    ]
    gltf.root["textures"] = [{"source": 0}, {"source": 1}]
    gltf.root["images"] = [
        {"uri": "a%20red.png"},
        {"uri": "data:image/png;base64," + base64.b64encode(png((0, 255, 0, 255))).decode()},
    ]
    write("a red.png", png())
    for uri in (data, "cube.bin"):
        gltf.root["buffers"] = [{"byteLength": len(gltf.data), "uri": uri}]
        write("cube.bin", gltf.data)
        mesh, facts = load_model(write("cube.gltf", json.dumps(gltf.root)))
        assert len(mesh.triangles) == 12
        assert [tuple(image.pixels[0, 0]) for image in mesh.images] == [(255, 0, 0, 255), (0, 255, 0, 255)]
        assert {"cube.gltf", "a red.png"} <= {file.name for file in facts.files}


def test_textures_without_coordinates_leave_the_factors(gltf, cube):
    """Of two meshes of one material, one has no coordinates: it is plain, the other textured."""
    gltf.node(mesh=gltf.mesh(*cube, material=0, TEXCOORD_0=cube[0][:, :2].copy()))
    gltf.node(mesh=gltf.mesh(*cube, material=0))
    gltf.root["materials"] = [{"name": "skin", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    gltf.root["textures"] = [{"source": 0}]
    gltf.root["images"] = [{"bufferView": gltf.view(png()), "mimeType": "image/png"}]
    mesh = load(gltf)
    first, second = (mesh.materials[i] for i in mesh.triangle_material[[0, -1]])
    assert first.base_color_texture is not None
    assert second == replace(first, base_color_texture=None)
    assert mesh.warnings == (
        "hand.glb: material 'skin' has textures, but some of its triangles have no coordinates: plain there",
    )


@pytest.mark.parametrize("name", ["KHR_gaussian_splatting", "ADOBE_materials_clearcoat_tint"])
def test_a_required_extension_that_is_not_read_is_named(gltf, cube, name):
    gltf.node(mesh=gltf.mesh(*cube))
    gltf.root["extensionsRequired"] = ["KHR_texture_transform", name, "KHR_materials_volume"]
    with pytest.raises(ModelError, match=f"requires the extension {name}, not read here"):
        load(gltf)


def test_a_dead_texture_is_a_warning(gltf, cube):
    gltf.root["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "baseColorFactor": [1, 0, 0, 1]}}]
    gltf.root["textures"] = [{"source": 0}]
    gltf.root["images"] = [{"uri": "gone.png"}]
    gltf.node(mesh=gltf.mesh(*cube, material=0))
    mesh = load(gltf)
    assert mesh.materials[0].base_color_texture is None
    assert mesh.materials[0].base_color == (1, 0, 0, 1)
    assert "hand.glb" in mesh.warnings[0]
    assert "gone.png" in mesh.warnings[0]


def cycle(root):
    root["nodes"] = [{"children": [1], "mesh": 0}, {"children": [0]}]
    root["scenes"] = [{"nodes": [0]}]


BROKEN = {
    "cycle": (cycle, "cycle"),
    "version": (lambda r: r.update(asset={"version": "1.0"}), "1.0"),
    "version as a number": (lambda r: r.update(asset={"version": 1}), "expected glTF version 2.0, found 1"),
    "giant count": (lambda r: r["accessors"][0].update(count=10**15), "elements"),
    "giant zeros": (lambda r: r.update(accessors=[{"componentType": 5126, "type": "VEC3", "count": 10**10}]), "at most"),
    "short view": (lambda r: r["bufferViews"][0].update(byteLength=10), "truncated"),
    "view beyond the buffer": (lambda r: r["bufferViews"][0].update(byteOffset=10**6), "bufferViews[0]"),
    "index out of range": (lambda r: r["accessors"][0].update(count=4), "indices below 4"),
    "no such mesh": (lambda r: r["nodes"][0].update(mesh=3), "index below 1"),
    "no such accessor": (lambda r: r["meshes"][0]["primitives"][0].update(indices=77), "index below 2"),
    "no such material": (lambda r: r["meshes"][0]["primitives"][0].update(material=5), "materials"),
    "wrong type": (lambda r: r.update(nodes={"a": 1}), "an array"),
    "wrong number": (lambda r: r["nodes"][0].update(translation=[0, "x", 0]), "3 numbers"),
    "no triangles": (lambda r: r.update(nodes=[]), "no triangles"),
    "root": (lambda r: r.update(accessors=7), "an array"),
}  # fmt: skip


@pytest.mark.parametrize("case", BROKEN)
def test_broken_files_are_one_clear_error(gltf, cube, case):
    change, message = BROKEN[case]
    gltf.node(mesh=gltf.mesh(*cube))
    change(gltf.root)
    with pytest.raises(ModelError) as error:
        load_model(gltf.write())
    text = str(error.value)
    assert message in text
    assert "hand.glb" in text
    assert "\n" not in text


def test_every_truncation_of_a_file_is_an_error(gltf, cube, write):
    gltf.node(mesh=gltf.mesh(*cube))
    whole = gltf.write().read_bytes()
    for length in range(0, len(whole), 37):
        with pytest.raises(ModelError, match=r"cut\.glb"):
            load_model(write("cut.glb", whole[:length]))


def test_a_vertex_that_is_nowhere_is_refused_with_its_number_if_a_face_names_it(gltf, cube):
    points = np.concatenate([cube[0], [[np.nan, 0, 0]]]).astype(np.float32)
    gltf.node(mesh=gltf.mesh(points, cube[1]))
    assert len(load(gltf).triangles) == 12
    points[7] = np.inf
    gltf.node(mesh=gltf.mesh(points, cube[1]))
    with pytest.raises(
        ModelError, match=r"meshes\[1\]\.primitives\[0\]: vertex 8 of 9 has a NaN or infinite coordinate \(inf inf"
    ):
        load(gltf)


def test_flat_triangles_are_dropped_and_counted(gltf, cube):
    extra = np.array([[0, 0, 1], [2, 2, 2]], np.uint16)
    gltf.node(mesh=gltf.mesh(cube[0], np.vstack([cube[1], extra])))
    mesh = load(gltf)
    assert len(mesh.triangles) == 12
    assert mesh.warnings == ("hand.glb: 2 triangles without area dropped",)


def test_normals_without_direction_are_smooth_and_said(gltf, cube):
    normals = np.tile(np.array([0, 0, 1], np.float32), (8, 1))
    normals[0], normals[1], normals[2] = np.nan, 0, np.inf
    gltf.node(mesh=gltf.mesh(*cube, NORMAL=normals))
    mesh, _ = load_model(gltf.write())
    assert mesh.warnings == ("hand.glb: 3 of 8 normals are missing, NaN or of no length: smooth ones take their place",)
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1, rtol=1e-6)
    np.testing.assert_array_equal(mesh.normals[3:], normals[3:])


def test_hidden_nodes_take_what_is_below_along(gltf, cube):
    mesh = gltf.mesh(*cube)
    hidden = {"KHR_node_visibility": {"visible": False}}
    gltf.node(mesh=mesh, name="shown", children=[1, 3], extensions={"KHR_node_visibility": {"visible": True}})
    gltf.node(mesh=mesh, name="hidden", children=[2], extensions=hidden)
    gltf.node(mesh=mesh, name="below", extensions={"KHR_node_visibility": {"visible": True}})
    gltf.node(mesh=mesh, name="beside")
    gltf.root["extensionsRequired"] = ["KHR_node_visibility"]
    gltf.root["scenes"] = [{"nodes": [0]}]
    assert load(gltf).parts == ("shown", "beside")
    gltf.root["nodes"][0]["extensions"] = hidden
    with pytest.raises(ModelError, match="all of its meshes are hidden"):
        load(gltf)
