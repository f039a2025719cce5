"""The format `glb`, read by trimesh: every object's vertices are its model's, moved by its pose."""

import csv
import json
import struct

import numpy as np
import pytest
import trimesh

from cube_dataset import make
from small import small_recipe
from viewsphere import Dataset, generate
from viewsphere.assets.exported import read_exported
from viewsphere.check import check
from viewsphere.formats.glb import verify
from viewsphere.geometry.rotation import transform
from viewsphere.recipe.formats import FormatEntry
from viewsphere.run.exporting import write


def exported(dataset, folder):
    folder.mkdir()
    write(dataset, [(FormatEntry(name="glb"), folder)])
    with (folder / "frames.csv").open(newline="", encoding="utf-8") as file:
        return {int(row["frame"]): row["scene"] for row in csv.DictReader(file)}


def nodes_of(file):
    data = file.read_bytes()
    (size,) = struct.unpack_from("<I", data, 12)
    root = json.loads(data[20 : 20 + size])
    return [root["nodes"][i] for i in root["scenes"][0]["nodes"]]


def z_up(points):
    x, y, z = np.asarray(points).T
    return np.column_stack((x, -z, y))


def compare(dataset, sample, file):
    """A scene with the objects of a sample."""
    nodes, scene = nodes_of(file), trimesh.load_scene(file)
    assert [node["extras"]["id"] for node in nodes] == [o.id for o in sample.objects]
    models = {info.key: info for model in dataset.models for info in (model, *model.steps)}
    for node, o in zip(nodes, sample.objects, strict=True):
        assert node["extras"] == {
            "id": o.id, "category": o.category, "category_id": o.category_id, "supercategory": o.supercategory,
            "class": 31 + o.category_id, "model": o.key,
        }  # fmt: skip
        assert node["name"] == f"{o.id:03d} {o.category}"
        info = models[o.key]
        expected = transform(o.world_from_object, read_exported(dataset.path(info.glb), info.parts, info.node).vertices)
        found = []
        for name in scene.graph.transforms.children.get(node["name"], []):
            for own in [name, *scene.graph.transforms.children.get(name, [])]:
                pose, geometry = scene.graph.get(own)
                if geometry is not None:
                    found.append(trimesh.transform_points(scene.geometry[geometry].vertices, pose))
        found = np.unique(np.round(z_up(np.concatenate(found)), 5), axis=0)
        distance = np.abs(found[:, None] - np.unique(expected, axis=0)[None]).max(axis=2)
        assert distance.min(axis=0).max() < 2e-5 and distance.min(axis=1).max() < 2e-5


def test_several_objects(tmp_path):
    dataset = make(tmp_path / "out", several=True)
    scenes = exported(dataset, tmp_path / "glb")
    assert set(scenes.values()) == {"00000000.glb"} and set(scenes) == {sample.index for sample in dataset}
    compare(dataset, dataset[0], tmp_path / "glb" / "00000000.glb")
    assert list(verify(dataset, tmp_path / "glb", ())) == []


def test_each_model_is_a_scene_of_its_own(tmp_path):
    dataset = make(tmp_path / "out")
    scenes = exported(dataset, tmp_path / "glb")
    assert sorted(set(scenes.values())) == ["00000000.glb", "00000004.glb", "00000008.glb"]
    for sample in dataset:
        compare(dataset, sample, tmp_path / "glb" / scenes[sample.index])


def test_its_proof_notices_other_bytes_and_rows(tmp_path):
    dataset, folder = make(tmp_path / "out"), tmp_path / "glb"
    exported(dataset, folder)
    file, table = folder / "00000004.glb", folder / "frames.csv"
    whole, rows = file.read_bytes(), table.read_bytes()
    file.write_bytes(whole.replace(b'"category_id":2', b'"category_id":3'))
    assert [frame for frame, _ in verify(dataset, folder, ())] == [4]
    file.write_bytes(whole)
    table.write_bytes(rows.replace(b"5,00000004", b"5,00000008"))
    assert len(list(verify(dataset, folder, ()))) == 1
    table.write_bytes(rows)
    file.unlink()
    assert len(list(verify(dataset, folder, ()))) == 1


def test_models_of_the_zoo_turned_and_with_textures(tmp_path):
    recipe = small_recipe(
        channels=["rgb", "depth", "instances"],
        formats=["glb"],
        scenes={"count": 1, "objects": 3, "repeat": True},
        viewpoints={"azimuth": [30, 100], "elevation": 20, "distance": 2.0},
    )
    generate(recipe, tmp_path, workers=0)
    dataset = Dataset(tmp_path)
    names = {file.name for file in (tmp_path / "glb").glob("*.glb")}
    assert names == {"00000000.glb"}
    compare(dataset, dataset[0], tmp_path / "glb" / "00000000.glb")
    scene = trimesh.load_scene(tmp_path / "glb" / "00000000.glb")
    assert any(mesh.visual.material.baseColorFactor is not None for mesh in scene.geometry.values())
    assert check(dataset, rays=False).ok
    assert pytest.approx(0, abs=0.05) == z_up(scene.bounds)[0, 2]  # they stand on the ground
