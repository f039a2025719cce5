"""The plan: counts, shots, splits, backgrounds, and what it refuses."""

import re
import tracemalloc
from pathlib import Path

import pytest

from shots import unit_box
from viewsphere.errors import RecipeError
from viewsphere.model.shot import Shot
from viewsphere.planning.plan import SHOT_FRAMES, plan
from viewsphere.recipe.recipe import Recipe

ROOT = Path(__file__).parents[2]


def recipe(**fields):
    defaults = {
        "models": [{"source": "zoo:car", "count": 3}],
        "viewpoints": {"azimuth": {"start": 0, "stop": 360, "step": 10}, "distance": 5},
        "formats": [],
    }
    return Recipe(**{**defaults, **fields})


def error(**fields) -> str:
    with pytest.raises(RecipeError) as caught:
        plan(recipe(**fields))
    return str(caught.value)


TABLE_2 = {
    "car_poses": (100, 2736, 273_600),
    "bike_poses": (6, 108, 648),
    "chair_poses": (6, 324, 1_944),
    "boat_poses": (10, 651, 6_510),
    "hairdryer_poses": (6, 60, 360),
}


@pytest.mark.parametrize("name", TABLE_2)
def test_the_recipes_of_the_paper_have_its_counts(name):
    planned = plan(Recipe.load(ROOT / "recipes" / f"{name}.yaml"))
    assert (planned.models, planned.poses, planned.frames) == TABLE_2[name]
    assert planned.split_counts["train"] == round(0.7 * planned.models) * planned.poses
    assert sum(planned.split_counts.values()) == planned.frames
    assert planned.splits == ("train", "val")
    assert planned.warnings == ()


def test_shots_are_even_chunks_in_index_order():
    planned = plan(recipe())
    assert (planned.models, planned.poses, planned.frames) == (3, 36, 108)
    shots = list(planned.shots(unit_box))
    assert planned.shot_count == len(shots) == 9
    sizes = [len(s.instants) for s in shots]
    assert max(sizes) <= SHOT_FRAMES
    assert max(sizes) - min(sizes) <= 1
    assert [f.index for s in shots for f in s.instants] == list(range(108))
    assert [f.viewpoint.index for s in shots for f in s.instants] == 3 * list(range(36))
    assert [s.key for s in shots[:4]] == ["car_000-000000", "car_000-000012", "car_000-000024", "car_001-000000"]
    assert shots[3] == planned.shot(3, unit_box)
    assert [(row.key, row.first, row.count) for row in planned.rows] == [
        (s.key, s.instants[0].index, len(s.instants)) for s in shots
    ]
    assert [s.key.rpartition("-")[0] for s in shots] == [s.things[0].model.key for s in shots]
    assert planned.max_objects == max(len(s.things) for s in shots) == 1
    with pytest.raises(IndexError):
        planned.shot(9, unit_box)


def test_the_recipe_s_shot_frames_come_before_the_caller_s():
    assert plan(recipe(), shot_frames=36).shot_count == 3
    assert plan(recipe(shot_frames=1), shot_frames=36).shot_count == 108


def test_a_shot_is_plain_json_and_comes_back_the_same():
    shot = plan(recipe(engine={"name": "raster", "samples": 2}, viewpoints={"distance": 5, "bins": 90})).shot(1, unit_box)
    assert Shot.model_validate_json(shot.model_dump_json()) == shot
    assert shot.engine_options == {"samples": 2}
    assert shot.category_deg == 90
    assert shot.rig.sensors[0].intrinsics.width == 640
    assert shot.scene.ground is not None
    assert shot.scene.finish.background.color is None
    assert shot.things[0].id == 1


def test_shots_of_one_model_share_a_stage():
    shots = list(plan(recipe()).shots(unit_box))
    assert len({s.stage_key for s in shots[:3]}) == 1
    assert len({s.stage_key for s in shots}) == 3


def test_a_billion_frames_by_a_typing_mistake_are_refused_at_once():
    tracemalloc.start()
    message = error(
        models=[{"source": "zoo:car", "count": 10_000}],
        viewpoints={"azimuth": {"start": 0, "stop": 360, "step": 0.0036}, "distance": 5},
    )
    assert tracemalloc.get_traced_memory()[1] < 5_000_000
    tracemalloc.stop()
    assert message == (
        "viewpoints: expected at most 1,000,000 frames; found 1,000,000,000 (10,000 models x 1 tilts x 1 distances x "
        "1 elevations x 100,000 azimuths): set max_frames: 1000000000 in the recipe if that is meant"
    )


def test_a_million_frames_can_be_meant():
    planned = plan(recipe(models=[{"source": "zoo:car"}], viewpoints={"kind": "sphere", "count": 1_000_000, "distance": 5}))
    assert planned.frames == 1_000_000
    assert planned.shot(planned.shot_count - 1, unit_box).instants[-1].index == 999_999
    assert planned.split_counts in ({"train": 1_000_000, "val": 0}, {"train": 0, "val": 1_000_000})
    assert plan(recipe(max_frames=10**9, viewpoints={"kind": "sphere", "count": 10**7, "distance": 5})).frames == 3 * 10**7


@pytest.mark.parametrize(
    ("by", "units"), [("model", 1000), ("pose", 36), pytest.param("frame", 36_000, marks=pytest.mark.slow)]
)
def test_splits_have_their_shares_and_keep_together_what_they_should(by, units):
    planned = plan(
        recipe(models=[{"source": "zoo:car", "count": 1000}], splits={"by": by, "train": 0.7, "val": 0.2, "test": 0.1})
    )
    assert planned.splits == ("train", "val", "test")
    for name, share in (("train", 0.7), ("val", 0.2), ("test", 0.1)):
        spread = (share * (1 - share) / units) ** 0.5
        assert abs(planned.split_counts[name] / 36_000 - share) < 4 * spread
    found = {}
    for shot in (planned.shot(i, unit_box) for i in range(0, 300)):
        for frame in shot.instants:
            unit = {"model": shot.things[0].model.key, "pose": frame.viewpoint.index, "frame": frame.index}[by]
            assert found.setdefault(unit, frame.split) == frame.split
    assert len(set(found.values())) == 3


def test_adding_models_and_poses_moves_nothing_to_another_split():
    def splits(by, models, azimuths, kept):
        planned = plan(
            recipe(models=models, viewpoints={"azimuth": azimuths, "distance": 5}, splits={"by": by, "a": 0.5, "b": 0.5})
        ).keeping(kept)
        kept |= planned.dealt_splits
        return {(s.things[0].model.key, f.viewpoint.azimuth_deg): f.split for s in planned.shots(unit_box) for f in s.instants}

    cars = {"source": "zoo:car", "count": 20}
    for by in ("model", "pose", "frame"):
        kept = {}
        few = splits(by, [cars], [10, 20, 30], kept)
        many = splits(by, [{"source": "zoo:boat", "count": 7}, {**cars, "count": 30}], [0, 10, 15, 20, 30], kept)
        assert len(set(few.values())) == 2
        assert all(many[frame] == split for frame, split in few.items())


def test_listed_models_go_where_they_are_listed():
    planned = plan(recipe(splits={"train": 1, "val": ["car_001"]}))
    assert planned.split_counts == {"train": 72, "val": 36}
    assert [planned.shot(i, unit_box).instants[0].split for i in (0, 3, 6)] == ["train", "val", "train"]
    assert error(splits={"train": 1, "val": ["car_01"]}).startswith("splits.val: expected keys of models; found 'car_01'; did")
    assert error(splits={"a": ["car_001"], "b": ["car_001"]}) == (
        "splits.b: expected every model in one split; found 'car_001', listed in 'a' too"
    )
    assert error(splits={"a": ["car_001"]}) == (
        "splits: expected every model to be listed; found no split for 'car_000'. Add it to the list of a split, or a "
        "split with a share"
    )


def test_an_empty_split_is_warned_of():
    planned = plan(recipe(splits={"train": 1, "val": 0}))
    assert planned.split_counts == {"train": 108, "val": 0}
    assert len(planned.warnings) == 1
    assert planned.warnings[0].startswith("split 'val' is empty: too few models for its share")


def test_unknown_engines_and_formats_are_told_with_the_nearest_name():
    assert re.fullmatch(r"engine: 'rastr' is unknown; did you mean 'raster'\? Valid: .*", error(engine="rastr"))
    said = error(channels=["rgb", "dept"])
    assert re.fullmatch(r"channels\[1\]: 'dept' is unknown; did you mean 'depth'\? Valid: rgb, rgba, .*, depth, .*", said)
    for field in ("annotations", "channels"):
        said = error(**{field: ["rgb", "bbox"] if field == "channels" else ["bbox"]})
        assert "'bbox' is unknown; `box2d` is in every data set: leave it out. Valid: " in said
    assert error(formats=["nonesuch"]).startswith("formats[0]: 'nonesuch' is unknown. Valid: ")


@pytest.fixture
def photos(tmp_path):
    for i in range(20):
        (tmp_path / "photos" / f"{i % 2}").mkdir(parents=True, exist_ok=True)
        (tmp_path / "photos" / f"{i % 2}" / f"{i:02d}.jpg").write_bytes(b"")
    (tmp_path / "photos" / "notes.txt").write_text("")
    return tmp_path


def backgrounds(folder, models, azimuths=(0, 10, 20), **background):
    data = {
        "models": models,
        "viewpoints": {"azimuth": list(azimuths), "distance": 5},
        "formats": [],
        "scene": {"background": background},
    }
    planned = plan(Recipe.model_validate(data, context={"folder": folder}))
    return planned, {
        (s.things[0].model.key, f.viewpoint.azimuth_deg): f.finish and f.finish.background
        for s in planned.shots(unit_box)
        for f in s.instants
    }


def test_backgrounds_drawn_per_frame_follow_from_names(photos):
    cars = {"source": "zoo:car", "count": 20}
    planned, few = backgrounds(photos, [cars], images="photos")
    _, many = backgrounds(photos, [{"source": "zoo:boat"}, {**cars, "count": 25}], (0, 5, 10, 20), images="photos")
    assert len(planned.images) == 20
    assert all(b is not None and b.image in planned.images for b in few.values())
    assert len({b.image for b in few.values()}) > 15  # 60 draws of 20
    assert all(many[frame] == background for frame, background in few.items())
    assert planned.shot(0, unit_box).scene.ground is None


def test_a_fixed_background_is_one_for_all_frames(photos):
    planned, frames = backgrounds(photos, [{"source": "zoo:car", "count": 9}], images="photos", draw="fixed")
    assert set(frames.values()) == {None}
    assert len({s.scene.finish.background.image for s in planned.shots(unit_box)}) == 1
    planned, _ = backgrounds(photos, [{"source": "zoo:car"}], image="photos/0/04.jpg")
    assert planned.shot(0, unit_box).scene.finish.background.image == str(photos / "photos/0/04.jpg")


def test_missing_backgrounds_are_named(photos):
    with pytest.raises(
        RecipeError, match=r"images: expected a folder with images \(.*\); found .*nothing, which does not exist"
    ):
        backgrounds(photos, [{"source": "zoo:car"}], images="nothing")
    with pytest.raises(RecipeError, match=r"scene.background.image: expected an image file; found none at .*x.png"):
        backgrounds(photos, [{"source": "zoo:car"}], image="x.png")


def test_the_digest_follows_what_the_store_holds_not_where_it_lies(tmp_path):
    def digest(folder, files=("a.obj",), frames=None, **fields):
        folder.mkdir(exist_ok=True)
        for name in files:
            (folder / name).write_text("x")
        data = {"models": [{"source": "*.obj", "category": "car"}], "viewpoints": {"distance": 5}, "formats": [], **fields}
        return plan(Recipe.model_validate(data, context={"folder": folder}), frames).digest

    first = digest(tmp_path / "one")
    assert digest(tmp_path / "two") == first
    assert digest(tmp_path / "two", name="b") == first
    assert digest(tmp_path / "two", frames=3) != first
    assert digest(tmp_path / "two", seed=1) != first
    assert digest(tmp_path / "two", files=("b.obj",)) != first


def test_a_mistake_found_by_planning_is_reported_at_its_line(tmp_path):
    file = tmp_path / "recipe.yaml"
    file.write_text("viewpoints: {distance: 8}\nmodels:\n  - source: zoo:car\n  - source: none.obj\n    category: x\n")
    with pytest.raises(RecipeError) as error:
        plan(Recipe.load(file))
    assert str(error.value).startswith(f"{file}:4: models[1].source: expected a file")


@pytest.mark.parametrize(
    ("viewpoints", "ground", "warned"),
    [
        ({"elevation": {"start": -10, "stop": 20, "step": 10}, "distance": 8}, "auto", True),
        ({"kind": "sphere", "count": 3, "distance": 8}, "auto", True),
        ({"elevation": -10, "distance": 8}, "off", False),
        ({"elevation": [0, 20], "distance": 8}, "on", False),
    ],
)
def test_cameras_below_the_ground_are_warned_of(viewpoints, ground, warned):
    recipe = Recipe(models=[{"source": "zoo:car", "count": 9}], viewpoints=viewpoints, scene={"ground": ground})
    assert any("ground hides" in warning for warning in plan(recipe).warnings) is warned
