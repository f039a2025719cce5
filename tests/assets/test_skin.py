"""Bones of skins: which of them moves each triangle, through every way that a mesh takes."""

import json
from dataclasses import replace

import numpy as np
import pytest

from rigged import BODY, arm, person, write_gltf
from small import ROOT
from viewsphere.assets.animation.deforming import DeformingMesh
from viewsphere.assets.animation.skin import NONE, strongest
from viewsphere.assets.cache import load
from viewsphere.assets.exporting.export import export_deforming, export_glb
from viewsphere.assets.exporting.exported import read_exported
from viewsphere.assets.exporting.glb import material_names
from viewsphere.assets.load import load_model
from viewsphere.assets.metadata.model_metadata import with_body_parts
from viewsphere.errors import ModelError
from viewsphere.model.model_spec import ModelSpec, Parts
from viewsphere.run.shots.models import mesh_digest

BENT = {"upper": [float(np.sin(0.5)), 0.0, 0.0, float(np.cos(0.5))]}


def spec_of(file, **more):
    return ModelSpec(key="m", source=str(file), category="c", category_id=1, scale="as_is", centring="as_is", **more)


@pytest.mark.parametrize("seed", range(3))
def test_the_strongest_bone_is_that_of_a_table_of_all_sums(seed):
    rng = np.random.default_rng(seed)
    bones, weights = rng.integers(0, 5, (40, 3)), rng.integers(0, 4, (40, 3)) / 4
    triangles = rng.integers(0, 40, (200, 3))
    table = np.zeros((200, 5))
    for corner in triangles.T:
        for column in range(3):
            np.add.at(table, (np.arange(200), bones[corner, column]), weights[corner, column])
    expected = np.where(table.max(axis=1) > 0, table.argmax(axis=1), NONE)
    np.testing.assert_array_equal(strongest(bones, weights, triangles), expected)


def test_weights_that_are_no_numbers_or_not_there():
    triangles = np.array([[0, 1, 2]])
    assert strongest(np.array([[0], [1], [1]]), np.array([[2.0], [np.nan], [0.5]]), triangles).tolist() == [0]
    assert strongest(np.zeros((3, 0), np.int64), np.zeros((3, 0)), triangles).tolist() == [NONE]
    assert strongest(np.array([[0], [1], [1]]), np.zeros((3, 1)), triangles).tolist() == [NONE]


@pytest.mark.parametrize("turned", [None, BENT])
def test_an_arm_is_parted_where_the_weights_of_its_bones_are_equal(tmp_path, turned):
    """The ring at 1 m: triangles above it have more of the second bone, however that is turned."""
    mesh, _ = load_model(write_gltf(arm(), tmp_path / "arm.gltf", turned))
    assert mesh.body_parts == ("lower", "upper")
    straight, _ = load_model(write_gltf(arm(), tmp_path / "straight.gltf"))
    middle = straight.vertices[straight.triangles].mean(axis=1)[:, 1]
    np.testing.assert_array_equal(mesh.triangle_body_part, 1 + (middle > 1))
    assert (np.abs(mesh.vertices - straight.vertices).max() > 0.3) == (turned is not None)


def test_parts_stay_with_their_triangles(tmp_path):
    """From the file through the cache, normalising and GLB to labels."""
    file, other = write_gltf(arm(), tmp_path / "arm.gltf"), write_gltf(arm(), tmp_path / "bent.gltf", BENT)
    mesh, _ = load(spec_of(file), folder=tmp_path / "cache")
    again, _ = load(spec_of(file), folder=tmp_path / "cache")
    for one in (mesh, again, read_exported(export_glb(mesh, tmp_path / "arm.glb"), mesh.parts)):
        assert one.body_parts == ("lower", "upper")
        middle = one.vertices[one.triangles].mean(axis=1)[:, 2]
        np.testing.assert_array_equal(one.triangle_body_part, 1 + (middle > 1))
    bent = load(spec_of(other), folder=tmp_path / "cache")[0]
    export_deforming(DeformingMesh.from_meshes({1: mesh, 2: bent}), tmp_path, "arms", {1: 0.0, 2: 1.0})
    read = read_exported(tmp_path / "arms.glb", bent.parts, "arms-f0002")
    np.testing.assert_array_equal(read.triangle_body_part, bent.triangle_body_part)
    assert mesh.emptied().triangle_body_part.size == 0 and material_names(tmp_path / "arm.glb") == ("clay",)


def test_some_parts_of_a_file_keep_theirs(tmp_path):
    file = write_gltf(arm(), tmp_path / "arm.gltf")
    mesh, _ = load(spec_of(file, parts=Parts(only=("body",))), folder=tmp_path / "cache")
    assert mesh.body_parts == ("lower", "upper") and set(mesh.triangle_body_part) == {1, 2}


def test_digests_of_meshes_without_bones_know_nothing_of_them(tmp_path):
    mesh, _ = load_model(write_gltf(arm(), tmp_path / "arm.gltf"))
    plain = replace(mesh, triangle_body_part=None, body_parts=())
    assert mesh_digest(plain) != mesh_digest(mesh) != mesh_digest(replace(mesh, body_parts=("a", "b")))
    other = replace(mesh, triangle_body_part=mesh.triangle_body_part[::-1].copy())
    assert mesh_digest(other) != mesh_digest(mesh)
    export_glb(plain, tmp_path / "plain.glb")
    assert b"body_parts" not in (tmp_path / "plain.glb").read_bytes()


def test_a_sidecar_groups_bones(tmp_path):
    file = write_gltf(person(), tmp_path / "person.gltf")
    mesh, _ = load(spec_of(file), folder=tmp_path / "cache")
    assert mesh.body_parts == tuple(BODY)
    beside = tmp_path / "person.gltf.viewsphere.yaml"
    beside.write_text("body_parts: {legs: [thigh_left, shin_left], head: [head, neck]}\n")
    parted = with_body_parts(mesh, spec_of(file))
    assert parted.body_parts == ("legs", "head")
    names = np.array(["none", *BODY])[mesh.triangle_body_part]
    expected = np.select([np.isin(names, ["thigh_left", "shin_left"]), np.isin(names, ["head", "neck"])], [1, 2], 0)
    np.testing.assert_array_equal(parted.triangle_body_part, expected)


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ("{head: [hed]}", r"body_parts\.head: expected bones of the model's skin; found 'hed'; did you mean 'head'\?"),
        ("{head: [head], top: [head]}", r"expected every bone of body_parts once; found 'head' again"),
        ("{}", r"body_parts"),
        ("{head: []}", r"body_parts\.head"),
    ],
)
def test_a_sidecar_s_mistakes_are_told(tmp_path, said, message):
    file = write_gltf(person(), tmp_path / "person.gltf")
    (tmp_path / "person.gltf.viewsphere.yaml").write_text(f"body_parts: {said}\n")
    mesh, _ = load_model(file)
    with pytest.raises(ModelError, match=rf"person\.gltf\.viewsphere\.yaml.*{message}"):
        with_body_parts(mesh, spec_of(file))


def test_a_model_without_bones_has_no_parts_to_name(tmp_path):
    (tmp_path / "m.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (tmp_path / "m.obj.viewsphere.yaml").write_text("body_parts: {head: [head]}\n")
    mesh, _ = load_model(tmp_path / "m.obj")
    with pytest.raises(ModelError, match=r"expected bones of the model's skin; found a model that has none"):
        with_body_parts(mesh, spec_of(tmp_path / "m.obj"))


def test_names_of_bones_are_each_another(tmp_path):
    rigged = arm()
    file = write_gltf(rigged, tmp_path / "arm.gltf")
    root = json.loads(file.read_text())
    for names, expected in ((("a", "a"), ("a", "a_2")), (("", "node0"), ("node0", "node0_2"))):
        root["nodes"][0]["name"], root["nodes"][1]["name"] = names
        file.write_text(json.dumps(root))
        assert load_model(file)[0].body_parts == expected


def test_the_recipe_s_person_is_this_one(tmp_path):
    made = write_gltf(person(), tmp_path / "person.gltf")
    assert made.read_text() == (ROOT / "recipes/labels/models/person.gltf").read_text()
