"""What is exported reads back: by trimesh as an oracle, and by our own readers field by field."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from viewsphere.assets.exporting.export import export_glb, export_obj
from viewsphere.assets.load import load_model
from viewsphere.assets.mesh import Image, Material, Mesh, Texture
from viewsphere.assets.normalise import normalise
from viewsphere.model.model_spec import ModelSpec

EVERYTHING = Material(
    name="every thing",
    base_color=(0.1, 0.2, 0.3, 0.4),
    base_color_texture=Texture(0, 1, "clamp", "mirror", True, (0.1, 0.2), 0.5, (2.0, 3.0)),
    metallic=0.25,
    roughness=0.75,
    metallic_roughness_texture=Texture(1),
    normal_texture=Texture(1),
    normal_scale=0.5,
    occlusion_texture=Texture(1),
    occlusion_strength=0.125,
    emissive=(4.0, 2.0, 0.0),
    emissive_texture=Texture(0),
    alpha_mode="MASK",
    alpha_cutoff=0.3,
    double_sided=False,
    unlit=True,
    clearcoat=0.9,
    clearcoat_texture=Texture(0),
    clearcoat_roughness=0.8,
    clearcoat_roughness_texture=Texture(1),
    clearcoat_normal_texture=Texture(1),
    transmission=0.35,
    transmission_texture=Texture(0),
    ior=1.33,
    thickness=0.003,
    specular=0.45,
    specular_texture=Texture(0),
    specular_color=(0.9, 0.8, 0.7),
    specular_color_texture=Texture(0),
)
SPEC = ModelSpec(key="a", source="a.glb", category="car", category_id=1, centring="box")


@pytest.fixture
def mesh():
    """300 triangles of three parts and three materials, with every attribute; not sorted."""
    rng = np.random.default_rng(11)
    count = 120
    normals = rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    images = (
        Image("first", rng.integers(0, 256, (5, 4, 4)).astype(np.uint8)),
        Image("second", rng.integers(0, 256, (2, 3, 4)).astype(np.uint8)),
    )
    return Mesh(
        vertices=rng.normal(size=(count, 3)).astype(np.float32),
        triangles=np.array([rng.permutation(count)[:3] for _ in range(300)], np.int32),
        normals=normals.astype(np.float32),
        triangle_material=rng.integers(0, 3, 300).astype(np.int32),
        triangle_part=rng.integers(0, 3, 300).astype(np.int32),
        materials=(EVERYTHING, Material(name="plain"), Material(name="plain", base_color=(1, 0, 0, 0.5), alpha_mode="BLEND")),
        parts=("left wheel", "Türe", "x"),
        uv0=rng.random((count, 2)).astype(np.float32),
        uv1=rng.random((count, 2)).astype(np.float32),
        colors=rng.random((count, 4)).astype(np.float32),
        images=images,
    )


@pytest.fixture
def sorted_mesh(mesh):
    from viewsphere.assets.primitive import FileFacts

    return normalise(mesh, FileFacts(Path("a.stl"), "stl", "+z", "-y", 1.0), SPEC)


def corners(mesh, name):
    array = getattr(mesh, name)
    return array[mesh.triangles]


def to_object_axes(points):
    """glTF's (x, y, z) is the object's (x, -z, y)."""
    return np.stack([points[..., 0], -points[..., 2], points[..., 1]], axis=-1)


@pytest.mark.parametrize("which", ["mesh", "sorted_mesh"])
def test_trimesh_reads_the_glb_s_triangles_in_order(which, request, tmp_path):
    mesh = request.getfixturevalue(which)
    scene = trimesh.load_scene(export_glb(mesh, tmp_path / "a.glb"), process=False)
    triangles = np.concatenate([scene.geometry[name].triangles for name in scene.geometry])
    np.testing.assert_array_equal(to_object_axes(triangles).astype(np.float32), corners(mesh, "vertices"))


def test_the_glb_reads_back_field_by_field(sorted_mesh, tmp_path):
    back, facts = load_model(export_glb(sorted_mesh, tmp_path / "a.glb"))
    assert (facts.up, facts.forward, facts.unit) == ("+y", "+z", 1)
    np.testing.assert_array_equal(to_object_axes(corners(back, "vertices")), corners(sorted_mesh, "vertices"))
    np.testing.assert_allclose(to_object_axes(corners(back, "normals")), corners(sorted_mesh, "normals"), atol=1e-7)
    for name in ("uv0", "uv1", "colors"):
        np.testing.assert_array_equal(corners(back, name), corners(sorted_mesh, name))
    np.testing.assert_array_equal(back.triangle_part, sorted_mesh.triangle_part)
    np.testing.assert_array_equal(back.triangle_material, sorted_mesh.triangle_material)
    assert back.parts == sorted_mesh.parts
    assert back.materials == sorted_mesh.materials
    for ours, theirs in zip(sorted_mesh.images, back.images, strict=True):
        assert ours.name == theirs.name
        np.testing.assert_array_equal(ours.pixels, theirs.pixels)
    assert back.warnings == ()


def test_normalising_an_exported_glb_gives_the_same_vertices(sorted_mesh, tmp_path):
    raw, facts = load_model(export_glb(sorted_mesh, tmp_path / "a.glb"))
    again = normalise(raw, facts, SPEC)
    np.testing.assert_allclose(corners(again, "vertices"), corners(sorted_mesh, "vertices"), atol=1e-6)


@pytest.mark.slow
def test_the_obj_reads_back_to_the_same_floats(sorted_mesh, tmp_path):
    path = export_obj(sorted_mesh, tmp_path, "a")
    back, _ = load_model(path)
    for name in ("vertices", "normals"):
        np.testing.assert_allclose(corners(back, name), corners(sorted_mesh, name), atol=6e-8, rtol=0)
    np.testing.assert_array_equal(corners(back, "vertices"), corners(sorted_mesh, "vertices"))
    np.testing.assert_array_equal(back.triangle_part, sorted_mesh.triangle_part)
    assert back.parts == ("left_wheel", "Türe", "x")
    assert [m.name for m in back.materials] == ["every_thing", "plain", "plain_2"]
    every, plain, glass = back.materials
    assert (every.roughness, every.metallic, every.emissive) == (0.75, 0.25, (4, 2, 0))
    assert (every.clearcoat, every.clearcoat_roughness, every.normal_scale) == (0.9, 0.8, 0.5)
    assert (plain.alpha_mode, glass.alpha_mode, glass.base_color) == ("OPAQUE", "BLEND", (1, 0, 0, 0.5))
    picture = back.images[every.base_color_texture.image].pixels
    np.testing.assert_array_equal(picture, sorted_mesh.images[0].pixels)
    merged = back.images[every.metallic_roughness_texture.image].pixels
    np.testing.assert_array_equal(merged[..., 1:3], sorted_mesh.images[1].pixels[..., 1:3])
    np.testing.assert_allclose(corners(back, "colors")[..., :3], corners(sorted_mesh, "colors")[..., :3], atol=1e-6)


def test_each_number_of_an_obj_has_the_fewest_digits_that_give_it_back(mesh, tmp_path):
    odd = np.float32([0, -0.0, 1e-30, -1e-5, 0.1, 1 / 3, 12345.678, 1 << 24, 1e20])
    plain = replace(mesh, vertices=np.random.default_rng(5).choice(odd, (120, 3)), colors=None)
    lines = export_obj(plain, tmp_path, "a").read_text("utf-8").splitlines()
    for keyword, rows in (("v", plain.vertices), ("vn", plain.normals)):
        spelt = {f"{keyword} {' '.join(map(str, row))}" for row in rows}
        assert {line for line in lines if line.startswith(f"{keyword} ")} == spelt
    at = [np.float32(line.split()[1:]) for line in lines if line.startswith("v ")]
    corners = [line.split()[1:] for line in lines if line.startswith("f ")]
    assert all(corner == "/".join([corner.split("/")[0]] * 3) for triangle in corners for corner in triangle)
    found = sorted([at[int(corner.split("/")[0]) - 1].tolist() for corner in triangle] for triangle in corners)
    assert found == sorted(plain.vertices[plain.triangles].tolist())


def test_trimesh_reads_the_obj_s_triangles(sorted_mesh, tmp_path):
    path = export_obj(sorted_mesh, tmp_path, "a")
    scene = trimesh.load_scene(path, process=False, split_object=True, group_material=False)
    found = np.concatenate([g.triangles for g in scene.geometry.values()]).reshape(-1, 9).astype(np.float32)
    ours = corners(sorted_mesh, "vertices").reshape(-1, 9)
    np.testing.assert_array_equal(np.unique(found, axis=0), np.unique(ours, axis=0))


def test_the_obj_s_texture_coordinates_hold_the_transform(sorted_mesh, tmp_path):
    """KHR_texture_transform by its specification's matrices, translation * rotation * scale."""
    back, _ = load_model(export_obj(sorted_mesh, tmp_path, "a"))
    mine = sorted_mesh.triangle_material == 0
    c, s = np.cos(0.5), np.sin(0.5)
    matrix = np.array([[1, 0, 0.1], [0, 1, 0.2], [0, 0, 1]]) @ [[c, s, 0], [-s, c, 0], [0, 0, 1]] @ np.diag([2, 3, 1])
    uv = corners(sorted_mesh, "uv1")[mine].reshape(-1, 2)
    expected = (np.column_stack([uv, np.ones(len(uv))]) @ matrix.T)[:, :2]
    np.testing.assert_allclose(corners(back, "uv0")[mine].reshape(-1, 2), expected, atol=1e-6)


def test_bytes_are_the_same_every_time(mesh, tmp_path):
    for folder in ("one", "two"):
        export_obj(mesh, tmp_path / folder, "a")
        export_glb(mesh, tmp_path / folder / "a.glb")
    files = sorted((tmp_path / "one").iterdir())
    assert {"a.obj", "a.mtl", "a.glb"} < {file.name for file in files}
    for file in files:
        assert file.read_bytes() == (tmp_path / "two" / file.name).read_bytes()
