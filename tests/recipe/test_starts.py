"""What `viewsphere new` writes: every kind explains itself. That it renders unchanged and is true, and that its script runs, is
proved by tests/test_cookbook.py, and of the first one by tests/test_docs.py.
"""

import math
import re
import subprocess
import sys

import jsonschema
import pytest

import viewsphere as vs
from command_line import viewsphere
from deadline import DEADLINE
from shots import unit_box
from viewsphere.engines.shared.blender.options import PRESETS
from viewsphere.errors import RecipeError
from viewsphere.plugins import names
from viewsphere.recipe.reading.file import read
from viewsphere.recipe.recipe import schema
from viewsphere.recipe.starts import FIRST, kinds, start


def test_the_kinds():
    assert kinds() == (FIRST, "blender", "detector", "in-memory", "pose6d")


@pytest.mark.parametrize("kind", kinds())
def test_a_recipe_is_valid_and_explains_itself(kind, tmp_path):
    text = start(kind)["recipe.yaml"]
    (tmp_path / "recipe.yaml").write_text(text)
    data = read(tmp_path / "recipe.yaml")[0]
    jsonschema.Draft202012Validator(schema()).validate(data)
    assert data.keys() >= {"name", "seed", "models", "viewpoints", "camera", "scene", "channels", "formats"}
    assert 2 <= vs.plan(vs.Recipe.load(tmp_path / "recipe.yaml")).frames <= 100
    commands = re.findall(r"viewsphere (\w[\w-]*)", text.split("\nname:")[0])
    assert "preview" in commands and max(map(len, text.splitlines())) <= 160
    assert sum("#" in line for line in text.splitlines()) > len(text.splitlines()) / 4


@pytest.mark.parametrize("kind", kinds())
def test_new_writes_all_files_and_never_over_others(kind, tmp_path):
    said = viewsphere("new", "mine", "--kind", kind, cwd=tmp_path)
    assert said.returncode == 0 and "next: viewsphere preview" in said.stdout
    found = {file.name: file.read_text("utf-8") for file in (tmp_path / "mine").iterdir()}
    assert found == start(kind)
    assert all(f"mine/{name}" in said.stdout for name in found)
    (tmp_path / "mine" / "recipe.yaml").unlink()
    again = viewsphere("new", "mine", "--kind", kind, cwd=tmp_path)
    assert again.returncode == (2 if len(found) > 1 else 0)
    assert again.returncode == 0 or ("expected a new file" in again.stderr and not (tmp_path / "mine" / "recipe.yaml").exists())


def test_another_kind_is_a_mistake(tmp_path):
    said = viewsphere("new", "mine", "--kind", "detecter", cwd=tmp_path)
    assert said.returncode == 2 and "did you mean 'detector'" in said.stderr
    assert not (tmp_path / "mine").exists()


def test_the_script_of_poses_asks_for_a_data_set(tmp_path):
    viewsphere("new", "mine", "--kind", "pose6d", cwd=tmp_path)
    said = subprocess.run([sys.executable, "poses.py"], cwd=tmp_path / "mine", capture_output=True, text=True, timeout=DEADLINE)
    assert (said.returncode, said.stdout) == (2, "")
    assert said.stderr == "expected a data set; found none: python poses.py DATASET > poses.csv\n"


@pytest.mark.slow
def test_frames_without_a_car_are_skipped(tmp_path):
    viewsphere("new", "mine", "--kind", "in-memory", cwd=tmp_path)
    recipe = tmp_path / "mine" / "recipe.yaml"
    small = {
        "empty: 0.4\n\ncamera:": "camera:",
        "count: 5 ": "count: 20",
        "size: [32, 24]": "size: [224, 224]",
        ": zoo:can": ": zoo:car",
    }
    text = recipe.read_text("utf-8")
    for new, old in small.items():
        assert text.count(old) == 1
        text = text.replace(old, new)
    recipe.write_text(text)
    shown = sum((sample.instances == 1).any() for sample in vs.render(recipe))
    assert 0 < shown < 20
    lines = run("train.py", folder=tmp_path / "mine").splitlines()
    assert [int(line.split()[2]) for line in lines] == [shown, shown]
    assert all(math.isfinite(float(line.split()[-1])) for line in lines)


@pytest.mark.parametrize("kind", kinds())
def test_the_formats_that_a_comment_names_exist(kind):
    comment = re.search(r"^formats: .*# or ([\w, ]+)", start(kind)["recipe.yaml"], re.MULTILINE)
    named = comment[1].split(", ") if comment else []
    assert set(named) <= {*names("formats")}
    assert named or kind != "detector"


@pytest.mark.parametrize("kind", kinds())
def test_the_qualities_that_a_comment_names_are_the_engine_s(kind):
    comment = re.search(r"quality: (\w+).*# (\w+(?:, \w+)* or \w+)", start(kind)["recipe.yaml"])
    if comment:
        named = re.split(", | or ", comment[2])
        assert comment[1] in named and named == [*PRESETS]
    assert comment or kind != "blender"


@pytest.mark.parametrize(("kind", "count", "enough"), [("poses", 4, 8), ("pose6d", 1, 3)])
def test_company_needs_the_models_that_its_comment_says(kind, count, enough, tmp_path):
    text = start(kind)["recipe.yaml"].replace("# company:", "company:")
    assert f"count: {enough}" in re.search(r"^  company: .*# (.*)", text, re.MULTILINE)[1]
    file = tmp_path / "recipe.yaml"
    file.write_text(text)
    with pytest.raises(RecipeError, match=r"scene\.company\.count"):
        vs.plan(file)
    file.write_text(text.replace(f"count: {count}", f"count: {enough}", 1))
    planned = vs.plan(file)
    assert {len(planned.cast(subject, 0)) for subject in planned.subjects} == {planned.recipe.scene.company.number + 1}


@pytest.mark.slow
def test_the_detector_s_floors_are_grey_to_sand(tmp_path):
    (tmp_path / "recipe.yaml").write_text(start("detector")["recipe.yaml"])
    planned = vs.plan(vs.Recipe.load(tmp_path / "recipe.yaml"))
    colors = {shot.scene.ground.color for shot in planned.shots(unit_box)}
    assert len(colors) == 5
    for red, green, blue in colors:
        assert red >= green >= blue > 0.4 * red


def run(*words, folder):
    done = subprocess.run([sys.executable, *words], cwd=folder, capture_output=True, text=True, timeout=DEADLINE)
    assert done.returncode == 0, done.stderr
    return done.stdout
