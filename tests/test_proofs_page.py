"""The page of proofs has a row for each label, and is not made where figures, pictures or tests are those of others."""

import json
import shutil
import sys

import pytest

from small import ROOT
from viewsphere.labels import drawable, labels

sys.path.insert(0, str(ROOT / "scripts"))
import docs

PICTURES = f"docs/{docs.LABEL_PICTURES}"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A copy of what the page is made of, free to be spoilt."""
    shutil.copytree(ROOT / PICTURES, tmp_path / PICTURES)
    shutil.copyfile(ROOT / "docs" / "labels.json", tmp_path / "docs" / "labels.json")
    (tmp_path / "tests").symlink_to(ROOT / "tests", target_is_directory=True)
    monkeypatch.setattr(docs, "DOCS", tmp_path / "docs")
    return tmp_path


def test_each_label_and_pass_has_its_row(folder):
    rows = [line for line in docs.proofs_page().splitlines() if line.startswith("| `")]
    named = [row.split("`")[1] for row in rows]
    assert named[: len(labels())] == list(labels()) and sorted(named) == sorted({*labels(), *drawable()} - {*docs.FINISHED})
    assert all(f"![{name}]({docs.LABEL_PICTURES}/{name}.jpg)" in row for name, row in zip(named, rows, strict=True))
    assert all("test_" in row and ": " in row for row in rows)


@pytest.mark.parametrize("part", ["proofs", "costs"])
def test_figures_of_other_labels_are_told(folder, part):
    file = folder / "docs" / "labels.json"
    known = json.loads(file.read_text("utf-8"))
    for changed, problem in (
        ({name: told for name, told in known[part].items() if name != "depth"}, "lacks depth"),
        (known[part] | {"deepness": known[part]["depth"]}, "has no use for deepness"),
    ):
        file.write_text(json.dumps({**known, part: changed}), "utf-8")
        with pytest.raises(SystemExit, match=f"labels.json: {part} {problem}"):
            docs.proofs_page()


def test_pictures_and_tests_that_are_missing_are_told(folder):
    (folder / PICTURES / "nocs.jpg").unlink()
    with pytest.raises(SystemExit, match="images/labels lacks nocs"):
        docs.proofs_page()
    shutil.copyfile(folder / PICTURES / "depth.jpg", folder / PICTURES / "nocs.jpg")
    file = folder / "docs" / "labels.json"
    file.write_text(file.read_text("utf-8").replace("test_amodal.py", "test_gone.py"), "utf-8")
    with pytest.raises(SystemExit, match=r"labels\.json: tests has no use for tests/labels/test_gone\.py"):
        docs.proofs_page()
