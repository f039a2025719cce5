"""The page about training is true: its scripts learn from every frame, in three epochs."""

import math
import os
import re
import subprocess
import sys

import pytest

import viewsphere as vs
from deadline import DEADLINE
from small import ROOT, small_recipe

PAGE = (ROOT / "docs" / "training.md").read_text("utf-8")
SCRIPTS = dict(re.findall(r"`(\w+\.py)`:\n\n```python\n(.*?)```", PAGE, re.DOTALL))
NEEDS = {"train_webdataset.py": "webdataset", "train_huggingface.py": "datasets"}

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The page's files beside its data set, of twelve frames, four of them in val."""
    place = tmp_path_factory.mktemp("training")
    recipe = small_recipe(
        channels=["rgb"],
        camera={"size": [64, 48], "fov_deg": 35},
        formats=["webdataset", "huggingface"],
        splits={"by": "pose", "train": 0.67, "val": 0.33},
    )
    (place / "recipe.yaml").write_text(recipe.to_yaml())
    vs.generate(recipe, place / "cars-ds")
    for name, script in SCRIPTS.items():
        (place / name).write_text(script)
    return place


@pytest.mark.parametrize("name", [name for name in SCRIPTS if name != "net.py"])
def test_a_script_learns_from_every_frame(folder, tmp_path, name):
    pytest.importorskip("torch")
    pytest.importorskip(NEEDS.get(name, "viewsphere"))
    offline = {"HF_HUB_OFFLINE": "1", "HF_DATASETS_OFFLINE": "1", "HF_HOME": str(tmp_path)}
    run = subprocess.run(
        [sys.executable, name], cwd=folder, env={**os.environ, **offline}, capture_output=True, text=True, timeout=DEADLINE
    )
    assert run.returncode == 0, run.stderr
    everything = vs.open(folder / "cars-ds")
    frames = len(everything) if name == "train_memory.py" else len(everything.select("index", split="train"))
    told = [line.split() for line in run.stdout.splitlines()]
    assert [(int(epoch), int(seen)) for epoch, seen, _ in told] == [(epoch, frames) for epoch in range(3)], run.stderr
    assert all(math.isfinite(float(loss)) for *_, loss in told)


def test_the_page_has_all_four():
    assert {name for name in SCRIPTS if name != "net.py"} == {
        "train_store.py", "train_memory.py", "train_webdataset.py", "train_huggingface.py",
    }  # fmt: skip
