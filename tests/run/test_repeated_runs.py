"""A run of a finished data set: it hires nobody, compiles nothing, and leaves good exports alone."""

import subprocess
import sys

import pytest

from small import small_recipe
from viewsphere.run.generate import generate

REPEATED = """
import sys
import viewsphere as vs
from viewsphere.run.executors import local
local._Worker.__init__ = None  # no worker can start
summary = vs.generate(vs.Recipe.load(sys.argv[1]), sys.argv[2], workers=None)
assert summary.rendered == 0
print(sorted({"numba", "scipy", "trimesh"} & set(sys.modules)))
"""


@pytest.fixture
def finished(tmp_path):
    """The files of a recipe and of its finished data set."""
    file, out = tmp_path / "recipe.yaml", tmp_path / "out"
    models = [{"source": "zoo:post_box", "category": "post box"}]
    recipe = small_recipe(models=models, channels=["rgb", "depth", "instances"], shot_frames=16)
    file.write_text(recipe.to_yaml(), "utf-8")
    generate(recipe, out)
    return recipe, file, out


def written_at(folder):
    return {path: path.stat().st_mtime_ns for path in folder.rglob("*") if path.is_file()}


@pytest.mark.slow
def test_it_does_not_import_numba(finished):
    _, file, out = finished
    run = subprocess.run([sys.executable, "-c", REPEATED, file, out], capture_output=True, text=True, check=True)
    assert run.stdout == "[]\n"


def test_exports_stay_unless_damaged(finished):
    recipe, _, out = finished
    before = written_at(out / "coco")
    assert generate(recipe, out).formats == ("native", "coco")
    assert written_at(out / "coco") == before
    labels = next((out / "coco").rglob("*.json"))
    good = labels.read_bytes()
    for spoil in (lambda: labels.write_bytes(good[:-2] + b" }"), labels.unlink):
        spoil()
        assert generate(recipe, out).formats == ("native", "coco")
        assert labels.read_bytes() == good
        assert written_at(out / "coco").keys() == before.keys()
