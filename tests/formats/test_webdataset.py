"""The format `webdataset`, read by the package of that name."""

import json
import tarfile
from itertools import pairwise

import numpy as np
import pytest

from cube_dataset import make
from viewsphere import Dataset
from viewsphere.formats.webdataset import FORMAT
from viewsphere.model.fields.files import Files
from viewsphere.run.exports.exporting import export
from viewsphere.store.shots.sample_records import from_whole_sample

webdataset = pytest.importorskip("webdataset")


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    return make(tmp_path_factory.mktemp("webdataset") / "out", several=True, ground=True)


def exported(dataset, folder, **options):
    export(dataset.root, [{"webdataset": options}], output=folder)
    return folder / "webdataset"


def read(shards, *decoders):
    urls = [str(shard) for shard in shards]
    return list(webdataset.WebDataset(urls, shardshuffle=False, empty_check=False).decode(*decoders))


def test_its_reader_gives_the_samples(dataset, tmp_path):
    folder = exported(dataset, tmp_path)
    for split in dataset.splits:
        wanted = [sample for sample in dataset if sample.split == split]
        found = read(sorted(folder.glob(f"{split}-*.tar")), "rgb8")
        assert [sample["__key__"] for sample in found] == [f"{sample.index:08d}" for sample in wanted]
        for sample, one in zip(wanted, found, strict=True):
            fields = {"json", "rgb.png", "rgba.png", *(f"{name}.npy" for name in sample.channels if "rgb" not in name)}
            assert {name for name in one if not name.startswith("__")} == fields
            np.testing.assert_array_equal(one["rgb.png"], sample.rgb)
            for name in fields - {"json", "rgb.png", "rgba.png"}:
                channel = sample.channels[name.removesuffix(".npy")]
                np.testing.assert_array_equal(one[name], channel)
                assert one[name].dtype == channel.dtype
            assert_same(one["json"], sample)


def assert_same(record, sample):
    """The JSON has everything of a sample, to the last bit."""
    restored = from_whole_sample({**record, "files": {}, "objects": [{**o, "model": ""} for o in record["objects"]]}, {}, {})
    assert (restored.index, restored.split, restored.pose) == (sample.index, sample.split, sample.pose)
    np.testing.assert_array_equal(restored.camera.P, sample.camera.P)
    for one, other in zip(restored.objects, sample.objects, strict=True):
        assert (one.id, one.category, one.key, one.box2d, one.rle) == (
            other.id,
            other.category,
            other.key,
            other.box2d,
            other.rle,
        )
        np.testing.assert_array_equal(one.box3d_pixels, other.box3d_pixels)
        np.testing.assert_array_equal(one.camera_from_object, other.camera_from_object)


def test_shards_end_where_the_options_say(dataset, tmp_path):
    by_count = exported(dataset, tmp_path / "count", samples_per_shard=2)
    assert counts(by_count) == {"train-000000.tar": 2, "train-000001.tar": 1, "val-000000.tar": 1}
    sizes = {file.name: file.stat().st_size for file in by_count.glob("*.tar")}
    most = sizes["val-000000.tar"]
    by_size = exported(dataset, tmp_path / "size", bytes_per_shard=most)
    assert counts(by_size) == {"train-000000.tar": 1, "train-000001.tar": 1, "train-000002.tar": 1, "val-000000.tar": 1}
    for folder in (by_count, by_size):
        for split in dataset.splits:
            index = json.loads((folder / f"{split}.json").read_text())
            assert index["wids_version"] == 1
            assert [c["name"] for c in index["categories"]] == [c.name for c in dataset.categories]
            assert {shard["url"]: shard["nsamples"] for shard in index["shardlist"]} == {
                name: count for name, count in counts(folder).items() if name.startswith(f"{split}-")
            }
            assert all((folder / shard["url"]).stat().st_size == shard["filesize"] for shard in index["shardlist"])
        assert sorted(s["__key__"] for s in read(sorted(folder.glob("*.tar")))) == [f"{s.index:08d}" for s in dataset]


def counts(folder):
    """Samples of each shard, counted by the package."""
    return {file.name: len(read([file])) for file in sorted(folder.glob("*.tar"))}


def test_equal_samples_make_equal_tars(dataset, tmp_path):
    one, other = (exported(Dataset(dataset.root), tmp_path / name) for name in ("one", "other"))
    assert {f.name: f.read_bytes() for f in one.iterdir()} == {f.name: f.read_bytes() for f in other.iterdir()}
    for file in one.glob("*.tar"):
        with tarfile.open(file) as tar:
            members = tar.getmembers()
        assert {(m.mtime, m.uid, m.gid, m.uname, m.gname, m.mode) for m in members} == {(0, 0, 0, "", "", 0o644)}
        keys = [m.name.split(".")[0] for m in members]
        assert all(one <= other for one, other in pairwise(keys))


def test_the_stores_files_are_smaller(tmp_path):
    dataset = make(tmp_path / "out", several=True, files=Files(depth="png16", rgb="webp"))
    plain, stored = (exported(dataset, tmp_path / name, arrays=name) for name in ("npy", "files"))
    first = read(sorted(stored.glob("train-*.tar")))[0]
    for name in ("rgb.webp", "depth.png", "normals.tiff", "instances.png"):
        assert first[name] == dataset.path(dataset[0].files[name.split(".")[0]]).read_bytes()
    assert sum(f.stat().st_size for f in stored.iterdir()) < 0.7 * sum(f.stat().st_size for f in plain.iterdir())
    assert list(FORMAT.verify(dataset, stored, (), FORMAT.options(arrays="files"))) == []
    assert list(FORMAT.verify(dataset, stored, (), FORMAT.options()))


def test_its_proof_names_the_frame_and_the_file(dataset, tmp_path):
    folder = exported(dataset, tmp_path)
    shard = folder / "train-000000.tar"
    with tarfile.open(shard) as tar:
        last = [m for m in tar.getmembers() if m.name.endswith("depth.npy")][-1]
    data = bytearray(shard.read_bytes())
    data[last.offset_data + 200] ^= 1
    shard.unlink()
    shard.write_bytes(data)
    ((frame, line),) = FORMAT.verify(dataset, folder, (), FORMAT.options())
    assert frame == int(last.name[:8])
    assert line.startswith(f"train-000000.tar: {last.name}: expected the bytes that are exported")
