"""Shots whose channels lie in one tar: the same samples and exports as from files, in a fraction of the files."""

import io
import re
import shutil
import tarfile

import fsspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from small import small_recipe, tree_hash
from viewsphere import Dataset, generate
from viewsphere.check import check
from viewsphere.check.repair import repair
from viewsphere.codecs import tar
from viewsphere.errors import StoreError
from viewsphere.run.datasets.merging import merge
from viewsphere.run.exports.exporting import export
from viewsphere.store import located
from viewsphere.store.shots.manifest import SHARD, Manifest, digest
from viewsphere.urls import files_below

CHANNELS = ["rgb", "depth", "instances", "normals"]
FORMATS = ["coco", "csv", "native", "webdataset"]


def recipe(shots, **changes):
    files = {"shots": shots, "rgb": "webp", "depth": "png16"}
    return small_recipe(**{"channels": CHANNELS, "formats": FORMATS, "files": files, **changes})


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    """The same data set twice: with a file of each channel, and with a tar of each shot. Do not change them."""
    folder = tmp_path_factory.mktemp("pair")
    for shots in ("files", "tar"):
        generate(recipe(shots), folder / shots)
    return folder / "files", folder / "tar"


@pytest.fixture
def packed(pair, tmp_path):
    """A copy of the one with a tar of each shot."""
    return shutil.copytree(pair[1], tmp_path / "tar")


def shards(root):
    return sorted(root.rglob(SHARD))


def equal(one, other):
    """Return whether two data sets hold equal frames."""
    assert len(one) == len(other) > 0
    for a, b in zip(one, other, strict=True):
        assert [o.rle for o in a.objects] == [o.rle for o in b.objects]
        assert a.channels.keys() == b.channels.keys()
        for name in a.channels:
            assert np.array_equal(a.channels[name], b.channels[name], equal_nan=True), name


@pytest.mark.slow
def test_frames_and_exports_are_those_of_files(pair):
    files, packed = map(Dataset, pair)
    equal(files, packed)
    assert [s.files for s in files] == [s.files for s in packed]
    for name in FORMATS:
        ours, theirs = ({p: (root / name / p).read_bytes() for p in files_below(root / name)} for root in pair)
        assert ours == theirs, name
    assert check(packed).ok
    assert packed.link_kinds == set()


def test_a_shot_is_a_few_files_whatever_it_holds(pair):
    for key, places in Dataset(pair[1]).shots():
        folder = Dataset(pair[1]).store.shot_folder(key)
        assert len(places) * len(CHANNELS) == 8
        assert sorted(path.name for path in folder.rglob("*")) == [SHARD, "frames.json", "manifest.json", "shot.json"]


def test_any_tar_reads_a_shard_and_finds_the_files_where_the_manifest_says(pair):
    for shard in shards(pair[1]):
        plain, spans = pair[0] / shard.parent.relative_to(pair[1]), Manifest.read(shard.parent).spans
        with tarfile.open(shard) as opened:
            members = {member.name: member for member in opened}
            assert members.keys() == spans.keys()
            for name, member in members.items():
                data = opened.extractfile(member).read()
                assert data == (plain / name).read_bytes()
                assert (member.offset_data, member.size) == spans[name][:2]
        assert shard.stat().st_size % tarfile.RECORDSIZE == 0


@pytest.mark.slow
@given(files=st.dictionaries(st.from_regex(r"[a-z]{1,20}/[0-9]{8}\.png", fullmatch=True), st.binary(max_size=2000)))
def test_what_is_put_into_a_tar_comes_out(files):
    data = b"".join(tar.member(name, content) for name, content in files.items())
    with tarfile.open(fileobj=io.BytesIO(data + tar.ending(len(data)))) as opened:
        assert {member.name: opened.extractfile(member).read() for member in opened} == files


@pytest.mark.slow
def test_workers_make_the_same_bytes(pair, tmp_path):
    generate(recipe("tar"), tmp_path / "out", workers=2)
    assert tree_hash(tmp_path / "out" / "store") == tree_hash(pair[1] / "store")


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_damage_is_found_and_mended(pair, packed, seed):
    rng, shard = np.random.default_rng(seed), shards(packed)[seed % 3]
    data = bytearray(shard.read_bytes())
    data[rng.integers(len(data))] ^= 1 << rng.integers(8)
    shard.write_bytes(data[: rng.integers(len(data))] if seed == 5 else data)
    assert any(str(shard) in finding.message for finding in check(Dataset(packed), fast=True).findings)
    assert repair(packed).report.ok
    assert tree_hash(packed) == tree_hash(pair[1])


def test_no_array_comes_out_of_damage(packed):
    sample = Dataset(packed)[0]
    shard = next(s for s in shards(packed) if str(s.parent).endswith(sample.files["rgb"].rpartition("/")[0].rpartition("/")[0]))
    for name, file in sample.files.items():
        at, size, _ = Manifest.read(shard.parent).spans["/".join(file.split("/")[-2:])]
        whole = shard.read_bytes()
        for place in (at, at + size // 2, at + size - 1):
            shard.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
            inside = "/".join(file.split("/")[-2:])
            with pytest.raises(StoreError, match=f"{SHARD}: {inside}: expected .* bytes with digest"):
                Dataset(packed)[0].channels[name]
            with pytest.raises(StoreError, match=r"expected .* bytes with digest"):
                Dataset(packed).link(file, packed / "copy")
        shard.write_bytes(whole)
    shard.unlink()
    with pytest.raises(StoreError, match="expected a readable png file"):
        Dataset(packed)[0].channels["depth"]


@pytest.mark.parametrize("span", [[-1, 5, "ab"], [0, -1, "ab"], [512, 10**15, "ab"], [10**15, 1, "ab"]])
def test_files_beyond_a_shard_are_refused(packed, span):
    folder = shards(packed)[0].parent
    told = Manifest.read(folder)
    Manifest(told.files, {**told.spans, next(iter(told.spans)): tuple(span)}).write(folder)
    with pytest.raises(StoreError, match=f"files beyond the end of {SHARD}"):
        Manifest.read(folder)


@pytest.mark.parametrize("name", ["../x.png", "/etc/passwd"])
def test_names_that_lead_out_of_a_shard_are_refused(packed, name):
    folder = shards(packed)[0].parent
    told = Manifest.read(folder)
    Manifest(told.files, {**told.spans, name: next(iter(told.spans.values()))}).write(folder)
    with pytest.raises(StoreError, match="a path that leads out of it"):
        Manifest.read(folder)


def test_a_shard_that_leads_out_is_not_read(packed, tmp_path):
    sample = Dataset(packed)[0]
    shard = packed / sample.files["rgb"].rpartition("/rgb/")[0] / SHARD
    shard.rename(tmp_path / "elsewhere")
    shard.symlink_to(tmp_path / "elsewhere")
    with pytest.raises(StoreError, match="found a link that leads out of it"):
        sample.channels["rgb"]
    with pytest.raises(StoreError, match="found a link that leads out of it"):
        Dataset(packed).link(sample.files["rgb"], packed / "copy")


@pytest.mark.parametrize("number", ["1e400", "null", '"x"', "[]"])
def test_numbers_that_are_none_are_told(packed, number):
    folder = shards(packed)[0].parent
    text = (folder / "manifest.json").read_text().rpartition(',"digest"')[0] + "}"
    text = re.sub(r'("spans":\{"[^"]+":\[)\d+', rf"\g<1>{number}", text)
    (folder / "manifest.json").write_text(f'{text[:-1]},"digest":"{digest(text.encode())}"}}')
    with pytest.raises(StoreError, match="expected the manifest of a finished folder"):
        Manifest.read(folder)


@pytest.mark.slow
def test_frames_and_channels_are_added_to_either_kind(pair, tmp_path):
    out = shutil.copytree(pair[0], tmp_path / "out")
    more = {"azimuth": [0, 120, 240, 300], "elevation": [15, 50], "distance": 1.0}
    generate(recipe("tar", channels=[*CHANNELS, "categories"], viewpoints=more), out, append=True)
    assert check(Dataset(out)).ok
    found = Dataset(out)
    assert len(found) == 16 and all("categories" in sample.channels for sample in found)
    assert {sample.categories.max() for sample in found} == {1}
    assert len(shards(out)) > 6  # the new frames, and the channel that the old ones got


@pytest.mark.slow
def test_merged_shots_are_packed_as_they_were(pair, tmp_path):
    other = tmp_path / "other"
    generate(recipe("files", seed=5, models=[{"source": "zoo:wheelie_bin", "category": "bin"}]), other)
    merged = merge([pair[1], other], tmp_path / "out")
    equal(merged, [*Dataset(pair[1]), *Dataset(other)])
    assert len(shards(tmp_path / "out")) == len(shards(pair[1])) > 0
    export(tmp_path / "out", FORMATS)
    assert check(merged).ok


def test_at_a_url_a_frame_is_one_range_of_the_shard(pair, monkeypatch):
    root, memory = located("memory://packed/out"), fsspec.filesystem("memory")
    for path in files_below(pair[1]):
        (root / path).write_bytes((pair[1] / path).read_bytes())
    kind, asked = fsspec.get_filesystem_class("memory"), []
    works = kind.cat_file

    def cat_file(self, path, start=None, end=None, **options):
        asked.append((path.rpartition("/")[2], start, end))
        return works(self, path, start=start, end=end, **options)

    monkeypatch.setattr(kind, "cat_file", cat_file)
    dataset, near = Dataset(root), Dataset(pair[1])
    for number in (3, 7, 2):
        sample = dataset[number]
        asked.clear()
        assert np.array_equal(sample.depth, near[number].depth)
        folder = near.store.root / sample.files["depth"]
        at, size, _ = Manifest.read(folder.parents[1]).spans["/".join(folder.parts[-2:])]
        assert asked[-1] == (SHARD, at, at + size) and len(asked) <= 2  # the manifest, where the shot is another
    memory.store.clear()
