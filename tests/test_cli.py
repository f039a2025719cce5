"""The command line as a user meets it."""

import json
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

from command_line import viewsphere
from deadline import DEADLINE, until
from small import ROOT, small_recipe
from viewsphere import plugins


def fails(*words):
    """The one line a mistake gives; status 2."""
    run = viewsphere(*words)
    assert run.returncode == 2, run
    return run.stderr


def test_import_and_help_do_not_load_the_heavy_packages():
    code = (
        "import sys, viewsphere, viewsphere.cli.commands\n"
        "heavy = {'numba', 'trimesh', 'numpy', 'pydantic', 'PIL', 'scipy', 'yaml'} & set(sys.modules)\n"
        "print(sorted(heavy))"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"


def test_every_command_has_help():
    top = viewsphere("--help")
    assert top.returncode == 0
    names = [
        "new",
        "schema",
        "inspect",
        "plan",
        "preview",
        "render",
        "export",
        "check",
        "report",
        "view",
        "merge",
        "import",
        "convert",
    ]
    for name in names:
        assert f" {name} " in top.stdout
        assert viewsphere(name, "--help").returncode == 0


def test_new_plan_schema(tmp_path):
    assert viewsphere("new", tmp_path / "cars").returncode == 0
    recipe = tmp_path / "cars" / "recipe.yaml"
    plan = json.loads(viewsphere("plan", recipe, "--json").stdout)
    assert plan["frames"] == plan["models"] * plan["poses"] > 0
    assert "exists" in fails("new", tmp_path / "cars")
    assert json.loads(viewsphere("schema").stdout)["properties"]["models"]


@pytest.mark.parametrize(
    ("name", "poses", "frames"),
    [
        ("car", 2736, 273_600),
        ("bike", 108, 648),
        ("chair", 324, 1_944),
        ("boat", 651, 6_510),
        ("hairdryer", 60, 360),
    ],
)
def test_the_paper_s_plans(name, poses, frames):
    run = viewsphere("plan", ROOT / "recipes" / f"{name}_poses.yaml")
    assert f"{poses:,} poses = {frames:,} frames" in run.stdout


@pytest.mark.slow
def test_render_export_check_preview(tmp_path):
    recipe = tmp_path / "recipe.yaml"
    recipe.write_text(small_recipe(viewpoints={"azimuth": [0, 90], "elevation": [20], "distance": 1.0}).to_yaml())
    out = tmp_path / "out"
    command = [sys.executable, "-m", "viewsphere", "render", str(recipe), "-o", str(out), "--workers", "0", "--json"]
    run = subprocess.run(command, capture_output=True, text=True, timeout=DEADLINE)
    assert run.returncode == 0, run.stderr
    summary = json.loads(run.stdout)
    assert (summary["frames"], summary["rendered"], summary["skipped"]) == (4, 4, {})
    assert viewsphere("export", out, "--format", "coco").returncode == 0
    check = viewsphere("check", out)
    assert check.returncode == 0, check.stdout + check.stderr
    assert viewsphere("preview", out, "-o", tmp_path / "sheet.png", "--draw", "boxes", "--draw", "boxes3d").returncode == 0
    sheet = np.asarray(Image.open(tmp_path / "sheet.png"))
    assert sheet.ndim == 3
    assert len(np.unique(sheet.reshape(-1, 3), axis=0)) > 50
    next((out / "store" / "shots").glob("*/*/depth/*.tiff")).write_bytes(b"x")
    assert viewsphere("check", out).returncode == 1


def test_preview_of_a_recipe_draws_everything(tmp_path):
    recipe = tmp_path / "recipe.yaml"
    recipe.write_text(small_recipe().to_yaml())
    words = [w for d in ("boxes", "boxes3d", "masks", "depth") for w in ("--draw", d)]
    assert viewsphere("preview", recipe, "-o", tmp_path / "sheet.png", "-n", 3, *words).returncode == 0
    assert Image.open(tmp_path / "sheet.png").width > 96 * 2


def test_inspect(tmp_path):
    run = viewsphere("inspect", "zoo:hair_drier", "-o", tmp_path / "sides.png", "--json")
    assert run.returncode == 0, run.stderr
    report = json.loads(run.stdout)
    assert report["triangles"] > 100
    assert len(report["size"]) == 3
    assert Image.open(tmp_path / "sides.png").width > 4 * 300


def test_inspect_shows_rigs(tmp_path):
    recipe = tmp_path / "two.yaml"
    recipe.write_text(
        "models: [{source: gone.glb, category: car}]\nviewpoints: {distance: 4}\nrig: {kind: stereo, baseline: 0.2}\n"
    )
    run = viewsphere("inspect", "--rig", recipe, "-o", tmp_path / "rig.png")
    assert run.returncode == 0, run.stderr
    assert "left (blue)" in run.stdout and "baseline 0.2 m" in run.stdout
    assert Image.open(tmp_path / "rig.png").width > 4 * 300 and (tmp_path / "rig.glb").read_bytes()[:4] == b"glTF"
    run = viewsphere(
        "inspect", "--rig", recipe, "-o", tmp_path / "rig.png", "--json", "--set", "rig={kind: surround, count: 3}"
    )
    told = json.loads(run.stdout)
    assert [sensor["name"] for sensor in told["sensors"]] == ["camera0", "camera1", "camera2"] and told["rectified"] == []
    assert fails("inspect", "zoo:car", "--rig", recipe).count("\n") == 1


def test_mistakes_are_one_line_and_status_2(tmp_path):
    (tmp_path / "typo.yaml").write_text("name: x\nmodels:\n  - source: zoo:car\n    categry: car\n")
    line = fails("plan", tmp_path / "typo.yaml")
    assert "typo.yaml:4" in line
    assert "category" in line
    assert "gone.yaml" in fails("render", tmp_path / "gone.yaml", "-o", tmp_path / "out")
    assert "data set" in fails("check", tmp_path)
    assert "data set" in fails("export", tmp_path, "-f", "coco")
    assert fails("inspect", tmp_path / "gone.glb").count("\n") == 1
    assert "spaceship" in fails("inspect", "zoo:spaceship")
    bad = small_recipe(models=[{"source": "zoo:spaceship", "category": "ship", "count": 2}])
    (tmp_path / "ship.yaml").write_text(bad.to_yaml())
    assert "spaceship" in fails("render", tmp_path / "ship.yaml", "-o", tmp_path / "out")


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="POSIX signals")
def test_ctrl_c_keeps_what_is_finished(tmp_path):
    import os
    import signal

    recipe = tmp_path / "recipe.yaml"
    grid = {
        "azimuth": {"start": 0, "stop": 360, "step": 2},
        "elevation": {"start": 0, "stop": 80, "step": 5},
        "distance": 1.0,
    }
    recipe.write_text(small_recipe(viewpoints=grid, channels=["rgb"], formats=[]).to_yaml())
    out = tmp_path / "out"
    run = subprocess.Popen(
        [sys.executable, "-m", "viewsphere", "render", str(recipe), "-o", str(out), "--workers", "2"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        # a job in the background inherits an ignored SIGINT
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # noqa: PLW1509
    )
    assert until(lambda: any((out / "store" / "shots").glob("*/*")))
    os.killpg(run.pid, signal.SIGINT)
    _, err = run.communicate(timeout=DEADLINE)
    assert run.returncode == 130
    assert "are kept" in err
    assert "Traceback" not in err


def test_a_part_is_exported_beside_the_data_set(small_run, tmp_path):
    run = viewsphere("export", small_run, "-f", "native", "--frames", "0-2", "-o", "part", cwd=tmp_path)
    assert run.returncode == 0 and "wrote part/native" in run.stdout
    assert len(list((tmp_path / "part" / "native").rglob("RGB/*.png"))) == 3
    assert "--output: expected another folder" in fails("export", small_run, "-f", "native", "--models", "*_000")
    for option, wrong in (("--frames", "x"), ("--frames", ","), ("--models", ",")):
        assert f"{option}: expected" in fails("export", small_run, "-f", "native", option, wrong, "-o", tmp_path / "b" / "c")
    assert not (tmp_path / "b").exists()


def test_an_export_to_no_format_is_a_mistake(small_run):
    assert f"expected one or more of {', '.join(plugins.names('formats'))}" in fails("export", small_run, "-f", ",")


def test_what_libraries_print_while_rendering_is_not_in_the_json(monkeypatch, tmp_path):
    from viewsphere.run import generate

    def chatty(*values, export=generate.export, **options):
        print("hello")
        return export(*values, **options)

    monkeypatch.setattr(generate, "export", chatty)
    (tmp_path / "recipe.yaml").write_text(small_recipe(formats=[]).model_dump_json(exclude_unset=True))
    run = viewsphere("render", tmp_path / "recipe.yaml", "-o", tmp_path / "out", "--workers", "0", "--json")
    assert json.loads(run.stdout)["frames"] == 12
    assert run.stderr == "hello\n"
