"""The .blend files that tests open as scenes."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def made(blender, tmp_path_factory):
    """The folder of the files that `make_scene` makes; do not change them."""
    folder = tmp_path_factory.mktemp("scenes")
    script = Path(__file__).with_name("make_scene.py")
    done = subprocess.run([blender, "-P", str(script), str(folder)], capture_output=True, text=True)
    assert (folder / "made.json").exists(), done.stderr[-3000:]
    return folder
