"""The tutorial is true: its files are written, its commands run in order in one folder, and say what the page shows."""

import os
import re
import shlex
import subprocess
import sys
from importlib.util import find_spec
from typing import NamedTuple

import pytest

from built_once import built_once
from command_line import viewsphere
from deadline import DEADLINE
from small import ROOT

PAGE = (ROOT / "docs" / "tutorial.md").read_text("utf-8")
IN_A_SHELL = {"python make_houses.py\n", "viewsphere render toys/recipe.yaml -o toys-ds\n", "viewsphere check toys-ds\n"}
TORCH = """
import pickle
import numpy as np


class DataLoader:
    def __init__(self, dataset, batch_size, num_workers):
        self.copies = [pickle.loads(pickle.dumps(dataset)) for _ in range(num_workers)]
        self.size = batch_size

    def __iter__(self):
        for start in range(0, len(self.copies[0]), self.size):
            rows = [self.copies[i % len(self.copies)][i] for i in range(start, start + self.size)]
            yield tuple(map(np.stack, zip(*rows)))
"""


class Block(NamedTuple):
    """A fenced block: its language, its text, the file it is to be saved as, and the output that is shown after it."""

    language: str
    text: str
    file: str
    shown: str


def blocks(page=PAGE):
    """All blocks but those of output, in order."""
    found = []
    for before, language, text in re.findall(r"([^\n]*)\n\n```(\w*)\n(.*?)```", page, re.DOTALL):
        name = re.search(r"`([\w./]+)`[^`]*:$", before)
        if language:
            found.append(Block(language, text, name[1] if name and language != "sh" else "", ""))
        else:
            found[-1] = found[-1]._replace(shown=text)
    return found


def run_outside(words):
    run = subprocess.run(words, capture_output=True, text=True, timeout=DEADLINE)
    return run.returncode, run.stdout + run.stderr


def check_output(block, status, said):
    assert status == (2 if block.shown.startswith("viewsphere: ") else 0), f"{block.text}\n{said}"
    for line in block.shown.splitlines():
        pattern = re.escape(line).replace(r"\.\.\.", ".+")
        assert re.search(f"^{pattern}$", said, re.MULTILINE), f"{block.text}\n{line}\nis not in\n{said}"


@pytest.fixture
def empty_folder(tmp_path, monkeypatch):
    """An empty working folder; torch is a stand-in where there is none."""
    folder = tmp_path / "tutorial"
    folder.mkdir()
    monkeypatch.chdir(folder)
    monkeypatch.setenv("COLUMNS", "200")
    if find_spec("torch") is None:
        package = tmp_path / "stand-in" / "torch" / "utils" / "data"
        package.mkdir(parents=True)
        (package / "__init__.py").write_text(TORCH)
        monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path / "stand-in"), os.environ.get("PYTHONPATH", "")]))
    with built_once():
        yield folder


def test_the_page_has_what_it_promises():
    commands = [line.split()[1] for b in blocks() if b.language == "sh" for line in b.text.splitlines() if "viewsphere" in line]
    wanted = ["inspect", "new", "plan", "preview", "render", "check", "report", "export", "merge", "import"]
    assert list(dict.fromkeys(commands)) == wanted
    saved = [b.file for b in blocks() if b.file]
    assert saved[:4] == ["make_houses.py", "toys/recipe.yaml", "houses.py", "train.py"]
    assert saved[4:] == ["toys/village.yaml", "toys/street.yaml", "toys/walk.csv", "toys/walk.yaml", "photos.py"]


@pytest.mark.slow
def test_from_top_to_bottom(empty_folder, monkeypatch):
    """Frames are rendered and proved by commands in a shell, by as many workers as it has cores; the rest in this process."""
    monkeypatch.setattr("viewsphere.run.generate.default_workers", lambda work: 0)
    monkeypatch.setattr("viewsphere.cli.datasets.cores", lambda: 1)
    monkeypatch.setenv("PATH", os.pathsep.join([os.path.dirname(sys.executable), os.environ["PATH"]]))  # noqa: PTH120
    assert {block.text for block in blocks()} >= IN_A_SHELL
    for block in blocks():
        if block.file:
            (empty_folder / block.file).write_text(block.text, "utf-8")
        elif block.language == "python":
            check_output(block, *run_outside([sys.executable, "-c", block.text]))
        elif block.text in IN_A_SHELL:
            check_output(block, *run_outside(["bash", "-c", block.text]))
        else:
            status, said = 0, ""
            for line in block.text.splitlines():
                words = shlex.split(line)
                if words[0] == "viewsphere":
                    status, *printed = viewsphere(*words[1:])
                    answer = "".join(printed)
                else:
                    status, answer = run_outside([sys.executable if words[0] == "python" else words[0], *words[1:]])
                said += answer
            check_output(block, status, said)
    assert (empty_folder / "toys-ds" / "report.html").stat().st_size > 100_000
    for picture in ("blue-sides", "preview", "village", "street"):
        assert (empty_folder / f"{picture}.png").stat().st_size > 10_000


def test_its_pictures_are_few_and_small():
    pictures = re.findall(r"\]\((images/[^)]+)\)", PAGE)
    assert 1 <= len(pictures) <= 2
    for picture in pictures:
        assert (ROOT / "docs" / picture).stat().st_size < 120_000
