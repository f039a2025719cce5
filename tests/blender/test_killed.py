"""A Blender that is killed while it reads a file says nothing about the file."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from fake_blender import with_modules

from quick import quick
from viewsphere.assets.animation.timeline import Blenders
from viewsphere.assets.cache import cache_folder, load
from viewsphere.assets.sandbox.client import READ_HERE
from viewsphere.assets.scene_file import scene_file
from viewsphere.blender.interpreter import VARIABLE
from viewsphere.errors import ModelError
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.thing import TimeStep

pytestmark = [pytest.mark.skipif(sys.platform == "win32", reason="signals")]

SAID = "Blender, which reads it, ended unexpectedly: it was killed (SIG{how}), perhaps because memory ran out; "

READERS = {
    "model": lambda path: load(ModelSpec(key="a", source=str(path), category="thing", category_id=1)),
    "frame": lambda path: load(ModelSpec(key="a", source=str(path), category="thing", category_id=1), step=TimeStep(frame=3)),
    "timeline": lambda path: Blenders.none_yet().timeline(path, True),
    "scene": scene_file.__wrapped__,
}


@pytest.fixture(autouse=True)
def apart(monkeypatch, tmp_path):
    """Models are read in processes of their own, and cached below the test's folder."""
    monkeypatch.delenv(READ_HERE, raising=False)
    monkeypatch.setenv("VIEWSPHERE_CACHE", str(tmp_path / "cache"))


@pytest.fixture
def dying(tmp_path, monkeypatch):
    """Makes a Blender that a signal ends as it starts, and gives its interpreter."""

    def make(how):
        python = with_modules(tmp_path, {"bpy": f"import os, signal; os.kill(os.getpid(), signal.SIG{how})"})
        monkeypatch.setenv(VARIABLE, str(python))
        return python

    return make


def refused(read, path: Path) -> str:
    with pytest.raises(ModelError) as caught:
        READERS[read](path)
    said = str(caught.value)
    assert said.startswith(f"{path}: ")
    assert "\n" not in said
    return said.removeprefix(f"{path}: ")


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "models" / "a.blend"
    path.parent.mkdir()
    path.write_bytes(b"BLENDER-v500")
    return path


@pytest.mark.parametrize("read", quick(READERS, *(READERS.keys() - {"frame"})))
@pytest.mark.parametrize("how", ["KILL", pytest.param("TERM", marks=pytest.mark.slow)])
def test_it_is_said_to_be_killed_and_not_the_file_to_be_damaged(dying, file, read, how):
    dying(how)
    said = refused(read, file)
    assert said.startswith(SAID.format(how=how))
    assert "damaged" not in said


@pytest.mark.slow
def test_nothing_of_it_is_kept(dying, file, tmp_path):
    python, started = dying("KILL"), tmp_path / "started"
    python.write_text(python.read_text().replace("#!/bin/sh\n", f"#!/bin/sh\necho >> {started}\n"))
    for count in (1, 2):
        assert "SIGKILL" in refused("model", file)
        assert list(cache_folder().iterdir()) == []
        assert len(started.read_text()) == count


@pytest.mark.slow
def test_a_script_that_starts_blender_tells_the_signal(dying, file):
    python = dying("KILL")
    python.write_text(python.read_text().replace("exec ", "") + "\nexit $?\n")
    assert refused("model", file).startswith(SAID.format(how="KILL"))


@pytest.mark.slow
def test_a_crash_of_its_own_may_be_the_file_s(dying, file):
    dying("SEGV")
    assert refused("model", file).startswith("reading it crashed (Blender died (signal SIGSEGV) after")


@pytest.mark.parametrize("read", quick(READERS, *(READERS.keys() - {"model"})))
def test_one_that_cannot_be_started_is_no_damage_either(file, read, tmp_path, monkeypatch):
    (tmp_path / "python").write_text("no program")
    monkeypatch.setenv(VARIABLE, str(tmp_path / "python"))
    said = refused(read, file)
    assert "Blender cannot be started" in said
    assert "damaged" not in said
