"""The format `huggingface`, loaded by the package `datasets`, without a network."""

from __future__ import annotations

import math
import sys

import numpy as np
import pytest

from cube_dataset import CHANNELS, make
from viewsphere import Dataset
from viewsphere.errors import UserError
from viewsphere.formats.huggingface import FORMAT, Options
from viewsphere.labels import channels
from viewsphere.model.fields.files import Files
from viewsphere.run.datasets.importing import import_dataset
from viewsphere.run.exports.exporting import export

pytestmark = pytest.mark.filterwarnings("ignore")  # its own, of packages that it uses
PICTURES = [name for name in CHANNELS if name in {"rgb", "rgba"} or channels()[name].components == 1]


@pytest.fixture(scope="module")
def datasets(tmp_path_factory):
    """The package, offline, with its caches in a folder of the test's."""
    with pytest.MonkeyPatch.context() as patch:
        for name in ("HF_HUB_OFFLINE", "HF_DATASETS_OFFLINE"):
            patch.setenv(name, "1")
        patch.setenv("HF_HOME", str(tmp_path_factory.mktemp("hub")))
        yield pytest.importorskip("datasets")


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    return make(tmp_path_factory.mktemp("huggingface") / "out", several=True, ground=True)


def exported(dataset, folder, **options):
    export(dataset.root, [{"huggingface": options}], output=folder)
    return folder / "huggingface"


def loaded(datasets, folder, tmp_path, **how):
    return datasets.load_dataset(str(folder), cache_dir=str(tmp_path / "cache"), **how)


def test_it_loads_with_types(datasets, dataset, tmp_path):
    found = loaded(datasets, exported(dataset, tmp_path), tmp_path)
    assert set(found) == set(dataset.splits)
    for split, part in found.items():
        features = part.features
        assert features["image"] == datasets.Image() == features["depth"]
        assert set(features) - {"image"} >= set(PICTURES) - {"rgb"}
        assert "normals" not in features
        assert features["index"] == datasets.Value("int64")
        objects = features["objects"]
        assert objects["category"].feature == datasets.ClassLabel(names=[c.name for c in dataset.categories])
        assert objects["bbox"].feature == datasets.Sequence(datasets.Value("float64"), length=4)
        wanted = [sample for sample in dataset if sample.split == split]
        for sample, row in zip(wanted, part, strict=True):
            assert_same(row, sample, objects["category"].feature)


def assert_same(row, sample, classes):
    assert row["index"] == sample.index
    np.testing.assert_array_equal(np.asarray(row["image"]), sample.rgb)
    for name in set(PICTURES) - {"rgb"}:
        np.testing.assert_array_equal(np.asarray(row[name]), sample.channels[name])
    assert (row["image"].width, row["image"].height) == (row["width"], row["height"]) == (sample.width, sample.height)
    np.testing.assert_array_equal(row["camera"]["K"], sample.camera.K)
    np.testing.assert_array_equal(row["camera"]["R"], sample.camera.R)
    np.testing.assert_array_equal(row["camera"]["t"], sample.camera.t)
    assert row["pose"]["azimuth_deg"] == sample.pose.azimuth_deg
    seen, told = [o for o in sample.objects if o.area], row["objects"]
    assert told["id"] == [o.id for o in seen]
    assert [classes.int2str(number) for number in told["category"]] == [o.category for o in seen]
    for o, (x, y, width, height) in zip(seen, told["bbox"], strict=True):
        assert (x, y, x + width, y + height) == o.box2d
    for name in ("box3d_camera", "box3d_pixels", "camera_from_object"):
        np.testing.assert_array_equal(told[name], [getattr(o, name) for o in seen])


def test_it_streams_shards_in_order(datasets, dataset, tmp_path):
    folder = exported(dataset, tmp_path, samples_per_shard=2)
    assert {file.name for file in (folder / "data").iterdir()} == {
        f"{n}.parquet" for n in ("train-00000", "train-00001", "val-00000")
    }
    for split in dataset.splits:
        found = loaded(datasets, folder, tmp_path, split=split, streaming=True)
        assert [row["index"] for row in found] == [sample.index for sample in dataset if sample.split == split]
    assert list(FORMAT.verify(dataset, folder, (), Options(samples_per_shard=2))) == []


def test_files_that_pillow_cannot_read_are_made_anew(datasets, tmp_path):
    pytest.importorskip("imagecodecs")
    dataset = make(tmp_path / "out", files=Files(rgb="qoi", depth="npz", masks="png8"), channels=("rgb", "depth", "instances"))
    for row in loaded(datasets, exported(dataset, tmp_path), tmp_path, split="train"):
        sample = next(sample for sample in dataset if sample.index == row["index"])
        np.testing.assert_array_equal(np.asarray(row["image"]), sample.rgb)
        np.testing.assert_array_equal(np.asarray(row["depth"]), sample.depth)
        np.testing.assert_array_equal(np.asarray(row["instances"]), sample.instances)


def test_a_data_set_without_cameras(datasets, dataset, tmp_path):
    export(dataset.root, ["coco"])
    import_dataset("coco", dataset.root / "coco", tmp_path / "imported")
    imported = Dataset(tmp_path / "imported")
    (row, *_) = loaded(datasets, exported(imported, tmp_path), tmp_path, split="train")
    assert row["camera"] is None
    assert math.isnan(np.array(row["objects"]["box3d_camera"])[0, 0, 0])
    assert [b is not None for b in row["objects"]["bbox"]] == [True] * len([o for o in imported[0].objects if o.box2d])


def test_its_proof_names_the_row(dataset, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    folder = exported(dataset, tmp_path)
    file = folder / "data" / "train-00000.parquet"
    table = parquet.read_table(file)
    values = table["time"].to_pylist()
    column = [*values[:-1], values[-1] + 1]
    changed = table.set_column(table.schema.get_field_index("time"), table.schema.field("time"), [column])
    file.unlink()
    parquet.write_table(changed, file)
    ((frame, line),) = FORMAT.verify(dataset, folder, (), Options())
    assert frame == table["index"][-1].as_py()
    assert line == "data/train-00000.parquet: expected the time that is exported, found another: export again"


def test_another_pyarrows_bytes_are_no_damage(dataset, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    folder = exported(dataset, tmp_path)
    file = folder / "data" / "train-00000.parquet"
    wrote = parquet.ParquetFile(file).metadata.created_by.encode()
    data = file.read_bytes()
    file.unlink()
    file.write_bytes(data.replace(wrote, wrote[:-1] + b"9"))
    assert data != file.read_bytes()
    assert list(FORMAT.verify(dataset, folder, (), Options())) == []


def test_splits_of_names_that_datasets_refuses(datasets, dataset, tmp_path, monkeypatch):
    from viewsphere.formats import huggingface
    from viewsphere.formats.huggingface.shards import split_name

    assert split_name("night-rain 2") == "night_rain_2"
    monkeypatch.setattr(huggingface, "split_name", lambda name: "one")
    with pytest.raises(UserError, match="expected splits that differ"):
        exported(dataset, tmp_path)


def test_it_needs_pyarrow(dataset, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    with pytest.raises(UserError, match=r"pip install 'viewsphere\[huggingface\]'"):
        exported(dataset, tmp_path)


def test_pictures_keep_their_bytes(datasets, dataset, tmp_path):
    (row, *_) = loaded(datasets, exported(dataset, tmp_path), tmp_path, split="val").cast_column(
        "image", datasets.Image(decode=False)
    )
    sample = next(sample for sample in dataset if sample.split == "val")
    assert row["image"]["bytes"] == dataset.path(sample.files["rgb"]).read_bytes()
