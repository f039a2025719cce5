"""Recipes with the former names of fields: read as before, with a warning for each."""

import pytest

import viewsphere as vs
from viewsphere.errors import RecipeError

BODY = "models: [{source: zoo:car}]\nviewpoints: {azimuth: 0, distance: 5}\n"
FORMER = {
    "sun": {"azimuth_deg": [0, 360], "elevation_deg": {"uniform": [20, 70]}},
    "sky": {"night": {"azimuth_deg": 3}},
    "lights": [{"kind": "point", "at": {"azimuth_deg": 40, "elevation_deg": 5, "distance": 2}, "radius": 0.1, "strength": 5}],
    "jitter": {"azimuth_deg": {"normal": [0, 3]}, "tilt_deg": [-2, 2]},
}
PRESENT = {
    "sun": {"azimuth": [0, 360], "elevation": {"uniform": [20, 70]}},
    "sky": {"night": {"azimuth": 3}},
    "lights": [{"kind": "point", "at": {"azimuth": 40, "elevation": 5, "distance": 2}, "radius": 0.1, "strength": 5}],
    "jitter": {"azimuth": {"normal": [0, 3]}, "tilt": [-2, 2]},
}


def recipe(scene, **fields):
    views = {"azimuth": 0, "distance": 5}
    return vs.Recipe.model_validate({"models": [{"source": "zoo:car"}], "viewpoints": views, "scene": scene, **fields})


def test_former_names_mean_the_same_and_are_reported_one_by_one():
    former, present = recipe(FORMER), recipe(PRESENT)
    assert former == present and former.digest == present.digest
    assert present.warnings == ()
    assert former.warnings[0] == "scene.sun.azimuth_deg: this field is now called 'azimuth': rename it"
    assert [line.partition(":")[0] for line in former.warnings] == [
        "scene.sun.azimuth_deg",
        "scene.sun.elevation_deg",
        "scene.sky.night.azimuth_deg",
        "scene.lights[0].at.azimuth_deg",
        "scene.lights[0].at.elevation_deg",
        "scene.jitter.azimuth_deg",
        "scene.jitter.tilt_deg",
    ]


def test_former_names_within_choices_and_variations_are_read():
    choice = {"sun": {"choice": [{"azimuth_deg": 1}, {"azimuth_deg": 2}]}}
    assert recipe(choice).scene.sun.choice[1].azimuth == 2
    varied = recipe({}, variations={"low": {"sun": {"elevation_deg": 5}}})
    assert varied.variations["low"].sun.elevation == 5
    assert [line.partition(":")[0] for line in varied.warnings] == ["variations.low.sun.elevation_deg"]


def test_a_file_may_override_a_former_name_by_the_present_one(tmp_path):
    (tmp_path / "base.yaml").write_text(f"{BODY}scene:\n  sun:\n    azimuth_deg: 10\n    elevation_deg: 20\n")
    path = tmp_path / "recipe.yaml"
    path.write_text("extends: base.yaml\nscene: {sun: {azimuth: 30}}\n")
    made = vs.Recipe.load(path, {"scene.sun.elevation_deg": 25})
    assert (made.scene.sun.azimuth, made.scene.sun.elevation) == (30, 25)
    reported = [line.removeprefix(str(tmp_path)).lstrip("/\\").partition(":") for line in vs.plan(made).warnings]
    assert [name for name, _, _ in reported][:2] == ["base.yaml", "--set scene.sun.elevation_deg"]
    assert reported[0][2] == "5: scene.sun.azimuth_deg: this field is now called 'azimuth': rename it"


def test_both_names_at_once_are_a_mistake_and_other_entries_have_no_former_names():
    now = "this field is now called '{}', which is set as well: remove one of the two"
    both = {"azimuth_deg": 1, "azimuth": 2, "elevation": 3, "elevation_deg": 4}
    with pytest.raises(RecipeError) as told:
        recipe({"sun": both, "jitter": {"tilt_deg": [0, 1]}}, variations={"low": {"sun": {"azimuth": 1, "azimuth_deg": 1}}})
    assert str(told.value).splitlines() == [
        f"scene.sun.azimuth_deg: {now.format('azimuth')}",
        f"scene.sun.elevation_deg: {now.format('elevation')}",
        f"variations.low.sun.azimuth_deg: {now.format('azimuth')}",
    ]
    with pytest.raises(RecipeError, match="azimuth_deg"):
        vs.Recipe.model_validate({"models": [{"source": "zoo:car"}], "viewpoints": {"azimuth_deg": 0, "distance": 5}})
