"""Data sets joined: everything renumbered, nothing lost, the sources untouched."""

import json

import numpy as np
import pytest
from PIL import Image

from small import small_recipe, tree_hash
from viewsphere import Dataset, generate
from viewsphere.check import check
from viewsphere.errors import StoreError, UserError
from viewsphere.formats.coco.categories import Options, category_ids
from viewsphere.run.datasets.merging import merge
from viewsphere.run.exports.exporting import export
from viewsphere.store.index import numbers

COCOS_OWN = Options(category_ids="coco")


def recipe(**changes):
    channels = ["rgb", "depth", "instances", "categories", "semantic", "panoptic"]
    return small_recipe(**{"channels": channels, "formats": ["coco"], **changes})


BIN = {"source": "zoo:wheelie_bin", "category": "bin", "scale": {"length": 0.2}}


@pytest.fixture(scope="module")
def sources(tmp_path_factory):
    """Two data sets: post boxes; and a bin before a post box, which is one of the first, by its key."""
    folder = tmp_path_factory.mktemp("sources")
    generate(recipe(name="first"), folder / "a")
    boxes = {"source": "zoo:post_box", "category": "post box", "count": 1, "scale": {"length": 0.18}}
    generate(recipe(name="second", seed=5, models=[BIN, boxes]), folder / "b")
    return folder / "a", folder / "b"


@pytest.fixture(scope="module")
def merged(sources, tmp_path_factory):
    before = [tree_hash(s / "store") for s in sources]
    out = tmp_path_factory.mktemp("merged") / "c"
    merge(sources, out)
    assert [tree_hash(s / "store") for s in sources] == before
    export(out, ["coco", "native"])
    return out


def test_every_frame_is_there_once_with_its_pixels_and_numbers(sources, merged):
    joined = Dataset(merged)
    old = [sample for source in sources for sample in Dataset(source)]
    assert len(joined) == len(old) == joined.plan.frames
    for i, (new, was) in enumerate(zip(joined, old, strict=True)):
        assert (new.index, new.split) == (i, was.split)
        assert np.array_equal(new.rgb, was.rgb)
        assert np.array_equal(new.depth, was.depth)
        assert np.array_equal(new.camera.P, was.camera.P)
        for a, b in zip(new.objects, was.objects, strict=True):
            assert (a.category, a.rle, a.box2d, a.visibility) == (b.category, b.rle, b.box2d, b.visibility)
            assert np.array_equal(a.box3d_pixels, b.box3d_pixels)
            assert joined.path(a.model).is_file()
            assert joined.path(a.model).read_bytes() == (sources[i >= len(Dataset(sources[0]))] / b.model).read_bytes()


def test_categories_are_one_by_name_and_the_pixels_say_so(merged):
    joined = Dataset(merged)
    ids = {c.name: c.id for c in joined.categories}
    assert ids == {"post box": 1, "bin": 2}
    for sample in joined:
        by_id = np.array([0, *(ids[o.category] for o in sample.objects)])
        assert np.array_equal(sample.categories, by_id[sample.instances])
        things = sample.instances > 0
        assert np.array_equal(sample.semantic[things], 31 + sample.categories[things])
        assert (sample.semantic[~things] <= 2).all()
        assert np.array_equal(sample.panoptic, sample.semantic << 16 | sample.instances)


def test_models_of_one_key_and_other_content_are_two(sources, merged):
    keys = [info.key for info in Dataset(merged).models]
    assert keys == ["post_box_000", "post_box_001", "wheelie_bin_000", "post_box_000-2"]
    digests = [info.digest for info in Dataset(merged).models]
    assert len(set(digests)) == 4


@pytest.mark.slow
def test_a_merged_data_set_passes_every_proof(merged):
    report = check(Dataset(merged))
    assert report.ok, report.findings
    assert report.checked["coco"] == report.checked["native"] == len(Dataset(merged))


def test_pose_and_annotation_numbers_stay_unique(merged):
    joined = Dataset(merged)
    poses = {}
    for sample in joined:
        for o in sample.objects:
            assert (o.key, sample.pose.index) not in poses
            poses[o.key, sample.pose.index] = sample
    ids = [a["id"] for f in (merged / "coco" / "annotations").glob("*.json") for a in json.loads(f.read_text())["annotations"]]
    assert len(ids) == len(set(ids)) > 0


def test_the_same_model_is_kept_once(sources, tmp_path):
    generate(recipe(name="other poses", viewpoints={"azimuth": 30, "elevation": 15, "distance": 1.0}), tmp_path / "d")
    joined = merge([sources[0], tmp_path / "d"], tmp_path / "e")
    assert [info.key for info in joined.models] == ["post_box_000", "post_box_001"]
    assert joined.plan.poses == 7


@pytest.mark.slow
def test_merging_again_finds_it_done_and_a_merge_can_be_merged(sources, merged, tmp_path):
    before = tree_hash(merged / "store")
    merge(sources, merged)
    assert tree_hash(merged / "store") == before
    with pytest.raises(StoreError, match="choose another output folder"):
        merge(sources[::-1], merged)
    twice = merge([merged, sources[0]], tmp_path / "twice")
    assert len(twice) == len(Dataset(merged)) + len(Dataset(sources[0]))
    report = check(twice)
    assert report.ok, report.findings


BAD = [
    ({"camera": {"size": [96, 72], "fov_deg": 36}}, r"expected the camera of .*, 96x72 fx .*; found 96x72 fx .*--mixed"),
    ({"channels": ["rgb", "instances"]}, r"expected the channels of .*, rgb, .*; found rgb, instances: .*--mixed"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("change", "message"), BAD)
def test_other_cameras_and_channels_are_refused_unless_asked_for(sources, tmp_path, change, message):
    generate(recipe(**change), tmp_path / "d")
    with pytest.raises(UserError, match=message):
        merge([sources[0], tmp_path / "d"], tmp_path / "e")
    assert not (tmp_path / "e").exists()
    joined = merge([sources[0], tmp_path / "d"], tmp_path / "e", mixed=True)
    assert [set(s.files) for s in joined] == [set(s.files) for d in (sources[0], tmp_path / "d") for s in Dataset(d)]
    report = check(joined)
    assert report.ok, report.findings


def test_what_cannot_be_merged_says_so_and_changes_nothing(sources, tmp_path):
    with pytest.raises(UserError, match="expected two data sets or more; found 1"):
        merge([sources[0]], tmp_path / "e")
    with pytest.raises(UserError, match="expected every data set once"):
        merge([sources[0], sources[0]], tmp_path / "e")
    with pytest.raises(UserError, match="expected a new folder for the merged data set; found one of its sources"):
        merge(sources, sources[0])
    with pytest.raises(StoreError, match="expected a data set"):
        merge([sources[0], tmp_path], tmp_path / "e")
    assert not (tmp_path / "e").exists()


def test_an_unfinished_data_set_is_refused_unless_asked_for(sources, small_dataset, tmp_path):
    import shutil

    first = next(small_dataset.plan.rows).key
    shutil.rmtree(small_dataset.store.shot_folder(first))
    with pytest.raises(StoreError, match=r"expected 12 frames, found 10: render it to the end, or .*--keep-going"):
        merge([sources[0], small_dataset.root], tmp_path / "e", mixed=True)
    joined = merge([sources[0], small_dataset.root], tmp_path / "e", mixed=True, keep_going=True)
    assert len(joined) == joined.plan.frames == 22
    assert [s.index for s in joined] == list(range(22))
    known = [
        (key, pose) for block in joined.plan.parts[1].blocks for key in block.subjects for pose in numbers(block.positions)
    ]
    assert known == [(s.objects[0].key, s.pose.index) for s in joined][12:]
    assert joined.plan.parts[1].digest == ""  # else its recipe would take it for whole
    assert category_ids(joined, COCOS_OWN) == category_ids(small_dataset, COCOS_OWN) != {1: 1}


def test_channels_that_were_not_added_to_the_end_are_an_unfinished_data_set(sources, tmp_path):
    import shutil

    one = {"azimuth": 30, "elevation": 15, "distance": 1.0}
    generate(recipe(viewpoints=one), tmp_path / "a")
    more = ["rgb", "depth", "instances", "categories", "normals"]
    generate(recipe(viewpoints=one, channels=more), tmp_path / "a", append=True)
    grown = Dataset(tmp_path / "a")
    shutil.rmtree(grown.store.shot_folder(next(row for index, _ in grown.plan.supplements for row in index).key))
    with pytest.raises(StoreError, match=r"expected all channels, found 1 frame that lack those that were added last"):
        merge([sources[0], tmp_path / "a"], tmp_path / "e", mixed=True)
    assert not (tmp_path / "e").exists()


@pytest.mark.slow
def test_one_model_in_two_categories_is_two_models(sources, tmp_path):
    letter_box = {"source": "zoo:post_box", "category": "letter box", "count": 1, "scale": {"length": 0.18}}
    viewpoints = {"azimuth": 30, "elevation": 15, "distance": 1.0}
    generate(recipe(name="other category", models=[letter_box], viewpoints=viewpoints), tmp_path / "d")
    generate(recipe(name="capitals", models=[{**letter_box, "category": "Post Box"}], viewpoints=viewpoints), tmp_path / "f")
    joined = merge([sources[0], tmp_path / "d", tmp_path / "f"], tmp_path / "e")
    assert [(info.key, info.category) for info in joined.models] == [
        ("post_box_000", "post box"),
        ("post_box_001", "post box"),
        ("post_box_000-2", "letter box"),
    ]
    assert [o.category for s in joined for o in s.objects][12:] == ["letter box", "post box"]
    report = check(joined)
    assert report.ok, report.findings


@pytest.mark.slow
def test_scenery_goes_along(tmp_path):
    """Both have a plane of one name, of different heights; rays are cast at the right one."""
    Image.new("RGB", (8, 8), (200, 0, 0)).save(tmp_path / "red.png")
    one = {"azimuth": 30, "elevation": 15, "distance": 1.0}
    for name, height in (("a", 0.3), ("b", 0.6)):
        planes = [{"image": str(tmp_path / "red.png"), "height": height, "at": [0, 0.5, 0]}]
        generate(recipe(name=name, viewpoints=one, scene={"ground": True, "planes": planes}), tmp_path / name)
    report = check(merge([tmp_path / "a", tmp_path / "b"], tmp_path / "e"))
    assert report.ok, report.findings
    assert report.checked["surface"] == 4
    assert "surface" not in report.not_run


@pytest.mark.slow
def test_names_that_sentences_tell_are_not_respelled(tmp_path):
    for name, spelled in (("a", "bin"), ("b", "Bin")):
        generate(
            recipe(name=name, models=[{**BIN, "category": spelled}], annotations=["captions"], formats=[]), tmp_path / name
        )
    with pytest.raises(UserError, match=r"expected category 'bin', spelled as in a data set before it, .*; found 'Bin'"):
        merge([tmp_path / "a", tmp_path / "b"], tmp_path / "out")
    assert not (tmp_path / "out").exists()
