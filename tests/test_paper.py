"""The paper's data sets, rendered: they pass their own check, and the object is framed as promised. And the page about them:
its numbers are those of the plans, its fields are in the exports, its pictures are there.
"""

import importlib
import json
import os
import re
import shlex
import sys
from itertools import pairwise

import numpy as np
import pytest
import yaml
from PIL import Image

import viewsphere as vs
from small import ROOT
from viewsphere import plugins
from viewsphere.check import check
from viewsphere.cli.arguments import load_recipe
from viewsphere.model.sample import ObjectAnnotation
from viewsphere.plugins.format import FormatSpec
from viewsphere.recipe.reading.file import read

sys.path.insert(0, str(ROOT / "scripts"))
paper = importlib.import_module("paper")

PAGE = (ROOT / "docs" / "paper.md").read_text("utf-8")
SETS = ("car_poses", "bike_poses", "chair_poses", "boat_poses", "hairdryer_poses")


def table(page, head):
    """Rows of the table that begins with this head, as lists of cells."""
    lines = page[page.index(head) :].split("\n\n")[0].splitlines()[2:]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def number(text):
    return int(text.replace(",", ""))


@pytest.fixture(scope="module")
def planned():
    return {name: vs.plan(vs.Recipe.load(ROOT / "recipes" / f"{name}.yaml")) for name in SETS}


def test_table_2_holds_what_the_plans_say(planned):
    rows = table(PAGE, "| recipe | models | azimuth")
    assert [row[0].strip("`") for row in rows] == [f"{name}.yaml" for name in SETS]
    for row, plan in zip(rows, planned.values(), strict=True):
        views = [plan.pose_list[i] for i in range(plan.poses)]
        assert [number(row[i]) for i in (1, 5, 6)] == [plan.models, plan.poses, plan.frames]
        for cell, name in ((row[2], "azimuth_deg"), (row[3], "elevation_deg")):
            values = np.unique([getattr(v, name) for v in views])
            assert int(cell.rpartition(":")[2]) == len(values)
            stated = [float(v) for v in re.findall(r"\d+", cell.rpartition(":")[0])]
            if "by" in cell:
                first, last, step = stated
                assert values.tolist() == list(np.arange(first, min(last + 1, 360), step))
            else:
                assert values.tolist() == stated
        assert {v.distance for v in views} == {float(v) for v in re.findall(r"\d+", row[4])}
        assert [number(v) for v in row[7].split("/")] == list(plan.split_counts.values())


def test_the_paper_s_own_numbers_are_met(planned):
    """Ruiz et al. 2019, table 2: poses, models, images."""
    table_2 = {"car": (2736, 100, 273_600), "bike": (108, 6, 648), "chair": (324, 6, 1944), "boat": (651, 10, 6510)}
    table_2["hairdryer"] = (60, 6, 360)
    assert {n: (p.poses, p.models, p.frames) for n, p in planned.items()} == {f"{n}_poses": v for n, v in table_2.items()}


def test_the_recipes_page_holds_the_same_numbers(planned):
    rows = table((ROOT / "recipes" / "README.md").read_text("utf-8"), "| recipe |")
    stated = {row[0].strip("`").removesuffix(".yaml"): [number(v) for v in row[1:]] for row in rows}
    assert stated == {n: [p.models, p.poses, p.frames] for n, p in planned.items()}


def test_the_measured_runs_are_of_what_the_plans_say(planned):
    rows = table(PAGE, "| data set | frames | of |")
    assert [row[0] for row in rows] == list(SETS)
    for row, plan in zip(rows, planned.values(), strict=True):
        assert number(row[2]) == plan.frames >= number(row[1])
        frames, seconds, rate = number(row[1]), float(row[3].removesuffix(" s")), float(row[4])
        assert rate == pytest.approx(frames / seconds, rel=0.02)
        assert row[-1] == "all proofs hold"


def test_table_1_has_the_paper_s_ticks():
    """Sums of the columns of the paper's table 1: 2D box, 3D box, mask, depth, model, categories, matrices, flow, size."""
    rows = table(PAGE, "| data set or tool | frames | 2D box")
    assert len(rows) == 19 + 2
    ticks = np.array([[cell == "✓" for cell in row[2:]] for row in rows])
    assert ticks[:20].sum(axis=0).tolist() == [13, 8, 14, 14, 14, 15, 8, 6, 3]
    assert ticks[19].sum() == 8 and ticks[20].all()


def found(values, path):
    """What a path such as `poses.*.azimuth` leads to."""
    for step in path:
        inside = values if step == "*" else [v for v in values if step in v]
        assert inside, f"nothing at {step}"
        values = (
            [x for v in inside for x in (v.values() if isinstance(v, dict) else v)]
            if step == "*"
            else [v[step] for v in inside]
        )
    return values


def test_every_field_that_the_page_names_is_in_the_exports(small_run):
    native = json.loads((small_run / "native" / "dataset1.json").read_text())
    coco = json.loads((small_run / "coco" / "annotations" / "instances_train.json").read_text())
    spans = set(re.findall(r"`([^`\n]+)`", "\n".join(map(str, table(PAGE, "| annotation | native")))))
    fields = [span.split(".") for span in spans if re.match(r"(poses|vehicles|images|annotations|models)\.\*\.", span)]
    assert len(fields) >= 24
    for path in fields:
        home = native if path[0] in native else coco
        assert path[0] in home
        assert found([home], path), path
    globs = [span for span in spans if re.match(r"(native|coco)/", span)]
    assert len(globs) >= 7
    for pattern in globs:
        assert any(small_run.glob(pattern)), pattern
    sample = vs.open(small_run)[0]
    names = [span.split(".")[1] for span in spans if re.fullmatch(r"o\.\w+", span)]
    assert len(names) >= 15 and isinstance(sample.objects[0], ObjectAnnotation)
    for name in names:
        getattr(sample.objects[0], name)
    for name in ("depth", "camera"):
        assert f"sample.{name}" in spans and getattr(sample, name) is not None
    coded = set(re.findall(r"`([^`\n]+)`", PAGE))
    assert {"o.visibility", "o.truncation"} <= coded


@pytest.mark.parametrize(("page", "least"), [("docs/paper.md", 2), ("recipes/README.md", 6)])
def test_commands_on_the_pages_name_recipes_that_plan(page, least):
    text = (ROOT / page).read_text("utf-8").replace("\\\n", " ")
    commands = re.findall(r"^viewsphere (?:plan|render) (recipes/\S+)(.*?)(?:#.*)?$", text, re.MULTILINE)
    assert len(commands) >= least
    for file, options in commands:
        words = shlex.split(options)
        changes = [change for option, change in pairwise(words) if option == "--set"]
        assert vs.plan(load_recipe(ROOT / file, changes)).frames > 0


def test_the_page_s_pictures_are_there_and_not_too_large():
    for page in ("paper.md", "gallery.md"):
        names = re.findall(r"!\[[^\]]+\]\(([^)]+)\)", (ROOT / "docs" / page).read_text("utf-8"))
        assert len(names) >= 6
        for name in names:
            file = ROOT / "docs" / name
            with Image.open(file) as picture:
                assert picture.width <= 1600
            if file.name.startswith("paper_"):
                assert picture.width <= 1400 and file.stat().st_size < 250_000, name
    assert os.access(ROOT / "scripts" / "paper", os.X_OK)
    known = re.findall(r"^def (\w+)\(\) -> None:", (ROOT / "scripts" / "paper.py").read_text("utf-8"), re.MULTILINE)
    made = {name.removeprefix("images/paper_").removesuffix(".jpg") for name in re.findall(r"images/paper_\w+\.jpg", PAGE)}
    assert made and made <= set(known)


def test_the_page_s_script_picks_frames_by_model_and_viewpoint():
    made_of = paper.recipe("hairdryer", {"camera.size": [64, 48]})
    (sample,) = paper.frames(made_of, [paper.Pick(3, 20, 10, 4)])
    (o,) = sample.objects
    assert o.key == "hair_drier_003"
    assert (o.view.azimuth_deg, o.view.elevation_deg, o.view.distance) == pytest.approx((20, 10, 4))
    with pytest.raises(SystemExit, match="expected a pose"):
        paper.frames(made_of, [paper.Pick(3, 21, 10, 4)])


def framing(dataset):
    """Largest and smallest share of the picture's width or height that an object spans, and the largest truncation."""
    spans, cut = [], 0.0
    for sample in dataset:
        (o,) = sample.objects
        x0, y0, x1, y1 = o.box2d
        spans.append(max((x1 - x0) / sample.camera.width, (y1 - y0) / sample.camera.height))
        cut = max(cut, o.truncation)
    return min(spans), max(spans), cut


@pytest.mark.slow
def test_hairdryer_poses_whole(tmp_path):
    recipe = vs.Recipe.load(ROOT / "recipes" / "hairdryer_poses.yaml", {"camera.size": [160, 120]})
    summary = vs.generate(recipe, tmp_path / "out")
    assert (summary.frames, summary.rendered) == (360, 360)
    dataset = vs.open(tmp_path / "out")
    report = check(dataset, sample=20)
    assert report.ok, report.findings[:3]
    assert report.checked["coco"] == report.checked["native"] == 360
    smallest, largest, cut = framing(dataset)
    assert 0.25 <= smallest < largest <= 0.85
    assert cut == 0


@pytest.mark.slow
def test_a_hundred_frames_of_car_poses(tmp_path):
    data, _ = read(ROOT / "recipes" / "car_poses.yaml")
    data["models"][0]["count"] = 4
    data["camera"]["size"] = [256, 256]
    data["viewpoints"] = {
        "azimuth": {"start": 0, "stop": 270, "step": 90},
        "elevation": {"start": 0, "stop": 90, "step": 45},
        "distance": [5, 7],
    }
    (tmp_path / "recipe.yaml").write_text(yaml.safe_dump(data))
    summary = vs.generate(vs.Recipe.load(tmp_path / "recipe.yaml"), tmp_path / "out")
    assert summary.frames == 96
    dataset = vs.open(tmp_path / "out")
    report = check(dataset, sample=20)
    assert report.ok, report.findings[:3]
    smallest, largest, cut = framing(dataset)
    assert 0.23 <= smallest < largest <= 0.86  # head-on at 7 m, a long narrow car is 3.5 times smaller than side-on at 5 m
    assert cut == 0


def test_every_format_of_table_1_is_there_and_so_is_its_test():
    rows = re.findall(r"^\| .* \| ✓ \[`(\w+)`\]\(([\w.-]+)#\w+\) \| `(\S+)` \|", PAGE, re.MULTILINE)
    assert len(rows) >= 16
    for name, page, test in rows:
        assert plugins.load(FormatSpec, name).writer and (ROOT / test).is_file()
        assert f"\n## {name}\n" in (ROOT / "docs" / page).read_text("utf-8")
