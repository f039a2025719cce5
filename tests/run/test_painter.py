"""The machine and the build that painted a shot are recorded beside it, and nowhere else."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from small import small_recipe
from viewsphere.kernels import build
from viewsphere.run.generate import generate
from viewsphere.run.shots import tasks
from viewsphere.store.shots.manifest import MANIFEST, Manifest


def files(folder):
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_data_sets_of_two_machines_differ_in_the_manifests_of_shots_alone(tmp_path, monkeypatch):
    trees = []
    for painter in ("some processor, kernels for x86-64-v3", "other processor, kernels for it"):
        monkeypatch.setattr(tasks, "PAINTER", painter)
        generate(small_recipe(), tmp_path / painter, workers=0)
        trees.append(files(tmp_path / painter))
        shots = [path.parent for path in (tmp_path / painter).glob(f"store/shots/*/*/{MANIFEST}")]
        assert {Manifest.read(shot).painter for shot in shots} == {painter}
    first, second = trees
    assert first.keys() == second.keys()
    differing = {name for name in first if first[name] != second[name]}
    assert differing == {name for name in first if name.startswith("store/shots/") and name.endswith(MANIFEST)}


@pytest.mark.skipif(build.TARGET.cpu == build.HOST, reason="kernels are for this processor anyway")
def test_kernels_for_the_own_processor_are_another_painter():
    program = "from viewsphere.kernels.build import PAINTER; print(PAINTER)"
    run = [
        subprocess.run(
            [sys.executable, "-c", program], env={**os.environ, "VIEWSPHERE_NATIVE": native}, capture_output=True, text=True
        )
        for native in ("0", "1")
    ]
    common, native = (each.stdout for each in run)
    assert f"kernels for {build.COMMON}," in common
    assert f"kernels for {build.HOST}," in native
