"""Distances that follow from how much of the picture a model fills."""

import json
import math

import numpy as np
import pytest

import viewsphere as vs
from small import small_recipe
from viewsphere.check import check
from viewsphere.composing.filling import distance_of
from viewsphere.errors import RecipeError
from viewsphere.planning.plan import plan
from viewsphere.recipe.recipe import Recipe
from viewsphere.run.shots.stages import Stages

LENSES = {
    "wide": {"size": [96, 72], "fov_deg": 75},
    "long, off centre, upright": {"size": [60, 90], "K": [[300, 2, 20], [0, 280, 50], [0, 0, 1]]},
    "brown": {
        "size": [96, 72],
        "fov_deg": 60,
        "distortion": {"model": "brown_conrady", "coefficients": [-0.25, 0.06, 1e-3, -2e-3]},
    },
    "fisheye": {"size": [80, 80], "fov_deg": 90, "distortion": {"model": "fisheye", "coefficients": [0.02, -0.004, 0, 0]}},
}
PANORAMAS = {
    "equirectangular": {"size": [128, 64], "projection": "equirectangular"},
    "cylindrical": {"size": [96, 96], "projection": "cylindrical", "span": {"horizontal": 80}},
}
VIEWPOINTS = {
    "grid": {"azimuth": [0, 77], "elevation": [-20, 65], "distance": {"fill": [0.85, 0.25]}, "tilt": 11},
    "steps": {"azimuth": 30, "elevation": 0, "distance": {"fill": {"start": 0.25, "stop": 0.85, "step": 0.2}}},
    "sphere": {"kind": "sphere", "count": 5, "distance": {"fill": [0.25, 0.85]}},
    "normal": {"kind": "normal", "count": 4, "distance": {"fill": 0.4}, "sd": {"azimuth": 30, "elevation": 10}},
    "jitter": {"kind": "jitter", "azimuth": [0, 90], "distance": {"fill": 0.6}, "plus_minus": {"azimuth": 20, "tilt": 30}},
}


def recipe_of(models=("zoo:car", "zoo:bicycle", "zoo:chair"), **more):
    values = {
        "models": [{"source": source} for source in models],
        "viewpoints": VIEWPOINTS["grid"],
        "camera": LENSES["wide"],
        "scene": {"ground": "off"},
        "channels": ["instances"],
        "shot_frames": 3,
    }
    return Recipe(**{**values, **more})


def label_fill(sample, objects=None):
    """The larger share, from the label's own boxes."""
    boxes = np.array([o.box2d_unclipped for o in objects or sample.objects[:1]])
    width, height = boxes[:, 2:].max(axis=0) - boxes[:, :2].min(axis=0)
    return max(width / sample.camera.width, height / sample.camera.height)


@pytest.mark.slow
@pytest.mark.parametrize("lens", LENSES)
def test_the_labels_box_fills_the_share_that_was_asked_for(lens):
    recipe = recipe_of(camera=LENSES[lens])
    wanted = [p.fill for p in plan(recipe).pose_list]
    assert sorted(set(wanted)) == [0.25, 0.85]
    samples = list(vs.render(recipe))
    assert [sample.pose.fill for sample in samples] == 3 * wanted
    for sample in samples:
        assert label_fill(sample) == pytest.approx(sample.pose.fill, rel=1e-3)
        assert label_fill(sample) == pytest.approx(sample.pose.fill, rel=1e-8)  # of what the recorded camera projects
        stands = np.linalg.norm(sample.camera.center - np.array(sample.pose.target or (0, 0, 0)))
        assert stands == pytest.approx(sample.pose.distance, rel=1e-9)


@pytest.mark.parametrize("lens", PANORAMAS)
def test_the_box_in_a_panorama_fills_the_share_too(lens):
    views = {"azimuth": [0, 50], "distance": {"fill": [0.5, 0.1]}}
    samples = list(vs.render(recipe_of(("zoo:chair",), camera=PANORAMAS[lens], viewpoints=views)))
    assert [label_fill(sample) for sample in samples] == pytest.approx([0.5, 0.5, 0.1, 0.1], rel=1e-8)


@pytest.mark.parametrize("kind", VIEWPOINTS)
def test_every_kind_of_viewpoints_that_stands_still_takes_a_share(kind):
    samples = list(vs.render(recipe_of(("zoo:chair",), viewpoints=VIEWPOINTS[kind])))
    fills = [sample.pose.fill for sample in samples]
    assert [label_fill(sample) for sample in samples] == pytest.approx(fills, rel=1e-8)
    if kind == "steps":
        assert fills == [0.25, 0.45, 0.65, 0.85]
    if kind == "sphere":
        assert len(set(fills)) == 5
        assert all(0.25 <= fill <= 0.85 for fill in fills)


def test_shares_are_drawn_uniformly_and_by_the_poses_name():
    def fills(count, **more):
        views = {"kind": "sphere", "count": count, "distance": {"fill": [0.25, 0.85]}}
        return [p.fill for p in plan(recipe_of(viewpoints=views, **more)).pose_list]

    many = np.array(fills(2000))
    assert abs(many.mean() - 0.55) < 4 * 0.6 / math.sqrt(12 * 2000)
    assert many.min() < 0.26
    assert many.max() > 0.84
    assert fills(7) == many[:7].tolist()
    assert fills(7, seed=1) != many[:7].tolist()


@pytest.mark.slow
def test_all_models_of_a_random_scene_fill_the_share_together():
    views = {"azimuth": [0, 50], "distance": {"fill": 0.7}}
    recipe = recipe_of(scenes={"count": 2, "objects": 3}, splits={"train": 1.0}, viewpoints=views)
    for sample in vs.render(recipe):
        assert label_fill(sample, sample.objects) == pytest.approx(0.7, rel=1e-8)


@pytest.mark.slow
def test_a_frames_model_fills_the_share_whatever_stands_beside_it():
    views = {"azimuth": [0, 200], "elevation": 40, "distance": {"fill": 0.12}}
    recipe = recipe_of(scene={"company": 2, "ground": "off"}, splits={"train": 1.0}, viewpoints=views)
    for sample in vs.render(recipe):
        assert len(sample.objects) == 3
        assert label_fill(sample) == pytest.approx(0.12, rel=1e-8)


def test_jitter_comes_on_top_and_its_distance_is_a_factor():
    still = recipe_of(("zoo:chair",), viewpoints={"azimuth": [0, 90], "distance": {"fill": 0.5}})
    turned = recipe_of(
        ("zoo:chair",),
        viewpoints=still.viewpoints,
        scene={"ground": "off", "jitter": {"azimuth": [5, 40], "elevation": 12}},
    )
    farther = recipe_of(("zoo:chair",), viewpoints=still.viewpoints, scene={"ground": "off", "jitter": {"distance": 0.5}})
    assert [label_fill(sample) for sample in vs.render(turned)] == pytest.approx([0.5, 0.5], rel=1e-8)
    for near, far in zip(vs.render(still), vs.render(farther), strict=True):
        assert far.pose.distance == pytest.approx(1.5 * near.pose.distance)


@pytest.mark.slow
def test_the_distance_does_not_depend_on_how_shots_are_cut():
    recipe = recipe_of(("zoo:chair", "zoo:car"))
    whole, cut = (list(vs.render(recipe.model_copy(update={"shot_frames": n}))) for n in (8, 1))
    assert [s.pose for s in whole] == [s.pose for s in cut]


@pytest.mark.slow
def test_check_proves_a_set_of_shares_and_its_records_name_them(tmp_path):
    recipe = small_recipe(viewpoints={"azimuth": [0, 120], "elevation": 15, "distance": {"fill": [0.3, 0.6]}})
    vs.generate(recipe, tmp_path / "out", formats=["coco"])
    dataset = vs.open(tmp_path / "out")
    assert [sample.pose.fill for sample in dataset] == 2 * [0.3, 0.3, 0.6, 0.6]
    assert not check(dataset).findings


def test_records_of_given_distances_are_what_they_were():
    shot = plan(recipe_of(viewpoints={"azimuth": 0, "distance": 8})).shot(0, Stages().box)
    assert "fill" not in json.loads(shot.model_dump_json())["instants"][0]["viewpoint"]


@pytest.mark.parametrize(
    ("viewpoints", "message"),
    [
        ({"distance": {"fill": 1e-300}}, "viewpoints.distance.fill: expected a share of 1e-06 to 4; found 1e-300"),
        ({"distance": {"fill": 0}}, "viewpoints.distance.fill: expected a share of 1e-06 to 4; found 0"),
        ({"distance": {"fill": [0.5, 0.5]}}, "viewpoints.distance: expected distinct values; found 0.5 twice"),
        ({"distance": {"full": 0.5}}, "viewpoints.distance"),
        ({"kind": "sphere", "count": 2, "distance": {"fill": [0.5, 0.2]}}, "viewpoints.distance.fill: expected [low, high]"),
        (
            {"kind": "jitter", "distance": {"fill": 0.5}, "plus_minus": {"distance": 1}},
            "viewpoints.plus_minus.distance: expected 0 beside distance: {fill: ...}",
        ),
        (
            {"kind": "normal", "count": 1, "distance": {"fill": 0.5}, "sd": {"distance": 1}},
            "viewpoints.sd.distance: expected 0 beside distance: {fill: ...}",
        ),
    ],
)
def test_mistakes_name_their_field(viewpoints, message):
    with pytest.raises(RecipeError) as caught:
        recipe_of(viewpoints=viewpoints)
    assert message in str(caught.value)


def test_sequences_refuse_a_share():
    with pytest.raises(RecipeError, match=r"viewpoints.distance: expected metres beside time"):
        plan(recipe_of(time={"frames": 3}))
    with pytest.raises(RecipeError, match=r"viewpoints.distance: expected metres, as what moves .* found fill"):
        recipe_of(time={"frames": 3}, viewpoints={"kind": "orbit", "distance": {"fill": 0.5}})


def test_a_share_that_no_distance_gives_is_an_error_with_the_model_and_the_pose():
    bent = {"size": [80, 80], "fov_deg": 40, "distortion": {"model": "brown_conrady", "coefficients": [-0.9, 0, 0, 0]}}
    with pytest.raises(RecipeError, match=r"viewpoints.distance: expected a share .* chair_000 .* found 3 \(pose 0\)"):
        list(vs.render(recipe_of(("zoo:chair",), camera=bent, viewpoints={"azimuth": 0, "distance": {"fill": 3}})))


def test_a_camera_that_a_share_puts_inside_of_a_model_is_an_error():
    views, lens = {"azimuth": 0, "elevation": 65, "distance": {"fill": 0.85}}, {**LENSES["fisheye"], "fov_deg": 120}
    with pytest.raises(RecipeError, match=r"expected the camera outside .* inside chair chair_000"):
        list(vs.render(recipe_of(("zoo:chair",), viewpoints=views, camera=lens)))


def test_the_search_finds_closed_forms_in_few_steps():
    asked = []

    def pinhole(distance):
        asked.append(distance)
        return math.inf if distance <= 0.5 else 0.8 / (distance - 0.5)

    for fill in (1e-4, 0.25, 0.85, 7.0):
        asked.clear()
        assert distance_of(fill, pinhole, 1.0) == pytest.approx(0.5 + 0.8 / fill, rel=1e-8)
        assert len(asked) < 60
        assert len(set(asked)) == len(asked)
    assert distance_of(0.5, lambda distance: 0.3 if distance > 1 else math.inf, 1.0) is None
    assert distance_of(0.5, lambda distance: 0.3, 1.0) is None
    assert distance_of(0.5, lambda distance: 0.7, 1.0) is None


def test_appended_sets_tell_shares_apart(tmp_path):
    values = {
        "models": [{"source": "zoo:post_box", "category": "post box", "scale": {"length": 0.18}}],
        "channels": ["instances"],
    }

    def with_fill(*fill):
        return small_recipe(**values, formats=[], viewpoints={"azimuth": 0, "distance": {"fill": list(fill)}})

    vs.generate(with_fill(0.3), tmp_path / "out")
    vs.generate(with_fill(0.3, 0.6), tmp_path / "out", append=True)
    assert [sample.pose.fill for sample in vs.open(tmp_path / "out")] == [0.3, 0.6]
