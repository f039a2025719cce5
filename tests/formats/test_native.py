import json

import numpy as np
import pytest
from PIL import Image

from cube_dataset import MESHES, POSES, make
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.recipe.formats import FormatEntry
from viewsphere.run.exports.exporting import write

TOP = ["vehicles", "poses"]
VEHICLE = ["supercategory", "category", "model_file", "bbox3D_model", "real_size"]
POSE = ["distance", "elevation", "azimuth", "transformation_matrix", "vehicles_rendered"]
RENDERED = ["path_rgb", "path_mask", "path_depth", "render_resolution", "render_scale", "bbox_3D_pxs"]
FACES = {
    "ground": "0123", "top": "4765", "right": "2673", "front": "1562", "left": "0451", "back": "4037",
}  # fmt: skip


def export(dataset, folder):
    folder.mkdir(exist_ok=True)
    write(dataset, [(FormatEntry(name="native"), folder)])
    return json.loads((folder / "dataset1.json").read_text())


@pytest.fixture(scope="module", params=[False, True], ids=["one object", "three objects"])
def exported(request, tmp_path_factory):
    root = tmp_path_factory.mktemp("native")
    dataset = make(root / "out", request.param, ground=True)
    return dataset, root / "native", export(dataset, root / "native")


def assert_faces(faces):
    assert {name: "".join(face) for name, face in faces.items()} == FACES
    assert list(faces) == list(FACES)


def test_the_papers_keys(exported):
    dataset, _, value = exported
    assert list(value) == TOP
    assert list(value["vehicles"]) == [m.key for m in dataset.models]
    for vehicle in value["vehicles"].values():
        assert list(vehicle) == VEHICLE
        assert list(vehicle["real_size"]) == ["width", "height", "length"]
        assert_faces(vehicle["bbox3D_model"])
    assert list(value["poses"]) == [str(p.index) for p in POSES]
    for pose in value["poses"].values():
        assert set(POSE) <= set(pose)
        assert list(pose["transformation_matrix"]) == ["K", "RT"]
        assert np.shape(pose["transformation_matrix"]["K"]) == (3, 3)
        assert np.shape(pose["transformation_matrix"]["RT"]) == (3, 4)
        assert len(pose["vehicles_rendered"]) == 3
        for rendered in pose["vehicles_rendered"].values():
            assert list(rendered)[: len(RENDERED)] == RENDERED
            assert_faces(rendered["bbox_3D_pxs"])


def test_files_and_numbers_are_those_of_the_samples(exported):
    dataset, folder, value = exported
    checked = 0
    for sample in dataset:
        pose = value["poses"][str(sample.pose.index)]
        assert (pose["distance"], pose["elevation"], pose["azimuth"]) == (
            *(sample.pose.distance, sample.pose.elevation_deg, sample.pose.azimuth_deg),
        )
        assert pose["distance"] > 0
        motion = np.column_stack([sample.camera.R, sample.camera.t])
        for o in sample.objects:
            several = f"_{sample.index + 1}_{o.id}" if dataset.max_objects > 1 else ""
            rendered = pose["vehicles_rendered"][o.key + several]
            assert np.array_equal(rendered["transformation_matrix"]["RT"], motion)
            assert np.array_equal(rendered["transformation_matrix"]["K"], sample.camera.K)
            base = folder / pose["folder"]
            assert base == folder / f"Pose-{sample.pose.index}"
            assert np.array_equal(Image.open(base / "RGB" / rendered["path_rgb"]), sample.rgb)
            assert np.array_equal(Image.open(base / "MASK" / rendered["path_mask"]), sample.instances == o.id)
            assert np.array_equal(Image.open(base / "DEPTH" / rendered["path_depth"]), sample.depth)
            assert rendered["render_resolution"] == [96, 72]
            assert rendered["render_scale"] == 1
            for face in rendered["bbox_3D_pxs"].values():
                for vertex, point in face.items():
                    expected = o.box3d_pixels[int(vertex)]
                    assert np.isnan(expected).all() if point is None else np.array_equal(point, expected)
            assert rendered["id_model"] == o.key
            assert rendered["split"] == sample.split
            checked += 1
    assert checked == sum(len(p["vehicles_rendered"]) for p in value["poses"].values()) == 12
    assert len(list(folder.glob("Pose-*/MASK/*.png"))) == 12


def test_models_and_true_sizes(exported):
    _, folder, value = exported
    for key, vehicle in value["vehicles"].items():
        assert (folder / vehicle["model_file"]).is_file()
        box = {int(v): p for face in vehicle["bbox3D_model"].values() for v, p in face.items()}
        assert np.array_equal([box[i] for i in range(8)], MESHES[int(key[-1])].vertices)
    assert [(v["category"], v["supercategory"]) for v in value["vehicles"].values()] == [
        ("hair_drier", "appliance"), ("gizmo", ""), ("car", "vehicle"),
    ]  # fmt: skip
    assert value["vehicles"]["block-0"]["real_size"] == dict.fromkeys(("width", "height", "length"))
    assert value["vehicles"]["block-1"]["real_size"] == {"width": 0.1, "height": 0.2, "length": 0.3}


def test_behind_the_camera_is_null(tmp_path):
    value = export(make(tmp_path / "out", True), tmp_path / "native")
    points = [
        point
        for pose in value["poses"].values()
        for name, rendered in pose["vehicles_rendered"].items()
        for point in rendered["bbox_3D_pxs"]["top"].values()
        if name.startswith("block-2")  # 50 m along +Y: behind the cameras that look the other way
    ]
    assert None in points
    assert any(p is not None for p in points)


def test_fy_is_right_for_any_aspect(tmp_path):
    lens = Intrinsics(width=64, height=36, fx=70, fy=70, cx=32, cy=18)
    value = export(make(tmp_path / "out", intrinsics=lens, channels=("instances",)), tmp_path / "native")
    assert value["poses"]["0"]["transformation_matrix"]["K"] == [[70, 0, 32], [0, 70, 18], [0, 0, 1]]
    rendered = value["poses"]["0"]["vehicles_rendered"]["block-0"]
    assert (rendered["path_rgb"], rendered["path_depth"]) == (None, None)
    assert rendered["path_mask"] == "block-0-0000.png"


def test_a_half_finished_data_set(tmp_path):
    value = export(make(tmp_path / "out", leave_out=(0, 1)), tmp_path / "native")
    assert [list(p["vehicles_rendered"]) for p in value["poses"].values()] == [["block-2"]] * 4
    assert export(make(tmp_path / "none", leave_out=(0, 1, 2)), tmp_path / "native2")["poses"] == {}


def test_equal_bytes(exported, tmp_path):
    dataset, folder, _ = exported
    export(dataset, tmp_path / "again")
    names = sorted(p.relative_to(folder) for p in folder.rglob("*") if p.is_file())
    assert names == sorted(p.relative_to(tmp_path / "again") for p in (tmp_path / "again").rglob("*") if p.is_file())
    for name in names:
        assert (tmp_path / "again" / name).read_bytes() == (folder / name).read_bytes()


def test_large_data_sets_have_numbered_folders(exported, monkeypatch, tmp_path):
    dataset, _, _ = exported
    monkeypatch.setattr("viewsphere.formats.native.writing.FOLDER_SIZE", 2)
    value = export(dataset, tmp_path / "large")
    for folder in tmp_path.rglob("*"):
        assert not folder.is_dir() or folder.name == "large" or len(list(folder.iterdir())) <= 3
    for pose in value["poses"].values():
        for rendered in pose["vehicles_rendered"].values():
            assert (tmp_path / "large" / pose["folder"] / "RGB" / rendered["path_rgb"]).is_file()
            assert (tmp_path / "large" / pose["folder"] / "MASK" / rendered["path_mask"]).is_file()
