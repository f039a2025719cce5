"""`viewsphere doctor`, with and without Blender."""

from __future__ import annotations

import json
import sys

import pytest
from fake_blender import LACKING, blind_blender, fake_blender, with_modules, without_blender
from typer.testing import CliRunner

from viewsphere.blender import environment
from viewsphere.blender.interpreter import VARIABLE
from viewsphere.cli.commands import app


def doctor(*words):
    run = CliRunner().invoke(app, ["doctor", *words])
    assert run.exit_code == 0, run.output
    return run


@pytest.mark.slow
def test_a_machine_where_all_works(tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(fake_blender(tmp_path)))
    said = doctor().stdout
    for word in (
        "viewsphere ",
        sys.executable,
        "cores",
        "kernels",
        "[codecs]",
        f"9.8.7, {tmp_path}",
        "CUDA: A card",
        "EEVEE, Workbench: drawn by A driver",
    ):
        assert word in said
    told = json.loads(doctor("--json").stdout)
    assert told["blender"]["problem"] is None
    assert told["blender"]["devices"][0] == {"kind": "CPU", "name": "A processor"}
    assert told["blender"]["graphics"] == {"driver": "A driver", "problem": None}
    assert told["processor"]["cores"] >= 1
    assert told["kernels"]["target"] and told["kernels"]["numba"] and told["kernels"]["llvmlite"]
    assert {extra["name"] for extra in told["extras"]} >= {"check", "codecs"}
    assert all((extra["install"] is None) == (None not in extra["packages"].values()) for extra in told["extras"])


@pytest.mark.slow
def test_a_machine_without_blender(tmp_path, monkeypatch):
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    monkeypatch.setattr(environment, "home", lambda: tmp_path)
    assert "found none: pip install 'viewsphere[blender]' in Python 3.11" in doctor().stdout
    assert json.loads(doctor("--json").stdout)["blender"]["python"] is None


@pytest.mark.slow
def test_a_machine_that_cannot_draw(tmp_path, monkeypatch):
    """Blender dies of it, and all else is told."""
    monkeypatch.setenv(VARIABLE, str(blind_blender(tmp_path)))
    said = doctor().stdout
    assert "9.8.7" in said and "CPU: A processor" in said
    (line,) = (line for line in said.splitlines() if "EEVEE, Workbench: cannot draw here, Blender died" in line)
    assert "apt-get install libegl1 libgl1-mesa-dri" in line and "its log" not in line


@pytest.mark.slow
def test_an_interpreter_that_lacks_bpy(tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(without_blender(tmp_path)))
    assert f"does not work, {tmp_path / 'python'}: it has no bpy: pip install" in doctor().stdout


@pytest.mark.slow
def test_a_system_that_lacks_a_library(tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(with_modules(tmp_path, {"bpy": LACKING})))
    said = doctor().stdout
    assert "the system lacks libXi.so.6" in said
    assert "on Debian and Ubuntu: apt-get install libxi6" in said
    assert json.loads(doctor("--json").stdout)["blender"]["missing"] == [{"library": "libXi.so.6", "package": "libxi6"}]


def test_a_cache_that_cannot_be_written(tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(without_blender(tmp_path)))
    (tmp_path / "file").touch()
    monkeypatch.setenv("VIEWSPHERE_CACHE", str(tmp_path / "file" / "cache"))
    kernels = json.loads(doctor("--json").stdout)["kernels"]
    assert (kernels["writable"], kernels["compiled"]) == (False, False)
    assert "set VIEWSPHERE_CACHE" in doctor().stdout


@pytest.mark.slow
def test_speed_is_measured_in_a_second_once_kernels_are_there(monkeypatch):
    from viewsphere.run.estimate import REFERENCE_MS, measure_speed, speed_recipe
    from viewsphere.run.shots import precompile as warm

    monkeypatch.setattr("viewsphere.run.estimate.is_precompiled", lambda shot: False)
    assert measure_speed() is None
    assert "speed        not measured" in doctor().stdout
    monkeypatch.setattr("viewsphere.run.estimate.is_precompiled", lambda shot: True)
    monkeypatch.setattr("viewsphere.run.estimate.render", lambda recipe: iter(range(5)))
    clock = iter([0.0, 0.020, 0.050, 0.070, 0.090])
    monkeypatch.setattr("time.process_time", lambda: next(clock))
    found = measure_speed()
    assert found is not None and found.frame_ms == pytest.approx(20)
    assert found.relative == pytest.approx(REFERENCE_MS / 20)
    assert warm.sketched(speed_recipe()).objects


@pytest.mark.slow
def test_setting_up_says_each_step_and_only_once(tmp_path, monkeypatch):
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    monkeypatch.setattr(environment, "home", lambda: tmp_path / "env")

    def make(listener):
        listener("making")
        (tmp_path / "env" / "bin").mkdir(parents=True)
        fake_blender(tmp_path).rename(environment.interpreter_of(tmp_path / "env"))

    monkeypatch.setattr(environment, "make_environment", make)
    first, second = doctor("--setup-blender"), doctor("--setup-blender")
    assert "making" in first.stderr
    assert "making" not in second.stderr
    assert "9.8.7" in first.stdout and "9.8.7" in second.stdout
