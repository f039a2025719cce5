"""Cityscapes, read by Pillow as cityscapesScripts does, and by these and torchvision where they are installed."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image, ImageDraw
from torchvision_readers import torchvision_datasets

import cube_dataset
from proven import close, equal
from viewsphere import plugins
from viewsphere.errors import UserError
from viewsphere.formats.cityscapes.classes import COLORS, INSTANCES, LABELS, label_of
from viewsphere.formats.cityscapes.instances import regions
from viewsphere.geometry.lenses import lens_parameters
from viewsphere.model.annotations.classes import SemanticClass
from viewsphere.plugins.format import FormatSpec
from viewsphere.recipe.formats import FormatEntry
from viewsphere.run.exports.exporting import export, write
from viewsphere.run.exports.scope import refusals, scope_of
from viewsphere.store import Category

IDS = {"sky": 23, "ground": 6, "car": 26, "chair": 5, "post_box": 4}
"""Of the classes of the worlds."""


@pytest.fixture(scope="module")
def written(stills, tmp_path_factory):
    place = tmp_path_factory.mktemp("cityscapes")
    export(stills.root, ["cityscapes"], output=place)
    return place / "cityscapes"


@pytest.fixture(scope="module")
def stereo(videos, tmp_path_factory):
    place = tmp_path_factory.mktemp("stereo")
    export(videos.root, [{"cityscapes": {"stereo": True}}], output=place)
    return place / "cityscapes"


def core(sample):
    return f"{sample.split}/stills/stills_{sample.index:06d}_000000"


def picture(folder, kind, name, ending):
    return np.array(Image.open(folder / kind / f"{name}_{ending}"))


def expected_labels(dataset, sample):
    table = np.zeros(100, np.uint8)
    for one in dataset.classes:
        table[one.id] = IDS.get(one.name, 255)
    return table[sample.semantic]


def drawn(value, of_instances):
    """The map that cityscapesScripts' json2labelImg, or json2instanceImg, draws of polygons.json."""
    out, counts = Image.new("I", (value["imgWidth"], value["imgHeight"])), {}
    for one in value["objects"]:
        number = LABELS.index(one["label"])
        if of_instances and number >= 24:
            counts[number] = counts.get(number, -1) + 1
            number = 1000 * number + counts[number]
        ImageDraw.Draw(out).polygon([tuple(point) for point in one["polygon"]], fill=number)
    return np.array(out)


def test_labels_instances_and_colours(stills, written):
    several = 0
    for sample in stills:
        labels = picture(written, "gtFine", core(sample), "gtFine_labelIds.png")
        numbers = picture(written, "gtFine", core(sample), "gtFine_instanceIds.png")
        colors = picture(written, "gtFine", core(sample), "gtFine_color.png")
        assert (labels.dtype, numbers.dtype, colors.shape[2]) == (np.uint8, np.uint16, 4)
        equal("cityscapes", "Pillow: labels", labels, expected_labels(stills, sample))
        assert np.array_equal(colors[..., :3], np.array([*COLORS.values()])[labels]) and (colors[..., 3] == 255).all()
        cars = [o for o in sample.objects if o.category == "car" and o.area]
        found = [np.unique(numbers[sample.instances == o.id]).tolist() for o in cars]
        assert sorted(found) == [[26000 + n] for n in range(len(cars))]
        apart = np.isin(sample.instances, [o.id for o in cars])
        equal("cityscapes", "Pillow: instances", numbers >= 1000, apart)
        assert np.array_equal(numbers[~apart], labels[~apart])
        equal("cityscapes", "Pillow: pictures", picture(written, "leftImg8bit", core(sample), "leftImg8bit.png"), sample.rgb)
        several += len(cars) > 1
    assert several


def test_polygons_drawn_are_the_maps(stills, written):
    for sample in stills:
        value = json.loads((written / "gtFine" / f"{core(sample)}_gtFine_polygons.json").read_text())
        assert (value["imgHeight"], value["imgWidth"]) == (sample.height, sample.width)
        for ending, of_instances in (("labelIds", False), ("instanceIds", True)):
            there = picture(written, "gtFine", core(sample), f"gtFine_{ending}.png")
            equal("cityscapes", "Pillow: polygons drawn", drawn(value, of_instances), there)


@pytest.mark.parametrize("seed", range(20))
def test_polygons_of_any_mask_are_the_mask(seed):
    """Holes, thin lines, single pixels and pieces: of a random map each label's polygons are its pixels and no others."""
    rng = np.random.default_rng(seed)
    labels = np.kron(rng.choice([7, 11, 23], (12, 16), p=[0.5, 0.3, 0.2]), np.ones((seed % 3 + 1,) * 2)).astype(np.uint8)
    for region in regions(labels, np.zeros(labels.shape, np.int32)):
        out = Image.new("1", labels.shape[::-1])
        for ring in region.rings:
            assert len(ring) >= 3
            ImageDraw.Draw(out).polygon([tuple(point) for point in ring.tolist()], fill=1)
        assert np.array_equal(np.array(out), region.mask) and (region.label, region.number) == (labels[region.mask][0],) * 2


def test_an_instance_in_pieces_is_one_polygon():
    """Car 1 is parted by car 2, which is nearer; they keep their numbers when they are drawn anew."""
    labels, instances = np.full((20, 40), 7, np.uint8), np.zeros((20, 40), np.int32)
    instances[5:15, 2:38], labels[5:15, 2:38] = 2, 26
    instances[3:17, 15:25], labels[3:17, 15:25] = 1, 26
    parts = regions(labels, instances)
    assert [(one.label, one.number, len(one.rings)) for one in parts] == [(26, 26000, 1), (26, 26001, 1), (7, 7, 1)]
    assert np.array_equal(parts[0].mask, instances == 2)
    told = [{"label": LABELS[one.label], "polygon": ring.tolist()} for one in parts for ring in one.rings]
    value = {"imgWidth": 40, "imgHeight": 20, "objects": told}
    whole = drawn(value, True)
    assert all((whole[one.mask] == one.number).all() for one in parts)


def test_cameras_are_those_of_the_calibration_paper(stills, written):
    """image = K [0 -1 0; 0 0 -1; 1 0 0] R^T (p - t), p in a vehicle that stands on the ground and heads as the camera does."""
    for sample in stills:
        value = json.loads((written / "camera" / f"{core(sample)}_camera.json").read_text())
        inner, outer = value["intrinsic"], value["extrinsic"]
        (s, c), (sr, cr) = ((math.sin(outer[angle]), math.cos(outer[angle])) for angle in ("pitch", "roll"))
        pitch, roll = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]), np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
        turn, place = pitch @ roll, np.array([outer["x"], outer["y"], outer["z"]])
        lens = np.array([[inner["fx"], 0, inner["u0"]], [0, inner["fy"], inner["v0"]], [0, 0, 1]])
        swap = np.array([[0, -1, 0], [0, 0, -1], [1, 0, 0]])
        heading = np.array([*sample.camera.R[2, :2], 0]) / np.linalg.norm(sample.camera.R[2, :2])
        vehicle = np.stack([heading, np.cross([0, 0, 1], heading), [0, 0, 1]])  # rows: its x, y, z in the world
        below = sample.camera.center * [1, 1, 0]
        for o in sample.objects:
            points = (o.box3d - below) @ vehicle.T
            pixels = (points - place) @ turn @ swap.T @ lens.T
            pixels = pixels[:, :2] / pixels[:, 2:]
            close("cityscapes", "csCalibration's formula: pixels", pixels + 0.5, o.box3d_pixels, "px", atol=1e-6)
        assert (outer["yaw"], outer["baseline"]) == (0, 0)


def test_stereo(videos, stereo):
    for sample in videos:
        number = videos.sequences.index(sample.sequence)
        city = sample.sequence.replace("_", "-")
        name = f"{sample.split}/{city}/{city}_{number:06d}_{sample.instant:06d}"
        kind = f"{sample.sensor}Img8bit"
        equal("cityscapes", "Pillow: pictures", picture(stereo, kind, name, f"{kind}.png"), sample.rgb)
        if sample.sensor == "left":
            steps = picture(stereo, "disparity", name, "disparity.png")
            assert steps.dtype == np.uint16 and steps.all()
            close("cityscapes", "Pillow: disparity", (steps - 1.0) / 256, sample.disparity, "px", atol=1 / 512 + 1e-6)
            outer = json.loads((stereo / "camera" / f"{name}_camera.json").read_text())["extrinsic"]
            close("cityscapes", "json: baseline", outer["baseline"], 0.1, "m", atol=1e-12)
    assert sum(1 for _ in (stereo / "gtFine").rglob("*labelIds.png")) == len(videos) // 2


def test_labels_by_name():
    found = {
        name: LABELS[label_of(SemanticClass(1, name, is_thing, (0, 0, 0)))]
        for name, is_thing in {
            "Car": True, "traffic_light": True, "Motor-Bike": True, "motorbike": True, "pedestrian": True, "boat": True,
            "lamp_post": True, "pavement": False, "scenery": False, "grass": False, "road marking": False, "lava": False,
        }.items()
    }  # fmt: skip
    assert found == {
        "Car": "car", "traffic_light": "traffic light", "Motor-Bike": "dynamic", "motorbike": "motorcycle",
        "pedestrian": "person", "boat": "dynamic", "lamp_post": "pole", "pavement": "sidewalk", "scenery": "static",
        "grass": "terrain", "road marking": "road", "lava": "static",
    }  # fmt: skip
    assert list(INSTANCES) == list(range(24, 34)) and LABELS[26] == "car" and LABELS[7] == "road" and LABELS[23] == "sky"


@pytest.mark.slow
def test_hostile_names_and_empty_pictures(tmp_path, monkeypatch):
    names = ('hair "drier" & co', "Große Schüssel 漢字", "  Bus ")
    monkeypatch.setattr(cube_dataset, "CATEGORIES", tuple(Category(i, name, "") for i, name in enumerate(names, 1)))
    placed, found = cube_dataset.placed, {}
    for name, away in (("near", 0), ("far", 500)):
        monkeypatch.setattr(cube_dataset, "placed", lambda offsets, away=away: placed({m: (0, 0, away) for m in offsets}))
        dataset = cube_dataset.make(tmp_path / f"{name}-store")
        (tmp_path / name).mkdir()
        write(dataset, [(FormatEntry(name="cityscapes"), tmp_path / name)])
        maps = [np.array(Image.open(file)) for file in (tmp_path / name / "gtFine").rglob("*instanceIds.png")]
        found[name] = set(np.unique(maps).tolist())
    assert found == {"near": {5, 23, 28000}, "far": {23}}


def bent(scope, **lens):
    sensor = scope.rig.sensors[0]
    changed = sensor.model_copy(update={"intrinsics": sensor.intrinsics.model_copy(update=lens)})
    return replace(scope, rig=scope.rig.model_copy(update={"sensors": (changed,)}))


def apart(scope):
    sensor = scope.rig.sensors[0]
    moved = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.5), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    other = sensor.model_copy(update={"name": "other", "rig_from_sensor": moved})
    return replace(scope, rig=scope.rig.model_copy(update={"sensors": (sensor, other)}))


@pytest.mark.parametrize(
    ("options", "change", "message"),
    [
        ({"stereo": True}, lambda scope: scope, "expected two rectified cameras .*; found camera"),
        ({}, lambda scope: replace(scope, most_objects=1001), "expected at most 1,000 objects in a picture; found 1,001"),
        (
            {},
            lambda scope: bent(scope, distortion=lens_parameters("brown_conrady", coefficients=(0.1, 0, 0, 0, 0))),
            "pinhole",
        ),
        ({}, lambda scope: bent(scope, skew=1.0), "expected cameras without skew; found 1 of camera"),
        ({}, apart, "expected one camera, or two that are rectified; found camera, other"),
    ],
)
def test_refusals(stills, options, change, message):
    entry = FormatEntry(name="cityscapes", options=options)
    with pytest.raises(UserError, match=message):
        raise UserError(*refusals(plugins.load(FormatSpec, "cityscapes"), entry, change(scope_of(stills))))


def test_torchvision_reads_it(stills, written):
    datasets = torchvision_datasets()
    kinds = ["instance", "semantic", "polygon", "color"]
    for split in stills.splits:
        found = datasets.Cityscapes(str(written), split=split, mode="fine", target_type=kinds)
        samples = {f"{core(sample)}_leftImg8bit.png": sample for sample in stills if sample.split == split}
        assert len(found) == len(samples)
        for path, (image, (numbers, labels, polygons, colors)) in zip(found.images, found, strict=True):
            sample = next(sample for name, sample in samples.items() if path.endswith(name))
            equal("cityscapes", "torchvision: pictures", np.array(image), sample.rgb)
            equal("cityscapes", "torchvision: labels", np.array(labels), expected_labels(stills, sample))
            assert numbers.mode == "I;16" and colors.mode == "RGBA" and polygons["imgWidth"] == sample.width
            assert {one["label"] for one in polygons["objects"]} == {LABELS[i] for i in np.unique(np.array(labels))}
            for one in found.classes:
                assert one.id < 0 or (LABELS[one.id], COLORS[one.name]) == (one.name, one.color)


def test_cityscapesscripts_read_it(stills, written):
    pytest.importorskip("cityscapesscripts")
    from cityscapesscripts.evaluation.instances2dict import instances2dict
    from cityscapesscripts.helpers.annotation import Annotation
    from cityscapesscripts.helpers.csHelpers import getCsFileInfo
    from cityscapesscripts.helpers.labels import labels as known
    from cityscapesscripts.preparation.json2instanceImg import createInstanceImage
    from cityscapesscripts.preparation.json2labelImg import createLabelImage

    assert [(one.name, one.color) for one in known if one.id >= 0] == list(COLORS.items())
    assert [one.id for one in known if one.hasInstances] == list(INSTANCES)
    for sample in stills:
        file = written / "gtFine" / f"{core(sample)}_gtFine_polygons.json"
        info = getCsFileInfo(str(file))
        assert (info.city, info.sequenceNb, info.frameNb) == ("stills", f"{sample.index:06d}", "000000")
        annotation = Annotation()
        annotation.fromJsonFile(str(file))
        labels = picture(written, "gtFine", core(sample), "gtFine_labelIds.png")
        numbers = picture(written, "gtFine", core(sample), "gtFine_instanceIds.png")
        equal("cityscapes", "cityscapesScripts: labels drawn", np.array(createLabelImage(annotation, "ids")), labels)
        equal("cityscapes", "cityscapesScripts: instances drawn", np.array(createInstanceImage(annotation, "ids")), numbers)
        [found] = instances2dict([str(file).replace("polygons.json", "instanceIds.png")], verbose=False).values()
        cars = sorted(o.area for o in sample.objects if o.category == "car" and o.area)
        assert sorted(one["pixelCount"] for one in found["car"]) == cars
