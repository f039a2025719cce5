"""Troubleshooting shows messages as they are: each is provoked where that is cheap, else found in the source."""

import ast
import errno
import json
import os
import re
import shlex
import shutil
import sys
from pathlib import Path

import pytest
from PIL import Image

from animated import leaf
from command_line import viewsphere
from small import ROOT
from viewsphere.store.shots.manifest import sealed, unsealed

PAGE = (ROOT / "docs" / "troubleshooting.md").read_text("utf-8")
HEADINGS = re.findall(r"^### `(.+)`$", PAGE, re.MULTILINE)

RECIPE = """\
models: [{source: zoo:post_box, count: 2, scale: {length: 0.3}}]
viewpoints: {azimuth: [0, 180], distance: 1}
camera: {size: [32, 24], fov_deg: 35}
channels: [rgb, instances]
formats: []
splits: {by: frame, train: 0.5, val: 0.5}
"""
LIGHT = """\
models: [{source: here/ok.obj, category: thing}]
viewpoints: {azimuth: [0, 180], distance: 4}
camera: {size: [32, 24], fov_deg: 35}
channels: [rgb, instances]
formats: []
"""
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 1\nf 1 2 3\n"
FILES = {
    "r.yaml": RECIPE,
    "t.yaml": LIGHT,
    "tab.yaml": "models:\n\t- source: zoo:car\n",
    "star.yaml": "models:\n  - source: *.obj\n",
    "steps.yaml": "models:\n  - source: zoo:car\n   category: car\n",
    "comma.yaml": "models: [{source: zoo:chair count: 1}]\n",
    "walk.csv": "azimuth,elevation,distance\n0,10,nan\n",
    "short.csv": "azimuth,height\n0,1\n",
    "here/ok.obj": TRIANGLE,
    "here/huge.obj": TRIANGLE.replace("1", "900000", 2),
    "here/wide.obj": "v 0 0 0\nv 300 0 0\nv 0 100 40\nf 1 2 3\n",
    "here/points.obj": "v 0 0 0\nv 1 0 0\n",
    "here/page.glb": "<!DOCTYPE html><html></html>",
    "here/commas.obj": "v 0,5 0 0\n" + TRIANGLE,
    "here/clear.obj": "mtllib clear.mtl\nusemtl a\n" + TRIANGLE,
    "here/clear.mtl": "newmtl a\nd 0\n",
    "here/gloss.obj": "v 0 0 0\nv 1 0 0\nv 0 1 1\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3\n",
    "here/gloss.mtl": "newmtl a\nmap_Kd gloss.png\n",
    "here/thin.obj": TRIANGLE + "f 1 1 2\n",
    "here/empty.glb": "",
    "here/a.step": "ISO-10303-21;",
    "here/a.txt": "no model",
    "here/a.fbx": "",
    "here/b.USD": "",
    "here/c.abc": "",
    "here/plain.obj": "mtllib lost.mtl\nusemtl red\n" + TRIANGLE,
    "here/lost.obj": "mtllib lost.mtl\nusemtl a\n" + TRIANGLE,
    "here/away.obj": "mtllib away.mtl\nusemtl a\n" + TRIANGLE,
    "here/lost.mtl": "newmtl a\nmap_Kd wood.png\n",
    "here/away.mtl": "newmtl a\nmap_Kd ../wood.png\n",
    "here/packed.gltf": json.dumps({"asset": {"version": "2.0"}, "extensionsRequired": ["KHR_gaussian_splatting"]}),
    "here/line.obj": "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n",
    "photos/annotations/instances_train.json": json.dumps(
        {"images": [], "categories": [{"id": 1, "name": "x"}], "annotations": [{"id": 1, "image_id": 9, "category_id": 1}]}
    ),
    "here/square.hdr": "#?RADIANCE\n\n-Y 9 +X 9\n",
    "here/large.ppm": "P6 20000 8000 255 ",
    "here/dull.obj": "v 0 0 0\nv 1 0 0\nv 0 1 1\nvn 0 0 0\nf 1//1 2//1 3//1\n",
    "folder/a.txt": "somebody's",
}  # fmt: skip


@pytest.fixture
def said(tmp_path, monkeypatch):
    """Runs a viewsphere command in a folder of hard cases and gives all that it prints."""
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    Image.new("RGB", (4, 4)).save(tmp_path / "wood.png")
    Image.new("RGBA", (4, 4), (9, 9, 9, 100)).save(tmp_path / "here" / "gloss.png")
    monkeypatch.chdir(tmp_path)

    def run(line):
        answer = viewsphere(*shlex.split(line))
        return answer.stdout + answer.stderr

    return run


COMMANDS = {
    "found a tab": "plan tab.yaml",
    "needs quotes": "plan star.yaml",
    "the indentation fits no line": "plan steps.yaml",
    "expected a comma or the end": "plan comma.yaml",
    "found a model: look": "render here/ok.obj -o out",
    "left out: name them": "plan t.yaml --set 'models=[{source: here, category: x}]'",
    "found no such folder": "check nowhere",
    "<where>: <name> is unknown; did you mean": "plan r.yaml --set scene.grond=on",
    "expected a readable recipe file": "plan gone.yaml",
    "expected field=value": "plan r.yaml --set scene.ground",
    "found no <name> in": "plan r.yaml --set 'models=[{source: gone.glb, category: x}]'",
    "gives none in": "plan r.yaml --set 'models=[{source: \"*.glb\", category: x}]'",
    "only models of a source have one": "plan r.yaml --set 'models=[{source: here/ok.obj}]'",
    "shares that add up to 1": "plan r.yaml --set splits.train=0.7",
    "split <name> is empty": "plan r.yaml --set splits.train=0.8 --set splits.val=0.1 --set splits.test=0.1",
    "the ground hides the models": "plan r.yaml --set viewpoints.elevation=-10 --set scene.ground=on",
    "ground hides about": "plan r.yaml --set viewpoints.elevation=60 --set 'scene={ground: on, background: {image: wood.png}}'",
    "no light<in some>": "plan r.yaml --set scene.sun=off --set scene.sky.strength=0",
    "white is black": "plan r.yaml --set scene.view.exposure=-16",
    "move the models' centre": "plan r.yaml --set scene.jitter.target=[9,9,9]",
    "scene.sky.hdri": "plan r.yaml --set scene.sky=here/square.hdr",
    "expected a readable image": "plan r.yaml --set scene.background.image=here/a.txt",
    "(limit MAX_PICTURE_PIXELS)": "plan r.yaml --set scene.background.image=here/large.ppm",
    "a pattern of its materials' names": "render t.yaml -o out --workers 0 --set 'scene.materials=[{material: x*, tint: red}]'",
    "normals are missing": "inspect here/dull.obj",
    "set max_frames": "plan r.yaml --set max_frames=3",
    "which format <format> needs": "render r.yaml -o out --workers 0 --set channels=[instances] --format coco",
    "--format: <name> is unknown": "render r.yaml -o out --workers 0 --format kiti",
    "is inside the model": "render r.yaml -o out --workers 0 --set viewpoints.distance=0.1",
    "scene.company.count": "plan r.yaml --set scene.company=5",
    "expected columns": "plan r.yaml --set 'viewpoints={kind: file, path: short.csv}'",
    "expected a finite number": "plan r.yaml --set 'viewpoints={kind: file, path: walk.csv}'",
    "files are not read": "inspect here/a.step",
    "expected a model file with suffix": "inspect here/a.txt",
    "no such file": "inspect here/gone.obj",
    "the file is empty": "inspect here/empty.glb",
    "expected a model, found": "inspect here/page.glb",
    "has a decimal comma": "inspect here/commas.obj",
    "nothing of the model can be seen": "inspect here/clear.obj",
    "does not state that the alpha of texture": "inspect here/gloss.obj",
    "no triangles found": "inspect here/points.obj",
    "every triangle has zero area": "inspect here/line.obj",
    "requires the extension": "inspect here/packed.gltf",
    "triangles without area dropped": "inspect here/thin.obj",
    "does not exist": "inspect here/lost.obj",
    "is outside the model's folder": "inspect here/away.obj",
    "is in no material library": "inspect here/plain.obj",
    "(limit MAX_SIZE) across": "inspect here/huge.obj",
    "m across: set unit": "inspect here/wide.obj",
    "wider than long": "inspect here/wide.obj",
    "family": "inspect zoo:spaceship",
    "axes at right angles": "inspect here/ok.obj --up +z --forward -z",
    "(store/plan.json)": "check folder",
    "expected an empty or new folder": "render r.yaml -o folder --workers 0",
    "expected a writable output folder": "render r.yaml -o r.yaml/out --workers 0",
    "expected a place to write": "inspect here/ok.obj -o r.yaml/a.png",
    "render: expected a recipe": "render",
    "expected the id of an image": "import coco photos -o photos-ds",
}
"""Words of a heading, and a command that prints such a message."""

ON_DATA = {
    "and no format uses": "render t.yaml -o large --workers 0 --set channels=[rgb,depth,normals] --format coco",
    "choose another output folder, add to it": "render r.yaml -o small --workers 0",
    "expected the channels of": "merge small other -o both",
}
"""The same, with a data set at hand."""

IN_THE_SOURCE = {
    "expected room for",
    "others can write this folder",
    "scaled to its real length",
    "expected finished frames",
    "another run appended a part",
    "stopped; <what is kept>",
    "its worker died",
    "expected a Ray cluster that answers",
    "expected a folder that all machines",
    "a worker failed",
    "expected embreex",
}
"""Words of the headings whose messages cost much to provoke, or need another machine."""

TRIED = {
    "limit MAX_READ_SECONDS",
    "so kernels are compiled for it alone",
    "files are read by Blender",
    "Blender cannot read it",
    "its frames are not known",
    "reading it takes more",
    "reading it crashed",
    "it was killed",
    "(limit MAX_TRIANGLES)",
    "what is finished is kept",
    "expected a finished data set to append to",
    "changed since this data set was begun",
    "expected the frames of a finished shot",
    "data made by viewsphere",
    "that is installed paints them",
    "hard links do not work here",
    "compiling kernels",
}
"""Words of the headings that have a test of their own."""


def heading_with(words):
    (found,) = [h for h in HEADINGS if words in h]
    return found


def pattern(heading):
    """A regular expression: what stands in <angle brackets> is anything; zoo:<family> is itself."""
    return ".*".join(map(re.escape, re.split(r"(?<!zoo:)<[^>]+>", heading)))


def assert_shown(words, text):
    expected = re.compile(pattern(heading_with(words)))
    lines = [re.sub(r"^(viewsphere: |warning: |note: |  (hint|warning) +)", "", line) for line in text.splitlines()]
    lines += [line.replace("--set ", "recipe.yaml:1: ", 1) for line in lines if line.startswith("--set ")]
    assert any(expected.fullmatch(line) for line in lines), f"{expected.pattern}\nis none of\n{text}"


def test_every_heading_is_tested_and_there_are_enough():
    known = [*COMMANDS, *ON_DATA, *IN_THE_SOURCE, *TRIED]
    assert sorted(map(heading_with, known)) == sorted(HEADINGS)
    assert len(HEADINGS) >= 50
    assert len(COMMANDS) + len(ON_DATA) + len(TRIED) >= 45


@pytest.mark.parametrize("words", COMMANDS)
def test_a_command_s_message(said, words):
    assert_shown(words, said(COMMANDS[words]))


@pytest.mark.parametrize("words", ON_DATA)
def test_a_data_set_s_message(said, small_run, words):
    shutil.copytree(small_run, "small")
    if words == "expected the channels of":
        said("render t.yaml -o other --workers 0")
    assert_shown(words, said(ON_DATA[words]))


@pytest.mark.slow
@pytest.mark.parametrize("words", sorted(IN_THE_SOURCE))
def test_a_message_of_the_source(words, templates):
    expected = re.compile(pattern(heading_with(words)))
    assert any(expected.search(template) for template in templates)


@pytest.fixture(scope="module")
def templates():
    """All texts of the source; what is filled in is an ellipsis."""
    return list(texts())


def texts():
    for file in (ROOT / "src").rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if isinstance(node, ast.JoinedStr):
                yield "".join(str(v.value) if isinstance(v, ast.Constant) else "..." for v in node.values)
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                yield node.value


@pytest.mark.slow
def test_reading_takes_too_long(said, monkeypatch, tmp_path):
    monkeypatch.setenv("VIEWSPHERE_CACHE", str(tmp_path / "cache"))
    monkeypatch.delenv("VIEWSPHERE_READ_HERE")
    monkeypatch.setenv("VIEWSPHERE_MAX_READ_SECONDS", "0.01")
    assert_shown("limit MAX_READ_SECONDS", said("inspect here/ok.obj"))


@pytest.mark.slow
def test_reading_takes_too_much(said, monkeypatch, tmp_path):
    def flood(*_, **__):
        raise MemoryError

    monkeypatch.setenv("VIEWSPHERE_CACHE", str(tmp_path / "cache"))
    monkeypatch.setenv("VIEWSPHERE_READ_HERE", "1")
    monkeypatch.setenv("VIEWSPHERE_MAX_TRIANGLES", "1")
    (tmp_path / "here" / "two.obj").write_text(TRIANGLE + "f 3 2 1\n")
    assert_shown("(limit MAX_TRIANGLES)", said("inspect here/two.obj"))
    monkeypatch.setattr("viewsphere.assets.load.load_model", flood)
    assert_shown("reading it takes more", said("inspect here/ok.obj"))


@pytest.mark.parametrize(("how", "words"), [("SEGV", "reading it crashed"), ("KILL", "it was killed")])
def test_reading_crashes_or_is_killed(said, monkeypatch, tmp_path, how, words):
    monkeypatch.delenv("VIEWSPHERE_READ_HERE")
    program = tmp_path / "crash"
    program.write_text(f"#!/bin/sh\nkill -{how} $$\n")
    program.chmod(0o755)
    monkeypatch.setenv("VIEWSPHERE_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(sys, "executable", str(program))
    assert_shown(words, said("inspect here/ok.obj"))


def test_an_animation_that_cannot_be_read(said, tmp_path):
    file = tmp_path / "leaf.gltf"
    leaf(file, {"Walk": 1})
    root = json.loads(file.read_text("utf-8"))
    root["animations"][0]["samplers"][0]["input"] = 99
    file.write_text(json.dumps(root), "utf-8")
    assert_shown("its frames are not known", said("inspect leaf.gltf"))


def test_a_full_disk(said, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Path, "write_bytes", full)
    monkeypatch.setattr("viewsphere.caches.folders._copy_bytes", full)
    text = said("render t.yaml -o out --workers 0")
    assert "No space left on device" in text
    assert_shown("what is finished is kept", text)


def test_an_unfinished_or_damaged_data_set_and_a_changed_model(said):
    said("render t.yaml -o out --workers 0")
    append = "render t.yaml -o out --workers 0 --append"
    frames = next(Path("out/store/shots").glob("*/*/frames.json"))
    whole = frames.read_bytes()
    frames.write_bytes(b"[")
    assert_shown("expected the frames of a finished shot", said("export out --format coco"))
    frames.write_bytes(whole)
    Path("here/ok.obj").write_text(TRIANGLE.replace("1 0 0", "2 0 0"))
    text = said(f"{append} --set viewpoints.distance=5")
    assert_shown("changed since this data set was begun", text)
    shutil.rmtree(frames.parent)
    assert_shown("expected a finished data set to append to", said(f"{append} --set viewpoints.distance=6"))


def test_another_version_s_data_set(said, monkeypatch):
    said("render t.yaml -o out --workers 0")
    plan = Path("out/store/plan.json")
    plan.write_text(sealed({**unsealed(plan.read_text()), "version": "0.0.1"}))
    assert_shown("data made by viewsphere", said("render t.yaml -o out --workers 0"))


def test_another_state_of_the_engine(said):
    said("render t.yaml -o out --workers 0 --set shot_frames=1")
    plan = Path("out/store/plan.json")
    record = unsealed(plan.read_text())
    record["parts"][0]["settings"]["the engine's program"] = "another"
    plan.write_text(sealed(record))
    shutil.rmtree(next(Path("out/store/shots").glob("*/*")))
    assert_shown("that is installed paints them", said("render t.yaml -o out --workers 0 --set shot_frames=1"))


def test_no_hard_links(said, monkeypatch):
    said("render t.yaml -o out --workers 0")

    def refuse(*_):
        raise OSError(errno.EPERM, "no")

    monkeypatch.setattr(os, "link", refuse)
    assert_shown("hard links do not work here", said("export out --format native"))


def test_the_first_run_says_why_it_takes_longer(monkeypatch, tmp_path, capsys):
    from viewsphere.cli.making import _compile_kernels
    from viewsphere.run.shots import precompile as warm

    def compile_all(overloads, tell):
        tell(0, 2)
        tell(2, 2)

    monkeypatch.setenv("VIEWSPHERE_CACHE", str(tmp_path))
    monkeypatch.setattr(warm, "compile_all", compile_all)
    _compile_kernels()
    assert_shown("compiling kernels", capsys.readouterr().err)
    _compile_kernels()
    assert capsys.readouterr().err == ""


def test_an_old_processor_is_named_where_kernels_are_compiled(monkeypatch, capsys):
    from viewsphere.cli.terminal import ProgressBar
    from viewsphere.kernels import build
    from viewsphere.run.progress import Progress

    monkeypatch.setattr(build, "TARGET", build.Target.for_machine(build.TRIPLE, "ivybridge", {"avx": True}, native=False))
    with ProgressBar(quiet=False) as bar:
        for done in range(3):
            bar.show(Progress("kernels", done, 2))
    said = capsys.readouterr().err
    assert said.count("lacks avx2") == 1
    assert_shown("so kernels are compiled for it alone", said)
