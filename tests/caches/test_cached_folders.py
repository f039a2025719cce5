"""Entries of several files: copied whole or made anew, whatever became of their files."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from viewsphere.caches import arrays, budget, cache_of, folders
from viewsphere.caches.entries import PREFIX, SUFFIX, write_entry
from viewsphere.caches.folders import FILE_SUFFIX, cached_files

FILES = {"a.obj": b"o" * 5000, "a.glb": b"g" * 3000, "again.mtl": b"o" * 5000, "empty.txt": b""}


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("VIEWSPHERE_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def filled(tmp_path):
    """Fills a new folder, checks it, and returns whether its files were made."""
    count = iter(range(100))

    def fill(name="a"):
        folder, calls = tmp_path / f"out{next(count)}", []
        folder.mkdir()

        def make(place):
            assert not list(place.iterdir())
            calls.append(place)
            for file, content in FILES.items():
                (place / file).write_bytes(content)

        cached_files("exports", name, make, folder)
        assert {file.name: file.read_bytes() for file in folder.iterdir()} == FILES
        return bool(calls)

    return fill


def kept():
    return sorted(cache_of("exports").glob(f"*{FILE_SUFFIX}"), key=lambda file: (file.stat().st_size, file.name))


def test_files_are_made_once_and_equal_ones_kept_once(filled):
    assert filled()
    assert not filled()
    assert [file.stat().st_size for file in kept()] == [0, 3000, 5000]
    assert filled("b")
    assert len(kept()) == 3


def test_files_of_a_data_set_are_its_own(filled, tmp_path):
    filled()
    (tmp_path / "out0" / "a.obj").write_bytes(b"changed")
    assert not filled()


@pytest.mark.parametrize("copies", [0, 1, None])
def test_files_are_whole_where_blocks_cannot_be_copied(copies, filled, monkeypatch):
    """Without copy_file_range, with one that copies a part, and with one that fails at once."""

    def partial(source, target, count, from_, to):
        if copies == 0 or from_ > 0:
            raise OSError(18, "Invalid cross-device link")
        return os.pwrite(target, os.pread(source, 100, 0), 0)

    if copies is None:
        monkeypatch.delattr(folders.os, "copy_file_range", raising=False)
    else:
        monkeypatch.setattr(folders.os, "copy_file_range", partial, raising=False)
    assert filled()
    assert not filled()


def flip(file):
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.write_bytes(content)


@pytest.mark.parametrize(
    "damage", [Path.unlink, flip, lambda file: os.truncate(file, 100), lambda file: file.write_bytes(b"x" * 9999)]
)
def test_an_entry_with_a_damaged_file_is_made_anew(damage, filled):
    filled()
    damage(kept()[1])
    assert filled()
    assert not filled()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes here")
@pytest.mark.parametrize("kind", ["device", "pipe", "dangling", "folder"])
def test_what_is_no_file_costs_time_only(kind, filled):
    filled()
    file = kept()[-1]
    file.unlink()
    match kind:
        case "device":
            file.symlink_to("/dev/zero")
        case "pipe":
            os.mkfifo(file)
        case "dangling":
            file.symlink_to("/nowhere")
        case _:
            file.mkdir()
    assert filled()
    assert filled() == (kind == "folder")


@pytest.mark.parametrize(
    "about",
    [
        {"../escaped": [5000, None]},
        {"/tmp/escaped": [5000, None]},
        {"..": [5000, None]},
        {"a/b": [5000, None]},
        {"a.obj": [5000, "../../secret"]},
        {"a.obj": ["5000", None]},
        {"a.obj": [-1, None]},
        {"a.obj": 5},
        ["a.obj"],
        None,
    ],
)
def test_a_hostile_entry_is_made_anew(about, filled, tmp_path):
    filled()
    good = kept()[-1].name.removesuffix(FILE_SUFFIX)
    if isinstance(about, dict):
        about = {name: [value[0], value[1] or good] if isinstance(value, list) else value for name, value in about.items()}
    write_entry(cache_of("exports") / f"a{SUFFIX}", about, {})
    assert filled()
    assert not (tmp_path / "escaped").exists() and not Path("/tmp/escaped").exists()
    assert not filled()


def test_a_cache_that_cannot_be_written_costs_time_only(filled, cache, monkeypatch):
    cache.write_bytes(b"a file in place of the folder")
    assert filled()
    cache.unlink()

    def full(*_):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(folders, "making", full)
        assert filled()
    with monkeypatch.context() as patch:
        patch.setattr(arrays, "write_arrays", full)
        assert filled()
    assert not list(cache_of("exports").glob(f"*{SUFFIX}")) and not list(cache_of("exports").glob(f"{PREFIX}*"))
    assert filled()
    assert not filled()


def test_errors_of_the_target_are_raised(filled, tmp_path):
    filled()

    def make(folder):
        (folder / "a.obj").write_bytes(b"")

    with pytest.raises(OSError, match="nowhere"):
        cached_files("exports", "a", make, tmp_path / "nowhere")


def test_exports_are_deleted_before_other_entries(filled, monkeypatch):
    other = cache_of("light") / f"old{SUFFIX}"
    write_entry(other, "old", {})
    os.utime(other, (1e9, 1e9))
    filled()
    budget.prune(other.stat().st_size)
    assert other.exists() and not list(cache_of("exports").iterdir())
