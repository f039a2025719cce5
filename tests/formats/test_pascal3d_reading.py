"""PASCAL3D+ data sets made elsewhere, by hand as MATLAB's struct arrays are, and our own, which go out equal again."""

from __future__ import annotations

import zlib

import numpy as np
import pytest
from PIL import Image
from scipy.io import loadmat, savemat
from viewpoint_readers import project_3d

from proven import close, equal
from small import tree_hash
from viewsphere import Dataset
from viewsphere.check import check
from viewsphere.codecs.palette import palette
from viewsphere.errors import StoreError, UserError
from viewsphere.report import write_report
from viewsphere.run.datasets.importing import import_dataset
from viewsphere.run.datasets.merging import merge
from viewsphere.run.exports.exporting import export

KIT = "PASCAL/VOCdevkit/VOC2012"
SIZE = (50, 40)
NOTHING = np.zeros((0, 0))
VERTICES = np.array([[0.5, -0.3, -0.2], [-0.5, -0.3, -0.2], [0.5, 0.4, -0.2], [-0.1, 0.0, 0.3]])
FACES = np.array([[1, 2, 3], [1, 2, 4], [2, 3, 4], [1, 3, 4]])


def structs(rows):
    found = np.empty((1, len(rows)), [(name, object) for name in rows[0]])
    for i, row in enumerate(rows):
        for name, value in row.items():
            found[name][0, i] = value
    return found


def viewpoint(**changes):
    said = {"azimuth_coarse": 30, "elevation_coarse": 10, "azimuth": 31.5, "elevation": 12.25, "distance": 7.5, "focal": 1,
            "px": 22.5, "py": 18.0, "theta": -4.5, "error": 3.25, "interval_azimuth": NOTHING, "num_anchor": 1,
            "viewport": 3000}  # fmt: skip
    return {**said, **changes}


def thing(kind="car", box=(3, 4, 20.5, 15), cad=1, view=None, anchors=NOTHING, **flags):
    where = {"class": kind, "bbox": np.array([box], float), "bbox_": NOTHING, "cad_index": cad}
    seen = {"anchors": anchors, "viewpoint": NOTHING if view is None else view}
    return {**where, **seen, "truncated": 0, "occluded": 1, "difficult": 0, **flags}


ANCHORS = {
    "left_wheel": {"location": np.array([[5.5, 7.25]]), "status": 1},
    "roof": {"location": NOTHING, "status": 2},
    "p_2nd": {"location": NOTHING, "status": 5},
}

PICTURES = {
    "car_pascal/2008_01": [thing(view=viewpoint(), anchors=ANCHORS), thing("bus", (1, 1, 9, 9), truncated=1)],
    "bus_pascal/2008_01": [thing("bus", (1, 1, 9, 9), 2, viewpoint(azimuth=200, px=5, py=6, distance=12), truncated=1)],
    "car_imagenet/n01": [thing(view=viewpoint(azimuth=359, elevation=-60, theta=170), difficult=1)],
    "car_imagenet/n02": [thing(view=viewpoint(distance=0, azimuth=0, elevation=0)), thing("person", cad=NOTHING)],
    "car_imagenet/n03": [thing(view=viewpoint()), thing(view=viewpoint(viewport=2000), box=(1, 1, 2, 2))],
}


def record(file, objects, packed=True, **more):
    file.parent.mkdir(parents=True, exist_ok=True)
    said = {"filename": f"{file.stem}.jpg", "imgsize": np.array([[*SIZE, 3.0]]), "segmented": 1.0}
    rows = structs(objects) if objects else NOTHING
    savemat(file, {"record": {**said, "objects": rows, **more}}, do_compression=packed, long_field_names=True)


def picture(file):
    file.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(np.random.default_rng(len(str(file))).integers(0, 255, (SIZE[1], SIZE[0], 3), np.uint8)).save(file)


def data_set(folder, cads=True):
    for name, objects in PICTURES.items():
        record(folder / f"Annotations/{name}.mat", objects, packed="imagenet" not in name)
        picture(folder / f"Images/{name}{'.JPEG' if 'imagenet' in name else '.jpg'}")
    ids = np.zeros(SIZE[::-1], np.uint8)
    ids[4:14, 3:20], ids[0:4, 0:9], ids[3, :] = 1, 2, 255
    (folder / KIT / "SegmentationObject").mkdir(parents=True)
    Image.fromarray(ids, "L").save(folder / KIT / "SegmentationObject/2008_01.png")
    for name, text in {
        f"{KIT}/ImageSets/Main/car_val": "2008_01  1\nother -1\n",
        f"{KIT}/ImageSets/Main/trainval": "2008_01\n",
        "Image_sets/car_imagenet_train": "n01\nn02\n",
        "Image_sets/car_imagenet_val": "n03\n",
    }.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / f"{name}.txt").write_text(text)
    row = {"vertices": VERTICES, "faces": FACES, "left_wheel": np.array([[0.1, 0.2, 0.3]]), "roof": NOTHING,
           "pnames": np.array([["left_wheel", "roof"]], object)}  # fmt: skip
    (folder / "CAD").mkdir()
    for name, count in {"car": 1, "bus": 2}.items() if cads else ():
        rows = [{**row, "vertices": VERTICES * (i + 1)} for i in range(count)]
        savemat(folder / f"CAD/{name}.mat", {name: structs(rows)})
    return folder


def whole(dataset):
    report = check(dataset)
    assert report.ok, report.findings
    return dataset


def differences(one, other, at=""):
    """Where two values of scipy's differ, and by how much at most."""
    if hasattr(one, "_fieldnames"):
        assert one._fieldnames == other._fieldnames, at
        for name in one._fieldnames:
            yield from differences(getattr(one, name), getattr(other, name), f"{at}.{name}")
    elif isinstance(one, np.ndarray) and one.dtype == object:
        assert one.shape == other.shape, at
        for a, b in zip(one.ravel(), other.ravel(), strict=True):
            yield from differences(a, b, at)
    elif isinstance(one, str):
        assert one == other or at == ".filename", at
    else:
        assert np.shape(one) == np.shape(other), at
        yield at, np.abs(np.subtract(one, other, dtype=float)).max(initial=0)


@pytest.mark.slow
@pytest.mark.parametrize("world", ["stills", "poses"])
def test_an_export_comes_back_and_goes_out_equal(world, request, tmp_path):
    own = request.getfixturevalue(world)
    export(own.root, "pascal3d", output=tmp_path / "one")
    first, second = tmp_path / "one/pascal3d", tmp_path / "two/pascal3d"
    before = tree_hash(first)
    import_dataset("pascal3d", first, tmp_path / "in")
    read = whole(Dataset(tmp_path / "in"))
    assert [c.name for c in read.categories] == [c.name for c in own.categories] and read.splits == own.splits
    export(read.root, "pascal3d", output=tmp_path / "two")
    assert tree_hash(first) == before
    files = sorted(file.relative_to(first) for file in first.rglob("*") if file.is_file())
    assert files == sorted(file.relative_to(second) for file in second.rglob("*") if file.is_file())
    for file in files:
        if file.suffix == ".mat" and file.parts[0] == "Annotations":
            one, other = (loadmat(at / file, squeeze_me=True, struct_as_record=False)["record"] for at in (first, second))
            for place, apart in differences(one, other):
                close("pascal3d", f"import and export:{place.replace('.objects.viewpoint', '')}", apart, 0, "", atol=1e-9)
        elif file.name != "checksums.xxh128":
            assert (first / file).read_bytes() == (second / file).read_bytes(), file
    for sample, known in zip(read, own, strict=True):
        equal("pascal3d", "import: K", sample.camera.K, known.camera.K)
        for o, other in zip(sample.objects, [o for o in known.objects if o.box2d], strict=True):
            assert (o.id, o.category, o.box2d, o.pose_category) == (other.id, other.category, other.box2d, other.pose_category)
            equal("pascal3d", "import: masks", o.mask, other.mask)
            close("pascal3d", "import: boxes", o.box3d_camera, other.box3d_camera, "m", atol=1e-7)
            close("pascal3d", "import: vertices", o.box3d_pixels, other.box3d_pixels, "px", atol=1e-4)
            assert (o.source["truncated"], o.keypoint_names) == (other.truncation > 0.15, other.keypoint_names)
            shown = o.keypoint_states == 0
            close("pascal3d", "import: keypoints", o.keypoints[shown], other.keypoints[shown], "px", atol=1e-12)


@pytest.mark.slow
def test_poses_without_our_own_fields(stills, tmp_path):
    """Of K alone and the viewpoint, where RT is not there, the same pose follows."""
    export(stills.root, "pascal3d", output=tmp_path)
    for file in (tmp_path / "pascal3d/Annotations").rglob("*.mat"):
        said = loadmat(file)["record"]
        for row in said[0, 0]["objects"][0]:
            row["RT"] = NOTHING
        savemat(file, {"record": said})
    import_dataset("pascal3d", tmp_path / "pascal3d", tmp_path / "in")
    for sample, known in zip(Dataset(tmp_path / "in"), stills, strict=True):
        for o, other in zip(sample.objects, [o for o in known.objects if o.box2d], strict=True):
            close("pascal3d", "import: poses by viewpoints", o.box3d_camera, other.box3d_camera, "m", atol=1e-7)


class View:
    """As MATLAB's code has a viewpoint."""

    def __init__(self, said):
        self.__dict__.update(said)


@pytest.fixture
def imported(tmp_path):
    before = tree_hash(data_set(tmp_path / "mine"))
    foreign = import_dataset("pascal3d", tmp_path / "mine", tmp_path / "in")
    assert tree_hash(tmp_path / "mine") == before
    assert (foreign.count, foreign.splits, foreign.left_out) == (4, ("train", "val"), ())
    found = whole(Dataset(tmp_path / "in"))
    return {sample.source["file_name"].partition("/")[2].partition(".")[0]: sample for sample in found}, found


def test_records_by_hand(imported):
    samples, dataset = imported
    assert [c.name for c in dataset.categories] == ["bus", "car", "person"]
    assert {name: sample.split for name, sample in samples.items()} == {
        "2008_01": "val", "n01": "train", "n02": "train", "n03": "val",
    }  # fmt: skip
    bus, car = samples["2008_01"].objects
    assert (car.category, car.box2d, bus.category, bus.box2d) == ("car", (2, 3, 20.5, 15), "bus", (0, 0, 9, 9))
    assert [bus.source[name] for name in ("truncated", "occluded", "difficult")] == [1, 1, 0] and bus.key == "bus_02"
    assert abs(bus.view.azimuth_deg - 200) < 1 and abs(bus.view.distance - 12) < 0.5  # around the middle of its box
    names, places = car.keypoint_names, car.keypoints
    assert (names, car.keypoint_states.tolist()) == (("left_wheel", "roof", "p_2nd"), [0, 1, 3])
    assert places[0].tolist() == [5, 6.75] and np.isnan(places[1:]).all()
    assert car.mask.sum() == 170 and not bus.mask.any() and samples["n01"].objects[0].area == 18.5 * 12
    coarse, person = samples["n02"].objects
    assert (coarse.view.azimuth_deg, coarse.view.elevation_deg, coarse.pose_category) == (30, 10, "front-left")
    assert (
        np.isnan(coarse.view.distance) and not coarse.is_placed and not person.is_placed and np.isnan(person.view.azimuth_deg)
    )
    one, other = samples["n03"].objects
    assert samples["n03"].known_camera is None and one.view.azimuth_deg == 31.5 and not other.is_placed


def test_one_object_is_projected_as_the_toolbox_does(imported):
    samples, dataset = imported
    sample, said = samples["n01"], PICTURES["car_imagenet/n01"][0]["viewpoint"]
    (o,) = sample.objects
    vertices = dataset.mesh(o.key).vertices.astype(float)
    equal("pascal3d", "by hand, import: CAD vertices", vertices, VERTICES.astype(np.float32).astype(float))
    points = vertices @ o.camera_from_object[:3, :3].T + o.camera_from_object[:3, 3]
    pixels = points @ sample.camera.K.T
    found = pixels[:, :2] / pixels[:, 2:] + 0.5
    close("pascal3d", "by hand, project_3d: vertices", found, project_3d(vertices, View(said)), "px", atol=1e-8)


def test_several_objects_are_seen_where_the_toolbox_sees_them(imported):
    samples, _ = imported
    sample = samples["2008_01"]
    views = [PICTURES[name][0]["viewpoint"] for name in ("bus_pascal/2008_01", "car_pascal/2008_01")]
    for o, said, size in zip(sample.objects, views, (2, 1), strict=True):
        origin = sample.camera.K @ o.camera_from_object[:3, 3]
        close("pascal3d", "by hand: origins", origin[:2] / origin[2] + 0.5, (said["px"], said["py"]), "px", atol=1e-8)
        points = (VERTICES * size) @ o.camera_from_object[:3, :3].T + o.camera_from_object[:3, 3]
        pixels = points @ sample.camera.K.T
        near = project_3d(VERTICES * size, View(said))
        apart = np.abs(pixels[:, :2] / pixels[:, 2:] + 0.5 - near).max()
        assert apart < 0.01 * np.ptp(near, axis=0).max()  # 3,000 pixels of focal length make a picture of a degree


def test_what_came_goes_out(imported, tmp_path):
    _, dataset = imported
    export(dataset.root, ["pascal3d", "coco", "voc"], output=tmp_path / "out")
    for sample in dataset:
        _, _, name = sample.source["file_name"].rpartition("/")
        for folder in {name: objects for name, objects in PICTURES.items()}:
            kind, stem = folder.split("/")
            if stem != name.partition(".")[0]:
                continue
            file = tmp_path / f"out/pascal3d/Annotations/{kind.partition('_')[0]}_pascal/{sample.index:08d}.mat"
            found = loadmat(file, squeeze_me=True, struct_as_record=False)["record"]
            (own,) = [o for o in PICTURES[folder] if o["class"] == kind.partition("_")[0]][:1]
            again = next(o for o in np.atleast_1d(found.objects) if getattr(o, "class") == own["class"])
            assert np.abs(again.bbox - own["bbox"][0]).max() < 1 and again.cad_index == own["cad_index"]
            assert (again.truncated, again.occluded, again.difficult) == tuple(
                own[f] for f in ("truncated", "occluded", "difficult")
            )
            if own["viewpoint"]["distance"] == 0:
                assert again.viewpoint.azimuth_coarse == 30 and again.viewpoint.distance == 0 and not again.RT.size


@pytest.mark.slow
def test_it_is_reported_and_merged(poses, imported, tmp_path):
    _, dataset = imported
    write_report(dataset, tmp_path / "report.html")
    assert b"person" in (tmp_path / "report.html").read_bytes()
    joined = merge([poses.root, dataset.root], tmp_path / "joined", mixed=True)
    assert len(whole(joined)) == len(poses) + 4 and {"bus_01", "bus_02", "car_01"} <= {info.key for info in joined.models}


def test_without_cads(tmp_path):
    import_dataset("pascal3d", data_set(tmp_path / "mine", cads=False), tmp_path / "in")
    dataset = whole(Dataset(tmp_path / "in"))
    o = next(s for s in dataset if "n01" in s.source["file_name"]).objects[0]
    assert o.is_placed and o.view.azimuth_deg == pytest.approx(359) and np.isnan(o.box3d).all() and not dataset.models
    export(dataset.root, "pascal3d", output=tmp_path / "out")
    assert not list((tmp_path / "out").rglob("*.off"))


def test_pictures_whose_pixels_are_not_square(tmp_path):
    record(tmp_path / "mine/Annotations/car_pascal/a.mat", [thing()], K=np.array([[90.0, 0, 20], [0, 80, 20], [0, 0, 1]]))
    picture(tmp_path / "mine/Images/car_pascal/a.jpg")
    import_dataset("pascal3d", tmp_path / "mine", tmp_path / "in")
    with pytest.raises(UserError, match="expected square pixels; found fx 90, fy 80, skew 0"):
        export(tmp_path / "in", "pascal3d")


BAD = [
    (thing(kind=NOTHING), "object 1: expected a class; found "),
    (thing(box=(9, 1, 2, 3)), "object 1: expected bbox x1 y1 x2 y2; found 9 1 2 3"),
    (thing(box=(np.nan, 1, 2, 3)), "object 1: expected bbox, 4 numbers below 1,000,000"),
    (thing(box=(1, 2, 3)), "object 1: expected bbox, 4 numbers below 1,000,000"),
    (thing(truncated=7), "object 1: expected truncated 0 to 1; found 7"),
    (thing(cad=1.5), "object 1: expected cad_index 0 to 1,000,000; found 1.5"),
    (thing(view=viewpoint(azimuth=np.inf)), "object 1: expected azimuth, a number below 1,000,000"),
    (thing(view=viewpoint(viewport=0)), "object 1: expected a viewpoint with .*; found no focal length"),
    (thing(view={"distance": 3.0, "azimuth": 1.0}), "object 1: expected a viewpoint with .*; found no elevation"),
    (thing(view="side"), "object 1: expected a struct `viewpoint`; found another"),
    (thing(anchors={"a": {"location": np.ones((1, 3)), "status": 1}}), "object 1: expected location of a, 2 numbers"),
    ({**thing(), "RT": np.ones((3, 4))}, r"object 1: quaternion_from_matrix: expected a \(3, 3\) rotation"),
    (thing(cad=9), "object 1: expected cad_index 1 to 1; found 9: its model is left out"),
]  # fmt: skip


@pytest.mark.parametrize(("broken", "message"), BAD)
def test_broken_objects_are_named_and_left_out(tmp_path, broken, message):
    source = data_set(tmp_path / "mine")
    record(source / "Annotations/car_imagenet/n01.mat", [broken])
    with pytest.raises(StoreError, match=rf"Annotations/car_imagenet/n01\.mat: {message}") as error:
        import_dataset("pascal3d", source, tmp_path / "in")
    assert len(str(error.value).splitlines()) == 2 and not (tmp_path / "in").exists()
    assert len(import_dataset("pascal3d", source, tmp_path / "in", keep_going=True).left_out) == 1
    whole(Dataset(tmp_path / "in"))


def hostile(folder):
    """Records, pictures and models that cannot be used, and what each message says."""
    notes = folder / "Annotations/car_imagenet"
    good = (notes / "n01.mat").read_bytes()
    Image.new("RGB", SIZE).save(folder.parent / "secret.jpg")
    for name in "bcdefghi":
        picture(folder / f"Images/car_imagenet/{name}.jpg")
        (notes / f"{name}.mat").write_bytes(good)
    (notes / "a.mat").write_bytes(good)
    (notes / "b.mat").write_bytes(b"no mat")
    (notes / "c.mat").write_bytes(good[: len(good) // 2])
    (notes / "d.mat").write_bytes(
        good[:128] + b"\x0f\0\0\0" + len(zipped := zlib.compress(bytes(9 << 20))).to_bytes(4, "little") + zipped
    )
    savemat(notes / "e.mat", {"other": 1})
    record(notes / "f.mat", [thing()] * 5)
    (folder / "Images/car_imagenet/g.jpg").unlink()
    (folder / "Images/car_imagenet/g.jpg").symlink_to(folder.parent / "secret.jpg")
    (notes / "h.mat").unlink()
    (notes / "h.mat").symlink_to(folder.parent / "secret.jpg")
    (folder / "Images/car_imagenet/i.jpg").write_bytes(b"\xff\xd8 no picture")
    savemat(folder / "CAD/car.mat", {"car": structs([{"vertices": VERTICES, "faces": FACES + 9}])})
    return {
        "a.mat": "expected a picture; found no Images/car_imagenet/a",
        "b.mat": "expected a MATLAB file of version 5 to 7; found another: save it again with -v7",
        "c.mat": "cut off",
        "d.mat": "found a file that unpacks to more than 1,048,576 bytes",
        "e.mat": "expected a struct `record`; found none",
        "f.mat": "expected at most 4 objects (limit MAX_IMPORTED_OBJECTS); found 5",
        "g.mat": "found a link that leads out of it",
        "h.mat": "found a link that leads out of it",
        "i.mat": "cannot identify image file",
        "car.mat": "model 1: a face names a vertex outside 1 to 4",
    }


def test_hostile_trees(tmp_path, monkeypatch):
    monkeypatch.setenv("VIEWSPHERE_MAX_IMPORTED_OBJECTS", "4")
    monkeypatch.setenv("VIEWSPHERE_MAX_ANNOTATION_BYTES", str(1 << 20))
    expected = hostile(data_set(tmp_path / "mine"))
    with pytest.raises(StoreError, match="mend them, or leave them out with --keep-going"):
        import_dataset("pascal3d", tmp_path / "mine", tmp_path / "in")
    assert not (tmp_path / "in").exists()
    found = import_dataset("pascal3d", tmp_path / "mine", tmp_path / "in", keep_going=True)
    for (name, message), line in zip(expected.items(), found.left_out, strict=True):
        assert f"/{name}: " in line and any(part in line for part in message.split("|")) and "\n" not in line, line
    assert found.count == 4 and {info.key for info in whole(Dataset(tmp_path / "in")).models} == {"bus_01", "bus_02"}


def test_what_is_no_data_set_says_so(tmp_path):
    for place in (tmp_path, tmp_path / "no", __file__):
        with pytest.raises(
            StoreError, match=r"expected a PASCAL3D\+ data set \(Annotations, Images, CAD\); found no such folders"
        ):
            import_dataset("pascal3d", place, tmp_path / "out")
    for name in ("Annotations", "Images"):
        (tmp_path / name).mkdir()
    with pytest.raises(StoreError, match="expected pictures that can be used; found none"):
        import_dataset("pascal3d", tmp_path, tmp_path / "out")


@pytest.mark.parametrize("colors", [False, True])
@pytest.mark.parametrize("numbers", [(1, 2), (2, 1), (0, 1)])
def test_masks_belong_to_the_boxes_that_they_fill(tmp_path, numbers, colors):
    """A small object's place in a map may be a large one's by its number, or that of the next where one has no pixels."""
    record(tmp_path / "mine/Annotations/car_pascal/a.mat", [thing(box=(1, 1, 48, 38)), thing(box=(11, 11, 20, 20))])
    picture(tmp_path / "mine/Images/car_pascal/a.jpg")
    ids = np.zeros(SIZE[::-1], np.uint8)
    large, small = np.s_[0:38, 0:48], np.s_[10:20, 10:20]
    if numbers[0]:
        ids[large] = numbers[0]
    ids[small] = numbers[1]
    place = tmp_path / "mine" / KIT / "SegmentationObject/a.png"
    place.parent.mkdir(parents=True)
    image = Image.fromarray(ids, "P")
    image.putpalette(np.array(palette(), np.uint8).ravel().tolist())
    (image.convert("RGB") if colors else image).save(place)
    import_dataset("pascal3d", tmp_path / "mine", tmp_path / "in")
    (sample,) = whole(Dataset(tmp_path / "in"))
    assert [int(o.mask.sum()) for o in sample.objects] == [38 * 48 - 100 if numbers[0] else 0, 100]
