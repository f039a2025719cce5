"""docs/blender.md is true: its recipes are, its options are all there are, its commands run."""

from __future__ import annotations

import re
from dataclasses import fields

import pytest
import yaml

from command_line import viewsphere
from small import ROOT
from viewsphere import Dataset, Recipe, plan
from viewsphere.blender.interpreter import SCRIPTS
from viewsphere.engines.shared.blender.options import PRESETS, Options, parse_options

PAGE = (ROOT / "docs" / "blender.md").read_text("utf-8")
RECIPE, ENGINE, FORMATS = re.findall(r"```yaml\n(.*?)```", PAGE, re.DOTALL)
ROWS = dict(re.findall(r"^\| `(\w+)` \|([^\n]*)\|$", PAGE, re.MULTILINE))


def test_recipes_are_valid():
    recipe = Recipe(**yaml.safe_load(RECIPE))
    assert plan(recipe).frames == 2
    parse_options(recipe.engine.options)
    found = parse_options({k: v for k, v in yaml.safe_load(ENGINE)["engine"].items() if k != "name"})
    assert (found.bounces, found.settings["seed"]) == (12, 7)
    formats = Recipe(models=yaml.safe_load(FORMATS)["models"], viewpoints={"distance": 9})
    assert len(formats.models) == 2


def test_the_table_has_every_option_and_preset():
    assert set(ROWS) == {f.name for f in fields(Options)} | {"quality"}
    presets = list(PRESETS.values())
    assert list(PRESETS) == re.findall(r"`(\w+)`", ROWS["quality"].split("|")[1])
    for name in ("samples", "bounces"):
        assert [getattr(p, name) for p in presets] == [int(n) for n in re.findall(r"\d+", ROWS[name])]
    assert [p.denoise for p in presets] == re.findall(r"`(\w+)`", ROWS["denoise"])[-3:]
    for name in ("threads", "replace_after"):
        assert int(re.findall(r"\d+", ROWS[name])[0]) == getattr(Options(), name)


@pytest.mark.slow
@pytest.mark.usefixtures("blender")
def test_commands_run(tmp_path, monkeypatch):
    monkeypatch.setenv(SCRIPTS, "0")  # which --allow-scripts sets in this process
    (tmp_path / "drier.yaml").write_text(RECIPE, "utf-8")
    (tmp_path / "rust.py").write_text(re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)[0], "utf-8")
    commands = [line for block in re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL) for line in block.splitlines()]
    assert [line.split()[1] for line in commands] == ["doctor", "doctor", "render", "check", "render"]
    for line in commands:
        if "--setup-blender" not in line:  # downloads a gigabyte
            run = viewsphere(*line.split()[1:], cwd=tmp_path)
            assert run.returncode == 0, f"{line}\n{run.stdout}{run.stderr}"
    plain, rusty = (next(iter(Dataset(tmp_path / name))).channels for name in ("drier", "rusty"))
    assert (plain["instances"] == rusty["instances"]).all()
    assert (plain["rgb"] != rusty["rgb"]).any()
    assert len(Dataset(tmp_path / "drier")) == 2
