"""Every field of a store's texts, and every file of it, is changed in turn, and all digests are mended: `check` finds each."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from json_leaves import leaves
from quick import quick
from sealing import seal_again
from sequence_recipe import eventful_recipe
from small import small_recipe
from viewsphere import generate
from viewsphere.check import check
from viewsphere.check.claims import left_out, unclaimed
from viewsphere.check.frames.recomputed import Recomputed
from viewsphere.check.frames.sources import Sources
from viewsphere.check.models import differing
from viewsphere.check.repair import repair
from viewsphere.check.report import Finding, Report
from viewsphere.labels import channels
from viewsphere.model.channel import PASSES
from viewsphere.recipe.recipe import BEFORE_RENDERING
from viewsphere.store import Dataset, encode
from viewsphere.store.shots.manifest import sealed, unsealed

RECIPE = {
    "channels": ["rgb", "depth", "instances", "semantic"],
    "scene": {"ground": True, "sun": {"azimuth": [0, 360]}},
    "annotations": ["keypoints"],
    "formats": [],
    "splits": {"train": 0.5, "val": 0.5},
}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A data set of each kind of text; do not change it."""
    out = tmp_path_factory.mktemp("tamperings") / "out"
    generate(small_recipe(**RECIPE), out)
    return out


@pytest.fixture
def copied(whole, tmp_path):
    return shutil.copytree(whole, tmp_path / "out")


def another(value):
    """Another value of the same type."""
    match value:
        case bool():
            return not value
        case int():
            return value + 1
        case float():
            return value * (1 + 1e-6) + 1e-6
        case str():
            return value[:-1] + ("x" if value[-1:] != "x" else "y")
        case list():
            return ["x"]
        case dict():
            return {"x": 1}
        case _:
            return 1.0


def changed(value, where):
    """A copy of a value of JSON with another leaf at a place."""
    made = json.loads(json.dumps(value))
    inside = made
    for key in where[:-1]:
        inside = inside[key]
    inside[where[-1]] = another(inside[where[-1]])
    return made


def found(prove):
    """Return whether anything is found, or the text cannot be read, which every command reports."""
    try:
        return list(prove())
    except Exception as error:
        return [f"{type(error).__name__}: {error}"]


def missed(file, value, write, prove, share=1):
    """The places of a text, or of a share of them, of which another value is not found."""
    text = file.read_text()
    places = []
    for where in list(leaves(value))[::share]:
        file.write_text(write(changed(value, where)))
        if not found(prove):
            places.append(where)
    file.write_text(text)
    return places


def plan_findings(root):
    recomputed = Recomputed(Dataset(root))
    return list(recomputed.of_plan())


def test_a_whole_data_set_is_as_its_recipe_gives_it(whole):
    dataset = Dataset(whole)
    recomputed = Recomputed(dataset)
    sources = Sources(dataset, recomputed)
    assert [*recomputed.of_plan(), *sources.contradictions(dataset.plan.models), *unclaimed(dataset)] == []
    assert [message for row in dataset.rows for message in recomputed.of_shot(row)] == []
    assert (recomputed.why_not, recomputed.refused, sources.why_not) == ({}, {}, {})


@pytest.mark.parametrize("share", quick([9, 1], 9))
def test_every_field_of_a_shot_is_what_the_recipe_gives(copied, share):
    dataset = Dataset(copied)
    recomputed, row = Recomputed(dataset), dataset.rows[1]
    file = dataset.store.shot_folder(row.key) / "shot.json"
    value = json.loads(file.read_text())
    assert {"scene", "engine", "label_alpha", "category_deg"} <= value.keys()
    assert missed(file, value, json.dumps, lambda: recomputed.of_shot(row), share) == []


@pytest.mark.parametrize("share", quick([3, 1], 3))
def test_every_field_of_a_models_record_is_what_its_source_gives(copied, share):
    dataset = Dataset(copied)
    recomputed, key = Recomputed(dataset), dataset.plan.models[0]
    file = dataset.store.model_folder(key) / "model.json"
    value = json.loads(file.read_text())
    assert {"real_size", "keypoints", "digest", "diameter", "credit", "parts"} <= value.keys()
    assert missed(file, value, json.dumps, lambda: Sources(Dataset(copied), recomputed).contradictions([key]), share) == []


def tops(value):
    """One leaf of each field of the plan, of its recipe and of its part."""
    for where in leaves(value):
        depth = {"recipe": 2, "parts": 3}.get(where[0], 1)
        yield where[: depth + (depth == 3 and where[2] == "recipe")], where


@pytest.mark.parametrize("share", quick([8, 1], 8))
def test_every_field_of_the_plan_is_what_the_recipe_gives(copied, share):
    """By default of every eighth field one leaf."""
    file = Dataset(copied).store.plan_file
    value = unsealed(file.read_text())
    assert {"name", "recipe", "classes", "splits"} <= value.keys()
    places = list(leaves(value)) if share == 1 else list(dict(tops(value)).values())[::share]
    unseen = []
    for where in places:
        file.write_text(sealed(changed(value, where)))
        unseen += [where] if not found(lambda: plan_findings(copied)) else []
    assert unseen == []


FIELDS = ["seed", "camera", "scene", "engine", "models", "viewpoints", "splits", "label_alpha"]


@pytest.mark.parametrize("field", quick(FIELDS, "seed", "camera"))
def test_a_recipe_that_is_another_in_all_its_copies(copied, field):
    """The plan's copy and the part's: digests and settings then contradict the recipe."""
    file = Dataset(copied).store.plan_file
    value = unsealed(file.read_text())
    unseen, places = [], [where for where in leaves(value["recipe"]) if where[0] == field]
    for where in places[:: max(1, len(places) // 4)]:
        made = changed(value, ("recipe", *where))
        made = changed(made, ("parts", 0, "recipe", *where))
        file.write_text(sealed(made))
        unseen += [where] if not found(lambda: plan_findings(copied)) else []
    assert places and field not in BEFORE_RENDERING
    assert unseen == []


WITHOUT_EFFECT = {
    "max_frames": "a limit on mistakes in the number of frames: every value that is not below it gives the same plan"
}
"""Fields of a recipe of which another value changes no plan, shot, picture or label, and why."""


@pytest.mark.parametrize("field", WITHOUT_EFFECT)
def test_a_field_without_effect_may_have_any_value_that_gives_the_same_plan(copied, field):
    """A value that no plan of so many frames has is found."""
    file = Dataset(copied).store.plan_file
    value, verdicts = unsealed(file.read_text()), {}
    for limit in (1_000_001, 12, 11):
        recipe = value["recipe"] | {field: limit}
        parts = [part | {"recipe": recipe} for part in value["parts"]]
        file.write_text(sealed(value | {"recipe": recipe, "parts": parts}))
        verdicts[limit] = bool(found(lambda: plan_findings(copied)))
    assert field in BEFORE_RENDERING
    assert verdicts == {1_000_001: False, 12: False, 11: True}


# files


def verdict(root, **options):
    """The report of all frames, after all digests are mended."""
    seal_again(root)
    return check(Dataset(root), sample=None, rays=False, **options)


def one_step(root, name):
    """Another pixel of one file of a channel, by the smallest step."""
    sample = Dataset(root)[5]
    array = np.array(sample.channels[name])
    where = tuple(int(i[0]) for i in np.nonzero(np.isfinite(array) & (array < 255 if name == "rgb" else array > 0)))
    array[where] = array[where] + 1 if np.issubdtype(array.dtype, np.integer) else np.nextafter(array[where], np.float32(9))
    (root / sample.files[name]).write_bytes(encode(channels()[name], array))


@pytest.mark.slow
@pytest.mark.parametrize("name", RECIPE["channels"])
def test_one_step_of_one_pixel_is_found(copied, name):
    """That of a picture by painting it again."""
    one_step(copied, name)
    report = verdict(copied)
    assert report.ok == (name in PASSES)
    if name in PASSES:
        assert "0 of 12 frames painted again" in report.verdict
        report = verdict(copied, repaint=None)
        assert [(finding.check, finding.frame) for finding in report.findings] == [("repaint", 5)]
        assert "12 of 12 frames painted again" in report.verdict


def texts(root):
    """The store's files that are no channel's and no manifest."""
    found = sorted(path for path in root.glob("store/**/*") if path.is_file() and path.suffix not in (".png", ".tiff"))
    return [path for path in found if path.name not in ("manifest.json", "lock", "skipped.json")]


def kinds(root):
    """One file of each kind of a store."""
    return {path.suffix if path.suffix != ".json" else path.name: path for path in texts(root)}


@pytest.mark.slow
def test_every_file_that_is_lost_or_damaged_is_found(whole, tmp_path):
    for name, path in kinds(whole).items():
        for change in (Path.unlink, _cut, _turn_bit):
            copied = shutil.copytree(whole, tmp_path / f"{change.__name__}-{name}")
            change(copied / path.relative_to(whole))
            assert found(lambda copied=copied: verdict(copied).findings), (name, change)
            shutil.rmtree(copied)


def _cut(path):
    path.write_bytes(path.read_bytes()[:-9])


def _turn_bit(path):
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 4
    path.write_bytes(data)


STRANGE = [
    "store/more.json", "store/models/more.txt", "store/models/{model}/more.png", "store/models/other/model.json",
    "store/shots/more", "store/shots/zz/more", "{shot}/more.json", "{shot}/rgb/00000099.png", "{shot}/rgb/00000000.jpg",
    "{shot}/flow/00000000.tiff", "{shot}/rgb.png", "store/simulated/ab/cd/more.json",
]  # fmt: skip


@pytest.mark.parametrize("name", STRANGE)
def test_files_that_nothing_names_are_found(copied, name):
    dataset = Dataset(copied)
    row = dataset.rows[0]
    shot = dataset.store.shot_folder(row.key).relative_to(copied).as_posix()
    file = copied / name.format(model=dataset.plan.models[0], shot=shot)
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(b"{}")
    seal_again(copied)
    findings = [*unclaimed(Dataset(copied)), *(message for _, message in differing(Dataset(copied), []))]
    assert any(file.name in message or file.parent.name in message for message in findings)


@pytest.mark.parametrize("kind", ["model", "shot", "stranger"])
def test_what_was_left_out_is_missing(copied, kind):
    dataset = Dataset(copied)
    key = {"model": dataset.plan.models[0], "shot": dataset.rows[2].key, "stranger": "nobody"}[kind]
    (copied / "store" / "skipped.json").write_text(json.dumps({key: "no triangles"}))
    sources = Sources(dataset, Recomputed(dataset))
    (message,) = left_out(dataset, sources, [])
    assert key in message


@pytest.mark.slow
def test_a_model_that_was_left_out_without_a_reason_is_found(copied):
    dataset = Dataset(copied)
    key = dataset.plan.models[0]
    for row in dataset.rows:
        if row.subject == key:
            shutil.rmtree(dataset.store.shot_folder(row.key))
    shutil.rmtree(dataset.store.model_folder(key))
    (copied / "store" / "skipped.json").write_text(json.dumps({key: "no triangles"}))
    assert "skipped" in {finding.check for finding in verdict(copied).findings}


@pytest.mark.slow
def test_what_contradicts_the_recipe_is_made_again(copied):
    """A model's true size, and the light of a shot; the bytes are then those of before."""
    dataset = Dataset(copied)
    model = dataset.store.model_folder(dataset.plan.models[0]) / "model.json"
    shot = dataset.store.shot_folder(dataset.rows[0].key) / "shot.json"
    before = [path.read_text() for path in (model, shot)]
    model.write_text(json.dumps(json.loads(before[0]) | {"real_size": [1.0, 2.0, 3.0]}))
    shot.write_text(json.dumps(json.loads(before[1]) | {"label_alpha": 0.5}))
    seal_again(copied)
    repaired = repair(copied, rays=False)
    assert repaired.report.ok, repaired.report.findings
    assert [path.read_text() for path in (model, shot)] == before


@pytest.mark.slow
def test_parts_that_were_appended_are_planned_and_painted_again(tmp_path):
    """Another model, then another viewpoint, then a channel of the frames that are there."""
    known = {"formats": [], "channels": ["rgb", "depth", "instances"], "splits": {"train": 1}}
    more = [{"source": "zoo:post_box", "category": "post box", "count": 3, "scale": {"length": 0.18}}]
    views = {"azimuth": [0, 60, 120, 240], "elevation": [15, 50], "distance": 1.0}
    generate(small_recipe(**known), tmp_path)
    for added in ({"models": more}, {"viewpoints": views}, {"channels": ["rgb", "depth", "instances", "normals", "rgba"]}):
        known |= added
        generate(small_recipe(**known), tmp_path, append=True)
    report = check(Dataset(tmp_path), repaint=None, rays=False)
    assert report.ok and set(report.not_run) == {"surface"}
    assert report.checked["plan"] == 4 and report.checked["repaint"] == 24


@pytest.mark.slow
def test_sequences_are_composed_and_painted_again(tmp_path):
    """Of a stereo rig that shakes around things that move; each frame is painted by itself."""
    generate(eventful_recipe(6), tmp_path)
    report = check(Dataset(tmp_path), repaint=3, rays=False)
    assert report.ok and set(report.not_run) == {"surface"}
    assert "3 of 24 frames painted again" in report.verdict


def test_a_verdict_names_every_proof_that_did_not_run():
    """The number of proofs that hold counts those that looked at anything."""
    whole = Report({"digests": 9, "depth": 3}, ())
    assert whole.verdict == "all proofs hold"
    some = Report({"digests": 9, "depth": 0}, (), not_run={"depth": "no frame has it", "surface": "install viewsphere[check]"})
    assert some.verdict == "1 proof holds, 2 not run: depth (no frame has it), surface (install viewsphere[check])"
    failed = Report({"digests": 9}, (Finding("digests", None, "a"),), coverage=((3, 12, "frames painted again"),))
    assert failed.verdict == "1 finding; 3 of 12 frames painted again"
