"""ImageFolder, read by torchvision where it is installed, and by `datasets`: pictures in the class of their largest object."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image
from torchvision_readers import torchvision_datasets

from proven import close, equal
from viewsphere import Dataset, generate
from viewsphere.errors import UserError
from viewsphere.formats.imagefolder import FORMAT
from viewsphere.run.exports.exporting import export
from viewsphere.run.exports.scope import scope_of
from worlds import poses as recipe

HOSTILE = 'train/..%[x] "y"? é. '
"""A category that would lead out of its split, name a split, and end as folders of Windows cannot."""
FOLDER = "train%2F..%25%5Bx%5D %22y%22%3F é.%20"


@pytest.fixture(scope="module")
def written(request, tmp_path_factory):
    made = {}

    def get(world, by):
        if (world, by) not in made:
            made[world, by] = tmp_path_factory.mktemp("imagefolder")
            export(request.getfixturevalue(world).root, [{"imagefolder": {"by": by}}], output=made[world, by])
        return made[world, by] / "imagefolder"

    return get


@pytest.fixture(scope="module")
def datasets(tmp_path_factory):
    """The package, offline, with its caches in a folder of the test's."""
    with pytest.MonkeyPatch.context() as patch:
        for name in ("HF_HUB_OFFLINE", "HF_DATASETS_OFFLINE"):
            patch.setenv(name, "1")
        patch.setenv("HF_HOME", str(tmp_path_factory.mktemp("hub")))
        yield pytest.importorskip("datasets")


@pytest.fixture(scope="module")
def odd(tmp_path_factory):
    """Pictures of one category of a hostile name, and half of them of nothing."""
    out = tmp_path_factory.mktemp("odd") / "out"
    said = recipe(
        rig={"sensors": {"ahead": {}, "behind": {"rotation": [0, 180, 0]}}},
        models=[{"source": "zoo:post_box", "category": HOSTILE}],
        viewpoints={"azimuth": [0, 90], "elevation": [20], "distance": 2.5},
        scene={}, channels=["rgb", "instances"], annotations=[], splits={},
    )  # fmt: skip
    generate(said, out)
    return Dataset(out)


def largest(sample):
    return sorted(sample.objects, key=lambda o: (-o.area, o.id))[0]


@pytest.mark.parametrize("by", ["category", "pose_category"])
@pytest.mark.parametrize("world", ["stills", "poses", "videos"])
def test_each_picture_is_in_its_class(request, written, world, by):
    dataset, folder = request.getfixturevalue(world), written(world, by)
    for sample in dataset:
        file = folder / sample.split / getattr(largest(sample), by) / f"{sample.index:08d}.png"
        with Image.open(file) as opened:
            equal("imagefolder", "own reader: pictures", np.asarray(opened), sample.rgb)
    assert len(list(folder.rglob("*.png"))) == len(dataset)


@pytest.mark.parametrize("by", ["category", "pose_category"])
def test_torchvision_reads_it(stills, written, by):
    reader = torchvision_datasets().ImageFolder
    for split in stills.splits:
        own = [sample for sample in stills if sample.split == split]
        found = reader(str(written("stills", by) / split))
        labels = {sample.index: getattr(largest(sample), by) for sample in own}
        assert found.classes == sorted(set(labels.values()))
        assert len(found) == len(own)
        for (path, _), (image, number) in zip(found.samples, found, strict=True):
            index = int(path.rpartition("/")[2].removesuffix(".png"))
            equal("imagefolder", "torchvision: classes", found.classes[number], labels[index])
            equal("imagefolder", "torchvision: pictures", np.asarray(image), stills[index].rgb)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("by", ["category", "pose_category"])
@pytest.mark.slow
def test_datasets_reads_it(datasets, stills, written, by, tmp_path):
    found = datasets.load_dataset(str(written("stills", by)), cache_dir=str(tmp_path))
    assert tuple(found) == stills.splits
    for split, part in found.items():
        rows = sorted(part, key=lambda row: row["index"])
        assert [row["index"] for row in rows] == [sample.index for sample in stills if sample.split == split]
        for row in rows:
            sample = stills[row["index"]]
            o = largest(sample)
            equal("imagefolder", "datasets: pictures", np.asarray(row["image"]), sample.rgb)
            equal("imagefolder", "datasets: labels", row["label"], getattr(o, by))
            assert (row["category"], row["pose_category"], row["model"]) == (o.category, o.pose_category, o.key)
            assert row["objects"] == sum(bool(one.area) for one in sample.objects)
            close("imagefolder", "datasets: boxes", row["box"], o.box2d, "px")
            view = (row["azimuth"], row["elevation"], row["distance"], row["tilt"])
            own = (o.view.azimuth_deg, o.view.elevation_deg, o.view.distance, o.view.tilt_deg)
            close("imagefolder", "datasets: viewpoints", view, own, "degrees, m")
            close("imagefolder", "datasets: visibility", row["visibility"], o.visibility)


@pytest.mark.filterwarnings("ignore")
def test_hostile_names_and_pictures_of_nothing(datasets, odd, tmp_path):
    export(odd.root, "imagefolder", output=tmp_path)
    folder = tmp_path / "imagefolder"
    (split,) = {sample.split for sample in odd}
    seen = [sample.index for sample in odd if sample.sensor == "ahead"]
    assert [path.name for path in (folder / split).iterdir() if path.is_dir()] == [FOLDER]
    assert [path.stem for path in sorted(folder.rglob("*.png"))] == [f"{index:08d}" for index in seen]
    found = datasets.load_dataset(str(folder), cache_dir=str(tmp_path / "cache"))
    assert list(found) == [split]
    assert [(row["index"], row["label"]) for row in found[split]] == [(index, HOSTILE) for index in seen]
    lines = (folder / split / "metadata.jsonl").read_text().splitlines()
    assert [json.loads(line)["file_name"] for line in lines] == [f"{FOLDER}/{index:08d}.png" for index in seen]


def scoped(dataset, **changes):
    return replace(scope_of(dataset), **changes)


def named(dataset, *names):
    one = scope_of(dataset).categories[0]
    return scoped(dataset, categories=tuple(replace(one, name=name) for name in names))


def test_what_it_refuses(poses):
    assert list(FORMAT.refuses(named(poses, "é" * 128), FORMAT.options())) == [
        f"expected names of categories that fit a folder's, 1 to 255 bytes; found {'é' * 128!r}"
    ]
    assert list(FORMAT.refuses(named(poses, "Car", "car"), FORMAT.options())) == [
        "expected names of categories that differ in more than case and signs; found Car, car"
    ]
    assert list(FORMAT.refuses(named(poses, "Car", "car"), FORMAT.options(by="pose_category"))) == []
    assert list(FORMAT.refuses(scoped(poses, splits=("a b", "a-b")), FORMAT.options())) == [
        "expected names of splits that differ in more than case and signs; found a_b, a_b"
    ]


def test_objects_without_a_pose_have_no_pose_category(poses):
    from viewsphere.formats.imagefolder import ImageFolder

    sample = poses[0]
    unknown = replace(sample, objects=tuple(replace(o, pose_category="") for o in sample.objects))
    with pytest.raises(UserError, match=r"imagefolder: expected the pose_category of object 1; found none .frame 0."):
        list(ImageFolder(poses, FORMAT.options(by="pose_category")).sample_files(unknown))
