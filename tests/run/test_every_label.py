"""Every label is the same however its frame came into a data set: merged, appended, in shards, resumed, or rendered at once."""

from __future__ import annotations

import shutil
from dataclasses import dataclass

import numpy as np
import pytest

from built_once import QUICK
from viewsphere import Dataset, Recipe, generate
from viewsphere.check import check
from viewsphere.errors import PluginError
from viewsphere.labels import (
    ChannelLabel,
    Field,
    FollowedPoints,
    ObjectLabel,
    by_table,
    channel_labels,
    in_attributes,
    labels,
    on_request,
    requires,
)
from viewsphere.labels.shared.ids import has_whole_numbers
from viewsphere.run.datasets.importing import import_dataset
from viewsphere.run.datasets.merging import merge

BOX = [(x, y, z) for x in (-1, 1) for y in (-0.5, 0.5) for z in (-0.25, 0.25)]
FACES = ("1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4")
LIDAR = {"rings": 6, "elevation": [-40, 5], "azimuth_step": 6, "sigma": 0.01, "dropout": 0.1}
FEW = ["depth", "instances"]


def write_models(folder):
    """Boxes of three shapes, each of two parts and two materials, with a named point."""
    (folder / "m.mtl").write_text("newmtl red\nKd 0.7 0.1 0.1\nnewmtl grey\nKd 0.5 0.5 0.5\n")
    for name, scale in (("flat", (1, 1, 1)), ("cube", (0.6, 1.2, 2.4)), ("pole", (0.3, 0.6, 5))):
        points = [f"v {x * scale[0]} {y * scale[1]} {z * scale[2]}" for x, y, z in BOX]
        faces = [f"f {face}" for face in FACES]
        lines = ["mtllib m.mtl", *points, "o low", "usemtl red", *faces[:3], "o high", "usemtl grey", *faces[3:]]
        (folder / f"{name}.obj").write_text("\n".join(lines) + "\n")
        (folder / f"{name}.obj.viewsphere.yaml").write_text("keypoints: {points: {tip: [0.0, 0.0, 0.1]}}\n")


@pytest.fixture(scope="session")
def recipe_of(tmp_path_factory):
    """Makes recipes of random scenes over time with all labels; models are named in the order of their categories."""
    folder = tmp_path_factory.mktemp("boxes")
    write_models(folder)

    def made(*names, seed=1, count=1, **changes):
        entry = {"up": "+z", "forward": "-y", "motion": {"kind": "constant", "velocity": [4, 0, 0]}}
        said = {
            "name": "every label",
            "seed": seed,
            "models": [{"source": str(folder / f"{name}.obj"), "category": name, **entry} for name in names],
            "scenes": {"count": count, "objects": 2, "gap": 0.05},
            "time": {"frames": 2, "fps": 10},
            "viewpoints": {"azimuth": 20, "elevation": 25, "distance": 6},
            "camera": {"size": [32, 24], "fov_deg": 50},
            "rig": {"sensors": {
                "left": {},
                "right": {"position": [0.2, 0, 0]},
                "top": {"position": [0, -0.2, 0], "lidar": LIDAR, "channels": ["lidar", *FEW]},
            }},
            "splits": {"by": "scene", "train": 1},
            "scene": {"ground": True},
            "engine": QUICK,
            "channels": list(channel_labels()),
            "annotations": list(on_request()),
            "tracks": {"grid": 8},
            "labels": {"voxels": {"size": [4, 2, 4], "cell": 0.5, "distance": 5}, "surface_samples": {"count": 8}},
            "formats": [],
        }  # fmt: skip
        said |= changes
        options = {name: of for name, of in said["labels"].items() if name in said["channels"]}
        return Recipe.model_validate({**said, "labels": options})

    return made


@pytest.fixture(scope="session")
def rendered(recipe_of, tmp_path_factory):
    """Gives the data set of a recipe, rendered at once; do not change it."""
    known = {}

    def of(*names, **changes):
        key = repr((names, changes))
        if key not in known:
            known[key] = tmp_path_factory.mktemp("rendered") / "out"
            generate(recipe_of(*names, **changes), known[key])
        return known[key]

    return of


def frames_of(*folders):
    """The samples of data sets, one after another."""
    return [sample for folder in folders for sample in Dataset(folder)]


def by_name(samples):
    return {(sample.sequence, sample.sensor, sample.time): sample for sample in samples}


def assert_same_labels(found, expected):
    """All labels of two samples are equal, attribute by attribute; numbers of frames and poses may differ."""
    assert set(found.channels) == set(expected.channels)
    for name in expected.channels:
        np.testing.assert_array_equal(found.channels[name], expected.channels[name], err_msg=name)
    for name in ("K", "R", "t"):
        assert np.array_equal(getattr(found.camera, name), getattr(expected.camera, name))
    assert [(o.id, o.key, o.track) for o in found.objects] == [(o.id, o.key, o.track) for o in expected.objects]
    for label in labels().values():
        pairs = [(found, expected)]
        if isinstance(label, ObjectLabel):
            pairs = list(zip(found.objects, expected.objects, strict=True))
        for field in getattr(label, "fields", ()) if label.is_in(expected) else ():
            for one, other in pairs:
                mine, theirs = getattr(one, field.name), getattr(other, field.name)
                assert field.equals(mine, theirs), (label.name, field.name, mine, theirs)


def assert_same(found, expected, frames):
    """Two lists of samples have the same labels, frame by frame, and there are so many."""
    found, expected = by_name(found), by_name(expected)
    assert found.keys() == expected.keys() and len(found) == frames
    for name in expected:
        assert_same_labels(found[name], expected[name])


def test_frames_of_all_kinds_of_labels_hold_something(rendered):
    """Else their comparison would say nothing."""
    samples = frames_of(rendered("flat", "cube"))
    for name, label in channel_labels().items():
        arrays = [sample.channels[name] for sample in samples if name in sample.channels]
        if name != "body_parts":  # no model has bones
            assert any(len(np.unique(array)) > 1 for array in arrays), name
        assert label.ids is not None or not has_whole_numbers(label.dtype), name
    assert all(sample.captions and sample.referring for sample in samples if sample.sensor == "left")


@pytest.mark.slow
def test_merging_gives_other_categories_as_they_would_be_rendered(rendered, tmp_path):
    """The second data set's categories have another order, and so other ids, in the first one and in the merged one."""
    first, second = rendered("flat", "cube"), rendered("pole", "cube", "flat", seed=2)
    merge([first, second], tmp_path / "out")
    merged, expected = Dataset(tmp_path / "out"), frames_of(rendered("flat", "cube", "pole", seed=2))
    assert [c.name for c in merged.categories] == ["flat", "cube", "pole"]
    assert [c.name for c in Dataset(second).categories] == ["pole", "cube", "flat"]
    found = [merged[i] for i in range(len(merged))]
    for sample, own in zip(found, [*frames_of(first), *expected], strict=True):
        assert_same_labels(sample, own)


@pytest.mark.slow
def test_a_merged_data_set_proves_its_labels(rendered, tmp_path):
    merge([rendered("flat", "cube"), rendered("pole", "cube", "flat", seed=2)], tmp_path / "out")
    report = check(Dataset(tmp_path / "out"))
    assert report.ok, report.findings


def test_noise_that_is_appended_is_that_of_one_run(recipe_of, rendered, tmp_path):
    """Shots that add a channel have other keys and other lengths than those of the frames that they add it to."""
    stills = {"tracks": None, "rig": None, "annotations": [], "channels": FEW}
    out = shutil.copytree(rendered("flat", "cube", shot_frames=1, **stills), tmp_path / "out")
    stills["channels"] = [*FEW, "depth_sensor"]
    generate(recipe_of("flat", "cube", **stills), out, append=True)
    assert_same(frames_of(out), frames_of(rendered("flat", "cube", **stills)), 2)


@pytest.mark.slow
def test_channels_that_are_appended_are_those_of_one_run(recipe_of, rendered, tmp_path):
    out = shutil.copytree(rendered("flat", "cube", channels=FEW, shot_frames=1), tmp_path / "out")
    generate(recipe_of("flat", "cube"), out, append=True)
    assert_same(frames_of(out), frames_of(rendered("flat", "cube")), 6)
    report = check(Dataset(out))
    assert report.ok, report.findings


@pytest.mark.slow
def test_appending_twice_is_one_run(recipe_of, rendered, tmp_path):
    out = shutil.copytree(rendered("flat", "cube", channels=FEW), tmp_path / "out")
    generate(recipe_of("flat", "cube", count=2, channels=[*FEW, "depth_sensor", "lidar"]), out, append=True)
    generate(recipe_of("flat", "cube", count=3), out, append=True)
    assert_same(frames_of(out), frames_of(rendered("flat", "cube", count=3)), 18)
    report = check(Dataset(out))
    assert report.ok, report.findings


@pytest.mark.slow
def test_models_and_poses_that_are_appended_are_those_of_one_run(recipe_of, tmp_path):
    """New models come first in the recipe, and new poses between the old ones, so that all have other numbers."""
    stills = {"scenes": None, "time": None, "tracks": None, "splits": {"by": "model", "train": 1}}
    moving = {name for name, label in labels().items() if label.pose_offsets or requires(label.needs, FollowedPoints)}
    names = [name for name in channel_labels() if name not in moving]
    few = {"viewpoints": {"azimuth": [0, 60], "elevation": 20, "distance": 6}}
    more = {"viewpoints": {"azimuth": [0, 30, 60, 90], "elevation": 20, "distance": 6}, "shot_frames": 3}
    asked = [name for name in on_request() if name not in moving]
    made = still_recipes(recipe_of, stills | {"channels": names, "annotations": asked})
    generate(made("flat", "cube", **few), tmp_path / "grown")
    generate(made("pole", "flat", "cube", **more), tmp_path / "grown", append=True)
    generate(made("flat", "cube", "pole", **more), tmp_path / "once")
    found, expected = (
        {(s.objects[0].key, s.sensor, s.pose.azimuth_deg): s for s in frames_of(tmp_path / name)} for name in ("grown", "once")
    )
    assert found.keys() == expected.keys() and len(found) == 3 * 4 * 3
    for name in found:
        assert_same_labels(found[name], expected[name])


def still_recipes(recipe_of, changes):
    """Makes recipes of models x poses, which stand still."""

    def made(*names, **more):
        said = recipe_of(*names, **changes, **more).model_dump(mode="json", exclude_unset=True)
        models = [{name: value for name, value in entry.items() if name != "motion"} for entry in said["models"]]
        return Recipe.model_validate(said | {"models": models})

    return made


@pytest.mark.slow
@pytest.mark.parametrize("how", ["shards", "resumed", "other shots"])
def test_runs_in_pieces_are_one_run(how, recipe_of, rendered, tmp_path):
    recipe = recipe_of("flat", "cube", count=3, **({"shot_frames": 1} if how != "resumed" else {}))
    if how != "other shots":
        generate(recipe, tmp_path / "out", shard=(1, 2))
    if how == "shards":
        generate(recipe, tmp_path / "out", shard=(0, 2))
    generate(recipe, tmp_path / "out")
    assert_same(frames_of(tmp_path / "out"), frames_of(rendered("flat", "cube", count=3)), 18)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["native", "coco"])
def test_what_an_export_holds_comes_back_and_merges_with_other_categories(kind, recipe_of, rendered, tmp_path):
    """Boxes, masks and categories of imported objects are those that were rendered, before and after a merge."""
    stills = {"scenes": None, "time": None, "tracks": None, "annotations": [], "rig": None}
    made = still_recipes(recipe_of, stills | {"channels": ["rgb", *FEW, "categories"], "splits": {"by": "model", "train": 1}})
    once, other = made("flat", "cube", formats=[kind]), made("pole", "cube", "flat", seed=2)
    generate(once, tmp_path / "once")
    generate(other, tmp_path / "other")
    import_dataset(kind, tmp_path / "once" / kind, tmp_path / "in")
    merge([tmp_path / "other", tmp_path / "in"], tmp_path / "both", mixed=True)
    expected = frames_of(tmp_path / "once")
    for folder in ("in", "both"):
        dataset = Dataset(tmp_path / folder)
        found = [s for s in dataset if any(o.source is not None for o in s.objects)]
        assert len(found) == len(expected) == 2
        named = {c.id: c.name for c in dataset.categories}
        for sample in found:
            twin = next(s for s in expected if np.array_equal(s.rgb, sample.rgb))
            for o, p in zip(sample.objects, twin.objects, strict=True):
                assert (o.category, named[o.category_id]) == (p.category, p.category)
                assert (o.box2d, o.rle) == (p.box2d, p.rle)
                assert o.visibility == p.visibility or kind == "coco"  # COCO's own readers do not know it


@pytest.mark.parametrize("kind", ["category", "object", "part"])
def test_ids_get_others_and_come_back(kind, rendered):
    """The declared renumberings of all channels: one there and back changes nothing, and all that has the ids changes."""
    there = {i: i + 2 for i in range(1, 40)}
    back, changed = {new: old for old, new in there.items()}, set()
    for sample in frames_of(rendered("flat", "cube")):
        for name, label in channel_labels().items():
            array = sample.channels.get(name)
            if array is not None and kind in (label.ids or {}):
                moved = label.ids[kind](array, there)
                assert moved.dtype == array.dtype and moved.shape == array.shape
                np.testing.assert_array_equal(label.ids[kind](moved, back), array)
                changed |= {name} if (moved != array).any() else set()
    declared = {name for name, label in channel_labels().items() if kind in (label.ids or {})}
    assert declared - {"body_parts"} == changed - {"body_parts"} != set()


@dataclass(frozen=True)
class Neighbour:
    """A value with an id."""

    id: int
    share: float


COMPUTE = {"meaning": "x", "compute": lambda context: np.zeros((2, 2), np.int32)}


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ChannelLabel(name="x", dtype=np.int32, **COMPUTE), "label 'x' holds whole numbers"),
        (lambda: ChannelLabel(name="x", dtype=[("a", "<f4"), ("b", "<u2", (3,))], **COMPUTE), "label 'x' holds whole numbers"),
        (lambda: ChannelLabel(name="x", dtype=np.int32, ids={"klass": by_table}, **COMPUTE), "declares ids of 'klass'"),
        (lambda: ChannelLabel(name="x", dtype=np.int32, ids={"part": None}, **COMPUTE), "without a function"),
        (lambda: Field("x", "ids", int, (-1,), is_array=True), "field 'x' holds whole numbers"),
        (lambda: Field("x", "expressions", Neighbour, many=True), "field 'x' holds whole numbers"),
    ],
)
def test_a_label_of_whole_numbers_that_does_not_declare_its_ids_fails_to_load(make, message):
    with pytest.raises((PluginError, ValueError), match=message):
        make()


def test_labels_without_ids_and_values_with_some_load():
    ChannelLabel(name="x", dtype=np.float32, **COMPUTE)
    ChannelLabel(name="x", dtype=np.int32, ids={}, **COMPUTE)
    field = Field("x", "neighbours", Neighbour, many=True, ids={"object": in_attributes("id")})
    assert field.ids["object"]((Neighbour(1, 0.5), Neighbour(3, 0.5)), {1: 4}) == (Neighbour(4, 0.5), Neighbour(3, 0.5))
