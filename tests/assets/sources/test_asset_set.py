"""Sets of models in a folder: which models there are follows from names alone, and no folder does harm."""

from __future__ import annotations

import gzip
import json
import os
import re
import time

import pytest
from typer.testing import CliRunner

from asset_trees import planned, pointer, put
from scratch import scratch_cache
from viewsphere import Recipe, generate
from viewsphere.assets.cache import load
from viewsphere.cli.commands import app
from viewsphere.errors import ModelError, RecipeError, UserError
from viewsphere.planning.models import model_specs

MUG, CAN = "025_mug", "002_master_chef_can"


@pytest.fixture
def shelf(tmp_path, monkeypatch):
    """A folder of two models in YCB's layout."""
    scratch_cache(monkeypatch, tmp_path / "cache")
    for name in (MUG, CAN):
        put(tmp_path / "shelf" / name / "google_16k" / "textured.obj", pointer("+z", "-y", 0.1))
    return tmp_path / "shelf"


def test_a_folder_a_model_in_it_and_a_relative_path_name_the_same_models(shelf, tmp_path, monkeypatch):
    both = planned(f"ycb:{shelf}").model_specs
    assert [spec.key for spec in both] == [CAN, MUG]
    (alone,) = planned(f"ycb:{shelf}/{MUG}").model_specs
    assert (alone.key, alone.source, alone.category) == (both[1].key, both[1].source, "mug")
    assert planned("ycb:shelf", folder=tmp_path).model_specs == both
    put(tmp_path / "base" / "base.yaml", "models: [{source: ycb:../shelf}]\nviewpoints: {distance: 3}\n")
    recipe = put(tmp_path / "lit" / "lit.yaml", "extends: ../base/base.yaml\n")
    assert [spec.key for spec in model_specs(Recipe.load(recipe))] == [CAN, MUG]
    monkeypatch.setenv("HOME", str(tmp_path))
    assert planned("ycb:~/shelf", folder=tmp_path / "lit").model_specs == both


def test_an_entry_overrides_what_the_set_says(shelf):
    (spec, _) = planned(f"ycb:{shelf}", category="thing", up="+y", forward="+z", unit="mm", name="a").model_specs
    assert (spec.key, spec.category, spec.up, spec.forward, spec.unit) == (f"a_{CAN}", "thing", "+y", "+z", 0.001)


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("gso:{}", r"expected Google Scanned Objects \(<model>/meshes/model\.obj\) in .*; found 002_master_chef_can, 025_mug$"),
        ("ycb:{}/none", r"expected the YCB object set \(.*\) in .*none; found no such folder$"),
        ("ycb:{}/../cache", r"found an empty folder$"),
        ("ycb:", "expected the name of a model after 'ycb:'; found none"),
    ],
)
def test_a_folder_of_another_layout_is_an_error_of_one_line(shelf, source, message):
    (shelf.parent / "cache").mkdir()
    with pytest.raises(RecipeError, match=message) as raised:
        planned(source.format(shelf))
    assert "\n" not in str(raised.value)


def test_broken_models_are_left_out_of_plans_and_of_data_sets(shelf, tmp_path):
    (shelf / "011_banana").mkdir()
    put(shelf / "013_apple" / "google_16k" / "textured.obj", "v 0 0 zero\n")
    plan = planned(f"ycb:{shelf}")
    assert [spec.key for spec in plan.model_specs] == [CAN, "013_apple", MUG]
    (line,) = [line for line in plan.warnings if "left out" in line]
    assert "ycb: 1 model of 4 left out, e.g. 011_banana: no google_16k/textured.obj" in line
    summary = generate(plan.recipe, tmp_path / "out", formats=[])
    assert summary.frames == 2 and [*summary.skipped] == ["013_apple"] and "textured.obj" in summary.skipped["013_apple"]
    assert "YCB object and model set (Calli et al. 2015)" in (tmp_path / "out" / "CREDITS.md").read_text()


def test_a_set_of_broken_models_only_is_an_error(tmp_path):
    (tmp_path / "011_banana").mkdir()
    with pytest.raises(RecipeError, match=r"ycb: none of 1 model can be used. The first, .*011_banana: no google_16k"):
        planned(f"ycb:{tmp_path}")


def test_count_draws_some_models_which_other_models_do_not_change(shelf):
    for number in range(3, 40):
        put(shelf / f"{number:03d}_cup" / "textured.obj", pointer("+z", "-y"))
    chosen = {spec.key for spec in planned(f"ycb:{shelf}", count=9).model_specs}
    assert len(chosen) == 9 and chosen == {spec.key for spec in planned(f"ycb:{shelf}", count=9).model_specs}
    put(shelf / "077_rope" / "textured.obj", pointer("+z", "-y"))
    assert len(chosen - {spec.key for spec in planned(f"ycb:{shelf}", count=9).model_specs}) <= 1
    with pytest.raises(RecipeError, match=r"count: expected at most 40, the number of models; found 41"):
        planned(f"ycb:{shelf}", count=41)


def test_a_link_out_of_the_set_is_read_only_where_the_recipe_allows_it(shelf, tmp_path):
    outside = put(tmp_path / "outside" / "textured.obj", pointer("+z", "-y"))
    (shelf / "011_banana").symlink_to(outside.parent)
    (spec,) = planned(f"ycb:{shelf}/011_banana").model_specs
    with pytest.raises(ModelError, match=r"011_banana/textured\.obj: leads out of .*shelf\. Copy the model, or set `confined"):
        load(spec)
    assert len(load(planned(f"ycb:{shelf}/011_banana", confined=False).model_specs[0])[0].triangles)
    (tmp_path / "linked").symlink_to(shelf)
    assert load(planned(f"ycb:{tmp_path}/linked/{MUG}").model_specs[0])[1].files


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs POSIX")
def test_pipes_devices_circles_and_names_that_are_no_text_are_broken_models(shelf):
    for number, name in enumerate(("pipe", "device", "circle")):
        (shelf / f"{number:03d}_{name}").mkdir()
    os.mkfifo(shelf / "000_pipe" / "textured.obj")
    (shelf / "001_device" / "textured.obj").symlink_to("/dev/zero")
    (shelf / "002_circle" / "textured.obj").symlink_to("textured.obj")
    (shelf / "003_up").symlink_to("..")
    put(shelf / "004_bell\a\x1b[2J" / "textured.obj", pointer("+z", "-y"))
    (shelf / os.fsdecode(b"005_\xff")).mkdir()
    plan = planned(f"ycb:{shelf}")
    assert [spec.key for spec in plan.model_specs] == [CAN, MUG]
    assert any("6 models of 8 left out" in line and line.isprintable() for line in plan.warnings)


def test_a_folder_of_too_many_entries_is_an_error(shelf, monkeypatch):
    monkeypatch.setenv("VIEWSPHERE_MAX_ENTRIES", "1")
    with pytest.raises(RecipeError, match=r"holds more than 1 entries \(limit MAX_ENTRIES\)"):
        planned(f"ycb:{shelf}")


@pytest.mark.slow
def test_a_hundred_thousand_folders_that_are_no_models_are_passed_over(shelf):
    for number in range(100_000):
        (shelf / f"{number}").mkdir()
    start = time.process_time()
    assert planned(f"ycb:{shelf}").models == 2
    assert time.process_time() - start < 10  # 1 s on a machine of its own


def test_inspect_counts_a_set_shows_some_of_it_and_names_broken_models(shelf, tmp_path, monkeypatch):
    (shelf / "011_banana").mkdir()
    put(shelf / "013_apple" / "google_16k" / "textured.obj", "v 0 0 zero\n")
    monkeypatch.chdir(tmp_path)
    run = CliRunner().invoke(app, ["inspect", "ycb:shelf"])
    assert run.exit_code == 0, run.output
    assert "models     4, of which 2 cannot be used" in run.stdout and "2 of them: ycb-shelf-models.png" in run.stdout
    assert "broken     011_banana: no google_16k/textured.obj" in run.stdout and "mug: 1 model" in run.stdout
    assert (tmp_path / "ycb-shelf-models.png").stat().st_size > 1000
    report = json.loads(CliRunner().invoke(app, ["inspect", "ycb:shelf", "--json"]).stdout)
    assert report["models"] == 4 and report["shown"] == [CAN, MUG] and sorted(report["faults"]) == ["011_banana", "013_apple"]
    run = CliRunner().invoke(app, ["inspect", f"ycb:./cache/../shelf/{MUG}"])
    assert run.exit_code == 0 and re.search(r"axes +up \+z, forward -y; 1 unit = 1 m", run.stdout), run.output


def test_a_link_in_a_circle_hides_no_model_and_a_folder_that_cannot_be_listed_is_reported(tmp_path):
    cars = tmp_path / "02958343"
    put(cars / "a" / "model.obj", pointer("+y", "+x"))
    (cars / "loop").symlink_to("loop")
    (tmp_path / "03001627").symlink_to("03001627")
    plan = planned(f"shapenet:{tmp_path}")
    assert [spec.key for spec in plan.model_specs] == ["02958343_a"]
    assert any("shapenet: 2 models of 3 left out" in line for line in plan.warnings)
    with pytest.raises(RecipeError, match=r"03001627: the folder cannot be listed: Too many .*links.*\. Make it readable"):
        planned(f"shapenet:{tmp_path}/03001627")


NESTED = b"[" * 100_000
DAMAGED = gzip.compress(b"{}", mtime=0)[:10] + b"\xff" * 40  # a block of a kind that does not exist


@pytest.mark.parametrize(
    "content", [NESTED, gzip.compress(NESTED, mtime=0), DAMAGED, b"{", b"3", gzip.compress(b"[3]", mtime=0), b""], ids=range(7)
)
def test_damaged_metadata_is_like_none(tmp_path, content):
    glb = "3dmodels/original/a/a.glb"
    sets = {
        "shapenet": ("02958343/a/model.obj", ["taxonomy.json", "all.csv"]),
        "abo": (glb, ["listings/metadata/listings_0.json", "listings/metadata/listings_1.json.gz"]),
        "objaverse": ("glbs/0/a.glb", ["lvis-annotations.json.gz", "annotations.json", "metadata/0.json.gz"]),
        "partnet": ("7/mobility.urdf", ["7/meta.json", "7/semantics.txt"]),
        "gso": ("a/meshes/model.obj", ["a/metadata.pbtxt"]),
        "thingi10k": ("raw_meshes/1.stl", ["metadata/input_summary.csv"]),
    }
    for name, (model, files) in sets.items():
        put(tmp_path / name / model, "")
        for file in files:
            put(tmp_path / name / file, "").write_bytes(content)
        (spec,) = planned(f"{name}:{tmp_path}/{name}").model_specs
        assert spec.category == {"shapenet": "car", "gso": "a"}.get(name, "object")


def test_metadata_that_a_link_leads_out_of_the_set_is_not_read(tmp_path):
    outside = put(tmp_path / "outside.pbtxt", 'categories { first: "Secret" }')
    put(tmp_path / "gso" / "x" / "meshes" / "model.obj", "")
    (tmp_path / "gso" / "x" / "metadata.pbtxt").symlink_to(outside)
    assert planned(f"gso:{tmp_path}/gso").model_specs[0].category == "x"
    inside = put(tmp_path / "gso" / "shared.pbtxt", 'categories { first: "Shoe" }')
    put(tmp_path / "gso" / "y" / "meshes" / "model.obj", "")
    (tmp_path / "gso" / "y" / "metadata.pbtxt").symlink_to(inside)
    assert [spec.category for spec in planned(f"gso:{tmp_path}/gso").model_specs] == ["x", "shoe"]
    secret = put(tmp_path / "taxonomy.json", json.dumps([{"synsetId": "99999999", "name": "secret"}]))
    put(tmp_path / "shapenet" / "99999999" / "a" / "model.obj", "")
    (tmp_path / "shapenet" / "taxonomy.json").symlink_to(secret)
    assert planned(f"shapenet:{tmp_path}/shapenet").model_specs[0].category == "99999999"


@pytest.mark.parametrize("source", ["gso:~nouser/x", "~nouser/x.obj"])
def test_the_home_of_an_unknown_user_is_an_error_of_one_line(source):
    with pytest.raises(UserError, match=r"~nouser names no user with a home folder\. Write the whole path"):
        planned(source, category="thing")


def test_a_null_byte_in_a_name_is_an_error_of_one_line(tmp_path):
    with pytest.raises(RecipeError, match="null byte"):
        planned("ycb:a\0b", folder=tmp_path)


def test_models_of_one_key_in_a_set_get_different_keys(tmp_path):
    for file in ("13.obj", "13.off"):
        put(tmp_path / "thingi10k" / "raw_meshes" / file, "")
    for split in ("train", "test"):
        put(tmp_path / "modelnet" / "chair" / split / "chair_1.off", "")
    for file in ("x.GLB", "x.glb", "X.glb"):
        put(tmp_path / "objaverse" / file, "")

    def keys(name: str) -> list[str]:
        return [spec.key for spec in planned(f"{name}:{tmp_path}/{name}").model_specs]

    assert keys("thingi10k") == ["13-obj", "13-off"]
    assert keys("modelnet") == ["chair_1-train", "chair_1-test"]
    if len(list((tmp_path / "objaverse").iterdir())) == 3:
        assert keys("objaverse") == ["X", "x-2", "x-3"]


def test_numbers_in_names_of_a_set_are_ascii_digits(tmp_path):
    wide = "\uff10\uff10\uff10\uff10\uff10\uff11"
    put(tmp_path / "lm" / "models" / f"obj_{wide}.ply", "")
    put(tmp_path / "lm" / "models" / "obj_000002.ply", "")
    assert [spec.key for spec in planned(f"bop:{tmp_path}/lm").model_specs] == ["lm_obj_000002"]
    put(tmp_path / "partnet" / "\u0661" / "mobility.urdf", "")
    put(tmp_path / "partnet" / "2" / "mobility.urdf", "")
    assert [spec.key for spec in planned(f"partnet:{tmp_path}/partnet").model_specs] == ["2"]
