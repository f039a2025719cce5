"""docs/animation.md is true: its recipes are, its tables have all fields, its commands run."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
import yaml

from command_line import viewsphere
from small import ROOT
from viewsphere import Dataset, Recipe, plan
from viewsphere.assets.animation.timeline import Blenders, Timeline
from viewsphere.recipe.cameras.viewpoints import PoseList
from viewsphere.recipe.models import ModelEntry

PAGE = (ROOT / "docs" / "animation.md").read_text("utf-8")
WALK, PEOPLE, CAMERA = re.findall(r"```yaml\n(.*?)```", PAGE, re.DOTALL)


def test_recipes_are_valid(tmp_path, monkeypatch):
    monkeypatch.setattr(Blenders, "timeline", lambda *_: Timeline(1, 25, 24.0, True))
    monkeypatch.chdir(tmp_path)
    for name in ("walker.fbx", "walker.blend"):
        Path(name).write_bytes(b"x")
    planned = plan(Recipe(**yaml.safe_load(WALK)))
    assert (planned.time_steps, planned.frames) == (3, 6)
    people = Recipe(**yaml.safe_load(PEOPLE), viewpoints={"azimuth": [0], "elevation": [10], "distance": 4})
    assert people.models[0].clip == "walk" and people.time is not None
    asked = Recipe(**yaml.safe_load(CAMERA))
    assert asked.models[0].poses == "moving"
    assert isinstance(asked.viewpoints, PoseList)


def test_the_tables_have_every_field():
    rows = set(re.findall(r"^\| (`\w+`(?:, `\w+`)?) \|", PAGE, re.MULTILINE))
    named = {name for row in rows for name in re.findall(r"\w+", row)}
    assert {"frames", "poses", "clip"} <= named & set(ModelEntry.model_fields)
    assert {"camera", "frames", "clip", "at", "size"} <= named & set(PoseList.model_fields)


@pytest.mark.slow
def test_commands_run(blender, tmp_path):
    subprocess.run([blender, Path(__file__).with_name("make_moving.py"), tmp_path], capture_output=True, check=True)
    shutil.copy(tmp_path / "jump.fbx", tmp_path / "walker.fbx")
    (tmp_path / "walk.yaml").write_text(WALK, "utf-8")
    commands = [line for block in re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL) for line in block.splitlines()]
    assert [line.split()[1] for line in commands] == ["plan", "render", "check"]
    for line in commands:
        run = viewsphere(*line.split()[1:], cwd=tmp_path)
        assert run.returncode == 0, f"{line}\n{run.stdout}{run.stderr}"
    assert len(Dataset(tmp_path / "walk")) == 6
