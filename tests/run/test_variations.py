"""Variations render the same shots under other light: labels are the same bytes, and nothing that is there changes."""

import json
from pathlib import Path

import numpy as np
import pytest

import viewsphere as vs
from small import small_recipe, still_channels
from viewsphere import Dataset, generate
from viewsphere.check import check
from viewsphere.errors import RecipeError
from viewsphere.geometry.box3d import Box3d
from viewsphere.model.channel import PICTURES
from viewsphere.model.sample import Sample
from viewsphere.planning.plan import plan

BOX = Box3d.between((-0.1, -0.1, 0), (0.1, 0.1, 0.3)).corners
DARK = {"sun": {"elevation": 12, "strength": 1.0}, "effects": {"read_noise": 0.3}}
BOTH = {"day": {"effects": {"read_noise": 0.3}}, "dark": DARK}
LABELS = [name for name in still_channels() if name not in PICTURES]
MODEL = {"source": "zoo:post_box", "category": "post box", "count": 2, "scale": {"length": 0.18}}
VIDEO = {
    "models": [{**MODEL, "count": 1, "motion": {"kind": "random", "position": [0.2, 0.2, 0], "rotation_deg": [0, 0, 30]}}],
    "viewpoints": {"kind": "orbit", "azimuth": [0, 60], "elevation": 20, "distance": 1},
    "time": {"frames": 3, "fps": 10},
    "channels": ["rgb", "depth", "instances", "flow"],
}


def recipe(**changes):
    sun = {"azimuth": {"uniform": [0, 360]}, "elevation": {"uniform": [30, 60]}}
    same = {"scene": {"ground": True, "sun": sun}, "variations": BOTH, "camera": {"size": [48, 36], "fov_deg": 35}}
    return small_recipe(**{**same, "formats": ["coco"], **changes})


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Dataset:
    out = tmp_path_factory.mktemp("variations") / "out"
    generate(recipe(), out)
    return Dataset(out)


def told(sample: Sample) -> tuple[object, ...]:
    """What a sample's labels say, but for its number."""
    objects = [(o.id, o.key, o.box2d, o.area, o.rle.counts, o.visibility, o.box3d.tobytes()) for o in sample.objects]
    return sample.split, sample.known_pose, objects, *(sample.channels[name].tobytes() for name in LABELS)


def test_labels_are_the_same_bytes_and_pictures_are_not(made: Dataset) -> None:
    of = {name: [s for s in made if s.variation == name] for name in BOTH}
    assert [len(samples) for samples in of.values()] == [12, 12]
    for day, dark in zip(*of.values(), strict=True):
        assert told(day) == told(dark)
        assert dark.rgb.mean() < 0.9 * day.rgb.mean()


WEATHER = {"dry": {}, "fog": {"fog": 3.0}, "rain": {"rain": 40.0}, "snow": {"snow": 3.0}, "wet": {"wet": {"puddles": 0.6}}}


@pytest.mark.slow
def test_no_weather_changes_a_label_and_every_weather_a_picture() -> None:
    once = recipe(
        variations=WEATHER, models=[{**MODEL, "count": 1}], viewpoints={"azimuth": 30, "elevation": 20, "distance": 1}
    )
    found = {s.variation: s for s in vs.render(once)}
    again = {s.variation: s.rgb for s in vs.render(once)}
    assert list(found) == list(WEATHER)
    for name, sample in found.items():
        assert told(sample) == told(found["dry"])
        assert (sample.rgb == again[name]).all()
        assert name == "dry" or (sample.rgb != found["dry"].rgb).mean() > 0.05


def test_noise_of_one_shot_differs_between_variations() -> None:
    twice = recipe(variations={"one": BOTH["day"], "other": BOTH["day"]}, models=[{**MODEL, "count": 1}])
    one, other = (s.rgb.astype(int) for s in vs.render(twice) if s.known_pose.index == 0)
    assert 0.3 < np.abs(one - other).mean() < 10


SUN = {"sun": {"azimuth": {"uniform": [0, 360]}, "elevation": 40}}
RAIN = {"rain": {"rate": {"uniform": [10, 50]}}}


def drawn_scenes(variations: dict[str, object], name: str) -> list[object]:
    """A field of the scene of each variation's shot."""
    one = recipe(variations=variations, models=[{**MODEL, "count": 1}], viewpoints={"azimuth": 0, "distance": 2})
    planned = plan(one)
    return [getattr(shot.scene, name) for shot in planned.shots(lambda spec, step=None: BOX)]


@pytest.mark.parametrize(("change", "field"), [(SUN, "sun"), (RAIN, "rain")])
def test_each_variation_draws_what_it_sets_unless_they_are_paired(change: dict[str, object], field: str) -> None:
    ten = {f"light{i}": change for i in range(10)}
    assert len({repr(one) for one in drawn_scenes(ten, field)}) == 10
    assert len({repr(one) for one in drawn_scenes(ten | {"paired": True}, field)}) == 1


def test_what_variations_take_from_the_scene_has_the_same_draws() -> None:
    suns = drawn_scenes({"clear": {}, "noisy": {"effects": {"read_noise": 0.3}}}, "sun")
    assert suns[0] == suns[1]


def test_a_variation_more_changes_no_draw_of_the_others() -> None:
    few, more = (drawn_scenes({name: SUN for name in names}, "sun") for names in ("ab", "cab"))
    assert more[1:] == few


def test_paired_is_kept_in_what_is_written_and_is_no_variation() -> None:
    paired = recipe(variations={"paired": True, **BOTH})
    again = vs.Recipe.model_validate_json(paired.model_dump_json())
    assert again.variations is not None and again.variations.paired and list(again.variations) == list(BOTH)
    assert "paired" not in json.loads(recipe().model_dump_json())["variations"]
    with pytest.raises(RecipeError, match=r"variations\.paired: expected true or false"):
        recipe(variations={"paired": {"sun": "off"}, **BOTH})


@pytest.mark.slow
def test_a_check_proves_the_data_set(made: Dataset) -> None:
    report = check(made)
    assert report.ok and report.checked["digests"]


def test_a_variation_looks_as_it_would_alone(made: Dataset) -> None:
    alone = {(s.objects[0].key, s.known_pose.index): s.rgb for s in vs.render(recipe(variations={"dark": DARK}))}
    together = {(s.objects[0].key, s.known_pose.index): s.rgb for s in made if s.variation == "dark"}
    assert alone.keys() == together.keys()
    assert all((alone[name] == picture).all() for name, picture in together.items())


@pytest.mark.slow
def test_a_further_variation_is_appended_and_nothing_else_is_touched(made: Dataset, tmp_path: Path) -> None:
    out = tmp_path / "out"
    generate(recipe(), out)
    before = {path: path.read_bytes() for path in (out / "store").rglob("*.png")}
    generate(recipe(variations={**BOTH, "low": {"sun": {"elevation": 5}}}), out, append=True)
    grown = Dataset(out)
    assert [sum(s.variation == name for s in grown) for name in ("day", "dark", "low")] == [12, 12, 12]
    assert all(path.read_bytes() == content for path, content in before.items())
    for day, low in zip((s for s in grown if s.variation == "day"), (s for s in grown if s.variation == "low"), strict=True):
        assert told(day) == told(low)


def test_a_variation_that_is_there_stays_what_it_is(made: Dataset, tmp_path: Path) -> None:
    with pytest.raises(RecipeError, match=r"variations.dark: expected"):
        generate(recipe(variations={"dark": {"sun": "off"}}), made.root, append=True)


def test_sequences_carry_the_name_and_their_shots_are_alike() -> None:
    film = [s for s in vs.render(recipe(**VIDEO))]
    assert [s.sequence for s in film] == ["post_box_000-day"] * 3 + ["post_box_000-dark"] * 3
    for day, dark in zip(film[:3], film[3:], strict=True):
        assert all((day.channels[name] == dark.channels[name]).all() for name in ("depth", "instances"))
        assert (day.rgb != dark.rgb).any()
    assert {s.split for s in film} == {film[0].split}


def test_vkitti_puts_variations_of_a_world_beside_one_another(tmp_path: Path) -> None:
    video = {**VIDEO, "channels": ["rgb", "depth", "instances", "semantic", "flow"], "annotations": ["velocity"]}
    video["models"] = [{**VIDEO["models"][0], "category": "post_box"}]
    generate(recipe(**video, formats=[{"vkitti": {"version": "1.3.1"}}]), tmp_path / "out")
    folders = {path.relative_to(tmp_path).as_posix() for path in (tmp_path / "out/vkitti/vkitti_1.3.1_rgb").glob("*/*")}
    assert folders == {f"out/vkitti/vkitti_1.3.1_rgb/post_box_000/{name}" for name in BOTH}


def test_without_variations_a_recipe_has_the_digest_it_had() -> None:
    plain = small_recipe()
    assert "variations" not in plain.to_yaml() and plan(plain).varied_subjects == plan(plain).subjects
    assert recipe().digest != recipe(variations={"day": BOTH["day"]}).digest


@pytest.mark.parametrize(
    ("variations", "message"),
    [
        ({"a": {"place": "zoo:neighbourhood"}}, r"variations\.a\.place: expected sun, .*; found place"),
        ({"a-b": {}}, r"variations"),
        ({"A": {}, "a": {}}, r"variations A and a differ only in capitals"),
        ({}, r"variations"),
        ({"a": {}, "b": {"background": "transparent"}}, r"variations\.b\.background: expected a transparent background in all"),
        ({"a": {}, "b": {"background": "#ff0000"}}, None),
        ({"a": {"view": {"exposure": float("nan")}}}, r"variations\.a\.view\.exposure"),
    ],
)
def test_mistakes_are_told_in_a_line(variations, message) -> None:
    if message is None:
        assert small_recipe(variations=variations)
        return
    with pytest.raises(RecipeError, match=message) as caught:
        small_recipe(variations=variations)
    assert "\n" not in str(caught.value)


def test_ground_that_follows_the_background_is_refused_where_labels_would() -> None:
    with pytest.raises(RecipeError, match=r"set scene\.ground"):
        small_recipe(scene={}, variations={"a": {}, "b": {"background": "#ff0000"}})
