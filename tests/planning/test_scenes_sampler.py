"""Random scenes: stable under more of them, of one split each, equals among equals, kept by the whole chain."""

import re
import tracemalloc
from collections import Counter
from itertools import combinations

import numpy as np
import pytest

import viewsphere as vs
from counting import counted
from installed import example, installed
from quick import quick
from small import small_recipe, tree_hash
from viewsphere.check import check
from viewsphere.composing.placing import footprint
from viewsphere.composing.viewpoints.poses import SpherePoses
from viewsphere.errors import PluginError, RecipeError
from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.rotation import transform
from viewsphere.model.shot import Shot
from viewsphere.planning.extension import extend, whole
from viewsphere.planning.plan import Plan
from viewsphere.planning.samplers import scenes
from viewsphere.preview import preview_samples
from viewsphere.run.estimate import estimate
from viewsphere.run.missing import Missing
from viewsphere.store import Store


def box_of(spec, step=None):
    """A box of its own for every model."""
    w, n, h = (0.2 + 0.05 * ((sum(spec.key.encode()) + i) % 7) for i in range(3))
    return Box3d.between((-w, -n, 0.0), (w, n, h)).corners


def recipe(count=12, models=9, **changes):
    scenes = {"count": count, "objects": [2, 4], **changes.pop("scenes", {})}
    defaults = {
        "models": [{"source": "zoo:post_box", "count": models, "scale": {"length": 0.18}}],
        "scenes": scenes,
        "viewpoints": {"kind": "sphere", "count": 3, "elevation": [15, 60], "distance": 4},
        "splits": {"by": "model", "train": 0.5, "val": 0.5},
        "formats": [],
    }
    return small_recipe(**{**defaults, **changes})


def shots(planned: Plan) -> dict[str, Shot]:
    return {shot.key: shot for shot in planned.shots(box_of)}


def described(shot: Shot, *but: str):
    return [(t.model.key, t.world_from_object, t.repaints) for t in shot.things], [
        instant.model_dump(exclude={"index", *but}) for instant in shot.instants
    ]


def test_a_number_is_short_for_so_many_scenes():
    short, long = small_recipe(scenes=7), small_recipe(scenes={"count": 7, "objects": {"uniform": [2, 5]}})
    assert short.digest == long.digest and short.sampler == "scenes"
    assert small_recipe().sampler == "product"


@pytest.mark.parametrize(
    ("by", "views"),
    quick([("model", None), ("model", 2), ("pose", 2), ("place", None), ("frame", 2)], ("model", 2), ("place", None)),
)
@pytest.mark.slow
def test_a_scene_is_the_same_however_many_there_are(by, views):
    more = {"splits": {"by": by, "train": 0.5, "val": 0.5}, "scenes": {"views": views}}
    more |= {"scene": {"place": {"source": "zoo:neighbourhood", "draw": "per_model"}, "sun": {"azimuth": [0, 360]}}}
    few, many = (shots(vs.plan(recipe(count, **more))) for count in (5, 12))
    assert few.keys() < many.keys()
    assert {key: described(shot) for key, shot in few.items()} == {key: described(many[key]) for key in few}
    assert {key: shot.scene for key, shot in few.items()} == {key: many[key].scene for key in few}


@pytest.mark.slow
def test_a_model_more_takes_one_place_at_most():
    before, after = (shots(vs.plan(recipe(40, models, splits={"by": "frame"}))) for models in (20, 21))
    changed = 0
    for key, shot in before.items():
        one, other = ({t.model.key for t in s.things} for s in (shot, after[key]))
        assert len(one - other) == len(other - one) <= 1
        changed += one != other
    assert 0 < changed < len(before) / 2


def test_objects_are_equal_clear_of_each_other_and_in_the_middle_of_the_picture():
    planned = vs.plan(recipe(30))
    facing, counts = set(), Counter()
    for shot in planned.shots(box_of):
        assert [thing.id for thing in shot.things] == list(range(1, len(shot.things) + 1)) and not shot.things[0].scenery
        counts[len(shot.things)] += 1
        assert len({t.model.key for t in shot.things}) == len(shot.things)
        prints = [footprint(box_of(t.model), t.world_from_object) for t in shot.things]
        assert all(a.apart(b, 0.3) for a, b in combinations(prints, 2))
        facing |= {thing.world_from_object[0][:2] for thing in shot.things}
        corners = np.concatenate([transform(t.world_from_object, box_of(t.model)) for t in shot.things])
        middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
        assert abs(corners[:, 2].min()) < 1e-12
        for i, instant in enumerate(shot.instants):
            np.testing.assert_allclose(instant.focus, middle, atol=1e-12)
            x, y, z = shot.camera(i).R @ (middle - shot.camera(i).center)
            assert abs(x) < 1e-9 and abs(y) < 1e-9 < z  # the optical axis goes through the middle
    assert set(counts) == {2, 3, 4} and planned.max_objects == 4
    assert len(facing) > 30


def test_random_viewpoints_are_drawn_for_each_scene_and_those_of_a_grid_are_the_same():
    angles = [[i.viewpoint.azimuth_deg for i in shot.instants] for shot in shots(vs.plan(recipe(6))).values()]
    assert len({angle for some in angles for angle in some}) == 6 * 3
    grid = {"azimuth": [0, 90, 180], "distance": 4}
    angles = [
        [i.viewpoint.azimuth_deg for i in shot.instants]
        for shot in shots(vs.plan(recipe(6, viewpoints=grid, shot_frames=16))).values()
    ]
    assert angles == [[0, 90, 180]] * 6


def test_some_of_the_viewpoints_are_drawn_for_each_scene():
    grid = {"azimuth": {"start": 0, "stop": 360, "step": 30}, "distance": 4}
    planned = vs.plan(recipe(20, viewpoints=grid, scenes={"views": 4}))
    assert planned.frames == 20 * 4 and planned.factors == "20 scenes of 9 models x 4 poses"
    taken = {
        name: tuple(p for r in planned.rows.rows_of(name) for a, b in r.positions for p in range(a, b))
        for name in planned.subjects
    }
    assert all(len(set(poses)) == 4 for poses in taken.values())
    assert len(set(taken.values())) > 10 and len({p for poses in taken.values() for p in poses}) == 12
    assert [row.first for row in planned.rows] == sorted(row.first for row in planned.rows)


def test_models_of_one_split_meet_and_nothing_of_one_is_seen_in_the_other():
    planned = vs.plan(recipe(40))
    seen = {"train": set(), "val": set()}
    for shot in planned.shots(box_of):
        (name,) = {instant.split for instant in shot.instants}
        keys = {thing.model.key for thing in shot.things}
        assert {planned.dealt_splits[key] for key in keys} == {name}
        seen[name] |= keys
    assert seen["train"] and seen["val"] and not seen["train"] & seen["val"]
    assert sum(planned.split_counts.values()) == planned.frames


def test_listed_models_have_scenes_of_their_own():
    planned = vs.plan(recipe(60, splits={"train": 1, "val": ["post_box_000", "post_box_003", "post_box_005", "post_box_007"]}))
    shares = Counter(planned.split(name, 0) for name in planned.subjects)
    assert 60 * 4 / 9 - 15 < shares["val"] < 60 * 4 / 9 + 15
    listed = {"post_box_000", "post_box_003", "post_box_005", "post_box_007"}
    for name in planned.subjects:
        assert {spec.key in listed for spec in planned.cast(name)} == {planned.split(name, 0) == "val"}


def test_splits_by_scene_meet_their_shares_and_an_append_moves_none():
    by = {"by": "scene", "train": 0.7, "val": 0.3}
    first = whole(vs.plan(recipe(10, splits=by)))
    assert first.plan.split_counts == {"train": 21, "val": 9}
    more = extend(vs.plan(recipe(20, splits=by)), first.record)
    assert more.plan.dealt_splits.items() > first.plan.dealt_splits.items()
    assert Counter(more.part.dealt_splits.values()) == {"train": 7, "val": 3}
    assert [block.subjects for block in more.part.blocks] == [tuple(f"scene-{i:06d}" for i in range(10, 20))]
    assert (more.part.first, more.part.frames) == (30, 30)


def test_more_viewpoints_are_added_to_scenes_that_are_there():
    grid = {"azimuth": [0, 90], "distance": 4}
    first = whole(vs.plan(recipe(4, viewpoints=grid)))
    more = extend(vs.plan(recipe(5, viewpoints={**grid, "azimuth": [0, 45, 90]})), first.record)
    assert [(b.subjects[-1], len(b.subjects), b.size) for b in more.part.blocks] == [
        ("scene-000003", 4, 1),
        ("scene-000004", 1, 3),
    ]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"models": 3}, r"scenes\.objects: splits are by model, so a scene of split '\w+' needs up to 4 models .* has \d of 3"),
        ({"scenes": {"layout": "scater"}}, r"scenes\.layout: 'scater' is unknown; did you mean 'scatter'\? Valid: .*"),
        (
            {"scenes": {"sampler": "scenez"}},
            r"scenes\.sampler: 'scenez' is unknown; did you mean 'scenes'\? Valid: .*product, scenes, .*",
        ),
        ({"scene": {"company": 1}}, r"scene\.company: expected none beside scenes"),
        ({"count": 2_000_000_000}, r"scenes\.count: expected at most 1,000,000 frames; found 2,000,000,000 scenes"),
        (
            {"count": 400, "max_frames": 1000},
            r"models: expected at most 1,000 frames; found 1,200 \(400 scenes of 9 models x 3 poses",
        ),
    ],
)
def test_what_cannot_be_is_said(changes, message):
    with pytest.raises(RecipeError, match=message):
        vs.plan(recipe(**changes))


ONE_MODEL = [{"source": "zoo:mug", "category": "mug"}]


@pytest.mark.parametrize(
    ("repeat", "remedies"),
    [
        (True, r"which has 0 of 1 model\. Set `splits: \{by: scene\}`, or add models\."),
        (False, r"which has \d of 1 model\. Set `splits: \{by: scene\}`, (set `scenes\.repeat: true`, ask for fewer, )?or add"),
    ],
)
def test_the_remedy_for_one_model_is_another_split_not_repeating_it(repeat, remedies):
    said = {"viewpoints": {"distance": 2}, "models": ONE_MODEL, "scenes": {"count": 4, "objects": 5, "repeat": repeat}}
    with pytest.raises(RecipeError, match=remedies):
        vs.plan(vs.Recipe(**said))
    assert vs.plan(vs.Recipe(**said | {"splits": {"by": "scene"}, "scenes": {**said["scenes"], "repeat": True}})).frames == 32


def test_repeated_models_are_instances():
    planned = vs.plan(recipe(10, 1, scenes={"repeat": True}, splits={"by": "scene", "train": 0.5, "val": 0.5}))
    assert all(len({t.model.key for t in shot.things}) == 1 < len(shot.things) for shot in planned.shots(box_of))


def test_splits_by_scene_need_scenes():
    with pytest.raises(RecipeError, match=r"splits\.by: .*; found scene: set scenes"):
        vs.plan(small_recipe(splits={"by": "scene", "train": 1}))


def test_listed_spots_are_taken():
    spots = [[1, 0, 0], [-1, 0, 90], [0, 2, 180]]
    planned = vs.plan(recipe(3, scenes={"objects": 3, "layout": spots}))
    for shot in planned.shots(box_of):
        assert [(t.world_from_object[0][3], t.world_from_object[1][3]) for t in shot.things] == [(1, 0), (-1, 0), (0, 2)]
    with pytest.raises(RecipeError, match=r"expected objects: 3, one for each place"):
        recipe(3, scenes={"layout": spots})


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    out = tmp_path_factory.mktemp("scenes") / "out"
    vs.generate(recipe(3, formats=["native", "coco"], scenes={"objects": [1, 3]}), out)
    return vs.open(out)


@pytest.mark.slow
def test_a_data_set_of_scenes_is_proved(dataset):
    report = check(dataset)
    assert report.ok, report.findings
    assert len(dataset) == 9 and report.checked["coco"] == report.checked["native"] == 9
    assert [sample.index for sample in dataset] == list(range(9))
    drawn = {
        key: tuple(dict.fromkeys(o.key for o in s.objects)) for key, p in dataset.shots() for s in dataset.samples_of(key, p)
    }
    planned = vs.plan(recipe(3, scenes={"objects": [1, 3]}))
    assert set(drawn.values()) == {tuple(spec.key for spec in planned.cast(name)) for name in planned.subjects}
    first = next(iter(drawn.values()))[0]
    chosen = vs.Dataset(dataset.root, vs.store.Choice(models=(first,)))
    assert 0 < len(chosen) <= 9 and all(first in {o.key for o in sample.objects} for sample in chosen)


@pytest.mark.slow
def test_what_is_missing_is_counted_in_scenes(dataset, tmp_path):
    vs.generate(recipe(3, scenes={"objects": [1, 3]}), tmp_path / "out")
    gone = next((tmp_path / "out" / "store" / "shots").glob("*/*/manifest.json"))
    gone.unlink()
    messages = [f.message for f in check(vs.open(tmp_path / "out"), rays=False).findings]
    assert any("3 scenes x 3 poses" in message for message in messages)


@pytest.mark.slow
def test_workers_appending_and_memory_make_the_same_pictures(dataset, tmp_path):
    vs.generate(recipe(2, scenes={"objects": [1, 3]}), tmp_path / "out")
    summary = vs.generate(recipe(3, scenes={"objects": [1, 3]}), tmp_path / "out", append=True)
    assert (summary.rendered, summary.frames) == (3, 9)
    added, in_memory = vs.open(tmp_path / "out"), list(vs.render(recipe(3, scenes={"objects": [1, 3]})))
    for one, other, third in zip(dataset, added, in_memory, strict=True):
        assert np.array_equal(one.rgb, other.rgb) and np.array_equal(one.rgb, third.rgb)
        assert [o.key for o in one.objects] == [o.key for o in other.objects] == [o.key for o in third.objects]
        assert one.split == other.split == third.split
    assert check(added, rays=False).ok


@pytest.mark.slow
def test_channels_are_added_to_scenes_of_the_same_models(tmp_path):
    out = tmp_path / "out"
    vs.generate(recipe(2, channels=["rgb"], scenes={"objects": 2}), out)
    before = tree_hash(out / "store" / "shots")
    vs.generate(recipe(2, channels=["rgb", "depth"], scenes={"objects": 2}), out, append=True)
    assert tree_hash(out / "store" / "shots") != before
    assert all(np.isfinite(sample.depth).any() for sample in vs.open(out))
    with pytest.raises(RecipeError, match="found scenes drawn from other models"):
        vs.generate(recipe(2, 12, channels=["rgb", "depth", "instances"], scenes={"objects": 2}), out, append=True)
    with pytest.raises(RecipeError, match=r"scenes\.objects: expected 2, as the data set has; found 3"):
        vs.generate(recipe(3, channels=["rgb", "depth"], scenes={"objects": 3}), out, append=True)
    with pytest.raises(RecipeError, match="scenes: expected frames of sampler scenes, as the data set has; found product"):
        vs.generate(recipe(scenes={}).model_copy(update={"scenes": None}), out, append=True)


@pytest.mark.slow
def test_preview_and_estimate_know_scenes():
    samples = list(preview_samples(recipe(3), 6))
    assert len({(sample.objects[0].key, sample.pose.azimuth_deg) for sample in samples}) == 6
    cost = estimate(recipe(3, scenes={"objects": 2}), 2)
    assert cost.seconds > 0 and cost.bytes > 10_000


@pytest.fixture
def pairs(tmp_path):
    with installed(tmp_path, "samplers", "pairs", example("Every model beside")) as file:
        yield file


def pairs_recipe(**scenes):
    return small_recipe(models=[{"source": "zoo:post_box", "count": 3}], scenes={"sampler": "pairs", **scenes})


@pytest.mark.usefixtures("pairs")
@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"gapp": 1}, r"scenes\.gapp: expected no field but gap; found 'gapp'; did you mean 'gap'"),
        ({"gap": "wide"}, r"scenes\.gap: .*'wide'"),
    ],
)
def test_a_plan_refuses_options_that_a_sampler_does_not_have(options, message):
    with pytest.raises(RecipeError, match=message):
        vs.plan(pairs_recipe(**options))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("    split=split,\n", "", r"SamplerSpec\.split: expected a value; found nothing"),
        ("    split=split,", "    splitt=split,", r"SamplerSpec\.splitt: 'splitt' is unknown; did you mean 'split'"),
        ("    split=split,", "    split='train',", r"SamplerSpec\.split: expected a function; found 'train'"),
        (
            "    split=split,",
            "    split=factors,",
            r"SamplerSpec\.split: expected a function of 3 values; found factors",
        ),
        ("SAMPLER =", "SAMPLERS =", r"expected SAMPLER = SamplerSpec\(\.\.\.\); found no SAMPLER; did you mean 'SAMPLERS'"),
        ("SAMPLER = SamplerSpec(", "SAMPLER = dict(", r"SAMPLER: expected a SamplerSpec; found a mapping"),
        ("def subjects", "import no_such_package\n\ndef subjects", r"pairs cannot be imported: ModuleNotFoundError"),
    ],
)
def test_a_faulty_spec_is_refused_with_its_file_and_field(old, new, message, tmp_path):
    code = example("Every model beside")
    assert old in code
    with (
        installed(tmp_path, "samplers", "pairs", code.replace(old, new)) as file,
        pytest.raises(PluginError, match=f"^{re.escape(str(file))}: .*{message}"),
    ):
        vs.plan(pairs_recipe())


@pytest.mark.usefixtures("pairs")
def test_the_sampler_in_the_docs_is_one_file():
    grid = {"azimuth": [0, 90], "distance": 4}
    pairs = small_recipe(
        models=[{"source": "zoo:post_box", "count": 3}],
        scenes={"sampler": "pairs", "gap": 0.5},
        viewpoints=grid,
        splits={"by": "frame"},
    )
    planned = vs.plan(pairs)
    assert (planned.frames, planned.factors) == (4, "2 pairs x 2 poses")
    assert [len(shot.things) for shot in planned.shots(box_of)] == [2, 2]
    assert [len(sample.objects) for sample in vs.render(pairs)] == [2] * 4


@pytest.mark.parametrize(("models", "poses"), quick([(1, 10**8), (1000, 10**5)], (1, 10**8)))
@pytest.mark.parametrize("by", ["model", "frame"])
def test_a_hundred_million_frames_are_planned_in_little_memory(models, poses, by, tmp_path):
    big = small_recipe(
        models=[{"source": "zoo:post_box", "count": models}],
        viewpoints={"kind": "sphere", "count": poses, "distance": 4},
        splits={"by": by, "train": 0.5, "val": 0.5},
        max_frames=10**9,
    )
    vs.plan(small_recipe())  # what is loaded once does not count
    tracemalloc.start()
    portion = whole(vs.plan(big))
    first = next(Missing(portion, Store(tmp_path)).rows())
    assert sum(portion.plan.split_counts.values()) == portion.plan.frames == 10**8
    assert next(iter(portion.rows)) == first and len(portion.record.to_json()) < 500_000
    assert tracemalloc.get_traced_memory()[1] < 20_000_000
    tracemalloc.stop()


@pytest.mark.parametrize("views", [None, 2])
def test_planning_counts_scenes_out_once_and_asks_for_no_pose_again(views, monkeypatch):
    blocks, ranges = counted(monkeypatch, scenes.SAMPLER, "blocks"), counted(monkeypatch, scenes, "as_ranges")
    named = counted(monkeypatch, SpherePoses, "name")
    planned = vs.plan(recipe(count=300, scenes={"views": views}))
    assert (planned.frames, planned.shot_count) == (300 * (views or 3), len(planned.rows))
    assert len(blocks) == 1
    assert len(ranges) == (300 if views else 0)
    assert len(named) == (3 if views else 0)


def test_splits_of_more_scenes_than_are_counted_are_what_some_of_them_say(monkeypatch):
    exact = vs.plan(recipe(count=400)).split_counts
    monkeypatch.setattr("viewsphere.planning.plan.COUNTED", 200)
    planned = vs.plan(recipe(count=400))
    drawn = counted(monkeypatch, planned.sampler, "split")
    assert planned.split_counts.keys() == exact.keys()
    assert sum(planned.split_counts.values()) == planned.frames
    assert max(abs(planned.split_counts[name] - exact[name]) for name in exact) < 0.1 * planned.frames
    assert len(drawn) == 200
