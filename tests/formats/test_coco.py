import contextlib
import io
import json

import numpy as np
import pytest
from PIL import Image
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

from cube_dataset import MESHES, make
from viewsphere.errors import UserError
from viewsphere.formats.coco import FORMAT
from viewsphere.formats.coco.categories import CATEGORY_IDS, Options, _official_ids, category_ids
from viewsphere.geometry.mask import encode_rle
from viewsphere.recipe.formats import FormatEntry
from viewsphere.run.exports.exporting import write
from viewsphere.store import Category

COCOS_OWN = {"category_ids": "coco"}


@pytest.fixture(scope="module", params=[False, True], ids=["one object", "three objects"])
def exported(request, tmp_path_factory):
    root = tmp_path_factory.mktemp("coco")
    dataset = make(root / "out", request.param)
    (root / "coco").mkdir()
    write(dataset, [(FormatEntry(name="coco", options=COCOS_OWN), root / "coco")])
    return dataset, root / "coco"


def load(folder, split):
    with contextlib.redirect_stdout(io.StringIO()):
        return COCO(folder / "annotations" / f"instances_{split}.json")


def average_precision(truth, detections, kind):
    with contextlib.redirect_stdout(io.StringIO()):
        evaluation = COCOeval(truth, truth.loadRes(detections), kind)
        evaluation.evaluate()
        evaluation.accumulate()
        evaluation.summarize()
    return evaluation.stats


def test_the_80_categories_of_coco():
    ids = CATEGORY_IDS
    assert len(ids) == len(set(ids.values())) == 80
    assert sorted(set(range(1, 91)) - set(ids.values())) == [12, 26, 29, 30, 45, 66, 68, 69, 71, 83]
    known = {"person": 1, "bicycle": 2, "car": 3, "boat": 9, "traffic light": 10, "bench": 15, "giraffe": 25}
    known |= {"bottle": 44, "wine glass": 46, "chair": 62, "dining table": 67, "toilet": 70, "tv": 72}
    known |= {"refrigerator": 82, "book": 84, "hair drier": 89, "toothbrush": 90}
    assert {name: ids[name] for name in known} == known


@pytest.mark.parametrize("name", ["hair drier", "hair_drier", "Hair-Drier", "hairdrier", "hairdryer", "hair dryer"])
def test_categories_keep_coco_ids_however_spelled(name):
    categories = (Category(1, "gizmo", ""), Category(2, name, ""), Category(3, "hair drier", ""))
    assert _official_ids(categories) == {1: 91, 2: 89, 3: 93}


def test_the_zoos_furniture_has_cocos_ids():
    names = ("sofa", "bed", "television", "refrigerator")
    categories = [Category(i, name, "") for i, name in enumerate(names, 1)]
    assert list(_official_ids(categories).values()) == [63, 65, 72, 82]


def test_detections_rebuilt_from_the_stored_maps_score_one(exported):
    dataset, folder = exported
    for split in dataset.splits:
        truth, detections = load(folder, split), []
        ids = category_ids(dataset, Options(**COCOS_OWN))
        for sample in dataset:
            if sample.split != split:
                continue
            for o in sample.objects:
                mask = sample.instances == o.id
                if mask.any():
                    rows, columns = np.nonzero(mask)
                    box = [columns.min(), rows.min(), np.ptp(columns) + 1, np.ptp(rows) + 1]
                    code = {"size": list(mask.shape), "counts": encode_rle(mask)}
                    detections.append(
                        {
                            "image_id": sample.index + 1,
                            "category_id": ids[o.category_id],
                            "score": 0.9,
                            "segmentation": code,
                            "bbox": [int(b) for b in box],
                        }
                    )
        for kind in ("segm", "bbox"):
            assert average_precision(truth, detections, kind)[0] == pytest.approx(1, abs=1e-12)


def test_annotations_are_the_masks(exported):
    dataset, folder = exported
    annotations = {}
    for split in dataset.splits:
        truth = load(folder, split)
        assert set(annotations).isdisjoint(truth.anns)
        annotations |= {i: (truth, a, split) for i, a in truth.anns.items()}
    expected = {s.index * dataset.max_objects + o.id: (s, o) for s in dataset for o in s.objects if o.area}
    assert set(annotations) == set(expected)
    assert min(annotations) == 1
    for number, (truth, annotation, split) in annotations.items():
        sample, o = expected[number]
        mask = truth.annToMask(annotation).astype(bool)
        np.testing.assert_array_equal(mask, sample.instances == o.id)
        picture = np.array(Image.open(folder / "images" / split / annotation["path_mask"]))
        np.testing.assert_array_equal(picture, mask)
        assert annotation["area"] == mask.sum()
        x, y, w, h = annotation["bbox"]
        assert (x, y, x + w, y + h) == o.box2d
        assert annotation["image_id"] == sample.index + 1


def test_images_carry_the_papers_keys(exported):
    dataset, folder = exported
    samples = {s.index + 1: s for s in dataset}
    for split in dataset.splits:
        truth = load(folder, split)
        for number, image in truth.imgs.items():
            sample = samples.pop(number)
            assert sample.split == split
            np.testing.assert_array_equal(np.array(Image.open(folder / "images" / split / image["file_name"])), sample.rgb)
            pose = sample.pose
            assert (image["distance"], image["elevation"], image["azimuth"], image["tilt"], image["id_pose"]) == (
                *(pose.distance, pose.elevation_deg, pose.azimuth_deg, pose.tilt_deg, pose.index),
            )
            assert image["distance"] > 0
            assert (image["width"], image["height"]) == (96, 72)
            assert image["render_resolution"] == [96, 72]
            assert image["render_scale"] == 1
            assert image["pose_category"] == pose.category
            matrices = image["transformation_matrix"]
            assert np.array_equal(matrices["K"], sample.camera.K)
            assert np.array_equal(matrices["P"], sample.camera.P)
            np.testing.assert_allclose(np.array(matrices["K"]) @ matrices["RT"], sample.camera.P, atol=1e-12)
            keys = [o.key for o in sample.objects]
            assert image["id_model"] == (keys[0] if len(keys) == 1 else keys)
    assert not samples


def test_3d_boxes_in_pixels_are_faces_of_numbered_vertices(exported):
    dataset, folder = exported
    truth = load(folder, "train")
    annotation = truth.anns[1]
    assert list(annotation["bbox_3D_pxs"]) == ["ground", "top", "right", "front", "left", "back"]
    pixels = dataset[0].objects[0].box3d_pixels
    for face in annotation["bbox_3D_pxs"].values():
        for vertex, point in face.items():
            assert np.array_equal(point, pixels[int(vertex)])


def test_models_and_categories(exported):
    _, folder = exported
    value = json.loads((folder / "annotations" / "instances_val.json").read_text())
    assert list(value) == ["info", "licenses", "categories", "models", "images", "annotations"]
    assert [(c["id"], c["name"], c["supercategory"]) for c in value["categories"]] == [
        (89, "hair_drier", "appliance"), (92, "gizmo", ""), (3, "car", "vehicle"),
    ]  # fmt: skip
    assert list(value["models"]) == ["block-0", "block-1", "block-2"]
    for key, model in value["models"].items():
        vertices = [
            [float(c) for c in line.split()[1:4]]
            for line in (folder / model["model_file"]).read_text().splitlines()
            if line.startswith("v ")
        ]
        box = {int(v): p for face in model["bbox3D_model"].values() for v, p in face.items()}
        assert np.array_equal([box[i] for i in range(8)], MESHES[int(key[-1])].vertices)
        np.testing.assert_allclose(np.ptp(vertices, axis=0), np.ptp(MESHES[int(key[-1])].vertices, axis=0))
    assert value["models"]["block-0"]["real_size"] == {"width": None, "height": None, "length": None}
    assert value["models"]["block-1"]["real_size"] == {"width": 0.1, "height": 0.2, "length": 0.3}


def test_ids_do_not_depend_on_what_is_finished(tmp_path):
    for name, left_out in (("whole", ()), ("part", (0,))):
        (tmp_path / name).mkdir()
        write(make(tmp_path / f"{name}-store", leave_out=left_out), [(FormatEntry(name="coco"), tmp_path / name)])
    whole, part = load(tmp_path / "whole", "train"), load(tmp_path / "part", "train")
    assert sorted(part.imgs) == sorted(whole.imgs)[4:]
    for number, annotation in part.anns.items():
        assert annotation == whole.anns[number]


def test_equal_bytes(exported, tmp_path):
    dataset, folder = exported
    write(dataset, [(FormatEntry(name="coco", options=COCOS_OWN), tmp_path)])
    names = sorted(p.relative_to(folder) for p in folder.rglob("*") if p.is_file())
    assert names == sorted(p.relative_to(tmp_path) for p in tmp_path.rglob("*") if p.is_file())
    for name in names:
        assert (tmp_path / name).read_bytes() == (folder / name).read_bytes()


def test_large_data_sets_have_numbered_folders(exported, monkeypatch, tmp_path):
    dataset, _ = exported
    monkeypatch.setattr("viewsphere.formats.coco.writing.FOLDER_SIZE", 3)
    write(dataset, [(FormatEntry(name="coco"), tmp_path)])
    for folder in [
        p for s in dataset.splits for p in [tmp_path / "images" / s, *(tmp_path / "images" / s).rglob("*")] if p.is_dir()
    ]:
        assert sum(p.is_file() for p in folder.iterdir()) <= 3
    for split in dataset.splits:
        truth = load(tmp_path, split)
        assert all((tmp_path / "images" / split / i["file_name"]).is_file() for i in truth.imgs.values())
        assert all((tmp_path / "images" / split / a["path_mask"]).is_file() for a in truth.anns.values())


def test_a_data_set_without_pictures_is_refused(tmp_path):
    with pytest.raises(UserError, match="expected channel rgb"):
        write(make(tmp_path / "out", channels=("instances",)), [(FormatEntry(name="coco"), tmp_path)])


def test_categories_count_from_one_without_gaps_unless_cocos_own_are_asked_for(exported, tmp_path):
    """Trainings that make a classifier of so many outputs fail at ids like 89 and 92."""
    dataset, folder = exported
    write(dataset, [(FormatEntry(name="coco"), tmp_path)])
    for split in dataset.splits:
        ours, cocos = load(tmp_path, split), load(folder, split)
        assert [ours.cats[i]["name"] for i in (1, 2, 3)] == [c.name for c in dataset.categories]
        assert ours.imgs == cocos.imgs and ours.anns.keys() == cocos.anns.keys()
        for number, annotation in ours.anns.items():
            other = cocos.anns[number]
            assert ours.cats[annotation["category_id"]]["name"] == cocos.cats[other["category_id"]]["name"]
            assert {**annotation, "category_id": 0} == {**other, "category_id": 0}


def test_the_papers_tree_has_the_same_files_a_folder_higher(exported, tmp_path):
    dataset, folder = exported
    write(dataset, [(FormatEntry(name="coco", options={**COCOS_OWN, "pictures": "splits"}), tmp_path)])
    for split in dataset.splits:
        for one, other in ((tmp_path / split, folder / "images" / split), (tmp_path / "annotations",) * 2):
            names = sorted(p.relative_to(one) for p in one.rglob("*") if p.is_file())
            assert names == sorted(p.relative_to(other) for p in other.rglob("*") if p.is_file()) != []
        name = f"annotations/instances_{split}.json"
        assert (tmp_path / name).read_bytes() == (folder / name).read_bytes()


@pytest.mark.slow
def test_captions_are_coco_s(tmp_path):
    """pycocotools reads them by the ids of the images; without them there is no such file, and a changed one is found."""
    dataset, folder = make(tmp_path / "out", True, annotations=("captions",)), tmp_path / "coco"
    folder.mkdir()
    write(dataset, [(FormatEntry(name="coco"), folder)])
    told = {sample.index + 1: [one.text for one in sample.captions] for sample in dataset}
    for split in dataset.splits:
        file = folder / "annotations" / f"captions_{split}.json"
        with contextlib.redirect_stdout(io.StringIO()):
            coco = COCO(file)
        assert {i: [one["caption"] for one in coco.imgToAnns[i]] for i in coco.imgs} == {i: told.pop(i) for i in coco.imgs}
        assert coco.dataset["images"] == load(folder, split).dataset["images"]
    assert not told
    assert not list(FORMAT.verify(dataset, folder, range(4), Options()))
    file.write_text(file.read_text().replace("picture", "image", 1).replace("be seen", "be heard", 1))
    assert list(FORMAT.verify(dataset, folder, range(4), Options()))


def test_without_captions_there_is_no_file_of_them(exported):
    assert not list(exported[1].glob("annotations/captions_*"))
