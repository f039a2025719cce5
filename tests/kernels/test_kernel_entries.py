"""Files of compiled kernels: found by content, whole, and nobody else's."""

from __future__ import annotations

import errno
import os
import pickle
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from viewsphere.caches.entries import PREFIX, sweep_once
from viewsphere.kernels import entries
from viewsphere.scratch import of_this_process

NAME = "0123/kernels_a.b-4567.kernel"
posix = pytest.mark.skipif(os.name != "posix", reason="owners and modes are POSIX's")


@pytest.fixture(autouse=True)
def root(monkeypatch, tmp_path):
    monkeypatch.setenv("VIEWSPHERE_CACHE", str(tmp_path / "cache"))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setattr(entries.tempfile, "gettempdir", lambda: str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    entries._warn.cache_clear()
    yield tmp_path / "cache" / "kernels"
    entries._warn.cache_clear()


def test_an_entry_is_read_as_it_was_written(root):
    assert entries.load(NAME) is None and not entries.has(NAME)
    entries.save(NAME, b"code" * 1000)
    assert entries.load(NAME) == b"code" * 1000 and entries.has(NAME)
    assert (root / NAME).stat().st_size < 200
    assert [file.name for file in (root / NAME).parent.iterdir()] == [Path(NAME).name]


def test_reading_an_entry_notes_that_it_was_used(root):
    entries.save(NAME, b"code")
    os.utime(root / NAME, (1e9, 1e9))
    entries.load(NAME)
    assert (root / NAME).stat().st_mtime > 1.5e9


@pytest.mark.parametrize("keep", [0, 1, 31, 32, 33, -1])
def test_a_truncated_entry_is_none(root, keep):
    entries.save(NAME, os.urandom(500))
    whole = (root / NAME).read_bytes()
    (root / NAME).write_bytes(whole[:keep])
    assert entries.load(NAME) is None
    entries.save(NAME, b"anew")
    assert entries.load(NAME) == b"anew"


def test_an_entry_of_which_any_bit_has_flipped_is_none(root):
    entries.save(NAME, b"some code")
    whole = (root / NAME).read_bytes()
    for bit in range(len(whole) * 8):
        flipped = bytearray(whole)
        flipped[bit // 8] ^= 1 << bit % 8
        (root / NAME).write_bytes(flipped)
        assert entries.load(NAME) is None


@posix
@pytest.mark.parametrize("place", ["kernels", "0123"])
@pytest.mark.parametrize("mode", [0o777, 0o1777, 0o770])
def test_a_folder_that_others_can_write_is_not_read(root, capsys, tmp_path, place, mode):
    entries.save(NAME, b"hostile")
    folder = root if place == "kernels" else root / "0123"
    folder.chmod(mode)
    entries._warn.cache_clear()
    assert entries.load(NAME) is None and not entries.has(NAME)
    assert entries.load(NAME) is None
    warned = capsys.readouterr().err
    assert warned.count("\n") == 1 and str(folder) in warned and "chmod 700" in warned
    entries.save(NAME, b"own")
    kept = place == "kernels"  # of one build's folder that others can write, nothing is kept
    assert entries.load(NAME) == (b"own" if kept else None)
    assert len(list((tmp_path / "temporary").rglob("*.kernel"))) == kept


@posix
def test_a_file_that_others_can_write_is_not_read(root):
    entries.save(NAME, b"code")
    (root / NAME).chmod(0o666)
    assert entries.load(NAME) is None


@posix
@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root can give files away")
@pytest.mark.parametrize("place", [".", "0123", NAME])
def test_nothing_of_another_user_is_read(root, place, monkeypatch):
    entries.save(NAME, b"hostile")
    os.chown(root / place, 12345, 12345)
    entries._warn.cache_clear()
    assert entries.load(NAME) is None


@posix
def test_links_and_pipes_are_not_followed(root, tmp_path):
    entries.save(NAME, b"code")
    shutil.move(root / NAME, tmp_path / "elsewhere")
    (root / NAME).symlink_to(tmp_path / "elsewhere")
    assert entries.load(NAME) is None
    (root / NAME).unlink()
    os.mkfifo(root / NAME)
    assert entries.load(NAME) is None


def test_a_full_disk_costs_only_time(root, monkeypatch, tmp_path):
    def full(*_):
        raise OSError(errno.ENOSPC, "full")

    monkeypatch.setattr(entries, "_write", full)
    entries.save(NAME, b"code")
    assert entries.load(NAME) is None


def test_half_an_entry_is_never_seen(root, monkeypatch):
    entries.save(NAME, b"old")
    monkeypatch.setattr(Path, "replace", lambda *_: (_ for _ in ()).throw(OSError(errno.EIO, "gone")))
    entries.save(NAME, b"new")
    assert entries.load(NAME) == b"old"
    assert [file.name for file in (root / NAME).parent.iterdir()] == [Path(NAME).name]


@posix
def test_a_read_only_folder_is_read(root, monkeypatch):
    entries.save(NAME, b"code")

    def refuse(*_, **__):
        raise PermissionError(errno.EROFS, "read-only")

    monkeypatch.setattr(os, "open", lambda file, flags, *mode: refuse() if flags & os.O_CREAT else OPEN(file, flags, *mode))
    assert entries.load(NAME) == b"code"
    entries.save("0123/other.kernel", b"more")
    assert entries.load("0123/other.kernel") is None


OPEN = os.open


def test_many_may_write_one_entry(root):
    contents = [bytes([n]) * 100_000 for n in range(8)]
    with ThreadPoolExecutor(8) as writers:
        done = [writers.submit(entries.save, NAME, content) for content in contents * 5]
        seen = {entries.load(NAME) for _ in range(50)}
        for each in done:
            each.result()
    assert seen <= {None, *contents} and entries.load(NAME) in contents


def test_what_killed_processes_left_goes(root):
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    half = root / f"{PREFIX}{of_this_process().replace(f'~{os.getpid()}~', f'~{dead.pid}~')}abc"
    half.mkdir(mode=0o700, parents=True)
    for name in ("lock", Path(NAME).name):
        (half / name).touch()
    sweep_once.cache_clear()
    entries.save(NAME, b"code")
    assert entries.load(NAME) == b"code"
    assert not half.exists()


def test_kernels_count_for_the_limit_of_the_cache(root, monkeypatch, tmp_path):
    monkeypatch.setenv("VIEWSPHERE_CACHE_LIMIT", "100kB")
    for number in range(40):
        entries.save(f"0123/{number}.kernel", os.urandom(5_000))
    assert sum(file.stat().st_size for file in root.rglob("*.kernel")) <= 100_000
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "elsewhere"))
    for number in range(40):
        entries.save(f"0123/{number}.kernel", os.urandom(5_000))
    assert len(list((tmp_path / "elsewhere").rglob("*.kernel"))) == 40


USE = """
import sys, numpy as np
from viewsphere.geometry.lenses.shared.kernels_lens import radial_fisheye
assert radial_fisheye(np.zeros(4), 0.5)[0] == 0.5
print(sum(radial_fisheye.stats.cache_misses.values()))
"""


def compiled(cache, source=None):
    """The number of kernels that a new process compiles."""
    environment = {**os.environ, "VIEWSPHERE_CACHE": str(cache), "PYTHONHASHSEED": "random", "TMPDIR": str(cache)}
    environment |= {"PYTHONPATH": str(source)} if source else {}
    cache.mkdir(exist_ok=True)
    run = subprocess.run([sys.executable, "-c", USE], env=environment, capture_output=True, text=True, check=True)
    return int(run.stdout), run.stderr


@pytest.mark.slow
def test_a_kernel_is_compiled_once_wherever_its_source_lies(tmp_path, root):
    import viewsphere

    assert [compiled(tmp_path)[0] for _ in range(2)] == [1, 0]
    package = Path(viewsphere.__file__).parent
    shutil.copytree(package, tmp_path / "moved" / "viewsphere", ignore=shutil.ignore_patterns("__pycache__", "web"))
    for source in (tmp_path / "moved").rglob("*.py"):
        os.utime(source, (1, 1))
    assert compiled(tmp_path, tmp_path / "moved")[0] == 0
    lens = tmp_path / "moved" / "viewsphere" / "geometry" / "lenses" / "shared" / "kernels_lens.py"
    lens.write_text(lens.read_text() + "\n# another\n")
    assert compiled(tmp_path, tmp_path / "moved")[0] == 1


@pytest.mark.slow
def test_kernels_that_a_package_brings_are_used(tmp_path):
    import viewsphere

    package = tmp_path / "installed" / "viewsphere"
    shutil.copytree(Path(viewsphere.__file__).parent, package, ignore=shutil.ignore_patterns("__pycache__", "web"))
    assert compiled(tmp_path / "built", package.parent)[0] == 1
    shutil.copytree(tmp_path / "built" / "kernels", package / "kernels" / "shipped")
    assert compiled(tmp_path / "first", package.parent) == (0, "")
    assert not list((tmp_path / "first").rglob("*.kernel"))
    (shipped,) = (package / "kernels" / "shipped").rglob("*.kernel")
    shipped.write_bytes(shipped.read_bytes()[:-1])
    assert compiled(tmp_path / "first", package.parent)[0] == 1
    assert compiled(tmp_path / "first", package.parent)[0] == 0


class Hostile:
    def __init__(self, file):
        self.file = file

    def __reduce__(self):
        return Path.touch, (self.file,)


@pytest.mark.slow
@posix
def test_a_hostile_pickle_is_never_loaded(tmp_path):
    assert compiled(tmp_path)[0] == 1
    (entry,) = (tmp_path / "kernels").rglob("*.kernel")
    ran = tmp_path / "ran"
    for content in (pickle.dumps(Hostile(ran)), entry.read_bytes()[:32] + pickle.dumps(Hostile(ran))):
        entry.write_bytes(content)
        assert compiled(tmp_path)[0] == 1
    import hashlib
    import zlib

    packed = zlib.compress(pickle.dumps(Hostile(ran)))
    entry.write_bytes(hashlib.sha256(packed).digest() + packed)  # whole, so that only the folder's owner protects
    entry.parent.chmod(0o777)
    _, said = compiled(tmp_path)
    assert "others can write this folder" in said
    assert not ran.exists()
