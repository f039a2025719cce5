"""The format `gltf`, read by trimesh: every object's vertices are its model's, moved by its pose."""

import csv
import json
import struct

import numpy as np
import pytest
import trimesh

from cube_dataset import FEW, LENS, make
from proven import close
from quick import quick
from small import small_recipe
from truth_scenes import LENSES
from viewsphere import Dataset, generate
from viewsphere.assets.exporting.exported import read_exported
from viewsphere.check import check
from viewsphere.formats.gltf import FORMAT
from viewsphere.geometry.camera import project
from viewsphere.geometry.rotation import transform
from viewsphere.recipe.formats import FormatEntry
from viewsphere.run.exports.exporting import write


def exported(dataset, folder):
    folder.mkdir()
    write(dataset, [(FormatEntry(name="gltf"), folder)])
    with (folder / "frames.csv").open(newline="", encoding="utf-8") as file:
        return {int(row["frame"]): row["scene"] for row in csv.DictReader(file)}


def root_of(file):
    data = file.read_bytes()
    (size,) = struct.unpack_from("<I", data, 12)
    return json.loads(data[20 : 20 + size])


def nodes_of(file):
    """The nodes of objects."""
    root = root_of(file)
    nodes = (root["nodes"][i] for i in root["scenes"][0]["nodes"])
    return [node for node in nodes if "camera" not in node]


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
    dataset = make(tmp_path / "out", several=True, channels=FEW)
    scenes = exported(dataset, tmp_path / "gltf")
    assert set(scenes.values()) == {"00000000.glb"} and set(scenes) == {sample.index for sample in dataset}
    compare(dataset, dataset[0], tmp_path / "gltf" / "00000000.glb")
    assert list(FORMAT.verify(dataset, tmp_path / "gltf", ())) == []


def test_each_model_is_a_scene_of_its_own(tmp_path):
    dataset = make(tmp_path / "out", channels=FEW)
    scenes = exported(dataset, tmp_path / "gltf")
    assert sorted(set(scenes.values())) == ["00000000.glb", "00000004.glb", "00000008.glb"]
    for sample in dataset:
        compare(dataset, sample, tmp_path / "gltf" / scenes[sample.index])


def test_its_proof_notices_other_bytes_and_rows(tmp_path):
    dataset, folder = make(tmp_path / "out", channels=FEW), tmp_path / "gltf"
    exported(dataset, folder)
    file, table = folder / "00000004.glb", folder / "frames.csv"
    whole, rows = file.read_bytes(), table.read_bytes()
    file.write_bytes(whole.replace(b'"category_id":2', b'"category_id":3'))
    assert [frame for frame, _ in FORMAT.verify(dataset, folder, ())] == [4]
    file.write_bytes(whole)
    table.write_bytes(rows.replace(b"5,00000004", b"5,00000008"))
    assert len(list(FORMAT.verify(dataset, folder, ()))) == 1
    table.write_bytes(rows)
    file.unlink()
    assert len(list(FORMAT.verify(dataset, folder, ()))) == 1


def test_models_of_the_zoo_turned_and_with_textures(tmp_path):
    recipe = small_recipe(
        channels=["rgb", "depth", "instances"],
        formats=["gltf"],
        scenes={"count": 1, "objects": 3, "repeat": True},
        viewpoints={"azimuth": [30, 100], "elevation": 20, "distance": 2.0},
    )
    generate(recipe, tmp_path, workers=0)
    dataset = Dataset(tmp_path)
    names = {file.name for file in (tmp_path / "gltf").glob("*.glb")}
    assert names == {"00000000.glb"}
    compare(dataset, dataset[0], tmp_path / "gltf" / "00000000.glb")
    scene = trimesh.load_scene(tmp_path / "gltf" / "00000000.glb")
    assert any(mesh.visual.material.baseColorFactor is not None for mesh in scene.geometry.values())
    assert check(dataset, rays=False).ok
    assert pytest.approx(0, abs=0.05) == z_up(scene.bounds)[0, 2]  # they stand on the ground


def seen_by(root, node, points):
    """Where a viewer that has the pictures' size shows world points."""
    lens = root["cameras"][node["camera"]]["perspective"]
    view = np.linalg.inv(np.reshape(node["matrix"], (4, 4)).T)
    x, y, z = points.T
    inside = np.column_stack((x, z, -y)) @ view[:3, :3].T + view[:3, 3]
    tall = np.tan(lens["yfov"] / 2)
    clip = inside[:, :2] / -inside[:, 2:] / (tall * lens["aspectRatio"], tall)
    return (clip * (1, -1) + 1) / 2 * (node["extras"]["width"], node["extras"]["height"])


@pytest.mark.parametrize("world", quick(["stills", "poses", "videos", "drives"], "stills"))
def test_cameras_see_what_pictures_show(world, request, tmp_path):
    dataset = request.getfixturevalue(world)
    scenes = exported(dataset, tmp_path / "gltf")
    seen = 0
    for name in set(scenes.values()):
        root = root_of(tmp_path / "gltf" / name)
        scene = trimesh.load_scene(tmp_path / "gltf" / name)  # one camera is the scene's, the others are nodes
        assert scene.camera.fov[1] == pytest.approx(np.degrees(root["cameras"][0]["perspective"]["yfov"]))
        for node in (node for node in root["nodes"] if "camera" in node):
            sample = dataset[node["extras"]["frame"]]
            assert scenes[sample.index] == name and node["name"] == f"{sample.index:08d} {sample.sensor}"
            assert np.array_equal(node["extras"]["K"], sample.camera.K) and node["extras"]["distortion"] is None
            points = sample.point_cloud("world").points[::97]
            expected = project(sample.camera.intrinsics, points @ sample.camera.R.T + sample.camera.t)[0]
            close("gltf", "own reader: cameras", seen_by(root, node, points), expected, "px", atol=1e-9)
            named = node["name"] in scene.graph.nodes
            read = scene.graph.get(node["name"])[0] if named else scene.camera_transform
            close("gltf", "trimesh: cameras", read.T.ravel(), node["matrix"], "m", atol=1e-12)
            seen += 1
    assert seen == sum(sample.sensor != "top" for sample in dataset)


def test_lenses_are_told(tmp_path):
    bent = LENS.model_copy(update={"distortion": LENSES["barrel"], "cx": 40.0, "fy": 90.0})
    exported(make(tmp_path / "out", several=True, intrinsics=bent, channels=FEW), tmp_path / "gltf")
    root = root_of(tmp_path / "gltf" / "00000000.glb")
    (lens,) = root["cameras"]
    assert lens["perspective"]["aspectRatio"] == pytest.approx((96 / 80) / (72 / 90))
    assert lens["perspective"]["yfov"] == pytest.approx(2 * np.arctan(36 / 90))
    for node in (node for node in root["nodes"] if "camera" in node):
        assert node["extras"]["K"][0][2] == 40
        assert node["extras"]["distortion"] == {"model": "brown_conrady", "coefficients": list(LENSES["barrel"].coefficients)}
