"""Licences of models, from a recipe to CREDITS.md and the exports: resumed, appended, merged, imported, checked and mended."""

import json
import shutil

import pytest
from markdown_it import MarkdownIt

from animated import let_walk
from command_line import viewsphere
from small import small_recipe, tree_hash
from viewsphere import Dataset, generate
from viewsphere.check import check
from viewsphere.check.repair import repair
from viewsphere.model.credit import Credit
from viewsphere.run.datasets.importing import import_dataset
from viewsphere.run.datasets.merging import merge
from viewsphere.store.credits import CREDITS, credits_text

MAKER = Credit(licence="CC-BY-4.0", attribution="A <b>Maker</b> | *& co* [x](y) `z`", source_url="https://example.org/a_b*c")


@pytest.fixture(scope="module")
def folder(tmp_path_factory, small_run):
    """A folder with two models."""
    folder = tmp_path_factory.mktemp("models")
    for name in ("post_box_000", "post_box_001"):
        shutil.copy(small_run / "store" / "models" / name / f"{name}.glb", folder / f"{name[-1]}.glb")
    return folder


def recipe(folder, source="*.glb", credit=None, **changes):
    said = credit.model_dump(exclude_none=True) if credit else {}
    models = [{"source": str(folder / source), "category": "post box", "scale": {"length": 0.18}, **said}]
    values = {"models": models, "channels": ["rgb", "depth", "instances"], "shot_frames": 6, "splits": {"train": 1}}
    return small_recipe(**values | changes)


def credits_of(root):
    return {info.key: info.credit for info in Dataset(root).models}


def cells(text):
    """The rows of a text's table as an independent reader shows them, HTML and links named."""
    tokens = MarkdownIt("commonmark").enable("table").parse(text)
    shown = []
    for token in tokens:
        if token.type == "tr_open":
            shown.append([])
        elif token.type == "inline" and shown:
            shown[-1].append("".join(c.content if c.type == "text" else f"{{{c.type}}}" for c in token.children))
    return shown[1:]


@pytest.fixture(scope="module")
def licensed(folder, tmp_path_factory):
    out = tmp_path_factory.mktemp("licensed") / "out"
    generate(recipe(folder, credit=MAKER), out)
    return out


def test_a_credit_is_shown_as_it_was_written(licensed):
    link = f"{{link_open}}{MAKER.source_url}{{link_close}}"
    assert cells((licensed / CREDITS).read_text("utf-8")) == [[MAKER.licence, MAKER.attribution, link, "0, 1"]]


def test_coco_has_licences_by_id_and_native_the_credit_of_each_model(licensed):
    value = json.loads((licensed / "coco" / "annotations" / "instances_train.json").read_text("utf-8"))
    assert value["licenses"] == [{"id": 1, "name": MAKER.licence, "url": ""}]
    (credit,) = value["info"]["credits"]
    assert credit == {"models": ["0", "1"], "license": 1, **MAKER.model_dump()}
    vehicles = json.loads((licensed / "native" / "dataset1.json").read_text("utf-8"))["vehicles"]
    assert vehicles == value["models"]
    assert [vehicle["credit"] for vehicle in vehicles.values()] == [MAKER.model_dump()] * 2
    assert check(Dataset(licensed), rays=False).ok


def test_without_a_credit_nothing_is_said(folder, tmp_path):
    generate(recipe(folder), tmp_path / "out")
    assert not (tmp_path / "out" / CREDITS).exists()
    value = json.loads((tmp_path / "out" / "coco" / "annotations" / "instances_train.json").read_text("utf-8"))
    assert value["licenses"] == [] and "credits" not in value["info"]
    models = (tmp_path / "out" / "store" / "models").glob("*/model.json")
    assert [("credit" in json.loads(file.read_text("utf-8"))) for file in models] == [False, False]


@pytest.mark.slow
def test_a_credit_said_later_is_written_without_rendering(folder, licensed, tmp_path):
    generate(recipe(folder), tmp_path / "out")
    before = tree_hash(tmp_path / "out" / "store" / "shots")
    assert generate(recipe(folder, credit=MAKER), tmp_path / "out").rendered == 0
    assert tree_hash(tmp_path / "out" / "store" / "shots") == before
    for part in (CREDITS, "coco/annotations/instances_train.json", "native/dataset1.json", "store/models/0/model.json"):
        assert (tmp_path / "out" / part).read_bytes() == (licensed / part).read_bytes()
    assert check(Dataset(tmp_path / "out"), rays=False).ok
    assert generate(recipe(folder), tmp_path / "out").rendered == 0  # what is not said any more stays
    assert credits_of(tmp_path / "out") == {"0": MAKER, "1": MAKER}


@pytest.mark.slow
def test_other_credits_renew_all_exports_that_name_them_and_no_other(folder, tmp_path):
    out, formats = tmp_path / "out", ["coco", "native", "csv"]
    generate(recipe(folder, credit=Credit(licence="CC0-1.0")), out, formats=formats)
    kept = ("store/shots", "csv")
    before = [tree_hash(out / part) for part in kept], (out / "csv").stat().st_ino
    again = generate(recipe(folder, credit=MAKER), out, formats=["coco"])
    assert again.rendered == 0 and again.formats == ("coco", "native")
    assert ([tree_hash(out / part) for part in kept], (out / "csv").stat().st_ino) == before
    assert cells((out / CREDITS).read_text("utf-8"))[0][0] == MAKER.licence
    for file in ("coco/annotations/instances_train.json", "native/dataset1.json"):
        said = json.loads((out / file).read_text("utf-8"))
        found = said["models"] if "models" in said else said["vehicles"]
        assert [vehicle["credit"] for vehicle in found.values()] == [MAKER.model_dump()] * 2
    assert check(Dataset(out), rays=False).ok
    assert generate(recipe(folder, credit=MAKER), out, formats=["coco"]).formats == ("coco",)


@pytest.mark.slow
def test_a_run_that_ends_before_its_exports_leaves_other_credits_to_the_next(folder, tmp_path, monkeypatch):
    out = tmp_path / "out"
    generate(recipe(folder), out, formats=["native"])
    with monkeypatch.context() as changed:
        changed.setattr("viewsphere.run.generate.export", lambda *args, **more: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            generate(recipe(folder, credit=MAKER), out, formats=["coco"])
    assert "credit" not in (out / "native" / "dataset1.json").read_text("utf-8")
    generate(recipe(folder, credit=MAKER), out, formats=["coco"])
    assert MAKER.licence in (out / "native" / "dataset1.json").read_text("utf-8")
    assert check(Dataset(out), rays=False).ok


@pytest.mark.slow
def test_appended_and_merged_models_keep_their_credits(folder, tmp_path):
    other = Credit(licence="CC0-1.0")
    generate(recipe(folder, "0.glb"), tmp_path / "a")
    generate(recipe(folder, "1.glb", other), tmp_path / "a", append=True)
    assert credits_of(tmp_path / "a") == {"0": None, "1": other}
    generate(recipe(folder, "0.glb", MAKER), tmp_path / "b")
    merge([tmp_path / "a", tmp_path / "b"], tmp_path / "c")
    assert credits_of(tmp_path / "c") == {"0": MAKER, "1": other}
    rows = cells((tmp_path / "c" / CREDITS).read_text("utf-8"))
    assert [(row[0], row[-1]) for row in rows] == [(MAKER.licence, "0"), (other.licence, "1")]


def test_native_s_credits_are_imported(licensed, tmp_path):
    import_dataset("native", licensed / "native", tmp_path / "out")
    assert credits_of(tmp_path / "out") == {"0": MAKER, "1": MAKER}
    assert (tmp_path / "out" / CREDITS).read_bytes() == (licensed / CREDITS).read_bytes()


@pytest.mark.slow
@pytest.mark.parametrize("spoil", [lambda file: file.unlink(), lambda file: file.write_text("| mine |")])
def test_check_proves_the_file_and_repair_writes_it_again(spoil, licensed, tmp_path):
    out = shutil.copytree(licensed, tmp_path / "out")
    spoil(out / CREDITS)
    (finding,) = check(Dataset(out), rays=False).findings
    assert finding.check == "credits" and CREDITS in finding.message
    mended = repair(out, rays=False)
    assert mended.report.ok and mended.done == (f"{CREDITS}: written again",)
    assert (out / CREDITS).read_bytes() == (licensed / CREDITS).read_bytes()


@pytest.mark.slow
def test_a_damaged_model_is_mended_with_the_credit_that_was_said_later(folder, tmp_path):
    generate(recipe(folder), tmp_path / "out")
    generate(recipe(folder, credit=MAKER), tmp_path / "out")
    (tmp_path / "out" / "store" / "models" / "0" / "0.obj").unlink()
    mended = repair(tmp_path / "out", rays=False)
    assert mended.report.ok, mended.report.findings
    assert credits_of(tmp_path / "out")["0"] == MAKER


def test_models_without_one_are_listed_beside_those_that_have_one(licensed):
    first, second = Dataset(licensed).models
    first.__dict__["credit"] = None
    assert [row[0] for row in cells(credits_text([first, second]))] == ["not known", MAKER.licence]
    assert credits_text([first]) == ""


def test_plan_notes_it_and_succeeds(folder, tmp_path):
    file = tmp_path / "recipe.yaml"
    file.write_text(recipe(folder).to_yaml())
    told = viewsphere("plan", file)
    assert told.returncode == 0 and told.stdout.count("note: 2 models have no licence (0, 1). ") == 1
    assert json.loads(viewsphere("plan", file, "--json").stdout)["notes"][0].startswith("2 models have no licence")
    file.write_text(recipe(folder, credit=MAKER).to_yaml())
    assert "note" not in viewsphere("plan", file).stdout


@pytest.mark.slow
def test_a_model_that_deforms_is_credited_once_and_so_are_its_time_steps(tmp_path, monkeypatch):
    let_walk(monkeypatch, tmp_path)
    walker = {"source": str(tmp_path / "walker.fbx"), "category": "person", "frames": [1, 13], **MAKER.model_dump()}
    out = tmp_path / "out"
    views = {"azimuth": 20, "elevation": 20, "distance": 3}
    generate(recipe(tmp_path, models=[walker], viewpoints=views, formats=["coco"]), out)
    assert credits_of(out) == dict.fromkeys(["walker", "walker-f0001", "walker-f0013"], MAKER)
    assert [row[-1] for row in cells((out / CREDITS).read_text("utf-8"))] == ["walker"]
    value = json.loads((out / "coco" / "annotations" / "instances_train.json").read_text("utf-8"))
    assert value["info"]["credits"][0]["models"] == ["walker"]
    assert check(Dataset(out), rays=False).ok
