"""BOP's data sets are imported with their poses, masks and depth, and exported again as they were."""

from __future__ import annotations

import json
import shutil

import cv2
import numpy as np
import pytest
from scipy.spatial import cKDTree

from proven import close, equal
from viewsphere import Dataset
from viewsphere.check import check
from viewsphere.errors import StoreError, UserError
from viewsphere.formats.bop import read
from viewsphere.run.datasets.importing import import_dataset
from viewsphere.run.exports.exporting import export

JSON = ("scene_camera.json", "scene_gt.json", "scene_gt_info.json", "scene_gt_coco.json")


@pytest.fixture(scope="module")
def exported(stills, tmp_path_factory):
    place = tmp_path_factory.mktemp("bop")
    export(stills.root, "bop", output=place)
    return place / "bop"


@pytest.fixture
def tree(exported, tmp_path):
    return shutil.copytree(exported, tmp_path / "bop")


@pytest.fixture(scope="module")
def imported(exported, tmp_path_factory):
    out = tmp_path_factory.mktemp("imported") / "out"
    import_dataset("bop", exported, out)
    return Dataset(out)


@pytest.mark.slow
def test_poses_masks_and_depth_come_in(stills, imported):
    pairs = {(s.split, s.source["im_id"]): s for s in imported}
    assert len(imported) == len(stills) and imported.splits == ("test", "train", "val")
    assert {c.name for c in imported.categories} <= {c.name for c in stills.categories}
    for own in stills:
        sample = pairs[own.split, own.index]
        equal("bop", "import: colours", sample.rgb, own.rgb)
        close("bop", "import: K", sample.camera.K, own.camera.K, "px", atol=1e-12)
        close("bop", "import: cameras", sample.camera.t, own.camera.t, "m", atol=1e-12)
        seen = np.isfinite(own.depth) & (own.depth < 65.53)
        close("bop", "import: depth", sample.depth[seen], own.depth[seen], "m", atol=5.1e-4)
        assert np.isinf(sample.depth[~np.isfinite(own.depth)]).all()
        for o, other in zip(sample.objects, own.objects, strict=True):
            close("bop", "import: poses", o.camera_from_object, other.camera_from_object, "m", atol=1e-12)
            close("bop", "import: poses in the world", o.world_from_object, other.world_from_object, "m", atol=1e-9)
            close("bop", "import: quaternions", o.quaternion, other.quaternion, atol=1e-9)
            equal("bop", "import: visible masks", o.mask, other.mask)
            assert o.amodal == other.amodal and o.box2d_amodal == other.box2d_amodal
            assert (o.category, o.key, o.area, o.box2d) == (other.category, other.key, other.area, other.box2d)
            close("bop", "import: visibility", o.visibility, other.visibility, atol=1e-15)
            close("bop", "import: truncation", o.truncation, other.truncation, atol=1e-12)


@pytest.mark.slow
def test_it_goes_out_as_it_came(exported, imported, tmp_path):
    assert check(imported).ok
    export(imported.root, "bop", output=tmp_path)
    for scene in exported.glob("*/0*"):
        for name in JSON:
            (again,) = (tmp_path / "bop" / scene.parent.name).glob(f"*/{name}")
            one, other = json.loads((scene / name).read_text()), json.loads(again.read_text())
            if name == "scene_gt_coco.json":
                images = {image["file_name"]: i for i, image in enumerate(one["images"])}
                assert len(images) == len(other["images"])
                continue
            for before, after in zip(one.values(), other.values(), strict=True):
                same(before, after)
        for kind in ("mask", "mask_visib", "depth"):
            files = sorted((scene / kind).iterdir())
            others = sorted((again.parent / kind).iterdir())
            for before, after in zip(files, others, strict=True):
                a, b = (cv2.imread(str(file), cv2.IMREAD_UNCHANGED) for file in (before, after))
                equal("bop", f"import and export: {kind}", b, a)


def same(before, after):
    if isinstance(before, dict):
        assert before.keys() == after.keys()
        for name in before:
            same(before[name], after[name])
    elif isinstance(before, list) and before and isinstance(before[0], dict):
        for one, other in zip(before, after, strict=True):
            same(one, other)
    else:
        close("bop", "import and export: numbers", after, before, atol=1e-9)


def spoil(tree, name, change):
    file = tree / "train" / "000000" / name
    said = json.loads(file.read_text())
    change(said)
    file.write_text(json.dumps(said))


@pytest.mark.slow
def test_of_others_less_is_known(tree, tmp_path):
    """What real data sets lack: names, masks, depth, infos, poses of cameras."""
    shutil.rmtree(tree / "test"), shutil.rmtree(tree / "val")
    (tree / "dataset_info.json").unlink()
    for name in ("mask", "depth"):
        shutil.rmtree(tree / "train" / "000000" / name)
    (tree / "train" / "000000" / "scene_gt_info.json").unlink()
    spoil(tree, "scene_camera.json", lambda said: [one.pop(f"cam_{what}_w2c") for one in said.values() for what in "Rt"])
    import_dataset("bop", tree, tmp_path / "out")
    dataset = Dataset(tmp_path / "out")
    assert dataset.plan.channels == ("rgb",) and {c.name for c in dataset.categories} <= {f"obj_{i:06d}" for i in range(9)}
    o = dataset[0].objects[0]
    np.testing.assert_array_equal(o.world_from_object, o.camera_from_object)
    assert np.isnan(o.visibility) and o.area and "amodal" not in o.extra
    with pytest.raises(UserError, match=r"format bop: expected amodal of all pictures; .*, and expected depth of all pictures"):
        export(dataset.root, "bop", output=tmp_path / "again")
    assert not (tmp_path / "again" / "bop").exists()


@pytest.mark.parametrize(
    ("name", "change", "problem"),
    [
        ("scene_camera.json", lambda said: said["0"].pop("cam_K"), "image 0: .*found no 'cam_K'"),
        pytest.param(
            "scene_camera.json",
            lambda said: said.update({"77": said["0"]}),
            "image 77: .*found no picture",
            marks=pytest.mark.slow,
        ),
        ("scene_gt.json", lambda said: said["1"][0].update(cam_R_m2c=[1] * 9), "image 1: .*rotation"),
        pytest.param(
            "scene_gt.json", lambda said: said["1"][0].update(obj_id="x"), "image 1: .*found obj_id 'x'", marks=pytest.mark.slow
        ),
        pytest.param(
            "scene_camera.json",
            lambda said: said["1"].update(depth_scale=-1),
            "image 1: .*found depth_scale -1",
            marks=pytest.mark.slow,
        ),
        ("scene_camera.json", lambda said: said.update({"9" * 5000: said["0"]}), "image 9+: .*found"),
        ("scene_gt.json", lambda said: said.update({"1": 5}), "image 1: .*found|image 1: .*int"),
        ("scene_gt_info.json", lambda said: said["1"][0].update(px_count_all=float("inf")), "image 1: .*infinity"),
        pytest.param(
            "scene_gt.json",
            lambda said: said["1"][0].pop("cam_t_m2c"),
            "image 1: .*found no 'cam_t_m2c'",
            marks=pytest.mark.slow,
        ),
        ("scene_gt_info.json", lambda said: said["1"][0].update(visib_fract=2), "image 1: .*where counts, a share and boxes"),
    ],
)
def test_broken_entries_are_told_and_left_out(tree, name, change, problem):
    whole = read(tree).count
    spoil(tree, name, change)
    with pytest.raises(StoreError, match=problem):
        read(tree)
    found = read(tree, keep_going=True)
    added = "77" in problem or "9+" in problem
    assert len(found.left_out) == 1 and found.count == whole - (not added)


def test_broken_files_are_told(tree, tmp_path):
    with pytest.raises(StoreError, match=r"expected a BOP data set .*; found no such file"):
        read(tmp_path)
    mask = tree / "train" / "000000" / "mask_visib" / "000000_000000.png"
    mask.write_bytes(b"no picture")
    with pytest.raises(StoreError, match="expected a mask; found"):
        list(read(tree).frames())
    cv2.imwrite(str(mask), np.zeros((3, 4), np.uint8))
    with pytest.raises(StoreError, match="expected 160 x 120 pixels; found"):
        list(read(tree).frames())
    cv2.imwrite(str(tree / "test" / "000000" / "depth" / "000006.png"), np.zeros((3, 4), np.uint16))
    with pytest.raises(StoreError, match=r"000006.png: expected 160 x 120 pixels; found 4 x 3"):
        list(read(tree).frames())
    (tree / "train" / "000000" / "scene_gt.json").write_text("{")
    with pytest.raises(StoreError, match="expected BOP's JSON; found"):
        read(tree)


@pytest.mark.slow
def test_models_come_in_and_go_out(stills, exported, imported, tmp_path):
    known = {model.key: model for model in stills.models}
    assert [model.key for model in imported.models] == list(known)
    for model in imported.models:
        own = known[model.key]
        close("bop", "import: models' boxes", model.box3d_object, own.box3d_object, "m", atol=1e-6)
        assert (model.category, model.triangles) == (own.category, own.triangles)
        assert (model.symmetries is None) == (own.symmetries is None)
        vertices, wanted = imported.mesh(model.key).vertices, stills.mesh(model.key).vertices
        assert len(vertices) <= len(wanted)
        gaps, _ = cKDTree(wanted).query(vertices)
        close("bop", "import: models' vertices", gaps, 0, "m", atol=1e-6)
    pairs = {(s.split, s.source["im_id"]): s for s in imported}
    for own in stills:
        for o, other in zip(pairs[own.split, own.index].objects, own.objects, strict=True):
            for name in ("box3d_object", "box3d", "box3d_camera", "size"):
                close("bop", f"import: {name}", getattr(o, name), getattr(other, name), "m", atol=2e-6)
            assert np.isnan(o.view.azimuth_deg)
    export(imported.root, "bop", output=tmp_path)
    before, after = (json.loads((at / "models/models_info.json").read_text()) for at in (exported, tmp_path / "bop"))
    same_within(before, after, 2e-3)
    assert (
        json.loads((exported / "dataset_info.json").read_text())["objects"]
        == json.loads((tmp_path / "bop/dataset_info.json").read_text())["objects"]
    )


def same_within(before, after, atol):
    if isinstance(before, dict):
        assert before.keys() == after.keys()
        for name in before:
            same_within(before[name], after[name], atol)
    else:
        np.testing.assert_allclose(np.array(after, float), np.array(before, float), atol=atol)


@pytest.mark.slow
def test_models_that_cannot_be_read_are_told_and_left_out(tree, tmp_path):
    (tree / "models/obj_000001.ply").write_bytes(b"ply\nformat ascii 1.0\nelement vertex 3\n")
    with pytest.raises(StoreError, match=r"obj_000001.ply: expected a model; found: .*") as error:
        import_dataset("bop", tree, tmp_path / "out")
    assert "\n" not in str(error.value).rpartition("\nmend them")[0] and not (tmp_path / "out").exists()
    foreign = import_dataset("bop", tree, tmp_path / "out", keep_going=True)
    assert len(foreign.left_out) == 1 and foreign.count == len(Dataset(tmp_path / "out"))
    assert check(Dataset(tmp_path / "out")).ok
