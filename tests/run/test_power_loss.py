"""The machine crashes at any moment: with fsync, what is there afterwards is whole, and what was finished is there.

The disk is played by what was synced: a file has the bytes, a folder the names, that it had when it was last synced.
"""

from __future__ import annotations

import os
import random
import resource
import shutil
import sys
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from unittest.mock import patch

import pytest

from small import small_recipe, tree_hash
from viewsphere.errors import UserError
from viewsphere.run.datasets.merging import merge
from viewsphere.run.generate import generate
from viewsphere.store.places import local
from viewsphere.store.shots import moving
from viewsphere.store.shots.manifest import MANIFEST, digest, unsealed

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="asks /proc which file is synced")

RECIPE = small_recipe(channels=["rgb", "depth", "instances"], formats=["coco"])


@dataclass(frozen=True)
class Crash:
    """What was on the disk at a moment, the names that were to be written next, and which shots had been finished. Names of
    folders end with a slash.
    """

    contents: dict[int, bytes]
    entries: dict[int, dict[str, int]]
    origin: int
    names: dict[str, int]
    finished: frozenset[str]

    def strict(self) -> dict[str, bytes]:
        """The files after it if nothing was written but what was synced."""
        return dict(self._below(self.origin, ""))

    def eager(self) -> dict[str, bytes]:
        """The files after it if all names were written, but no bytes that were not synced."""
        return {name: self.contents.get(inode, b"") for name, inode in self.names.items()}

    def _below(self, inode: int, path: str):
        for name, inside in self.entries.get(inode, {}).items():
            yield path + name, self.contents.get(inside, b"")
            if name.endswith("/"):
                yield from self._below(inside, path + name)


@dataclass
class Disk:
    """Notes what is synced below a folder, and what a crash at each such moment would leave."""

    origin: Path
    contents: dict[int, bytes] = field(default_factory=dict)
    entries: dict[int, dict[str, int]] = field(default_factory=dict)
    finished: set[str] = field(default_factory=set)
    crashes: list[Crash] = field(default_factory=list)
    held: list[int] = field(default_factory=list)

    def sync(self, descriptor: int) -> None:
        path = Path(f"/proc/self/fd/{descriptor}").readlink()
        self.held.append(os.dup(descriptor))  # so that no other file has its number later
        inode = os.fstat(descriptor).st_ino
        if path.is_dir():
            self.entries[inode] = {named(inside, path): inside.stat().st_ino for inside in path.iterdir()}
        else:
            self.contents[inode] = path.read_bytes()
        self.note()

    def moved(self, target: Path) -> None:
        if "shots" in target.parts:
            self.finished.add(target.relative_to(self.origin).as_posix())
        self.note()

    def note(self) -> None:
        names = {named(path, self.origin): path.stat().st_ino for path in sorted(self.origin.rglob("*"))}
        origin = self.origin.stat().st_ino
        self.crashes.append(Crash({**self.contents}, {**self.entries}, origin, names, frozenset(self.finished)))

    @contextmanager
    def watched(self):
        sync, rename, move = os.fsync, os.replace, local.move

        def synced(descriptor):
            sync(descriptor)
            self.sync(descriptor)

        def renamed(source, target):
            rename(source, target)
            self.note()

        def moved(source, target):
            move(source, target)
            self.moved(target)

        with (
            patch.object(moving, "AT_ONCE", 1),  # what is noted of one file is of one moment
            patch.object(os, "fsync", synced),
            patch.object(os, "replace", renamed),
            patch.object(local, "move", moved),
        ):
            yield


@pytest.fixture
def disk(tmp_path):
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, 8192), hard))
    made = Disk(tmp_path / "disk")
    made.origin.mkdir()
    yield made
    for descriptor in made.held:
        os.close(descriptor)
    resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def named(path: Path, origin: Path) -> str:
    return f"{path.relative_to(origin).as_posix()}{'/' if path.is_dir() else ''}"


def torn(files: dict[str, bytes]) -> set[str]:
    """Shots and models that look finished, and are not what their manifests say."""
    found = set()
    for name in (name for name in files if name.endswith(f"/{MANIFEST}") and "/writing/" not in name):
        place = name.removesuffix(MANIFEST)
        try:
            told = unsealed(files[name].decode())["files"]
        except ValueError:
            found.add(place)
            continue
        if any((len(data := files.get(place + path, b"")), digest(data)) != tuple(seal) for path, seal in told.items()):
            found.add(place)
    return found


def laid_out(files: dict[str, bytes], place: Path) -> Path:
    for name, data in files.items():
        (place / name if name.endswith("/") else (place / name).parent).mkdir(parents=True, exist_ok=True)
        if not name.endswith("/"):
            (place / name).write_bytes(data)
    return place


WORK = {
    "render": lambda sources, out: generate(RECIPE, out),
    "merge": merge,
}


@pytest.fixture
def sources(tmp_path):
    generate(RECIPE, tmp_path / "a", formats=[])
    return [tmp_path / "a", Path(shutil.copytree(tmp_path / "a", tmp_path / "b"))]


@pytest.mark.slow
@pytest.mark.parametrize("what", WORK)
def test_what_is_there_is_whole_and_what_was_finished_is_there(what, sources, disk, tmp_path, monkeypatch):
    monkeypatch.setenv(moving.DURABILITY, "fsync")
    work = WORK[what]
    with disk.watched():
        work(sources, disk.origin / "out")
    assert len(disk.crashes) > 50
    assert len(disk.crashes[-1].finished) == len(list((disk.origin / "out" / "store" / "shots").glob("*/*")))
    for crash in disk.crashes:
        for files in (crash.strict(), crash.eager()):
            assert not torn(files)
            assert all(f"{shot}/{MANIFEST}" in files for shot in crash.finished)
    monkeypatch.setenv(moving.DURABILITY, "none")
    whole, rng = tree_hash(disk.origin / "out"), random.Random(1)
    for number, crash in enumerate(rng.sample(disk.crashes, 4)):
        files = (crash.strict if number % 2 else crash.eager)()
        place = laid_out(files, tmp_path / f"after {number}")
        work(sources, place / "out")
        assert tree_hash(place / "out") == whole


@pytest.mark.slow
def test_without_it_shots_may_be_torn(sources, disk, monkeypatch):
    monkeypatch.delenv(moving.DURABILITY, raising=False)
    with disk.watched():
        generate(RECIPE, disk.origin / "out")
    assert any(torn(crash.eager()) for crash in disk.crashes)
    assert not disk.contents


@pytest.mark.slow
def test_it_changes_no_byte(sources, tmp_path, monkeypatch):
    monkeypatch.setenv(moving.DURABILITY, "fsync")
    generate(RECIPE, tmp_path / "synced", formats=[])
    assert tree_hash(tmp_path / "synced") == tree_hash(sources[0])


def test_another_word_is_a_mistake(tmp_path, monkeypatch):
    monkeypatch.setenv(moving.DURABILITY, "fsnyc")
    with pytest.raises(UserError, match="VIEWSPHERE_DURABILITY: expected none or fsync; found 'fsnyc'"):
        generate(RECIPE, tmp_path / "out")
