"""Real files, when they are there: counts as Blender finds them, shapes as trimesh does, and nothing but ModelError."""

import csv
import re
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest
import trimesh

from quick import quick
from viewsphere.assets.exporting.export import export_glb, export_obj
from viewsphere.assets.load import load_model
from viewsphere.assets.normalise import normalise
from viewsphere.assets.readers import readers
from viewsphere.errors import ModelError
from viewsphere.model.model_spec import ModelSpec

MODELS = Path(__file__).parents[3] / "shared" / "models"
FOLDERS = ("car", "chair", "bicycle", "boat", "hair_drier", "misc", "scene", "awkward")
READ_ALONE = {  # by a reader that needs no other package, nor Blender
    suffix
    for reader in readers().values()
    if not (reader.packages or reader.by_blender or reader.is_picture)
    for suffix in reader.suffixes
}
FILES = sorted(
    path.relative_to(MODELS).as_posix()
    for folder in FOLDERS
    for path in (MODELS / folder).rglob("*")
    if path.suffix[1:].lower() in READ_ALONE
)
LARGE = {"scene/street_assembled.glb", "awkward/1500_instances_unicode_names.glb"}
NO_NUMBERS = "awkward/number_formats.obj"  # not all of its words are numbers
TRIANGLES = {
    "awkward/degenerate_tris.obj": 16,  # Blender drops faces that name a vertex twice while reading
    "awkward/simple_skin.gltf": 8,  # Blender adds 80 triangles to show the bones
}
SIZES_DIFFER = {
    "awkward/degenerate_tris.obj",  # Blender counts vertices that no face uses
    "awkward/huge_coords_1e7.obj",  # Blender reads coordinates as float32
    "awkward/box_UTF16BE.obj",  # Blender reads nothing
    "awkward/simple_skin.gltf",
}
# trimesh repeats no instances here, or cannot read the file.
NO_ORACLE = {"awkward/box_UTF16BE.obj", "awkward/simple_skin.gltf", NO_NUMBERS}
# trimesh cuts every polygon as a fan, which folds over itself where the polygon is concave.
POLYGONS = {
    "awkward/concave_polygon.obj",
    "awkward/ngon_64_nonplanar.obj",
    "awkward/polygonfaces.obj",
    "awkward/space_in_material_name.obj",
    "bicycle/Bicycle.obj",
}

pytestmark = pytest.mark.skipif(not FILES, reason="the folder of real models is not there")


@pytest.fixture(scope="module")
def facts_of():
    with (MODELS / "ASSETS.csv").open(encoding="utf-8") as file:
        return {row["file"]: row for row in csv.DictReader(file)}


def areas(triangles):
    a, b, c = np.moveaxis(triangles.astype(np.float64), 1, 0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def moments(groups):
    """Area and area-weighted centroid of the triangles of each name."""
    found = {}
    for name, lists in groups.items():
        triangles = np.concatenate(lists)
        weights = areas(triangles)
        if weights.sum() > 0:
            found[name] = (weights.sum(), *(weights @ triangles.mean(axis=1) / weights.sum()))
    return found


def our_moments(mesh):
    groups = defaultdict(list)
    for index, material in enumerate(mesh.materials):
        groups[material.name].append(mesh.vertices[mesh.triangles[mesh.triangle_material == index]])
    return moments(groups)


def trimesh_moments(path, by_material):
    scene = trimesh.load_scene(path, process=False)
    groups = defaultdict(list)
    for node in scene.graph.nodes_geometry:
        matrix, geometry = scene.graph[node]
        mesh = scene.geometry[geometry]
        material = getattr(mesh.visual, "material", None)
        name = material.name if by_material else ""
        groups[name].append(mesh.triangles @ matrix[:3, :3].T + matrix[:3, 3])
    return moments(groups)


@pytest.mark.parametrize("name", quick(FILES, *(set(FILES) - LARGE)))
def test_counts_and_sizes(name, facts_of):
    if name == NO_NUMBERS:
        with pytest.raises(ModelError, match=r"number_formats.obj:11: expected 3 or more numbers behind 'v', found '3.1.e2'"):
            load_model(MODELS / name)
        return
    mesh, _ = load_model(MODELS / name)
    dropped = sum(int(m[1]) for w in mesh.warnings if (m := re.search(r"(\d+) triangles without area", w)))
    row = facts_of[name]
    expected = TRIANGLES.get(name) or int(row["triangles"] or row["trimesh"].split()[-1])
    assert len(mesh.triangles) + dropped == expected
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1, atol=1e-6)
    assert mesh.parts
    if row["bbox_size_after_import"] and name not in SIZES_DIFFER:
        size = sorted(float(x) for x in row["bbox_size_after_import"].split())
        np.testing.assert_allclose(sorted(mesh.bounds[1] - mesh.bounds[0]), size, atol=1e-3)


@pytest.mark.parametrize("name", quick([name for name in FILES if name not in NO_ORACLE | POLYGONS], *(set(FILES) - LARGE)))
def test_shape_agrees_with_trimesh(name):
    """Area and centroid by material for glTF and OBJ, where names survive; of the whole for the others."""
    mesh, facts = load_model(MODELS / name)
    by_material = facts.format in {"glb", "gltf", "obj"} and all(m.name not in {"", "default"} for m in mesh.materials)
    ours = our_moments(mesh)
    if not by_material:
        ours = moments({"": [mesh.vertices[mesh.triangles] + np.array(facts.origin)]})
    theirs = trimesh_moments(MODELS / name, by_material)
    assert ours.keys() == theirs.keys()
    scale = float(np.abs(mesh.bounds).max() + np.abs(facts.origin).max())
    for key, values in theirs.items():
        np.testing.assert_allclose(ours[key][0], values[0], rtol=1e-4)
        np.testing.assert_allclose(ours[key][1:], values[1:], atol=2e-5 * scale)


@pytest.mark.parametrize("name", sorted(POLYGONS & set(FILES)))
def test_polygons_keep_their_vector_area(name):
    """The sum of the triangles' normals does not depend on how polygons are cut; folds only add area."""

    def vectors(triangles):
        a, b, c = np.moveaxis(triangles.astype(np.float64), 1, 0)
        return np.cross(b - a, c - a) / 2

    mesh, _ = load_model(MODELS / name)
    ours = vectors(mesh.vertices[mesh.triangles])
    scene = trimesh.load_scene(MODELS / name, process=False)
    theirs = vectors(np.concatenate([g.triangles for g in scene.geometry.values()]))
    area = np.linalg.norm(ours, axis=1).sum()
    np.testing.assert_allclose(ours.sum(axis=0), theirs.sum(axis=0), atol=1e-4 * area)
    if "nonplanar" not in name:
        assert area < np.linalg.norm(theirs, axis=1).sum()
    if "concave" in name:  # one plane, nothing folded
        assert area == pytest.approx(np.linalg.norm(ours.sum(axis=0)), rel=1e-5)


@pytest.mark.parametrize(
    "name", ["car/NormalCar1.obj", "chair/ChairA.glb", "misc/fuze.obj", "awkward/nested40_negative_scale.glb"]
)
def test_exports_read_back(name, tmp_path):
    raw, facts = load_model(MODELS / name)
    mesh = normalise(raw, facts, ModelSpec(key="a", source=name, category="x", category_id=1, scale=1.8))
    triangles = mesh.vertices[mesh.triangles]
    assert np.ptp(mesh.bounds[:, 1]) == pytest.approx(1.8)
    scene = trimesh.load_scene(export_glb(mesh, tmp_path / "a.glb"), process=False)
    found = np.concatenate([g.triangles for g in scene.geometry.values()]).astype(np.float32)
    np.testing.assert_array_equal(found[..., [0, 2, 1]] * np.float32([1, -1, 1]), triangles)
    back, _ = load_model(export_obj(mesh, tmp_path, "a"))
    np.testing.assert_array_equal(back.vertices[back.triangles], triangles)
    assert len(back.materials) == len(mesh.materials)


@pytest.mark.parametrize("name", ["misc/BoxTextured.glb", "awkward/nested40_negative_scale.glb"])
def test_closed_models_are_wound_outwards(name, volume):
    mesh, _ = load_model(MODELS / name)
    assert volume(mesh) > 0


def test_alpha_modes():
    mesh, _ = load_model(MODELS / "awkward/AlphaBlendModeTest.glb")
    modes = {material.name: (material.alpha_mode, material.alpha_cutoff) for material in mesh.materials}
    assert {mode for mode, _ in modes.values()} == {"OPAQUE", "MASK", "BLEND"}
    cutoffs = {cutoff for mode, cutoff in modes.values() if mode == "MASK"}
    assert cutoffs == {0.25, 0.5, 0.75}


def test_specks_in_an_atlas_leave_a_chair_opaque():
    mesh, _ = load_model(MODELS / "chair" / "ChairA_dae" / "meshes" / "aws_ChairA_01_visual.DAE", confined=False)
    (material,) = mesh.materials
    assert mesh.images[material.base_color_texture.image].pixels[..., 3].min() < 250
    assert material.alpha_mode == "OPAQUE"
