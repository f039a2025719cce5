"""Data sets made elsewhere, opened, joined with ours, exported again."""

import json

import numpy as np
import pytest
from PIL import Image

from small import small_recipe, tree_hash
from viewsphere import Dataset, generate
from viewsphere.check import check
from viewsphere.errors import StoreError, UserError
from viewsphere.run.generate import export
from viewsphere.run.importing import import_dataset
from viewsphere.run.merging import merge

SIZE = (40, 30)


def coco(folder, change=None):
    """A data set as people have them: JPEG, gaps in the ids, a crowd, a box without a mask, an image without objects."""
    rng = np.random.default_rng(4)
    (folder / "annotations").mkdir(parents=True)
    (folder / "train").mkdir()
    images = [{"id": i, "file_name": f"photo {i}.jpg", "width": 40, "height": 30, "license": 3} for i in (7, 12, 139)]
    for image in images:
        Image.fromarray(rng.integers(0, 255, (30, 40, 3), np.uint8)).save(folder / "train" / image["file_name"])
    square, crowd = [[2.5, 3.0, 12.5, 3.0, 12.5, 13.0, 2.5, 13.0]], {"size": [30, 40], "counts": [600, 60, 540]}
    data = {
        "images": images,
        "categories": [{"id": 17, "name": "cat"}, {"id": 3, "name": "car", "supercategory": "vehicle"}],
        "annotations": [
            {
                "id": 50,
                "image_id": 7,
                "category_id": 17,
                "iscrowd": 0,
                "area": 100.0,
                "bbox": [2.5, 3, 10, 10],
                "segmentation": square,
            },
            {
                "id": 51,
                "image_id": 7,
                "category_id": 3,
                "iscrowd": 1,
                "area": 60,
                "bbox": [20, 0, 2, 30],
                "segmentation": crowd,
            },
            {"id": 900, "image_id": 139, "category_id": 3, "bbox": [1, 1, 5, 6], "keypoints": [1, 2, 2]},
        ],
    }
    if change:
        change(data)
    (folder / "annotations" / "instances_train.json").write_text(json.dumps(data))
    return folder


def test_a_coco_data_set_comes_in_and_goes_out_as_it_was(tmp_path):
    source = coco(tmp_path / "real")
    before = tree_hash(source)
    import_dataset("coco", source, tmp_path / "out")
    export(tmp_path / "out", ["coco"])
    was = json.loads((source / "annotations" / "instances_train.json").read_text())
    now = json.loads((tmp_path / "out" / "coco" / "annotations" / "instances_train.json").read_text())
    renewed = {"id", "image_id"}
    assert [{k: v for k, v in a.items() if k not in renewed} for a in was["annotations"]] == [
        {k: a[k] for k in b if k not in renewed} for a, b in zip(now["annotations"], was["annotations"], strict=True)
    ]
    assert {(c["id"], c["name"]) for c in now["categories"]} == {(17, "cat"), (3, "car")}
    by_old = {image["id"]: image for image in was["images"]}
    pictures = {new["id"]: old for new, old in zip(now["images"], by_old.values(), strict=True)}
    for a, b in zip(now["annotations"], was["annotations"], strict=True):
        assert pictures[a["image_id"]]["id"] == b["image_id"]
    for image in now["images"]:
        copy = tmp_path / "out" / "coco" / "train" / image["file_name"]
        assert copy.read_bytes() == (source / "train" / pictures[image["id"]]["file_name"]).read_bytes()
    assert tree_hash(source) == before


def test_imported_objects_say_what_is_known_and_nan_for_the_rest(tmp_path):
    import_dataset("coco", coco(tmp_path / "real"), tmp_path / "out")
    first, empty, last = Dataset(tmp_path / "out")
    assert first.known_camera is None
    assert (first.width, first.height, first.rgb.shape) == (40, 30, (30, 40, 3))
    with pytest.raises(StoreError, match="frame 0: expected a camera, found an imported picture"):
        _ = first.camera
    cat, crowd = first.objects
    assert cat.mask[3:13, 3:12].all()
    assert cat.mask.sum() in range(90, 111)
    assert crowd.mask[:, 20:22].all()
    assert crowd.mask.sum() == 60
    assert (cat.category, cat.is_placed, np.isnan(cat.box3d).all(), np.isnan(cat.visibility)) == ("cat", False, True, True)
    assert empty.objects == ()
    assert (last.objects[0].box2d, last.objects[0].mask.any()) == ((1, 1, 6, 7), False)
    report = check(Dataset(tmp_path / "out"))
    assert report.ok, report.findings


def test_rendered_frames_join_a_real_data_set(tmp_path, small_run):
    import_dataset("coco", coco(tmp_path / "real"), tmp_path / "opened")
    with pytest.raises(UserError, match="expected the channels of"):
        merge([tmp_path / "opened", small_run], tmp_path / "joined")
    joined = merge([tmp_path / "opened", small_run], tmp_path / "joined", mixed=True)
    assert {c.id: c.name for c in joined.categories} == {3: "car", 17: "cat", 1: "hair drier"}
    assert len(joined) == 3 + len(Dataset(small_run))
    export(tmp_path / "joined", ["coco", "native"])
    report = check(Dataset(tmp_path / "joined"))
    assert report.ok, report.findings
    written = json.loads((tmp_path / "joined" / "coco" / "annotations" / "instances_train.json").read_text())
    assert {c["id"] for c in written["categories"]} == {3, 17, 1}


def test_a_native_data_set_comes_in_and_goes_out_byte_for_byte(small_run, tmp_path):
    import_dataset("native", small_run / "native", tmp_path / "out")
    export(tmp_path / "out", ["native", "coco"])
    assert tree_hash(tmp_path / "out" / "native") == tree_hash(small_run / "native")
    report = check(Dataset(tmp_path / "out"))
    assert report.ok, report.findings
    known = {(s.objects[0].key, s.pose.index): s for s in Dataset(small_run)}
    assert len(known) == len(Dataset(tmp_path / "out"))
    for new in Dataset(tmp_path / "out"):
        old = known[new.objects[0].key, new.pose.index]
        assert np.array_equal(new.camera.P, old.camera.P)
        assert np.array_equal(new.depth, old.depth)
        assert new.objects[0].rle == old.objects[0].rle


def test_importing_again_finds_it_done(tmp_path):
    source = coco(tmp_path / "real")
    import_dataset("coco", source, tmp_path / "out")
    before = tree_hash(tmp_path / "out")
    import_dataset("coco", source, tmp_path / "out")
    assert tree_hash(tmp_path / "out") == before


def damage(path, value):
    def change(data):
        *steps, last = path
        for step in steps:
            data = data[step]
        data[last] = value

    return change


BROKEN = [
    (("annotations", 0, "image_id"), 8, r"annotation 50: expected the id of an image; found 8"),
    (("annotations", 1, "category_id"), 4, r"annotation 51: expected the id of a category; found 4"),
    (("annotations", 1, "id"), 50, r"annotation 50: expected every id once; found it again"),
    (("annotations", 0, "id"), None, r"annotation number 0: expected a whole number as id; found None"),
    (("images", 1, "id"), 7, r"image 7: expected every id once; found it again"),
    (("images", 0, "file_name"), "lost.jpg", r"image 7: expected its file below the folder; found no 'lost.jpg'"),
    (("images", 0, "file_name"), "../../outside.jpg", r"image 7: expected its file below the folder"),
    (("images", 0, "width"), 41, r"image 7: expected photo 7.jpg of 41 x 30 pixels; found 40 x 30"),
    (("annotations", 0, "bbox"), [1, 2, 3], r"annotation 50: expected bbox \[x, y, width, height\]; found \[1, 2, 3\]"),
    (("annotations", 0, "segmentation"), [[1, 2]], r"annotation 50: expected a segmentation of COCO"),
    (("annotations", 0, "segmentation"), [[1e9, 2, 3, 4, 5, 6]], r"annotation 50: expected a segmentation of COCO"),
    (("annotations", 1, "segmentation", "counts"), [5], r"annotation 51: expected a segmentation of COCO"),
    (("annotations", 1, "segmentation", "counts"), [-600, 60, 1740], r"annotation 51: expected a segmentation of COCO"),
    (("annotations", 1, "segmentation", "counts"), "zzzz", r"annotation 51: expected a segmentation of COCO"),
    (("annotations", 1, "segmentation"), 3, r"annotation 51: expected a segmentation of COCO"),
    (("categories", 0, "name"), None, r"category 17: expected a name; found none"),
]


@pytest.mark.parametrize(("path", "value", "message"), BROKEN)
def test_what_is_broken_is_named_and_can_be_left_out(tmp_path, path, value, message):
    source = coco(tmp_path / "real", damage(path, value))
    with pytest.raises(StoreError, match=message):
        import_dataset("coco", source, tmp_path / "out")
    assert not (tmp_path / "out").exists()
    foreign = import_dataset("coco", source, tmp_path / "out", keep_going=True)
    assert foreign.left_out
    report = check(Dataset(tmp_path / "out"))
    assert report.ok, report.findings


def test_what_is_no_data_set_says_so(tmp_path):
    with pytest.raises(
        StoreError, match=r"expected a COCO data set \(annotations/instances_<split>.json\); found no such file"
    ):
        import_dataset("coco", tmp_path, tmp_path / "out")
    (tmp_path / "x.json").write_text("{")
    with pytest.raises(StoreError, match=r"x.json: expected COCO's JSON; found"):
        import_dataset("coco", tmp_path, tmp_path / "out")
    (tmp_path / "x.json").write_text("[1]")
    with pytest.raises(StoreError, match=r"x.json: expected lists of images, annotations and categories"):
        import_dataset("coco", tmp_path, tmp_path / "out")
    with pytest.raises(StoreError, match=r"dataset1.json: expected the native format's JSON"):
        import_dataset("native", tmp_path, tmp_path / "out")
    with pytest.raises(UserError, match=r"import: expected one of coco, native; found 'kitti'"):
        import_dataset("kitti", tmp_path, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_native_frame_without_its_mask_is_named(small_run, tmp_path):
    import shutil

    source = shutil.copytree(small_run / "native", tmp_path / "native")
    next((source / "Pose-2" / "MASK").iterdir()).unlink()
    with pytest.raises(StoreError, match=r"pose 2, hair_drier_00\d: expected a frame that can be read; found no .*MASK"):
        import_dataset("native", source, tmp_path / "out")
    foreign = import_dataset("native", source, tmp_path / "out", keep_going=True)
    assert (foreign.count, len(foreign.left_out)) == (11, 1)


def test_the_recipe_can_be_appended_to_an_imported_set_only_by_merging(small_run, tmp_path):
    import_dataset("coco", coco(tmp_path / "real"), tmp_path / "out")
    before = tree_hash(tmp_path / "out")
    with pytest.raises(StoreError, match="choose another output folder"):
        generate(small_recipe(), tmp_path / "out")
    assert tree_hash(tmp_path / "out") == before
