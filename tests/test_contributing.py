"""The first steps of CONTRIBUTING.md are real, and every way to the checks calls the same scripts."""

import re
import subprocess

import pytest
import yaml

from installed import installed
from small import ROOT

PAGE = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
CHECK = (ROOT / "scripts" / "check").read_text("utf-8")
PARTS = re.findall(r"^    (\w+)\) ", CHECK, re.MULTILINE)


def test_the_first_plug_in_passes_the_test_on_the_page(tmp_path):
    (code,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    assert "Save the first example" in PAGE
    first, *_ = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "extending.md").read_text("utf-8"), re.DOTALL)
    assert "boxes.csv" in first
    scope = {}
    exec(code, scope)
    (test,) = (made for name, made in scope.items() if name.startswith("test_"))
    with installed(tmp_path / "site", "formats", "csv_boxes", first):
        test(tmp_path)


in_a_clone = pytest.mark.skipif(not (ROOT / ".github").exists(), reason="no clone")


@in_a_clone
@pytest.mark.parametrize("page", ["CONTRIBUTING.md", ".github/PULL_REQUEST_TEMPLATE.md", ".github/workflows/ci.yml"])
def test_files_that_pages_name_are_there(page):
    text = (ROOT / page).read_text("utf-8")
    named = re.findall(r"\]\(([\w./-]+\.\w+|LICENSE)\)", text) + re.findall(
        r"(?<!/)((?:scripts|benchmarks|\.ci)/[\w.]*\w)", text
    )
    assert named
    assert [name for name in named if not (ROOT / name).exists()] == []


@in_a_clone
def test_hooks_call_each_part_of_the_check():
    (local,) = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text("utf-8"))["repos"]
    assert local["repo"] == "local"
    assert [hook["entry"] for hook in local["hooks"]] == [f"scripts/check {part}" for part in PARTS]


def test_an_unknown_part_is_one_line(tmp_path):
    """The script alone, beside a setup that is done."""
    (tmp_path / "scripts").mkdir()
    for name, text in (("check", CHECK), ("setup", "#!/bin/sh\n")):
        (tmp_path / "scripts" / name).write_text(text)
        (tmp_path / "scripts" / name).chmod(0o755)
    run = subprocess.run([tmp_path / "scripts" / "check", "lintt"], capture_output=True, text=True)
    assert run.returncode == 2
    assert run.stderr == f"scripts/check: 'lintt' is not a part. Choose from {', '.join(PARTS)}.\n"
