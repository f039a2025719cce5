import json
import shutil
from pathlib import Path

import numpy as np
import pytest

import viewsphere.check
from cube_dataset import FEW, LENS, make
from json_leaves import leaves
from quick import quick
from sealing import seal_again
from small import small_recipe
from viewsphere import generate
from viewsphere.check import check
from viewsphere.check.digests import damaged
from viewsphere.check.frames.comparing import FRAME_PROOFS
from viewsphere.errors import MissingExtraError
from viewsphere.formats import native
from viewsphere.geometry.lenses import lens_parameters
from viewsphere.geometry.mask import decode_rle, encode_rle
from viewsphere.labels import Randomness, ShotAppearance, channel_labels, channels, labels, labels_of, object_labels, on_request
from viewsphere.labels.shared.spec import no_record
from viewsphere.model.fields.files import Files
from viewsphere.run.exports.exporting import export
from viewsphere.store import Dataset, encode
from viewsphere.store.shots.checksums import write_checksums
from viewsphere.store.shots.manifest import MANIFEST


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return make(tmp_path_factory.mktemp("check") / "out", ground=True)


@pytest.fixture
def dataset(whole, tmp_path):
    """A copy, free to be spoilt."""
    return Dataset(shutil.copytree(whole.root, tmp_path / "out"))


@pytest.fixture(scope="module")
def whole_records(tmp_path_factory):
    return make(tmp_path_factory.mktemp("check") / "out", ground=True, short=False)


@pytest.fixture(scope="module")
def few_channels(tmp_path_factory):
    """Whole records, and beside them only what they are proved by."""
    return make(tmp_path_factory.mktemp("check") / "out", ground=True, short=False, channels=FEW)


@pytest.fixture
def spelled(few_channels, tmp_path):
    """A copy whose records say everything, as those of data sets that were merged do; so it has no shots."""
    return Dataset(shutil.copytree(few_channels.root, tmp_path / "spelled"))


def failures(dataset, **options):
    """What is found besides digests, which are made to fit."""
    seal_again(dataset.root)
    report = check(Dataset(dataset.root), **options)  # afresh: an open one keeps what it has read
    assert report.ok == (not report.findings)
    return {(f.check, f.frame) for f in report.findings}


def edit_record(dataset, frame, change):
    """Change the record of a frame; all shots have four frames."""
    file = dataset.store.shot_folder(f"block-{frame // 4}-000000") / "frames.json"
    records = json.loads(file.read_text())
    change(records[frame % 4])
    file.write_text(json.dumps(records))


def edit_json(file, change):
    value = json.loads(file.read_text())
    change(value)
    file.write_text(json.dumps(value))


def edit_channel(dataset, frame, name, change):
    sample = dataset[frame]
    array = np.array(sample.channels[name])
    change(array)
    dataset.path(sample.files[name]).write_bytes(encode(channels()[name], array))


def test_a_whole_data_set_passes(whole):
    report = check(whole)
    assert report.ok, report.findings
    assert report.notes == ()
    assert report.not_run == dict.fromkeys(["plan", "recipe", "sources"], "made by viewsphere 1")
    held = f"{len(report.checked)} proofs hold, 3 not run: plan, recipe, sources (made by viewsphere 1)"
    assert report.verdict == f"{held}; 0 of 12 frames painted again"
    names = ["store", "files", "ids", "camera", "shot", *PLAIN, "surface"]
    assert report.checked.pop("digests") > 12 * len(whole.plan.channels)
    assert report.checked.pop("models") == 3
    assert report.checked == dict.fromkeys(names, 12)
    assert json.loads(json.dumps(report.to_json()))["ok"] is True


STILL = [name for name, label in channel_labels().items() if not label.needs and label.components]
ROWS = [name for name, label in channel_labels().items() if not label.needs and not label.components]
"""Labels of a still picture that are pixels, or rows of a number of their own."""
PLAIN = [name for name, label in labels().items() if not label.needs and name not in (*on_request(), *ROWS)]
LIFTED = ["nocs", "position"]
"""Labels that are proved by depth, where that is exact, and by object coordinates."""

LENSES = {
    "brown_conrady": lens_parameters("brown_conrady", coefficients=(-0.2, 0.05, 0.001, 0.0, 0.0)),
    "fisheye": lens_parameters("fisheye", coefficients=(0.02, 0.05, 0.001, 0.0)),
}


@pytest.mark.parametrize("lens", quick(LENSES, "fisheye"))
def test_bent_pictures_pass(tmp_path, lens):
    report = check(make(tmp_path, intrinsics=LENS.model_copy(update={"distortion": LENSES[lens]})))
    assert report.ok, report.findings


def test_several_objects_pass(tmp_path):
    report = check(make(tmp_path, several=True))
    assert report.ok, report.findings
    assert report.notes == ()


@pytest.mark.slow
def test_every_export_that_is_there_is_proved_by_its_format(dataset):
    assert "coco" not in check(dataset, rays=False).checked
    export(dataset.root, ["coco", "native"])
    report = check(Dataset(dataset.root), rays=False)
    assert report.ok, report.findings
    assert (report.checked["coco"], report.checked["native"]) == (12, 12)
    (dataset.root / "coco" / "images" / "train" / "000000000003.png").unlink()
    (dataset.root / "native" / "more.txt").touch()
    assert failures(dataset, rays=False) == {("coco", 2), ("native", None)}
    part = check(Dataset(dataset.root), rays=False, frames=6)
    assert part.ok and part.not_run["coco"] == "needs all frames"
    assert "6 of 12 frames read" in part.verdict


@pytest.mark.slow
def test_a_format_without_a_proof_is_not_run(dataset):
    (dataset.root / "blend").mkdir()
    (dataset.root / "blend" / "a.blend").write_text("scene")
    write_checksums(dataset.root / "blend")
    report = check(dataset, rays=False)
    assert report.ok and report.not_run["blend"] == "the format has no proof, only digests were compared"
    (dataset.root / "blend" / "a.blend").write_text("scena")
    assert [finding.check for finding in check(dataset, rays=False).findings] == ["blend"]


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (IndexError("7"), "expected an export that can be checked, found IndexError: 7"),
        (RuntimeError("no luck"), "the check itself failed: RuntimeError: no luck"),
    ],
)
def test_an_export_s_proof_that_breaks_off(dataset, monkeypatch, error, message):
    def broken(*_):
        raise error

    (dataset.root / "native").mkdir()
    write_checksums(dataset.root / "native")
    monkeypatch.setattr(native, "FORMAT", native.FORMAT.model_copy(update={"verify": broken}))
    assert [(f.check, f.message) for f in check(dataset, rays=False).findings] == [("native", message)]


def test_pictures_alone_pass_without_the_proof_of_surfaces(tmp_path):
    report = check(make(tmp_path, channels=("rgb",)))
    assert report.ok, report.findings
    assert report.not_run["surface"] == "needs the channels instances and depth, or depth_ray"


@pytest.mark.slow
def test_rays_are_cast_on_the_frames_asked_for(whole, monkeypatch):
    assert check(whole, sample=3).checked["surface"] == 3
    assert "surface" not in check(whole, rays=False).checked
    monkeypatch.setattr("viewsphere.check.frames.rays.find_spec", lambda name: None)
    report = check(whole)
    assert report.not_run["surface"] == "install viewsphere[check]"
    assert "surface (install viewsphere[check])" in report.verdict
    with pytest.raises(MissingExtraError, match=r"viewsphere\[check\]"):
        check(whole, rays=True)


def test_a_missing_and_a_broken_file(dataset):
    dataset.path(dataset[5].files["normals"]).unlink()
    broken = dataset.path(dataset[6].files["normals"])
    broken.write_bytes(broken.read_bytes()[:-20])
    assert failures(dataset) == {("files", 5), ("files", 6)}


def test_a_file_of_another_size(dataset):
    file = dataset.path(dataset[5].files["depth"])
    file.write_bytes(encode(channels()["depth"], np.ones((9, 9), np.float32)))
    assert ("files", 5) in failures(dataset, rays=False)


def test_a_broken_record(dataset):
    (dataset.store.shot_folder("block-1-000000") / "frames.json").write_text("[{}")
    assert {("files", i) for i in range(4, 8)} <= failures(dataset)


def test_a_missing_shot_and_model(dataset):
    shutil.rmtree(dataset.store.shot_folder("block-2-000000"))
    dataset.path("store/models/block-1/block-1.glb").unlink()
    report = check(Dataset(dataset.root), rays=False)
    messages = [f.message for f in report.findings if f.check == "counts"]
    assert "expected 12 frames (3 models x 4 poses), found 8" in messages[0]
    assert "block-1.glb" in messages[1]


@pytest.mark.slow
def test_what_was_left_out_on_purpose_is_a_note(tmp_path):
    dataset = make(tmp_path, leave_out=(2,))
    assert failures(dataset) == {("counts", None)}
    (dataset.store.folder / "skipped.json").write_text(json.dumps({"block-2-000000": "no triangles"}))
    report = check(Dataset(dataset.root))
    assert report.ok
    assert "block-2-000000 was left out: no triangles" in report.notes


def test_a_record_of_another_frame(dataset):
    edit_record(dataset, 6, lambda r: r.update(index=3))
    assert ("files", 6) in failures(dataset)


def test_an_unknown_id_in_the_map(dataset):
    edit_channel(dataset, 2, "instances", lambda a: a.__setitem__((0, 0), 9))
    assert ("instances", 2) in failures(dataset, sample=0)


@pytest.mark.slow
def test_a_wrong_category(dataset):
    edit_channel(dataset, 2, "categories", lambda a: a.__setitem__(dataset[2].instances > 0, 3))
    assert failures(dataset) == failures(dataset, sample=0) == {("categories", 2)}


def test_a_pixel_more_in_the_map(dataset):
    edit_channel(dataset, 9, "instances", lambda a: a.__setitem__((0, 0), 1))
    edit_channel(dataset, 9, "categories", lambda a: a.__setitem__((0, 0), 3))
    assert ("mask", 9) in failures(dataset, sample=0)


def with_a_hole(record):
    """Its mask without a row, its area right."""
    o = record["objects"][0]
    counts = o["mask"] if "mask" in o else o["rle"]["counts"]
    mask = decode_rle(72, 96, counts)
    mask[mask.any(axis=1).argmax()] = False
    if "mask" in o:
        o["mask"] = encode_rle(mask)
    else:
        o["rle"]["counts"], o["area"] = encode_rle(mask), int(mask.sum())
    return mask


def test_wrong_run_lengths(dataset, spelled):
    for some in (dataset, spelled):
        edit_record(some, 1, with_a_hole)
        assert ("mask", 1) in failures(some, sample=0)
    assert ("box2d", 1) in failures(spelled, sample=0)


def test_a_hole_that_is_cut_consistently(dataset):
    holes = []
    edit_record(dataset, 1, lambda r: holes.append(with_a_hole(r)))
    hole = (dataset[1].instances > 0) & ~holes[0]
    shown = [name for name in STILL if name != "body_parts"]  # which these models do not have
    for name in shown:
        edit_channel(dataset, 1, name, lambda a, empty=channels()[name].empty: a.__setitem__(hole, empty))
    found = failures(dataset)
    assert {(name, 1) for name in (*shown, "mask", "box2d")} == found


@pytest.mark.slow
def test_run_lengths_that_are_none(dataset, spelled):
    for frame, counts in enumerate(("?!", "", "o"), 1):
        edit_record(dataset, frame, lambda r, counts=counts: r["objects"][0].update(mask=counts))
        edit_record(spelled, frame, lambda r, counts=counts: r["objects"][0]["rle"].update(counts=counts))
    for some in (dataset, spelled):
        assert {("mask", 1), ("mask", 2), ("mask", 3)} <= failures(some)


def test_run_lengths_that_are_none_where_there_is_no_map(tmp_path):
    dataset = make(tmp_path, channels=("rgb",))
    edit_record(dataset, 1, lambda r: r["objects"][0].update(mask="?!"))
    assert {("mask", 1), ("box2d", 1)} <= failures(dataset)


@pytest.mark.parametrize("text", ["", "{}"])
def test_a_model_without_its_facts(dataset, text):
    (dataset.store.model_folder("block-1") / "model.json").write_text(text)
    assert failures(dataset) == {("counts", None)}


def test_wrong_numbers_of_pixels(spelled):
    wrong = {1: ("area", 7, "mask"), 2: ("visibility", 0.0, "visibility"), 3: ("truncation", 1.5, "visibility")}
    for frame, (key, value, _) in wrong.items():
        edit_record(spelled, frame, lambda r, key=key, value=value: r["objects"][0].update({key: value}))
    assert {(name, frame) for frame, (_, _, name) in wrong.items()} <= failures(spelled)


def test_wrong_2d_boxes(spelled):
    names = ("box2d", "box2d_projected", "box2d_unclipped")
    for frame, name in enumerate(names, 3):

        def change(record, name=name):
            box = record["objects"][0][name]
            record["objects"][0][name] = [box[0] + 2, *box[1:]]

        edit_record(spelled, frame, change)
    assert failures(spelled) == {("box2d", 3), ("box2d_projected", 4), ("box2d_projected", 5)}


def test_wrong_3d_boxes_and_poses(spelled):
    names = ("box3d_object", "box3d", "box3d_camera", "box3d_pixels", "camera_from_object")
    for frame, name in enumerate(names, 3):

        def change(record, name=name):
            record["objects"][0][name][1][1] += 3e-6

        edit_record(spelled, frame, change)
    assert {*(("box3d", frame) for frame in range(3, 7)), ("pose", 7)} <= failures(spelled)


def test_a_vertex_that_is_not_behind(spelled):
    def change(record):
        record["objects"][0]["box3d_in_front"][0] = False

    edit_record(spelled, 3, change)
    assert failures(spelled) == {("box3d", 3)}


def test_a_wrong_quaternion_size_and_category(spelled):
    edit_record(spelled, 3, lambda r: r["objects"][0].update(quaternion=[1, 0, 0, 0]))
    edit_record(spelled, 4, lambda r: r["objects"][0].update(size=[1, 2, 3]))
    edit_record(spelled, 5, lambda r: r["objects"][0].update(real_size=[1, 2, 3]))
    edit_record(spelled, 6, lambda r: r["objects"][0].update(pose_category="bottom"))
    edit_record(spelled, 7, lambda r: r["objects"][0].update(category="car"))
    edit_record(spelled, 8, lambda r: r["objects"][0].update(model="elsewhere.obj"))
    expected = {("pose", 3), ("size", 4), ("size", 5), ("pose_category", 6), ("category", 7), ("model", 8)}
    assert failures(spelled) == expected


def test_a_wrong_camera(spelled):
    edit_record(spelled, 3, lambda r: r["camera"]["t"].__setitem__(2, 2.5))
    assert {("box3d", 3), ("pose", 3), ("camera", 3)} <= failures(spelled)


def test_wrong_poses(spelled):
    for frame, name in enumerate(("azimuth_deg", "elevation_deg", "tilt_deg", "distance"), 3):
        edit_record(spelled, frame, lambda r, name=name: r["pose"].update({name: r["pose"][name] + 0.01}))
    assert failures(spelled) == {("camera", frame) for frame in range(3, 7)}


def test_a_wrong_view(spelled):
    edit_record(spelled, 3, lambda r: r["objects"][0]["view"].update(azimuth_deg=11))
    assert failures(spelled) == {("view", 3)}


def test_depth_that_is_not_the_models(dataset):
    edit_channel(dataset, 7, "depth", lambda a: a.__imul__(np.float32(1.001)))
    assert failures(dataset) == {("surface", 7), ("depth", 7), *((name, 7) for name in LIFTED)}
    assert failures(dataset, rays=False) == {("depth", 7), *((name, 7) for name in LIFTED)}


def nudged(array):
    """One pixel of the object is another number; of what these models do not have, parts of bodies, any pixel."""
    first = array if array.ndim == 2 else array[..., 0]
    shown = np.argwhere(np.isfinite(first) & (first != 0))
    y, x = shown[0] if len(shown) else (0, 0)
    array[y, x] = np.nextafter(array[y, x], np.float32(9)) if array.dtype == np.float32 else array[y, x] + 1


@pytest.mark.parametrize("half", [0, 1])
def test_every_label_of_pixels_is_computed_again_to_the_last_bit(dataset, half):
    """Each in a frame of its own."""
    names = dict(enumerate(STILL[half::2]))
    assert len(names) <= len(dataset)
    for frame, name in names.items():
        edit_channel(dataset, frame, name, nudged)
    assert {(name, frame) for frame, name in names.items()} <= failures(dataset, rays=False)


SMALL = {"voxels": {"size": [24, 20, 30], "cell": 0.11, "distance": 2.2, "bottom": -1}}
"""Options of labels that would be large without."""


@pytest.fixture(scope="module")
def rows(tmp_path_factory):
    kept = ("rgb", "depth", "instances", *ROWS)
    return make(tmp_path_factory.mktemp("rows") / "set", channels=kept, labels=SMALL, ground=True)


def test_labels_of_rows_are_proved(rows):
    report = check(rows)
    assert report.ok, report.findings
    assert ROWS and all(report.checked[name] == len(rows) for name in ROWS)


@pytest.mark.slow
@pytest.mark.parametrize("name", ROWS)
def test_every_field_of_labels_of_rows_is_computed_again(rows, tmp_path, name):
    dataset = Dataset(shutil.copytree(rows.root, tmp_path / "out"))
    for field in channels()[name].dtype.names:
        edit_channel(dataset, 5, name, lambda a, field=field: a[field].__setitem__(7, a[field][7] + 1))
        assert (name, 5) in failures(dataset, rays=False), field
        shutil.copy(rows.path(rows[5].files[name]), dataset.path(dataset[5].files[name]))


def test_channels_that_are_wrong_all_over(dataset):
    edit_channel(dataset, 5, "normals", lambda a: a.__imul__(-1))
    edit_channel(dataset, 6, "coordinates", lambda a: a.__iadd__(0.1))
    assert failures(dataset, rays=False) == {("normals", 5), *((name, 6) for name in ("coordinates", *LIFTED))}


def test_background_without_depth(dataset):
    edit_channel(dataset, 5, "depth", lambda a: a.__setitem__(dataset[5].instances == 0, np.inf))
    names = ("depth", "depth_ray", "panoptic", "position", "semantic", "surface")
    assert failures(dataset) == {(name, 5) for name in names}


KEPT = [label.name for label in object_labels() if label.keep is not no_record and not label.on_request]


def test_all_that_is_kept_of_objects_is_computed_again(dataset):
    assert 1 < len(KEPT) <= len(dataset)
    for frame, name in enumerate(KEPT):

        def change(record, name=name):
            kept = record["objects"][0][name]
            other = encode_rle(np.eye(72, 96, dtype=bool)) if isinstance(kept, str) else [kept[0] * 0.9, *kept[1:]]
            record["objects"][0][name] = other

        edit_record(dataset, frame, change)
    assert {(name, frame) for frame, name in enumerate(KEPT)} <= failures(dataset, rays=False)


@pytest.mark.parametrize("moved", quick(["motion", "instant"], "instant"))
def test_shots_that_were_changed(dataset, moved):
    """Beside one whose lens was changed, and one that is whole."""

    def change(shot):
        if moved == "motion":
            shot["things"][0]["motion"]["poses"][0][0][3] += 0.01
        else:
            shot["instants"][2]["world_from_rig"][0][3] += 0.01

    edit_json(dataset.store.shot_folder("block-1-000000") / "shot.json", change)
    edit_json(
        dataset.store.shot_folder("block-2-000000") / "shot.json",
        lambda shot: shot["rig"]["sensors"][0]["intrinsics"].update(fx=80.8),
    )
    found = {frame for name, frame in failures(dataset, rays=False) if name in labels()}
    assert found == {*([6] if moved == "instant" else [4, 5, 6, 7]), 8, 9, 10, 11}


@pytest.mark.slow
def test_rounded_depth_is_compared_to_its_step(tmp_path):
    dataset = make(tmp_path, files=Files(depth="png16", depth_unit=0.01), ground=True)
    assert check(dataset).ok
    sample = dataset[3]
    file, far = dataset.path(sample.files["depth"]), sample.depth.copy()
    far[sample.instances > 0] += np.float32(0.01)
    file.write_bytes(encode(channels()["depth"], far, Files(depth="png16", depth_unit=0.01)))
    assert failures(dataset, rays=False) == {("depth", 3)}


def test_another_model_than_was_drawn(dataset):
    shutil.copy(dataset.path("store/models/block-2/block-2.glb"), dataset.path("store/models/block-0/block-0.glb"))
    found = failures(dataset)
    assert {("surface", i) for i in range(4)} | {("depth", i) for i in range(4)} <= found
    assert {frame for name, frame in found if name != "models"} == {0, 1, 2, 3}
    assert ("models", None) in found


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (IndexError("7"), "expected data that can be checked, found IndexError: 7"),
        (RuntimeError("no luck"), "the check itself failed: RuntimeError: no luck"),
    ],
)
def test_a_proof_that_breaks_off_blames_the_data_only_for_what_data_causes(whole, monkeypatch, error, message):
    def broken(*_):
        raise error

    monkeypatch.setitem(FRAME_PROOFS, "camera", broken)
    findings = check(whole, rays=False).findings
    assert {(f.check, f.message) for f in findings} == {("camera", message)}
    assert len(findings) == len(whole)


def test_findings_say_where(spelled):
    edit_record(spelled, 3, lambda r: r["objects"][0].update(area=1))
    finding = next(f for f in check(spelled, rays=False).findings if f.check == "mask")
    assert str(finding).startswith("mask: frame 3: object 1: expected area")
    assert viewsphere.check.Finding("counts", None, "x").__str__() == "counts: x"


@pytest.mark.slow
def test_a_flipped_bit_in_any_file_of_the_store_is_found(whole, tmp_path):
    """One bit of every file that stands in a manifest, and of every manifest itself."""
    root = Path(shutil.copytree(whole.root, tmp_path / "spoilt"))
    rng = np.random.default_rng(4)
    kinds = {}
    for file in sorted(p for p in root.glob("store/*/**/*") if p.is_file()):
        kinds.setdefault((file.parent.name if "shots" in file.parts else "model", file.suffix, file.name == MANIFEST), file)
    assert len(kinds) > 15
    for file in kinds.values():
        data = bytearray(file.read_bytes())
        for at in rng.integers(0, 8 * len(data), 3).tolist():
            data[at // 8] ^= 1 << at % 8
            file.write_bytes(data)
            assert damaged(Dataset(root))[1], f"{file}: bit {at}"
            data[at // 8] ^= 1 << at % 8
        file.write_bytes(data)
    assert not damaged(Dataset(root))[1]


@pytest.mark.parametrize("change", ["lost", "longer", "strange"])
def test_files_that_are_lost_longer_or_strange_are_found(whole, tmp_path, change):
    root = Path(shutil.copytree(whole.root, tmp_path / "spoilt"))
    file = next(root.glob("store/shots/*/*/depth/*"))
    match change:
        case "lost":
            file.unlink()
        case "longer":
            file.write_bytes(file.read_bytes() + b"x")
        case _:
            (file.parent / "another.tiff").write_bytes(file.read_bytes())
    findings = [f for f in check(Dataset(root), rays=False).findings if f.check == "digests"]
    assert len(findings) == 1 and "expected " in findings[0].message


def test_labels_of_frames_without_their_shots_are_not_run(spelled):
    report = check(spelled, rays=False)
    assert report.ok
    assert report.not_run["labels"] == "12 frames came without their shots"


# the fields of records, generated from the tables of labels


def another(value):
    """What looks like a value of the field, and is none."""
    match value:
        case bool():
            return not value
        case int():
            return value + 1
        case float():
            return value * (1 + 1e-5) + 1e-5
        case str():
            return value + "x"
        case _:
            return 0.5


def place_of(record, where):
    for key in where[:-1]:
        record = record[key]
    return record, where[-1]


BARE = ("depth", "instances")
"""Channels of data sets whose records are spoilt: others are computed again each time, and find nothing more."""


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    """Records that leave out what their shots say."""
    return make(tmp_path_factory.mktemp("short") / "out", channels=BARE, ground=True)


@pytest.fixture(scope="module")
def merged(short, tmp_path_factory):
    """Records that say everything, and the shots that they are of."""
    dataset = make(tmp_path_factory.mktemp("merged") / "out", channels=BARE, ground=True, short=False)
    for file in short.root.glob("store/shots/*/*/shot.json"):
        shutil.copy(file, dataset.root / file.relative_to(short.root))
    seal_again(dataset.root)
    assert check(dataset).ok
    return dataset


def missed_leaves(dataset, places, monkeypatch):
    """Places of records where another value is not found, although digests are made to fit. Every frame is spoilt at one of
    them that it has, all frames at once; a frame in which nothing is found then is spoilt alone.
    """
    waiting, missed = list(places), []
    monkeypatch.setattr(viewsphere.check, "differing", lambda *_: ())  # models, which take half the time, are whole
    while waiting:
        spoilt: dict[int, tuple] = {}
        for where in waiting:
            free = (frame for frame in range(len(dataset)) if frame not in spoilt and holds(record_of(dataset, frame), where))
            if (frame := next(free, None)) is not None:
                spoilt[frame] = where
            if len(spoilt) == len(dataset):
                break
        assert spoilt, waiting
        waiting = [where for where in waiting if where not in spoilt.values()]
        # A record that cannot be read makes those beside it unreadable.
        found = {frame for name, frame in failures_of(dataset, spoilt) if name != "files"}
        missed += [where for frame, where in spoilt.items() if frame not in found and not failures_of(dataset, {frame: where})]
    seal_again(dataset.root)
    return missed


def holds(record, where):
    try:
        inside, key = place_of(record, where)
        inside[key]
    except (LookupError, TypeError):
        return False
    return True


def failures_of(dataset, spoilt):
    """What is found where frames have another value at these places; the files are left as they were."""
    texts = {file: file.read_text() for file in {records_file(dataset, frame) for frame in spoilt}}
    for file, text in texts.items():
        records = json.loads(text)
        for frame, where in spoilt.items():
            if records_file(dataset, frame) == file:
                inside, key = place_of(records[frame % 4], where)
                inside[key] = another(inside[key])
        file.write_text(json.dumps(records))
    found = failures(dataset, rays=False, sample=None)
    for file, text in texts.items():
        file.write_text(text)
    return found


def is_late_corner(where):
    return where[0] == "objects" and where[2] in ("contour", "hull") and where[-2] > 5


def records_file(dataset, frame):
    return dataset.store.shot_folder(dataset.plan.row_at(frame).key) / "frames.json"


def record_of(dataset, frame):
    return json.loads(records_file(dataset, frame).read_text())[frame % 4]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["short", "merged"])
def test_every_leaf_of_every_record_is_proved(short, merged, tmp_path, kind, monkeypatch):
    """Of each field of each label, and of each thing that is known of a frame."""
    source = short if kind == "short" else merged
    dataset = Dataset(shutil.copytree(source.root, tmp_path / "out"))
    record = record_of(dataset, 6)
    if kind == "merged":
        assert {field.name for label in labels_of(()) for field in label.fields} <= record["objects"][0].keys()
    places = list(leaves(record))
    if kind == "short":
        places = {where[:3]: where for where in places}.values()  # all of them are in the merged records
    assert missed_leaves(dataset, places, monkeypatch) == []


@pytest.mark.slow
def test_frames_of_another_split_than_the_plan_dealt(tmp_path):
    generate(small_recipe(formats=[]), tmp_path)
    file = next(tmp_path.glob("store/shots/*/*/shot.json"))

    def change(shot):
        for instant in shot["instants"]:
            instant["split"] = "val" if instant["split"] == "train" else "train"

    edit_json(file, change)
    assert {name for name, _ in failures(Dataset(tmp_path), rays=False)} == {"shot", "recipe"}


ASKED = tuple(
    name for name, label in on_request().items() if all(isinstance(need, (ShotAppearance, Randomness)) for need in label.needs)
)


@pytest.fixture(scope="module")
def annotated(tmp_path_factory):
    return make(tmp_path_factory.mktemp("annotated") / "set", several=True, channels=BARE, annotations=ASKED)


def test_labels_on_request_are_proved_where_they_were_asked_for(annotated):
    report = check(annotated, rays=False)
    assert report.ok, report.findings
    assert {name: report.checked[name] for name in ASKED} == dict.fromkeys(ASKED, 4)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["short", "merged"])
def test_every_leaf_of_labels_on_request_is_proved(annotated, tmp_path, kind, monkeypatch):
    """In a frame of objects that hide one another; records that say everything have their shots beside them."""
    dataset = Dataset(shutil.copytree(annotated.root, tmp_path / "out"))
    if kind == "merged":
        whole = make(tmp_path / "whole", several=True, channels=BARE, annotations=ASKED, short=False)
        shot = annotated.store.shot_folder("several-000000") / "shot.json"
        shutil.copy(shot, whole.store.shot_folder("several-000000"))
        seal_again(whole.root)
        dataset = Dataset(whole.root)
    assert check(dataset, rays=False).ok
    record = record_of(dataset, 1)
    fields = {*ASKED, *(field.name for name in ASKED for field in on_request()[name].fields)}
    # Of an outline's many corners the first ones are enough.
    found = [where for where in leaves(record) if fields.intersection(where) and not is_late_corner(where)]
    assert {where[2] for where in found if where[0] == "objects"} >= {"amodal", "occluders"}
    assert missed_leaves(dataset, found, monkeypatch) == []
