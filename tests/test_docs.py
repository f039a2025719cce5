"""What the pages say is true: generated pages are fresh, README's commands and code run."""

import json
import os
import re
import subprocess
import sys

import pytest

import viewsphere as vs
from built_once import built_once
from command_line import viewsphere
from deadline import DEADLINE
from small import ROOT
from viewsphere import plugins

README = (ROOT / "README.md").read_text("utf-8")


@pytest.mark.slow
def test_generated_pages_are_what_the_code_says():
    run = subprocess.run([sys.executable, ROOT / "scripts" / "docs.py", "--check"], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr


def test_links_lead_somewhere():
    pages = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md"), ROOT / "recipes" / "README.md"]
    for page in pages:
        for target in re.findall(r"\]\(([^)#]+)[^)]*\)", page.read_text("utf-8")):
            if "://" not in target:
                assert (page.parent / target).exists(), f"{page.name}: {target}"


def test_readme_s_scripts_exist():
    for name in re.findall(r"^(scripts/\w+)", README, re.MULTILINE):
        assert os.access(ROOT / name, os.X_OK)


@pytest.fixture
def models_built_once():
    with built_once():
        yield


@pytest.mark.slow
@pytest.mark.usefixtures("models_built_once")
def test_readme_s_commands_and_code_run(tmp_path, monkeypatch):
    monkeypatch.setattr("viewsphere.run.generate.default_workers", lambda work: 0)
    monkeypatch.setattr("viewsphere.cli.datasets.cores", lambda: 1)
    commands = re.findall(r"^viewsphere ([^#\n]+)", README, re.MULTILINE)
    assert len(commands) >= 5
    for line in (line for line in commands if not line.startswith("view ")):  # which goes on until Ctrl-C
        answer = viewsphere(*line.split(), cwd=tmp_path)
        assert answer.returncode == 0, f"{line}\n{answer.stdout}{answer.stderr}"
    assert {"rgb", "instances"} <= set(vs.open(tmp_path / "cars-ds")[0].channels)
    code = re.search(r"```python\n(.*?)```", README, re.DOTALL)
    assert code is not None
    subprocess.run([sys.executable, "-c", code[1]], cwd=tmp_path, check=True, timeout=DEADLINE)


def test_readme_s_recipe_is_valid(tmp_path):
    text = re.search(r"```yaml\n(.*?)```", README, re.DOTALL)
    assert text is not None
    (tmp_path / "models").mkdir()
    for name in "ab":
        (tmp_path / "models" / f"{name}.glb").write_bytes(b"")
    (tmp_path / "recipe.yaml").write_text(text[1])
    assert vs.plan(vs.Recipe.load(tmp_path / "recipe.yaml")).frames == 2 * 36 * 9 * 2


def test_readme_s_world_in_motion_is_valid(tmp_path):
    (text,) = (text for text in re.findall(r"```yaml\n(.*?)```", README, re.DOTALL) if "time:" in text)
    (tmp_path / "recipe.yaml").write_text(text)
    planned = vs.plan(vs.Recipe.load(tmp_path / "recipe.yaml"))
    assert planned.frames == 3 * 50 * 2 and len(planned.subjects) == 3


def test_every_release_has_a_line_in_the_history():
    measured = [release["version"] for release in json.loads((ROOT / "benchmarks" / "history.json").read_text("utf-8"))]
    released = re.findall(r"^## (\d+\.\d+\.\d+)$", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.MULTILINE)
    assert released
    assert set(released) <= set(measured)


def test_the_table_of_formats_is_short_and_their_evidence_is_folded_below():
    page = (ROOT / "docs" / "format-list.md").read_text("utf-8")
    proofs = json.loads((ROOT / "docs" / "formats.json").read_text("utf-8"))
    rows = re.findall(r"^\| \[`(\w+)`\]\(#\1\) (\|.*)\|$", page, re.MULTILINE)
    assert tuple(name for name, _ in rows) == plugins.names("formats")
    assert max(len(cell) for _, cells in rows for cell in cells.split("|")) < 200
    sections = dict(zip(*[iter(re.split(r"^## (\w+)$", page, flags=re.MULTILINE)[1:])] * 2, strict=True))
    for name, _ in rows:
        assert ("<details" in sections[name]) == (name in proofs)
        _, _, folded = sections[name].partition("<details")
        assert [proof["test"] for proof in proofs.get(name, []) if proof["test"].removeprefix("tests/") not in folded] == []
