"""Sequences: the same however they are cut and whatever else is there, one scene each, on a floor that stays."""

import pytest
from test_scenes_sampler import box_of

import viewsphere as vs
from small import small_recipe, tree_hash
from viewsphere.check import check
from viewsphere.errors import RecipeError
from viewsphere.model.scene import Floor
from viewsphere.run.datasets.merging import merge


def recipe(**changes):
    defaults = {
        "models": [{"source": "zoo:post_box", "count": 6, "scale": {"length": 0.18}}],
        "viewpoints": {"azimuth": [0, 120], "elevation": 20, "distance": 4},
        "time": {"frames": 10, "fps": 5},
        "splits": {"by": "sequence"},
        "formats": [],
    }
    return small_recipe(**{**defaults, **changes})


MODELS = [{"source": "zoo:post_box", "count": 2, "scale": {"length": 0.18}}]


def instants(planned, *but):
    """Every instant of every sequence, whole, with what stands there."""
    found = {}
    for shot in planned.shots(box_of):
        for instant in shot.instants:
            if instant.recorded:
                found[shot.sequence, instant.index] = (shot.things, shot.scene, instant.model_dump(exclude={*but}))
    return found


RANDOM = {
    "background": {"color": {"uniform": [[0, 0, 0], [1, 1, 1]]}},
    "jitter": {"azimuth": [-5, 5]},
    "company": {"count": 1, "draw": "per_sequence"},
    "sun": {"azimuth": [0, 360]},
    "effects": {"read_noise": 0.1},
}


@pytest.mark.parametrize("scenes", [None, 2])
def test_a_sequence_is_the_same_however_it_is_cut(scenes):
    scene = {name: part for name, part in RANDOM.items() if name != "company" or scenes is None}
    cut = [instants(vs.plan(recipe(shot_frames=most, scenes=scenes, scene=scene))) for most in (1, 3, 7, 10, 100)]
    assert len(cut[0]) == (scenes or 6) * 2 * 10
    assert all(one == cut[0] for one in cut[1:])


def test_models_and_viewpoints_change_no_other_sequence():
    few = instants(vs.plan(recipe(scene=RANDOM)), "split")
    more = recipe(scene=RANDOM, viewpoints={"azimuth": [0, 60, 120], "elevation": 20, "distance": 4})
    numbers = {"000000": "000000", "000001": "000002"}
    index = {f"post_box_{k:03d}-{old}": f"post_box_{k:03d}-{new}" for k in range(6) for old, new in numbers.items()}
    many = instants(vs.plan(more), "split")
    for (name, number), (things, scene, instant) in few.items():
        other = many[index[name], number]
        for mine in (instant, other[2]):
            mine["viewpoint"].pop("index")
        assert (things, scene, instant) == other


@pytest.mark.slow
def test_all_that_is_drawn_is_drawn_once_a_sequence():
    planned = vs.plan(recipe(scene=RANDOM, splits={"by": "sequence"}))
    for name in {shot.sequence for shot in planned.shots(box_of)}:
        own = [shot for shot in planned.shots(box_of) if shot.sequence == name]
        looks = {(i.finish.background, i.viewpoint.azimuth_deg, i.split) for shot in own for i in shot.instants}
        assert len(looks) == len({shot.stage_key for shot in own}) == 1
        assert len({i.finish.effects.seed for shot in own for i in shot.instants}) == 10
    backgrounds = {shot.instants[0].finish.background for shot in planned.shots(box_of)}
    assert len(backgrounds) == len({shot.instants[0].viewpoint.azimuth_deg for shot in planned.shots(box_of)}) == 12


def test_what_is_asked_for_flickers(tmp_path):
    scene = {"background": {"color": {"uniform": [[0, 0, 0], [1, 1, 1]]}, "draw": "per_frame"}}
    made = recipe(shot_frames=10, scene=scene | {"jitter": {"azimuth": [-5, 5], "draw": "per_frame"}})
    (tmp_path / "recipe.yaml").write_text(made.to_yaml())
    for one in (made, vs.Recipe.model_validate(made.model_dump(mode="json")), vs.Recipe.load(tmp_path / "recipe.yaml")):
        shot = vs.plan(one).shot(0, box_of)
        assert len({i.finish.background for i in shot.instants}) == len({i.viewpoint.azimuth_deg for i in shot.instants}) == 10


def test_seconds_count_instants_and_the_first_is_at_none():
    planned = vs.plan(recipe(shot_frames=10, time={"seconds": 1.4, "fps": 5}))
    shot = planned.shot(0, box_of)
    assert [i.seconds for i in shot.instants] == [0, 0.2, 0.4, 0.6, 0.8, 1.0, 1.2]
    assert planned.frames == 6 * 2 * 7


def test_the_floor_is_at_no_height_and_things_stand_on_it():
    shot = vs.plan(recipe()).shot(0, box_of)
    assert shot.scene.floor == Floor(height=0.0, is_fixed=True)
    assert shot.things[0].world_from_object[2][3] + box_of(shot.things[0].model)[:, 2].min() == 0


def test_a_split_by_sequence_keeps_sequences_whole():
    planned = vs.plan(recipe(splits={"by": "sequence", "train": 0.5, "val": 0.5}))
    splits = {(shot.sequence, i.split) for shot in planned.shots(box_of) for i in shot.instants}
    assert len(splits) == 12 and planned.split_counts == {"train": 60, "val": 60}


def test_views_drawn_for_each_scene_make_a_sequence_each():
    planned = vs.plan(recipe(scenes={"count": 4, "views": 1}))
    assert planned.frames == 40 and len({shot.sequence for shot in planned.shots(box_of)}) == 4


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"time": {"frames": 3, "seconds": 2}}, "time: expected one of frames, seconds; found both"),
        ({"time": {}}, "time: expected one of frames, seconds; found none"),
        ({"time": {"frames": 3, "fps": 0}}, "time.fps: "),
        ({"time": {"frames": 0}}, "time.frames: "),
        ({"time": {"seconds": 1e8, "fps": 100}}, "time: expected at most 1,000,000 instants"),
        ({"scene": {"company": {"count": 1, "draw": "per_frame"}}}, "company.draw: expected fixed, per_model or per_sequence"),
        ({"scene": {"draw": "per_frame"}}, "draw: expected fixed, per_model or per_sequence beside time"),
        ({"time": None, "splits": {}, "scene": {"draw": "per_sequence"}}, "draw: expected time beside per_sequence"),
        ({"time": None, "scene": {"jitter": {"draw": "per_sequence"}}}, "jitter.draw: expected time beside per_sequence"),
        ({"time": None}, "splits.by: expected .*found sequence: set time"),
        ({"time": None, "scenes": 2}, "splits.by: expected .*found sequence: set time"),
        ({"splits": {"by": "scene"}}, "splits.by: .*found scene: set scenes"),
    ],
)
def test_mistakes_are_said_in_one_line(changes, message):
    with pytest.raises(RecipeError, match=message):
        vs.plan(recipe(**changes))


@pytest.mark.slow
def test_a_data_set_of_sequences_is_proved_and_does_not_depend_on_how_it_was_cut(tmp_path):
    made = {}
    for most in (2, 5):
        vs.generate(recipe(models=MODELS, shot_frames=most, scene=RANDOM, formats=["native"]), tmp_path / str(most), workers=0)
        made[most] = tree_hash(tmp_path / str(most) / "native")
        dataset = vs.open(tmp_path / str(most))
        assert check(dataset).ok
        assert [(s.sequence, s.instant, s.time) for s in dataset][9:11] == [
            ("post_box_000-000000", 9, 1.8),
            ("post_box_001-000000", 0, 0.0),
        ]
    assert made[2] == made[5]


@pytest.mark.slow
def test_merged_sequences_of_one_name_stay_apart(tmp_path):
    for name, elevation in (("a", 20), ("b", 40)):
        seen_from = {"azimuth": 0, "elevation": elevation, "distance": 4}
        vs.generate(recipe(models=MODELS, viewpoints=seen_from, time={"frames": 3}), tmp_path / name, workers=0)
    merged = merge([tmp_path / "a", tmp_path / "b"], tmp_path / "both")
    names = ("post_box_000", "post_box_001")
    assert merged.sequences == (*names, *(f"{name}-merged-2" for name in names))
    for name, elevation in [*((name, 20) for name in names), *((f"{name}-merged-2", 40) for name in names)]:
        samples = merged.sequence(name)
        assert [(s.instant, s.pose.elevation_deg) for s in samples] == [(i, elevation) for i in range(3)]
    assert check(merged).ok
