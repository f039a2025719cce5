"""What the plan of a sequence finds before a model is read: in one line, which begins with file, line and field."""

import pytest

from viewsphere.errors import RecipeError
from viewsphere.planning.plan import plan
from viewsphere.recipe.recipe import Recipe
from viewsphere.validation.errors import Marks, Place

RECIPE = """\
models: [{{source: zoo:car, count: 2, motion: {motion}}}]
splits: {{by: sequence}}
time: {{frames: 4}}
viewpoints: {viewpoints}
scene:
  place: {place}
  company: {company}
{more}
"""
STREET = "\n    source: zoo:neighbourhood\n    motion:\n      "
OSCILLATE = "{kind: oscillate, position: [1, 0, 0]}"


def mistake(tmp_path, motion="{kind: constant}", viewpoints="{kind: drive}", place="null", company="null", more=""):
    file = tmp_path / "models.yaml"  # named as a field is: which is no field of a message
    file.write_text(RECIPE.format(motion=motion, viewpoints=viewpoints, place=place, company=company, more=more))
    with pytest.raises(RecipeError) as caught:
        plan(Recipe.load(file))
    return str(caught.value).removeprefix(str(file))


THINGS = "viewpoints.look: expected a thing's number or key: 1 (car_000); found"


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({}, ":4: viewpoints.kind: expected a place with lanes for drive; found none: set scene.place, or take spline"),
        (
            {"viewpoints": "{kind: drive, lane: up}", "place": "zoo:neighbourhood"},
            ":4: viewpoints.lane: 'up' is unknown. Valid: right, left",
        ),
        ({"viewpoints": "{kind: orbit, distance: 8, look: truck}"}, f":4: {THINGS} 'truck'"),
        ({"viewpoints": "{kind: mast, position: [0, 9, 9], look: 2}"}, f":4: {THINGS} 2"),
        ({"viewpoints": "{kind: spline, points: [[9, 0, 0], [9, 9, 0]], look: car_00}"}, f":4: {THINGS} 'car_00'"),
        (
            {"motion": "{kind: path, lane: any, speed: 3}", "viewpoints": "{distance: 9}"},
            ":1: models[0].motion.lane: expected a place with lanes, such as scene.place: zoo:neighbourhood or zoo:town; "
            "found none: set "
            "one, or list points",
        ),
        (
            {"place": f"{STREET}tree_*: {{kind: path, lane: up, speed: 1}}"},
            ":9: scene.place.motion.tree_*.lane: 'up' is unknown. Valid: any, right, left",
        ),
        (
            {"place": f"{STREET}'[tl]*_[0-9]': {{kind: oscillate, period: 0}}"},
            ":9: scene.place.motion.[tl]*_[0-9].period: expected a number greater than 0; found 0",
        ),
        (
            {"place": f"{STREET}tree_*: [{OSCILLATE}, {{kind: osc}}]"},
            ":9: scene.place.motion.tree_*[1].kind: 'osc' is unknown; did you mean 'oscillate'? Valid: ",
        ),
    ],
)
def test_mistakes(tmp_path, fields, message):
    found = mistake(tmp_path, **fields)
    assert found.startswith(message) and "\n" not in found


def test_a_distractor_looked_at_is_there(tmp_path):
    file = tmp_path / "recipe.yaml"
    looks = "{kind: mast, position: [0, 9, 9], look: 2}"
    more = {"motion": "{kind: constant}", "place": "null", "company": "{count: 1}", "more": ""}
    file.write_text(RECIPE.format(viewpoints=looks, **more))
    assert plan(Recipe.load(file)).frames == 8


def test_other_text_is_no_field():
    marks = Marks("r.yaml", {("models",): Place("r.yaml", 2), ("models", 0): Place("r.yaml", 3)})
    assert marks.located("models[0].source: expected") == "r.yaml:3: models[0].source: expected"
    assert marks.located("models: expected") == "r.yaml:2: models: expected"
    for other in ("models.yaml:2: models: expected", "models that are there: none", "/models: gone", "models.obj not there"):
        assert marks.located(other) == other


@pytest.mark.parametrize(
    "viewpoints",
    [
        "{kind: orbit, distance: 8, azimuth: [0, 40]}",
        "{kind: orbit, distance: [8, 9], elevation: [0, 20], tilt: [0, 1]}",
        "{kind: spline, points: [[9, 0, 0], [9, 9, 0]]}",
        "{kind: mast, position: [0, 9, 9]}",
        "{kind: walk, start: [0, 0], turns: [{at: 0, degrees: 9}]}",
        "{kind: drive}",
    ],
)
def test_a_sequence_of_one_frame_has_every_trajectory(tmp_path, viewpoints):
    fields = {"motion": "{kind: constant}", "company": "null", "more": "", "place": "zoo:neighbourhood"}
    (tmp_path / "r.yaml").write_text(RECIPE.format(viewpoints=viewpoints, **fields).replace("frames: 4", "frames: 1"))
    assert plan(Recipe.load(tmp_path / "r.yaml")).frames == 2
