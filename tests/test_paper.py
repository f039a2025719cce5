"""The paper's data sets, rendered: they pass their own check, and the object is framed as promised."""

import pytest
import yaml

import viewsphere as vs
from small import ROOT
from viewsphere.check import check
from viewsphere.model.recipe_file import read

pytestmark = [pytest.mark.slow, pytest.mark.timeout(400)]


def framing(dataset):
    """Largest and smallest share of the picture's width or height that an object spans, and the largest truncation."""
    spans, cut = [], 0.0
    for sample in dataset:
        (o,) = sample.objects
        x0, y0, x1, y1 = o.box2d
        spans.append(max((x1 - x0) / sample.camera.width, (y1 - y0) / sample.camera.height))
        cut = max(cut, o.truncation)
    return min(spans), max(spans), cut


def test_hairdryer_poses_whole(tmp_path):
    recipe = vs.Recipe.load(ROOT / "recipes" / "hairdryer_poses.yaml")
    summary = vs.generate(recipe, tmp_path / "out")
    assert (summary.frames, summary.rendered) == (360, 360)
    dataset = vs.open(tmp_path / "out")
    report = check(dataset, sample=40)
    assert report.ok, report.findings[:3]
    assert report.checked["coco"] == report.checked["native"] == 360
    smallest, largest, cut = framing(dataset)
    assert 0.25 <= smallest < largest <= 0.85
    assert cut == 0


def test_two_hundred_frames_of_car_poses(tmp_path):
    data, _ = read(ROOT / "recipes" / "car_poses.yaml")
    data["models"][0]["count"] = 10
    data["viewpoints"] = {
        "azimuth": {"start": 0, "stop": 270, "step": 90},
        "elevation": {"start": 0, "stop": 90, "step": 45},
        "distance": [5, 7],
    }
    (tmp_path / "recipe.yaml").write_text(yaml.safe_dump(data))
    summary = vs.generate(vs.Recipe.load(tmp_path / "recipe.yaml"), tmp_path / "out")
    assert summary.frames == 240
    dataset = vs.open(tmp_path / "out")
    report = check(dataset, sample=40)
    assert report.ok, report.findings[:3]
    smallest, largest, cut = framing(dataset)
    assert 0.23 <= smallest < largest <= 0.86  # head-on at 7 m, a long narrow car is 3.5 times smaller than side-on at 5 m
    assert cut == 0
