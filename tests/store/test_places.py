"""Data sets at URLs: the same bytes as on a disk, whole or absent, whatever goes wrong on the way."""

import errno
import pickle
import shutil
import subprocess
import sys
from pathlib import Path

import fsspec
import numpy as np
import pytest

from small import small_recipe
from viewsphere import Dataset, generate
from viewsphere.check import check
from viewsphere.check.repair import repair
from viewsphere.errors import RemoteError, StoreError, UserError
from viewsphere.run.datasets.merging import merge
from viewsphere.run.exports.exporting import export
from viewsphere.store import Store, located
from viewsphere.store.shots.checksums import CHECKSUMS
from viewsphere.urls import byte_range, files_below, here, remote_path
from viewsphere.urls.remote_path import RemotePath

FEW = {
    "viewpoints": {"azimuth": [0, 120], "elevation": [15], "distance": 1.0},
    "camera": {"size": [48, 36], "fov_deg": 35},
    "channels": ["rgb", "depth", "instances"],
    "formats": ["coco"],
    "shot_frames": 1,
}
"""Four frames, each a shot."""


@pytest.fixture
def url(monkeypatch):
    """A place of this process's memory that is empty, and is asked again at once."""
    monkeypatch.setattr(remote_path, "FIRST_WAIT_S", 0.0)
    memory = fsspec.filesystem("memory")
    memory.store.clear()
    memory.pseudo_dirs[:] = [""]
    yield "memory://pictures/out"
    memory.store.clear()


@pytest.fixture(scope="module")
def few(tmp_path_factory):
    """A small data set on the disk."""
    root = tmp_path_factory.mktemp("few") / "out"
    generate(small_recipe(**FEW), root)
    return root


@pytest.fixture
def uploaded(url, few):
    """The same, at a URL."""
    for path, data in contents(few).items():
        (located(url) / path).write_bytes(data)
    return located(url)


def contents(root):
    """All files but the lock of those that take turns, which a URL has not."""
    return {path: (root / path).read_bytes() for path in files_below(root) if path != "store/lock"}


def failing(monkeypatch, method, times, error=OSError("please wait")):
    """Let the memory refuse the first calls of a method for each path; gives the paths that were refused."""
    kind, refused = fsspec.get_filesystem_class("memory"), []
    works = getattr(kind, method)

    def refuse(self, path, *args, **options):
        if refused.count(path) < times:
            refused.append(path)
            raise error
        return works(self, path, *args, **options)

    monkeypatch.setattr(kind, method, refuse)
    return refused


@pytest.mark.parametrize("given", ["s3://bucket/a/b", "s3:/bucket/a/b", Path("s3://bucket/a/b"), located("s3://bucket/a/b")])
def test_urls_are_told_from_folders(given):
    found = located(given)
    assert isinstance(found, RemotePath) and str(found) == "s3://bucket/a/b"
    assert pickle.loads(pickle.dumps(found)) == found
    assert str(found / "store" / "plan.json") == "s3://bucket/a/b/store/plan.json"
    assert (found / "store/plan.json").relative_to(found).as_posix() == "store/plan.json"


def test_folders_stay_folders(tmp_path):
    assert located(str(tmp_path)) == located(f"file://{tmp_path}") == tmp_path
    assert not isinstance(located("a:b/c"), RemotePath)


def test_passwords_are_refused_and_not_shown():
    with pytest.raises(UserError) as refused:
        located("s3://somebody:s3cr3t@bucket/out")
    assert "s3cr3t" not in str(refused.value) and "without a password" in str(refused.value)


def test_unknown_kinds_of_urls_are_told():
    with pytest.raises(UserError, match="nothing://x: expected a URL that fsspec opens"):
        located("nothing://x").read_bytes()


def test_nothing_is_done_to_the_disk_by_mistake(url):
    with pytest.raises(TypeError, match="expected a file on this machine"):
        shutil.copyfile(located(url) / "file", "file")
    assert not hasattr(located(url), "rename")


@pytest.mark.slow
def test_data_sets_on_a_disk_need_no_fsspec(few):
    code = f"import sys, viewsphere; viewsphere.open({str(few)!r})[0].rgb; print('fsspec' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "False\n"


def test_files_are_read_in_blocks_and_ranges(url, monkeypatch):
    file, data = located(url) / "file", np.random.default_rng(0).bytes(1000)
    file.write_bytes(data)
    monkeypatch.setattr(remote_path, "BLOCK", 64)
    with file.open("rb") as stream:
        assert stream.read(100) == data[:100]
        stream.seek(-10, 2)
        assert stream.read() == data[-10:]
    assert byte_range(file, 7, 20) == data[7:27]
    assert file.stat().st_size == 1000
    with here(file) as copy:
        assert copy.name == "file" and copy.read_bytes() == data


def test_ranges_of_servers_that_have_none_or_end_before(url, monkeypatch):
    kind, file = fsspec.get_filesystem_class("memory"), located(url) / "file"
    file.write_bytes(bytes(range(200)))
    monkeypatch.setattr(kind, "cat_file", lambda self, path, **_: bytes(range(200)))
    assert byte_range(file, 7, 20) == bytes(range(7, 27))

    def beyond(self, path, **_):
        raise OSError(errno.EINVAL, "The requested range is not satisfiable")

    monkeypatch.setattr(kind, "cat_file", beyond)
    assert byte_range(file, 300, 20) == b""


@pytest.mark.slow
def test_a_rendered_data_set_is_the_same_at_a_url(few, url, monkeypatch):
    kind, written = fsspec.get_filesystem_class("memory"), {}
    works = kind.put_file

    def put_file(self, file, path):
        folder, _, name = path.partition("/store/shots/")[2].partition("/")[2].partition("/")
        written.setdefault(folder, []).append(name)
        works(self, file, path)

    monkeypatch.setattr(kind, "put_file", put_file)
    assert generate(small_recipe(**FEW), url).rendered == 4
    assert contents(located(url)) == contents(few)
    shots = [names for folder, names in written.items() if folder]
    assert len(shots) == 4 and all(names[-1] == "manifest.json" for names in shots)
    assert generate(small_recipe(**FEW), url).rendered == 0
    assert contents(located(url)) == contents(few)


def test_what_was_stopped_goes_on(few, url):
    def stop(progress):
        if progress.phase == "frames" and progress.done >= 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        generate(small_recipe(**FEW), url, listener=stop)
    begun = len(Dataset(url))
    assert 0 < begun < 4
    assert generate(small_recipe(**FEW), url).rendered == 4 - begun
    assert contents(located(url)) == contents(few)


def test_a_shot_without_its_manifest_is_absent_and_made_anew(few, uploaded):
    root = uploaded
    manifest = next(path for path in files_below(root / "store/shots") if path.endswith("manifest.json"))
    (root / "store/shots" / manifest).unlink()
    (root / "store/shots" / manifest).with_name("stranger").write_bytes(b"left by a run that was ended")
    assert len(Dataset(root)) == 3
    assert generate(small_recipe(**FEW), root).rendered == 1
    assert contents(root) == contents(few)


def test_other_recipes_and_strange_files_are_refused(few, url):
    (located(url) / "notes.txt").write_bytes(b"mine")
    with pytest.raises(StoreError, match="found other files"):
        generate(small_recipe(**FEW), url)
    (located(url) / "notes.txt").unlink()
    for path, data in contents(few).items():
        (located(url) / path).write_bytes(data)
    with pytest.raises(StoreError, match="expected data of recipe"):
        generate(small_recipe(**FEW, seed=8), url)


def test_other_processes_are_refused_what_only_this_one_sees(url):
    with pytest.raises(UserError, match="expected workers 0"):
        generate(small_recipe(**FEW), url, workers=2)


def test_samples_are_those_of_the_disk(uploaded, few):
    there, here_ = pickle.loads(pickle.dumps(Dataset(uploaded))), Dataset(few)
    assert len(there) == len(here_)
    assert np.array_equal(there[3].depth, here_[3].depth) and there[3].objects[0].box2d == here_[3].objects[0].box2d
    fields = ("rgb", "index", "objects.box2d")
    for one, other in zip(there.select(*fields), here_.select(*fields), strict=True):
        assert all(np.array_equal(one[name], other[name]) for name in fields)


def test_exports_go_from_and_to_urls(few, url, tmp_path):
    export(few, ["native"], output=f"{url}/elsewhere")
    export(few, ["native"], output=tmp_path)
    assert contents(located(url) / "elsewhere/native") == contents(tmp_path / "native")
    with pytest.raises(StoreError, match="expected an empty or new folder"):
        export(few, ["native"], output=f"{url}/elsewhere")
    for path, data in contents(few).items():
        (located(url) / "set" / path).write_bytes(data)
    assert export(f"{url}/set", ["native"], output=tmp_path / "again") == ()
    assert contents(tmp_path / "again/native") == contents(tmp_path / "native")


def test_data_sets_at_urls_are_merged(few, uploaded, tmp_path):
    generate(small_recipe(**FEW, seed=8), tmp_path / "other")
    merge([uploaded, tmp_path / "other"], tmp_path / "one")
    merge([few, tmp_path / "other"], tmp_path / "two")
    assert contents(tmp_path / "one") == contents(tmp_path / "two")


def damage(root, few):
    """One file of each kind is changed, cut, lost or too many; gives which."""
    files = [path for path in contents(few) if not path.endswith(("plan.json", "skipped.json"))]
    kinds = {}
    for path in files:
        kinds.setdefault((path.split("/")[0], Path(path).suffix, Path(path).parent.name in FEW["channels"]), []).append(path)
    spoilt = [kinds[kind][i % len(kinds[kind])] for i, kind in enumerate(kinds)]
    for i, path in enumerate(spoilt):
        data = bytearray((root / path).read_bytes())
        if i % 3 == 0:
            data[len(data) // 2] ^= 4
        elif i % 3 == 1:
            del data[len(data) // 2 :]
        (root / path).unlink()
        if i % 3 < 2:
            (root / path).write_bytes(bytes(data))
    return spoilt


@pytest.mark.slow
def test_damage_is_found_and_mended(few, uploaded):
    root = uploaded
    assert check(Dataset(root), sample=2, rays=False).ok
    spoilt = damage(root, few)
    assert len(spoilt) > 6
    found = [str(finding) for finding in check(Dataset(root), fast=True).findings]
    for path in spoilt:
        known = Path(path).parts[-2:]  # a lost manifest is found by the shot that is missing
        known += (CHECKSUMS,) if path.startswith("coco/") else ()  # a list that is damaged, too, vouches for nothing
        assert any(name in text for name in known for text in found), path
    repaired = repair(root, fast=True)
    assert repaired.report.ok, repaired.report.findings
    assert check(Dataset(root), fast=True).not_run == {
        "labels, plan, models": "only digests were compared, check without --fast"
    }
    assert contents(root) == contents(few)


def test_what_is_refused_is_asked_again(few, url, monkeypatch):
    refused = [failing(monkeypatch, method, 2) for method in ("cat_file", "info", "find", "put_file")]
    generate(small_recipe(**FEW), url)
    assert all(refused)
    assert contents(located(url)) == contents(few)


def test_what_never_answers_is_one_line(url, monkeypatch):
    failing(monkeypatch, "put_file", 99, OSError("no luck at https://me:s3cr3t@host"))
    with pytest.raises(
        RemoteError, match=r"memory://pictures/out/store/plan.json: expected to write it, found, 5 times"
    ) as told:
        generate(small_recipe(**FEW), url)
    assert "s3cr3t" not in str(told.value) and "\n" not in str(told.value)
    assert list(files_below(located(url))) == []


def test_refusals_are_not_asked_again(uploaded, monkeypatch):
    refused = failing(monkeypatch, "cat_file", 99, PermissionError("Access Denied"))
    with pytest.raises(RemoteError, match="expected to be allowed to read it, found: PermissionError: Access Denied"):
        Dataset(uploaded)
    assert len(refused) == 1


def test_a_picture_that_is_not_answered_is_no_damage(uploaded, monkeypatch):
    sample = Dataset(uploaded)[0]
    failing(monkeypatch, "cat_file", 99)
    with pytest.raises(RemoteError, match="expected to read it, found, 5 times"):
        sample.channels["rgb"]


def test_the_store_says_what_is_missing(url):
    with pytest.raises(StoreError, match="memory://pictures/out: expected a folder that render wrote"):
        Store(located(url)).plan()
