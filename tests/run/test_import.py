"""Data sets made elsewhere, opened, joined with ours, exported again."""

import json

import numpy as np
import pytest
from PIL import Image

from small import small_recipe, tree_hash
from viewsphere import Dataset, generate
from viewsphere.check import check
from viewsphere.errors import StoreError, UserError
from viewsphere.planning.extension import extend
from viewsphere.planning.plan import plan
from viewsphere.run.datasets.importing import import_dataset
from viewsphere.run.datasets.merging import merge
from viewsphere.run.exports.exporting import export

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
    export(tmp_path / "out", [{"coco": {"category_ids": "coco"}}])
    was = json.loads((source / "annotations" / "instances_train.json").read_text())
    now = json.loads((tmp_path / "out" / "coco" / "annotations" / "instances_train.json").read_text())
    renewed = {"id", "image_id"}
    assert [{k: v for k, v in a.items() if k not in renewed} for a in was["annotations"]] == [
        {k: a[k] for k in b if k not in renewed} for a, b in zip(now["annotations"], was["annotations"], strict=True)
    ]
    assert {(c["id"], c["name"]) for c in now["categories"]} == {(17, "cat"), (3, "car")}
    by_old = {image["id"]: image for image in was["images"]}
    pictures = {new["id"]: old for new, old in zip(now["images"], by_old.values(), strict=True)}
    for image in now["images"]:
        assert (image["imported_file_name"], image["license"]) == (pictures[image["id"]]["file_name"], 3)
    for a, b in zip(now["annotations"], was["annotations"], strict=True):
        assert pictures[a["image_id"]]["id"] == b["image_id"]
    for image in now["images"]:
        copy = tmp_path / "out" / "coco" / "images" / "train" / image["file_name"]
        assert copy.read_bytes() == (source / "train" / pictures[image["id"]]["file_name"]).read_bytes()
    assert tree_hash(source) == before


def test_imported_objects_say_what_is_known_and_nan_for_the_rest(tmp_path):
    import_dataset("coco", coco(tmp_path / "real"), tmp_path / "out")
    first, empty, last = Dataset(tmp_path / "out")
    assert first.known_camera is None
    assert (first.width, first.height, first.rgb.shape) == (40, 30, (30, 40, 3))
    with pytest.raises(StoreError, match="frame 0: an imported picture has no camera"):
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


@pytest.mark.slow
def test_rendered_frames_join_a_real_data_set(tmp_path, small_run):
    import_dataset("coco", coco(tmp_path / "real"), tmp_path / "opened")
    with pytest.raises(UserError, match="expected the channels of"):
        merge([tmp_path / "opened", small_run], tmp_path / "joined")
    joined = merge([tmp_path / "opened", small_run], tmp_path / "joined", mixed=True)
    assert {c.id: c.name for c in joined.categories} == {3: "car", 17: "cat", 1: "post box"}
    assert len(joined) == 3 + len(Dataset(small_run))
    export(tmp_path / "joined", [{"coco": {"category_ids": "coco"}}, "native"])
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
    (("categories", 0, "id"), 2**31, r"category number 0: expected a whole number as id; found 2147483648"),
    (("annotations", 0, "image_id"), [7], r"annotation 50: expected the id of an image; found \[7\]"),
    (("annotations", 0, "category_id"), {}, r"annotation 50: expected the id of a category; found {}"),
    (("annotations", 0, "bbox"), [9, 9, -2, 3], r"annotation 50: expected bbox"),
    (("annotations", 0, "bbox"), [10**400, 9, 2, 3], r"annotation 50: expected bbox"),
    (("annotations", 0, "area"), "big", r"annotation 50: expected a number as area; found 'big'"),
    (("annotations", 0, "score"), float("nan"), r"annotation 50: expected finite numbers; found NaN"),
    (("images", 0, "file_name"), "a" * 5000, r"image 7: expected its file below the folder"),
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


def test_ids_of_twelve_digits_and_sizes_with_a_point_are_legal(tmp_path):
    """COCO's own crowds have ids like 900100448263."""

    def change(data):
        data["images"][0] |= {"id": 900100448263, "width": 40.0}
        for annotation in data["annotations"][:2]:
            annotation |= {"id": annotation["id"] + 900100000000, "image_id": 900100448263}

    import_dataset("coco", coco(tmp_path / "real", change), tmp_path / "out")
    assert [len(sample.objects) for sample in Dataset(tmp_path / "out")] == [2, 0, 1]


def test_a_tiny_polygon_without_a_box_goes_out_again(tmp_path):
    def change(data):
        data["annotations"] = [{"id": 1, "image_id": 7, "category_id": 3, "segmentation": [[5.1, 5, 5.3, 5, 5.3, 5.2]]}]

    import_dataset("coco", coco(tmp_path / "real", change), tmp_path / "out")
    export(tmp_path / "out", ["coco"])
    assert Dataset(tmp_path / "out")[0].objects[0].box2d == (5.1, 5, 5.3, 5.2)
    written = json.loads((tmp_path / "out" / "coco" / "annotations" / "instances_train.json").read_text())
    assert [a["segmentation"] for a in written["annotations"]] == [[[5.1, 5, 5.3, 5, 5.3, 5.2]]]


def test_sixteen_bits_of_grey_are_not_white(tmp_path):
    source = coco(tmp_path / "real", lambda data: data["images"][0].update(file_name="deep.png"))
    deep = np.arange(1200, dtype=np.uint16).reshape(30, 40) * 54
    Image.fromarray(deep).save(source / "train" / "deep.png")
    import_dataset("coco", source, tmp_path / "out")
    assert np.array_equal(Dataset(tmp_path / "out")[0].rgb, np.repeat((deep >> 8)[..., None], 3, axis=2))


def test_one_file_of_the_annotations_folder_finds_its_images(tmp_path):
    source = coco(tmp_path / "real") / "annotations" / "instances_train.json"
    assert import_dataset("coco", source, tmp_path / "out").count == 3


def test_what_was_left_out_and_mended_is_another_data_set(tmp_path):
    source = coco(tmp_path / "real")
    photo = source / "train" / "photo 12.jpg"
    photo.rename(tmp_path / "aside.jpg")
    assert import_dataset("coco", source, tmp_path / "out", keep_going=True).count == 2
    (tmp_path / "aside.jpg").rename(photo)
    with pytest.raises(StoreError, match="choose another output folder"):
        import_dataset("coco", source, tmp_path / "out")


def test_imported_categories_of_one_name_stay_two_when_others_are_added(tmp_path):
    def change(data):
        data["categories"][0]["name"] = "car"

    import_dataset("coco", coco(tmp_path / "real", change), tmp_path / "out")
    models = [{"source": "zoo:post_box", "category": name} for name in ("box", "car")]
    planned = plan(small_recipe(models=[models[0], {**models[1], "supercategory": "vehicle", "name": "a"}]))
    portion = extend(planned, Dataset(tmp_path / "out").plan)
    assert [(c.id, c.name) for c in portion.record.categories] == [(3, "car"), (17, "car"), (18, "box")]
    assert [spec.category_id for spec, _ in portion.models] == [18, 3]


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
    with pytest.raises(UserError, match=r"import: 'viper' is unknown\. Valid: bop, coco, .*, yolo"):
        import_dataset("viper", tmp_path, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_native_frame_without_its_mask_is_named(small_run, tmp_path):
    import shutil

    source = shutil.copytree(small_run / "native", tmp_path / "native")
    next((source / "Pose-2" / "MASK").iterdir()).unlink()
    with pytest.raises(StoreError, match=r"pose 2, post_box_00\d: expected a frame that can be read; found no .*MASK"):
        import_dataset("native", source, tmp_path / "out")
    foreign = import_dataset("native", source, tmp_path / "out", keep_going=True)
    assert (foreign.count, len(foreign.left_out)) == (11, 1)


def elsewhere(data):
    data["vehicles"]["../../../../evil"] = data["vehicles"].pop("post_box_000")


def entry(name, value):
    def change(data):
        next(iter(data["poses"]["2"]["vehicles_rendered"].values()))[name] = value

    return change


HOSTILE = [
    (elsewhere, r"expected vehicles by names that a folder can have; found '../../../../evil'"),
    (entry("split", "../../evil"), r"pose 2, .*found pose 2 of split '../../evil'"),
    (entry("path_rgb", "../../../secret.png"), r"pose 2, .*found .*secret.png"),
    (entry("path_mask", "../../../secret.png"), r"pose 2, .*found .*secret.png"),
    (entry("render_resolution", [9, 9]), r"pose 2, .*96 x 72 pixels, not 9 x 9"),
    (entry("visibility", "x"), r"pose 2, .*a finite number is expected"),
    (entry("bbox_3D_pxs", {"front": {"99": [1, 2]}}), r"pose 2, .*out of bounds"),
    (lambda data: data["poses"].update({"8": [1]}), r"pose 8: expected mappings of what was rendered"),
    (lambda data: data["poses"].update({"999999999999": data["poses"].pop("2")}), r"found pose 999999999999"),
    (lambda data: data["vehicles"]["post_box_000"].update(bbox3D_model=3), r"vehicle post_box_000: expected its bbox3D"),
]


@pytest.mark.parametrize(("change", "message"), HOSTILE)
def test_a_hostile_native_data_set_is_refused_before_anything_is_written(small_run, tmp_path, change, message):
    import os
    import shutil

    source = shutil.copytree(small_run / "native", tmp_path / "native", copy_function=os.link)
    Image.new("RGB", (96, 72)).save(tmp_path / "secret.png")
    data = json.loads((source / "dataset1.json").read_text())
    change(data)
    (source / "dataset1.json").unlink()
    (source / "dataset1.json").write_text(json.dumps(data))
    with pytest.raises(StoreError, match=message):
        import_dataset("native", source, tmp_path / "out")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["native", "secret.png"]


def test_a_native_data_set_keeps_the_lens_that_bends(tmp_path):
    bent = {"size": [96, 72], "fov_deg": 35, "distortion": {"model": "brown_conrady", "coefficients": [-0.2, 0.05, 0, 0]}}
    one = {"azimuth": 30, "elevation": 15, "distance": 1.0}
    generate(small_recipe(camera=bent, viewpoints=one, formats=["native"]), tmp_path / "bent")
    import_dataset("native", tmp_path / "bent" / "native", tmp_path / "out")
    assert Dataset(tmp_path / "out")[0].camera.intrinsics == Dataset(tmp_path / "bent")[0].camera.intrinsics


def test_the_recipe_can_be_appended_to_an_imported_set_only_by_merging(small_run, tmp_path):
    import_dataset("coco", coco(tmp_path / "real"), tmp_path / "out")
    before = tree_hash(tmp_path / "out")
    with pytest.raises(StoreError, match="choose another output folder"):
        generate(small_recipe(), tmp_path / "out")
    assert tree_hash(tmp_path / "out") == before
