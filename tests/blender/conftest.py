"""The .blend files that tests open as scenes, and Blenders that stay up."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from viewsphere.blender.process import BlenderProcess
from viewsphere.scratch import LOCK


@pytest.fixture(scope="session")
def made(blender, tmp_path_factory):
    """The folder of the files that `make_scene` makes; do not change them."""
    folder = tmp_path_factory.mktemp("scenes")
    script = Path(__file__).with_name("make_scene.py")
    done = subprocess.run([blender, "-P", str(script), str(folder)], capture_output=True, text=True)
    assert (folder / "made.json").exists(), done.stderr[-3000:]
    return folder


MOST = 2
"""Blenders that run at a time; the one asked least lately ends first."""


class Staying(BlenderProcess):
    """A Blender that is left running for the next file of the same folders."""

    def close(self):
        if self._process.poll() is not None:
            super().close()


class Blenders:
    """Starts a Blender for a set of folders once. After `end` the next file finds a new one."""

    def __init__(self):
        self._running = {}

    def start(self, python, readable=None):
        key = python, tuple(readable or ())
        process = self._running.pop(key, None)
        if process is None or process._process.poll() is not None:
            process = Staying(python, readable=readable)
        self._running[key] = process
        if len(self._running) > MOST:
            BlenderProcess.close(self._running.pop(next(iter(self._running))))
        process.log.write_bytes(b"")
        for left in process.folder.iterdir():
            if left.is_file() and left.name not in (LOCK, process.log.name):
                left.unlink()
        return process

    def end(self):
        for process in self._running.values():
            BlenderProcess.close(process)
        self._running.clear()


@pytest.fixture(scope="module")
def blenders():
    """Models and scenes are read by Blenders that stay up: a start takes longer than to read a small file."""
    kept = Blenders()
    with pytest.MonkeyPatch.context() as patch:
        for module in ("readers.blender.reading", "scene_file"):
            patch.setattr(f"viewsphere.assets.{module}.BlenderProcess", kept.start)
        yield kept
        kept.end()
