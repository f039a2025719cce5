"""Frames that show enough of their models, annotations of what is hardly seen, and empty pictures."""

import json
import re

import numpy as np
import pytest

import viewsphere as vs
from built_once import built_once
from quick import quick
from small import tree_hash
from viewsphere.check import check
from viewsphere.composing.scene.draws import Scenes
from viewsphere.errors import RecipeError
from viewsphere.limits import limits
from viewsphere.planning.plan import plan
from viewsphere.planning.samplers.shared import sampling_context as _stock
from viewsphere.recipe.recipe import Recipe
from viewsphere.run.datasets.merging import merge
from viewsphere.run.shots.framing import Framing
from viewsphere.run.shots.stages import Stages
from viewsphere.store import Exported
from viewsphere.store.shots.checksums import write_checksums, written_least, written_options

MOST_TRIES = limits.MAX_REDRAWS

CROWD = {"company": {"count": 2, "draw": "per_frame", "gap": 0.05}, "ground": "off"}
LOW = {"kind": "sphere", "count": 6, "elevation": [0, 8], "distance": [2.5, 3]}


def recipe_of(**changes):
    values = {
        "models": [{"source": "zoo:post_box", "category": "post box", "count": 3, "scale": {"length": 0.18}}],
        "viewpoints": LOW,
        "camera": {"size": [64, 48], "fov_deg": 35},
        "scene": {"company": {"count": 2, "gap": 0.05}, "ground": "off"},
        "splits": {"train": 1.0},
        "channels": ["instances"],
        "formats": [],
    }
    return Recipe(**{**values, **changes})


def own(samples):
    return [sample.objects[0].visibility for sample in samples]


def test_random_viewpoints_are_drawn_again_until_enough_of_the_frames_model_is_seen():
    least = 0.8
    before, after = (list(vs.render(recipe_of(min_visibility=value))) for value in (None, least))
    assert sum(seen < least for seen in own(before)) >= 3  # else nothing is tried
    assert min(own(after)) >= least
    for one, two in zip(before, after, strict=True):  # what showed enough stays as it was
        assert (one.pose == two.pose) == (one.objects[0].visibility >= least)
        assert [o.key for o in one.objects] == [o.key for o in two.objects]
        assert np.array_equal(one.objects[1].world_from_object, two.objects[1].world_from_object)


@pytest.mark.slow
def test_company_that_is_drawn_for_each_frame_is_placed_again():
    views = {"azimuth": [0, 90, 180], "elevation": 2, "distance": 2.5}
    before, after = (list(vs.render(recipe_of(scene=CROWD, viewpoints=views, min_visibility=v))) for v in (None, 0.7))
    assert min(own(before)) < 0.7 <= min(own(after))
    assert [s.pose.azimuth_deg for s in before] == [s.pose.azimuth_deg for s in after]
    moved = [
        not np.array_equal(a.objects[1].world_from_object, b.objects[1].world_from_object)
        for a, b in zip(before, after, strict=True)
    ]
    assert moved == [seen < 0.7 for seen in own(before)]


def test_all_models_of_a_random_scene_have_to_be_seen():
    recipe = recipe_of(
        scene={"ground": "off"},
        scenes={"count": 4, "objects": 3, "gap": 0.05},
        viewpoints={**LOW, "count": 2, "elevation": [0, 40]},
    )
    before, after = (list(vs.render(recipe.model_copy(update={"min_visibility": value}))) for value in (None, 0.5))
    least = [min(o.visibility for o in sample.objects) for sample in after]
    assert min(min(o.visibility for o in sample.objects) for sample in before) < 0.5 <= min(least)


@pytest.mark.slow
def test_what_cannot_be_met_is_the_best_found_and_counted(tmp_path):
    views = {"kind": "jitter", "azimuth": 0, "elevation": 0, "distance": 2.5, "plus_minus": {"azimuth": 3}}
    row = {"company": {"layout": [[0, -0.6, 0], [0.6, 0.6, 0]], "gap": 0}, "ground": "off"}
    recipe = recipe_of(viewpoints=views, scene=row, min_visibility=0.99)
    summary = vs.generate(recipe, tmp_path / "out")
    samples = list(vs.open(tmp_path / "out"))
    hidden = sum(seen < 0.99 for seen in own(samples))
    assert hidden > 0
    (note,) = summary.notes
    assert re.match(rf"warning: min_visibility: {hidden} of 3 frames show less than 0.99 .* best of {MOST_TRIES} draws", note)
    drawn = recipe.model_copy(update={"min_visibility": None})
    planned = plan(drawn)
    stages = Stages()
    for sample, subject in zip(samples, planned.subjects, strict=True):
        redraws = [next(stages.render(planned.take(subject, [0], stages.box, redraws=[k]))) for k in range(MOST_TRIES)]
        assert sample.objects[0].visibility == max(own(redraws))


@pytest.mark.parametrize("least", [0.1, 0.8, 0.99])
@pytest.mark.parametrize("frames", [1, 6])
def test_no_shot_is_made_twice(frames, least):
    views = {"kind": "jitter", "azimuth": 0, "elevation": 0, "distance": 2.5, "count": frames, "plus_minus": {"azimuth": 30}}
    row = {"company": {"layout": [[0, -0.6, 0], [0.6, 0.6, 0]], "gap": 0}, "ground": "off"}
    recipe = recipe_of(viewpoints=views, scene=row, min_visibility=least)
    planned, stages, taken = plan(recipe), Stages(), []

    class Source:
        def shot(self, row, box_of, redraws=(), redraw=0):
            taken.append((tuple(redraws) or (0,) * frames, planned.shot(row, box_of, redraws, redraw)))
            return taken[-1][1]

        def whole(self, row):
            return planned.whole(row)

    for row in planned.rows:
        taken.clear()
        made = Framing(planned, Source(), stages, stages.box).shot(row)
        assert len({redraws for redraws, _ in taken}) == len(taken) <= MOST_TRIES
        drawn = [own(stages.render(shot)) for _, shot in taken]
        assert own(stages.render(made)) == [
            next((seen for seen in found if seen >= least), max(found)) for found in zip(*drawn, strict=True)
        ]
        if len(taken) == MOST_TRIES and frames == 1:
            assert made == max(taken, key=lambda one: own(stages.render(one[1])))[1]


def test_tries_share_what_is_computed_of_a_plan(monkeypatch):
    made = []
    monkeypatch.setattr(_stock, "Scenes", lambda *args: made.append(args) or Scenes(*args))
    planned, stages = plan(recipe_of()), Stages()
    shots = [planned.shot(0, stages.box, [number] * 6) for number in range(4)]
    assert len({shot.instants[0].viewpoint for shot in shots}) == 4
    assert len(made) == 1
    assert planned.with_redraws({0: 1}).schedules is planned.schedules


@pytest.mark.parametrize("name", quick(["min_visibility", "empty"], "empty"))
def test_appended_frames_show_as_much_of_their_models(name, tmp_path):
    few = {"formats": [], "viewpoints": {**LOW, "count": 2}}
    vs.generate(recipe_of(**few, **{name: 0.3}), tmp_path / "out")
    before = tree_hash(tmp_path / "out")
    for there, found in ((None, "null"), (0.4, "0.4")):
        for views in (few["viewpoints"], LOW):
            changes = {"formats": [], "viewpoints": views, name: there}
            with pytest.raises(RecipeError, match=rf"^{name}: expected 0.3, as the data set has; found {found}: appended .*"):
                vs.generate(recipe_of(**changes), tmp_path / "out", append=True)
    assert tree_hash(tmp_path / "out") == before
    vs.generate(recipe_of(formats=[], **{name: 0.3}), tmp_path / "out", append=True)
    assert len(vs.open(tmp_path / "out")) == 18


DRAWN = {"min_visibility": 0.6, "viewpoints": {**LOW, "count": 5}, "empty": 0.2}


@pytest.mark.slow
def test_the_draws_do_not_depend_on_how_shots_are_cut(tmp_path):
    recipe = recipe_of(**DRAWN)
    vs.generate(recipe, tmp_path / "one")
    poses = [
        [(s.index, s.pose, len(s.objects)) for s in vs.render(recipe.model_copy(update={"shot_frames": size}))]
        for size in (1, 5)
    ]
    assert poses[0] == poses[1] == [(s.index, s.pose, len(s.objects)) for s in vs.open(tmp_path / "one")]
    assert not check(vs.open(tmp_path / "one"), sample=None).findings


@pytest.mark.slow
def test_the_draws_do_not_depend_on_workers(tmp_path):
    for workers in (0, 2):
        vs.generate(recipe_of(**DRAWN), tmp_path / f"{workers}", workers=workers)
    assert tree_hash(tmp_path / "0/store/shots") == tree_hash(tmp_path / "2/store/shots")


@pytest.mark.slow
def test_exports_leave_out_annotations_of_what_is_hardly_seen(tmp_path):
    recipe = recipe_of(channels=["rgb", "instances"], formats=["coco", "native", "csv"], keep_annotations_above=0.5)
    vs.generate(recipe, tmp_path / "out")
    dataset = vs.open(tmp_path / "out")
    seen = {(s.index + 1, o.id): o.visibility for s in dataset for o in s.objects}
    kept = {name for name, value in seen.items() if value > 0.5}
    assert kept
    assert len([v for v in seen.values() if 0 < v <= 0.5]) > 0
    coco = json.loads((tmp_path / "out/coco/annotations/instances_train.json").read_text())
    assert {(a["image_id"], a["id_object"]) for a in coco["annotations"]} == kept
    assert len(coco["images"]) == len(dataset)
    rows = (tmp_path / "out/csv/objects.csv").read_text().splitlines()[1:]
    assert sum(bool(row.split(",")[9]) for row in rows) == len(kept)
    assert not check(dataset).findings


LEFT_OUT = {"channels": ["rgb", "instances"], "formats": ["coco", "csv"], "viewpoints": {**LOW, "count": 3}}


def coco_annotations(folder):
    value = json.loads((folder / "coco/annotations/instances_train.json").read_text())
    return {(a["image_id"] - 1, a["id_object"]) for a in value["annotations"]}


def seen_more_than(least, dataset):
    return {(s.index, o.id) for s in dataset for o in s.objects if o.visibility > least}


@pytest.mark.slow
def test_another_threshold_renews_all_exports_and_renders_nothing(tmp_path):
    out, fresh = tmp_path / "out", tmp_path / "fresh"
    vs.generate(recipe_of(**LEFT_OUT, keep_annotations_above=0.5), out)
    shots = tree_hash(out / "store/shots")
    vs.generate(recipe_of(**LEFT_OUT, keep_annotations_above=0.9), fresh)
    assert seen_more_than(0.9, vs.open(out)) < seen_more_than(0.5, vs.open(out)) < seen_more_than(0, vs.open(out))
    for append in (False, True):
        summary = vs.generate(recipe_of(**LEFT_OUT, keep_annotations_above=0.9), out, append=append, formats=["csv"])
        assert summary.rendered == 0
        if not append:
            assert "annotations of what is seen more than 0.9" in summary.notes[0]
            assert set(summary.formats) == {"coco", "csv"}
        assert tree_hash(out) == tree_hash(fresh)
    assert "# keep_annotations_above 0.9\n" in (out / "coco/checksums.xxh128").read_text()
    assert not check(vs.open(out)).findings
    vs.generate(recipe_of(**LEFT_OUT), out)
    assert coco_annotations(out) == seen_more_than(0, vs.open(out))
    assert tree_hash(out / "store/shots") == shots
    assert not check(vs.open(out)).findings


@pytest.mark.slow
def test_appended_frames_and_older_ones_have_one_threshold(tmp_path):
    vs.generate(recipe_of(**LEFT_OUT, keep_annotations_above=0.5), tmp_path / "out")
    more = {**LEFT_OUT, "viewpoints": {**LOW, "count": 4}, "keep_annotations_above": 0.9}
    assert vs.generate(recipe_of(**more), tmp_path / "out", append=True).rendered == 3
    dataset = vs.open(tmp_path / "out")
    assert coco_annotations(tmp_path / "out") == seen_more_than(0.9, dataset)
    assert not check(dataset).findings
    assert {part.recipe["keep_annotations_above"] for part in dataset.plan.parts} == {0.9}
    vs.generate(recipe_of(**LEFT_OUT, keep_annotations_above=0.5), tmp_path / "out")  # the first recipe, again
    assert coco_annotations(tmp_path / "out") == seen_more_than(0.5, dataset)
    assert not check(vs.open(tmp_path / "out")).findings


@pytest.mark.slow
def test_an_export_is_proved_by_the_threshold_that_it_was_made_with(tmp_path):
    out = tmp_path / "out"
    vs.generate(recipe_of(**LEFT_OUT, keep_annotations_above=0.5), out)
    store = vs.open(out).store
    store.save(store.plan().keeping_above(0.9))  # as a run leaves it that ends before its exports
    assert not check(vs.open(out)).findings
    vs.generate(recipe_of(**LEFT_OUT, keep_annotations_above=0.9), out, formats=[])  # goes on where that run ended
    assert coco_annotations(out) == seen_more_than(0.9, vs.open(out))
    assert written_least(out / "csv") == 0.9
    write_checksums(out / "coco", written_options(out / "coco"), 0.5)
    assert {finding.check for finding in check(vs.open(out)).findings} == {"coco"}


@pytest.mark.slow
def test_the_data_set_is_read_once_for_all_formats_that_leave_annotations_out(tmp_path, monkeypatch):
    vs.generate(recipe_of(**LEFT_OUT, keep_annotations_above=0.5), tmp_path / "out", formats=[])
    made, begin = [], Exported.__init__
    monkeypatch.setattr(Exported, "__init__", lambda self, *given: (made.append(given), begin(self, *given))[1])
    vs.export(tmp_path / "out", "coco,csv,native")
    assert len(made) == 1
    assert not check(vs.open(tmp_path / "out")).findings
    written = coco_annotations(tmp_path / "out")
    assert written == seen_more_than(0.5, vs.open(tmp_path / "out"))


@pytest.mark.slow
def test_a_merged_data_set_has_the_highest_threshold(tmp_path):
    places = [tmp_path / name for name in ("one", "two", "none")]
    for place, least in zip(places, (0.9, 0.5, None), strict=True):
        vs.generate(recipe_of(**LEFT_OUT, keep_annotations_above=least), place, formats=[])
    merge(places, tmp_path / "all")
    vs.export(tmp_path / "all", "coco")
    dataset = vs.open(tmp_path / "all")
    assert coco_annotations(tmp_path / "all") == seen_more_than(0.9, dataset) != seen_more_than(0.5, dataset)
    assert not check(dataset).findings


@pytest.mark.slow
def test_only_frames_of_the_recipe_are_counted_as_hidden(tmp_path):
    views = {"kind": "jitter", "azimuth": 0, "elevation": 0, "distance": 2.5, "plus_minus": {"azimuth": 3}}
    row = {"company": {"layout": [[0, -0.6, 0], [0.6, 0.6, 0]], "gap": 0}, "ground": "off"}
    low = {"scene": row, "min_visibility": 0.99}
    first = vs.generate(recipe_of(viewpoints=views, **low), tmp_path / "out")
    assert first.notes[0].startswith("warning: min_visibility: ")
    high = {**views, "elevation": 85}
    added = vs.generate(recipe_of(viewpoints=high, **low), tmp_path / "out", append=True)
    assert added.rendered == 3
    assert min(own(vs.open(tmp_path / "out")[3:])) >= 0.99
    assert not added.notes
    again = vs.generate(recipe_of(viewpoints=views, **low), tmp_path / "out")
    assert again.notes == first.notes


@pytest.mark.slow
def test_empty_pictures_are_the_same_without_their_models(tmp_path):
    scene = {"company": 2, "place": {"source": "zoo:neighbourhood"}}
    recipe = recipe_of(
        scene=scene,
        channels=["rgb", "depth", "instances"],
        formats=["coco"],
        empty=0.4,
        engine={"name": "raster", "bounces": "off"},
        viewpoints={**LOW, "count": 4, "elevation": [10, 20], "shared": True},
    )
    with built_once():
        vs.generate(recipe, tmp_path / "out")
        dataset = vs.open(tmp_path / "out")
        full = list(vs.render(recipe.model_copy(update={"empty": None, "channels": ("depth", "instances")})))
        assert not check(dataset).findings
    bare = [not sample.objects for sample in dataset]
    assert 2 <= sum(bare) <= 9
    assert sum(bare) < len(bare)
    for sample, whole in zip(dataset, full, strict=True):
        assert sample.pose == whole.pose
        if sample.objects:
            assert np.array_equal(sample.depth, whole.depth)
            assert np.array_equal(sample.instances, whole.instances)
        else:
            assert not sample.instances.any()
            behind = whole.instances == 0
            assert np.array_equal(sample.depth[behind], whole.depth[behind])


def test_the_share_of_empty_pictures_is_met_and_follows_from_names():
    recipe = recipe_of(viewpoints={**LOW, "count": 400}, scene={"ground": True}, empty=0.05)
    planned = plan(recipe)
    boxes = Stages().box
    gone = [
        now is None for i in range(3) for now in planned.take(planned.subjects[i], range(400), boxes).things[0].motion.poses
    ]
    assert abs(sum(gone) - 60) < 4 * (60 * 0.95) ** 0.5
    fewer = plan(recipe_of(viewpoints={**LOW, "count": 30}, scene={"ground": True}, empty=0.05))
    assert [now is None for now in fewer.take(fewer.subjects[0], range(30), boxes).things[0].motion.poses] == gone[:30]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"min_visibility": 0.2, "viewpoints": {"distance": 3}},
            r"min_visibility: expected something to draw again, .* kind grid",
        ),
        ({"min_visibility": 0.2, "time": {"frames": 2}, "scene": {}}, r"min_visibility: expected none beside time"),
        ({"empty": 0.2, "time": {"frames": 2}, "scene": {}}, r"empty: expected none beside time"),
        ({"min_visibility": 1.2}, r"min_visibility: expected"),
        ({"empty": 1}, r"empty: expected"),
        ({"keep_annotations_above": 1}, r"keep_annotations_above: expected"),
    ],
)
def test_mistakes_name_their_field(changes, message):
    with pytest.raises(RecipeError, match=message):
        plan(recipe_of(**changes))


def test_recipes_without_them_keep_their_digests():
    plain = recipe_of()
    assert recipe_of(min_visibility=None, empty=None, keep_annotations_above=None).digest == plain.digest
    assert recipe_of(keep_annotations_above=0.5).digest == plain.digest  # it changes neither a picture nor a label
    assert len({plain.digest, recipe_of(min_visibility=0.2).digest, recipe_of(empty=0.2).digest}) == 3
