"""What else a recipe may draw: lenses, sizes, numbers, orientations, and how often each category is shown."""

from collections import Counter
from itertools import combinations

import numpy as np
import pytest
from scipy.spatial import cKDTree

import viewsphere as vs
from small import small_recipe
from viewsphere.check import check
from viewsphere.errors import RecipeError
from viewsphere.geometry.rotation import random_rotation
from viewsphere.planning.plan import plan
from viewsphere.recipe.recipe import Recipe
from viewsphere.run.shots.stages import Stages

POST_BOX = {"source": "zoo:post_box", "category": "post box", "count": 2, "scale": {"length": 0.18}}


def recipe_of(**changes):
    values = {
        "models": [POST_BOX],
        "viewpoints": {"azimuth": [0, 60, 120, 180], "elevation": 20, "distance": 3},
        "camera": {"size": [64, 48], "fov_deg": 35},
        "splits": {"train": 1.0},
        "channels": ["instances"],
        "formats": [],
    }
    return Recipe(**{**values, **changes})


def lenses(samples):
    return [s.camera.intrinsics for s in samples]


def fov(lens):
    return np.degrees(2 * np.arctan(lens.width / 2 / lens.fx))


def test_every_picture_has_a_lens_of_its_own_which_its_names_decide():
    recipe = recipe_of(camera={"size": [64, 48], "fov_deg": [25, 60]})
    found = lenses(vs.render(recipe))
    assert len(set(found)) == len(found) == 8
    assert all(25 <= fov(lens) <= 60 for lens in found)
    assert lenses(vs.render(recipe.model_copy(update={"shot_frames": 1}))) == found
    fewer = recipe.model_copy(update={"models": recipe_of(models=[{**POST_BOX, "count": 1}]).models})
    assert lenses(vs.render(fewer)) == found[:4]


def test_lenses_are_uniform_over_what_may_be_drawn():
    recipe = recipe_of(
        camera={"fov_deg": {"choice": [30, 50], "weights": [3, 1]}}, viewpoints={"kind": "sphere", "count": 400, "distance": 3}
    )
    planned, box = plan(recipe), Stages().box
    found = Counter(round(fov(now.intrinsics)) for now in planned.take(planned.subjects[0], range(400), box).instants)
    assert found.keys() == {30, 50}
    assert abs(found[30] - 300) < 4 * (400 * 0.75 * 0.25) ** 0.5


@pytest.mark.parametrize(
    ("camera", "fx", "fy"),
    [
        ({"focal_px": {"uniform": [60, 90]}}, (60, 90), None),
        ({"focal_mm": [30, 50], "sensor_mm": 32}, (60, 100), None),
        ({"focal_px": [70, 71], "principal_point": [[30, 34], {"normal": [24, 1]}]}, (70, 70), 71),
    ],
)
def test_focal_lengths_and_principal_points_may_be_drawn(camera, fx, fy):
    found = lenses(vs.render(recipe_of(camera={"size": [64, 48], **camera})))
    assert all(fx[0] <= lens.fx <= fx[1] and lens.fy == (fy or lens.fx) for lens in found)
    assert len({lens.fx for lens in found}) == (8 if fy is None else 1)
    centres = {(lens.cx, lens.cy) for lens in found}
    assert centres == {(32, 24)} if fy is None else len(centres) == 8
    assert all(30 <= cx <= 34 for cx, _ in centres)


@pytest.mark.slow
def test_a_drawn_camera_is_recorded_with_each_sample_and_proved(tmp_path):
    recipe = small_recipe(camera={"size": [96, 72], "fov_deg": [30, 45], "principal_point": [[45, 50], 36]})
    vs.generate(recipe, tmp_path / "out")
    dataset = vs.open(tmp_path / "out")
    assert lenses(dataset) == lenses(vs.render(recipe))
    assert len(set(lenses(dataset))) == len(dataset)
    assert not check(dataset, sample=None).findings


def test_a_sequence_and_all_of_its_sensors_have_one_lens():
    camera = {"size": [64, 48], "fov_deg": [25, 60]}
    views = {"azimuth": [0, 90], "distance": 3}
    samples = list(
        vs.render(recipe_of(camera=camera, time={"frames": 3}, viewpoints=views, rig={"kind": "stereo", "baseline": 0.1}))
    )
    by_sequence = {name: {s.camera.intrinsics for s in samples if s.sequence == name} for name in {s.sequence for s in samples}}
    assert [len(found) for found in by_sequence.values()] == [1] * 4
    assert len(set.union(*by_sequence.values())) == 4
    moving = recipe_of(camera=camera, time={"frames": 3}, viewpoints={"kind": "orbit", "distance": 3})
    assert [len(set(lenses(list(vs.render(moving))[i : i + 3]))) for i in (0, 3)] == [1, 1]


def test_a_share_is_filled_through_the_lens_that_is_drawn():
    recipe = recipe_of(
        camera={"size": [64, 48], "fov_deg": [20, 70]}, viewpoints={"azimuth": [0, 90], "distance": {"fill": 0.5}}
    )
    for sample in vs.render(recipe):
        x0, y0, x1, y1 = sample.objects[0].box2d_unclipped
        assert max((x1 - x0) / 64, (y1 - y0) / 48) == pytest.approx(0.5, rel=1e-8)


def test_models_have_lengths_of_their_own():
    models = [{**POST_BOX, "count": 3, "scale": {"length": [0.1, 0.3]}}]
    found = [spec.scale for spec in plan(recipe_of(models=models)).model_specs]
    assert len(set(found)) == 3
    assert all(0.1 <= length <= 0.3 for length in found)
    assert [spec.scale for spec in plan(recipe_of(models=[{**models[0], "count": 2}])).model_specs] == found[:2]
    sample = next(vs.render(recipe_of(models=models)))
    assert sample.objects[0].size[2] == pytest.approx(found[0])


def test_the_number_of_zoo_models_may_be_drawn():
    found = [plan(recipe_of(models=[{**POST_BOX, "count": [2, 4]}], seed=seed)).models for seed in range(12)]
    assert set(found) == {2, 3, 4}


def test_the_number_of_distractors_is_drawn_when_they_are():
    models = [{**POST_BOX, "count": 5}]
    views = {"azimuth": list(range(0, 360, 10)), "distance": 9}
    recipe = recipe_of(models=models, scene={"company": {"count": [1, 3], "draw": "per_frame"}}, viewpoints=views)
    planned = plan(recipe)
    casts = [planned.cast(planned.subjects[0], pose) for pose in range(36)]
    assert {len(cast) for cast in casts} == {2, 3, 4}
    assert planned.max_objects == 4
    fixed = plan(recipe_of(models=models, scene={"company": {"count": 3, "draw": "per_frame"}}, viewpoints=views))
    for pose, cast in enumerate(casts):  # fewer are the first of more
        assert cast == fixed.cast(fixed.subjects[0], pose)[: len(cast)]
    each = plan(recipe_of(models=models, scene={"company": [1, 3]}))
    assert {len(each.cast(subject, 0)) for subject in each.subjects} <= {2, 3, 4}
    assert all(len({len(each.cast(subject, pose)) for pose in range(4)}) == 1 for subject in each.subjects)
    shown = [len(sample.objects) for sample in vs.render(recipe_of(models=models, scene={"company": [1, 3]}))]
    assert shown == [len(each.cast(subject, pose)) for subject in each.subjects for pose in range(4)]


def test_the_number_of_planes_may_be_drawn(tmp_path):
    from PIL import Image

    Image.new("RGB", (8, 8)).save(tmp_path / "wall.png")
    plane = {
        "image": str(tmp_path / "wall.png"),
        "height": 1,
        "around": {"distance": [4, 6]},
        "count": [1, 4],
        "draw": "per_frame",
    }
    planned, box = (
        plan(recipe_of(scene={"planes": plane}, viewpoints={"azimuth": list(range(0, 360, 15)), "distance": 2})),
        Stages().box,
    )
    found = {sum(t.scenery for t in planned.take(planned.subjects[0], [pose], box).things) for pose in range(24)}
    assert found == {1, 2, 3, 4}


def test_rotations_are_uniform():
    turns = np.array([random_rotation(np.random.default_rng(seed)) for seed in range(3000)])
    assert np.allclose(turns @ turns.transpose(0, 2, 1), np.eye(3), atol=1e-12)
    assert np.allclose(np.linalg.det(turns), 1)
    assert abs(turns.mean(axis=0)).max() < 4 / (3 * 3000) ** 0.5
    assert abs((turns**2).mean(axis=0) - 1 / 3).max() < 4 * (4 / 45 / 3000) ** 0.5
    angles = np.sort(np.arccos(np.clip((np.trace(turns, axis1=1, axis2=2) - 1) / 2, -1, 1)))
    expected = (angles - np.sin(angles)) / np.pi  # of Haar's measure
    assert abs(expected - np.linspace(0, 1, 3000)).max() < 1.63 / 3000**0.5


@pytest.mark.slow
@pytest.mark.parametrize("where", ["scenes", "company"])
def test_things_that_lie_any_way_lie_on_the_floor_clear_of_others(where):
    turned = {"orientation": "any", "gap": 0.2}
    around = (
        {"scenes": {"count": 3, "objects": 3, **turned}}
        if where == "scenes"
        else {"scene": {"company": {"count": 2, **turned}}}
    )
    recipe = recipe_of(models=[{"source": "zoo:chair", "count": 3}], viewpoints={"azimuth": 0, "distance": 9}, **around)
    planned, stages = plan(recipe), Stages()
    ups = []
    for shot in planned.shots(stages.box):
        things = shot.things if where == "scenes" else shot.things[1:]
        floors = []
        for thing in things:
            pose = np.array(thing.world_from_object)
            vertices = stages.model(thing.model).vertices @ pose[:3, :3].T + pose[:3, 3]
            assert vertices[:, 2].min() == pytest.approx(0, abs=1e-6)
            floors.append(cKDTree(vertices[:, :2]))
            ups.append(pose[2, 2])
        for one, other in combinations(floors, 2):
            assert one.query(other.data)[0].min() > 0.2 - 1e-6
        assert {o.model.key for o in things} <= {spec.key for spec in planned.model_specs}
    assert min(ups) < 0.9
    assert np.std(ups) > 0.2
    assert next(vs.render(recipe)).objects[0].area > 0


def test_categories_are_shown_equally_often_to_one():
    models = [
        {**POST_BOX, "count": 9},
        {"source": "zoo:chair", "count": 2},
        {"source": "zoo:bicycle", "count": 3},
        {"source": "zoo:boat", "count": 1},
    ]

    def casts(count, **scenes):
        planned = plan(
            recipe_of(models=models, scenes={"count": count, "objects": [1, 4], **scenes}, viewpoints={"distance": 9})
        )
        return [planned.cast(subject, 0) for subject in planned.subjects]

    before, after = casts(200), casts(200, balance="category")
    shown = [Counter(spec.category for cast in found for spec in cast) for found in (before, after)]
    assert max(shown[0].values()) > 3 * min(shown[0].values())
    assert max(shown[1].values()) - min(shown[1].values()) <= 1
    assert [len(cast) for cast in before] == [len(cast) for cast in after]
    assert all(len({spec.key for spec in cast}) == len(cast) for cast in after)  # none twice
    assert casts(50, balance="category") == after[:50]
    pairs = Counter(frozenset(spec.category for spec in cast) for cast in after if len(cast) == 2)
    assert len(pairs) == 6  # all pairs of categories meet
    keys = Counter(spec.key for cast in after for spec in cast if spec.category == "chair")
    assert max(keys.values()) < 2 * min(keys.values())


def test_categories_are_balanced_in_each_split_and_where_models_are_few():
    models = [{**POST_BOX, "count": 8}, {"source": "zoo:chair", "count": 4}]
    splits = {"by": "model", "train": 0.5, "val": 0.5}
    recipe = recipe_of(
        models=models, splits=splits, scenes={"count": 60, "objects": 2, "balance": "category"}, viewpoints={"distance": 9}
    )
    planned = plan(recipe)
    for split in ("train", "val"):
        own = [planned.cast(name, 0) for name in planned.subjects if planned.split(name, 0) == split]
        shown = Counter(spec.category for cast in own for spec in cast)
        assert len(shown) == 1 or abs(shown["post box"] - shown["chair"]) <= 1
    crowded = plan(
        recipe_of(models=models, scenes={"count": 3, "objects": 12, "balance": "category"}, viewpoints={"distance": 30})
    )
    assert all(len({spec.key for spec in crowded.cast(name, 0)}) == 12 for name in crowded.subjects)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"camera": {"fov_deg": [30, 200]}}, "camera.fov_deg"),
        (
            {"camera": {"K": [[90, 0, 32], [0, 90, 24], [0, 0, 1]], "principal_point": [3, 4]}},
            "expected no principal_point beside K",
        ),
        (
            {"camera": {"fov_deg": [30, 40]}, "rig": {"sensors": {"a": {}, "b": {"size": [32, 24], "position": [1, 0, 0]}}}},
            "rig.sensors.b: expected fov_deg, focal_px or K beside size or distortion, as the camera's lens is drawn",
        ),
        (
            {"models": [{"source": "a.obj", "category": "a", "count": [1, 2]}]},
            "count is a distribution, but for files it must be one number",
        ),
        ({"scene": {"company": {"count": [1, 3]}}}, "scene.company.count: expected at most 1, as there are 2 models"),
        ({"scenes": {"count": 2, "balance": "categories"}}, "did you mean 'category'"),
    ],
)
def test_mistakes_name_their_field(changes, message):
    with pytest.raises(RecipeError) as caught:
        plan(recipe_of(**changes))
    assert message in str(caught.value)
