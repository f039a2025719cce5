"""docs/scenes-in-blender.md is true: its recipe is valid, its commands run on a file as it describes."""

from __future__ import annotations

import re
import shutil

import pytest
import yaml

from command_line import viewsphere
from small import ROOT
from viewsphere import Dataset, Recipe
from viewsphere.recipe.world.blend import LabelRule

PAGE = (ROOT / "docs" / "scenes-in-blender.md").read_text("utf-8")
(RECIPE,) = re.findall(r"```yaml\n(.*?)```", PAGE, re.DOTALL)


def test_the_recipe_is_valid():
    blend = Recipe(**yaml.safe_load(RECIPE)).scene.blend
    assert blend.at == "Spot"
    assert Recipe(**yaml.safe_load(RECIPE) | {"scene": {"blend": "street.blend"}}).scene.blend.file == "street.blend"


def test_the_table_has_every_key_of_a_rule():
    assert set(re.findall(r"^\| `(\w+)` \|", PAGE, re.MULTILINE)) == set(LabelRule.model_fields) - {"category"}


@pytest.mark.slow
def test_commands_run(made, tmp_path):
    shutil.copy(made / "street.blend", tmp_path)
    (tmp_path / "street.yaml").write_text(RECIPE, "utf-8")
    for block in re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL):
        for line in block.splitlines():
            run = viewsphere(*line.split()[1:], cwd=tmp_path)
            assert run.returncode == 0, f"{line}\n{run.stdout}{run.stderr}"
    dataset = Dataset(tmp_path / "street-ds")
    assert {name for sample in dataset for name in (o.category for o in sample.objects)} == {"chair", "car", "tree", "aerial"}
