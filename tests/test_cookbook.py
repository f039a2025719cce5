"""The cookbook is true: each page's files are written, its commands and its Python run in order, in one folder."""

import re
import shlex
import sys

import pytest
from typer.main import get_command

import viewsphere as vs
from command_line import viewsphere
from small import ROOT
from test_tutorial import blocks, run_outside
from viewsphere.cli.commands import app
from viewsphere.plugins import names

PAGES = sorted((ROOT / "docs" / "cookbook").glob("*.md"))
ONCE = "viewsphere doctor --setup-blender"
"""What takes a gigabyte; whether Blender is there, the fixture says."""


def test_the_pages():
    assert [page.stem for page in PAGES] == ["blender", "depth", "detector", "in-memory", "pose6d"]
    for page in PAGES:
        assert f"cookbook/{page.name}" in (ROOT / "mkdocs.yml").read_text("utf-8")


def follow(page, folder, small=None):
    """Do what a page says, its complete recipes and scripts saved, and `small` put into its recipes, for what is there; returns
    what its Python printed.
    """
    said = []
    for block in blocks((ROOT / "docs" / "cookbook" / f"{page}.md").read_text("utf-8")):
        if block.file:
            (folder / block.file).write_text(block.text, "utf-8")
            if small and block.file.endswith(".yaml"):
                shrink(folder / block.file, small)
        elif block.language == "python":
            status, printed = run_outside([sys.executable, "-c", block.text])
            assert status == 0, printed
            said.append(printed)
        elif block.language == "sh":
            for line in block.text.splitlines():
                printed = command(line)
                said += [] if printed is None else [printed]
                if small and line.startswith("viewsphere new "):
                    shrink(folder / shlex.split(line)[2] / "recipe.yaml", small)
    return said


def shrink(recipe, small):
    text = recipe.read_text("utf-8")
    for old, new in small.items():
        assert text.count(old) == 1
        text = text.replace(old, new)
    recipe.write_text(text, "utf-8")


def command(line):
    """Run it; returns what a script printed."""
    words = shlex.split(line)
    if line == ONCE:
        return None
    if words[0] == "viewsphere":
        more = ["--workers", "0"] if words[1] in {"render", "check"} else []
        answer = viewsphere(*words[1:], *more)
        assert answer.returncode == 0, f"{line}\n{answer.stdout}{answer.stderr}"
        return None
    assert words[0] == "python"
    status, printed = run_outside([sys.executable, *words[1:]])
    assert status == 0, f"{line}\n{printed}"
    return printed


INLINE = [
    pytest.param(line, id=f"{page.stem}: {line}")
    for page in PAGES
    for line in re.findall(r"`(viewsphere\s[^`]+)`", page.read_text("utf-8"))
]


@pytest.mark.parametrize("line", INLINE)
def test_commands_within_sentences_have_options_and_formats_that_exist(line):
    _, name, *words = shlex.split(line)
    given = get_command(app).commands[name].make_context(name, words).params
    assert set((given.get("format_") or "").split(",")) <= {"", *names("formats")}


def test_there_are_commands_within_sentences():
    assert any("--format" in param.values[0] for param in INLINE)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.slow
def test_the_detector_s_categories(folder):
    few = {
        "count: 4                   # benches": "count: 2  # benches",
        "zoo:bicycle\n    count: 4": "zoo:bicycle\n    count: 1",
        "count: 3\n": "count: 1\n",
        "count: 30 ": "count: 8 ",
        "objects: [2, 5]": "objects: [2, 4]",
        "size: [480, 360]": "size: [160, 120]",
    }
    (said,) = follow("detector", folder, few)
    found = re.findall(r"^(\d+) (bench|bicycle|post box) (\d+)$", said, re.MULTILINE)  # pycocotools prints, too
    assert [(number, name) for number, name, _ in found] == [("1", "bench"), ("2", "bicycle"), ("3", "post box")]
    assert all(int(count) > 0 for *_, count in found)
    assert {"rgb", "instances"} <= set(vs.open(folder / "things-ds")[0].channels)


@pytest.mark.slow
def test_poses_give_depth(folder):
    poses, said = follow("pose6d", folder)
    model, difference = said.splitlines()
    assert model.endswith((".glb", ".obj")) and float(difference) < 1e-4
    made, lines = vs.open(folder / "part-ds"), poses.splitlines()
    assert {"rgb", "instances"} <= set(made[0].channels)
    assert len(lines) == 1 + len(made) and lines[0].startswith("frame,object,category,qw")
    first = made[0].objects[0]
    assert [float(value) for value in lines[1].split(",")[7:10]] == pytest.approx(first.camera_from_object[:3, 3], abs=1e-6)


@pytest.mark.slow
def test_depth_gives_points(folder):
    few = {
        "{count: 6, objects: 1}": "{count: 2, objects: 1}",
        "size: [320, 240]": "size: [160, 120]",
    }  # light in a room takes long
    (said,) = follow("depth", folder, few)
    found = re.findall(r"^(\d+) (\d+)% of the pixels, ([\d.]+) to ([\d.]+) m$", said, re.MULTILINE)
    assert len(found) == 2 and all(0 < float(near) < float(far) for *_, near, far in found)


@pytest.mark.slow
def test_frames_in_memory(folder):
    trained, looped = follow(
        "in-memory", folder, {"count: 4": "count: 2", "count: 20 ": "count: 10 ", "size: [224, 224]": "size: [96, 96]"}
    )
    errors = [float(line.split()[-1]) for line in trained.splitlines()]
    assert len(errors) == 2 and errors[1] < 0.9 * errors[0]
    assert looped == ""


@pytest.mark.usefixtures("blender")
def test_blender_s_first_pictures(folder):
    assert follow("blender", folder) == []
    assert vs.open(folder / "photos-ds")[0].rgb.std() > 10
