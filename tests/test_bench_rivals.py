"""benchmarks/bench --rivals: its table and figures, rivals that fail, and the car of one real rival beside ours."""

import json
import os
import sys
from pathlib import Path

import pytest

from small import ROOT

sys.path.insert(0, str(ROOT / "benchmarks"))
import bench_rivals
from bench_rivals import OURS, Rival, RivalFailedError, Row, installed, last_line, measured, table

RIVALS = str(ROOT / "benchmarks" / "rivals")
LOOP = f"import sys\nsys.path.insert(0, {RIVALS!r})\nfrom view_loop import opened\nscene = opened()\n"
DRAWS = LOOP + (
    "import numpy\n"
    "scene.ready('Fake 1.0', 'two greys')\n"
    "for view in scene.views():\n"
    "    picture = numpy.zeros((2, 3), numpy.uint8)\n"
    "    picture[0] = 7\n"
    "    scene.keep(view, picture)\n"
    "scene.finish()\n"
)


@pytest.fixture
def scripts(tmp_path, monkeypatch):
    """A folder for rivals' scripts, which this Python runs, with a scene of 3 x 2 pixels."""
    monkeypatch.setattr(bench_rivals, "SCRIPTS", tmp_path)
    monkeypatch.setattr(bench_rivals, "installed", lambda rival, cache: Path(sys.executable))
    (tmp_path / "scene.json").write_text(json.dumps({"width": 3, "height": 2, "views": [0] * 5}))
    return tmp_path


def test_table_sorts_by_rate_and_ends_with_problems():
    rows = [
        Row("viewsphere", "ours 1", "everything", (0.05, 0.04, 0.06)),
        Row("vtk", problem="no | wheel"),
        Row("open3d", "Open3D 2", "ids", (0.025, 0.025, 0.9)),
    ]
    assert table(rows)[2:] == [
        "| Open3D 2 | 40 | 2 | ids |",
        "| ours 1 | 20 | 1 | everything |",
        "| vtk | | | not measured: no / wheel |",
    ]
    assert table(rows[2:])[2] == "| Open3D 2 | 40 |  | ids |"


def test_figures_keep_every_frame():
    figures = bench_rivals.as_json([Row("vtk", "VTK 9", "colour", (0.2, 0.1))], "a machine")
    assert figures["machine"] == "a machine"
    assert figures["rows"] == [{"name": "vtk", "library": "VTK 9", "gives": "colour", "problem": "", "seconds": [0.2, 0.1]}]


def test_last_line_is_the_error():
    assert last_line("Traceback\n  File\nImportError: libX.so\n\n") == "ImportError: libX.so"
    assert last_line("\n") == ""


def test_unknown_name_is_refused():
    with pytest.raises(SystemExit, match="no rival is named 'vkt'"):
        bench_rivals.chosen(["vkt"])
    assert [rival.name for rival in bench_rivals.chosen(["vtk"])] == ["viewsphere", "vtk"]


def test_package_that_cannot_be_installed_is_a_reason(tmp_path, monkeypatch):
    bad = tmp_path / "python"
    bad.write_text("#!/bin/sh\necho 'ERROR: no such package' >&2\nexit 3\n")
    bad.chmod(0o755)
    monkeypatch.setattr(bench_rivals.shutil, "which", lambda name: str(bad))
    with pytest.raises(RivalFailedError, match="ERROR: no such package"):
        installed(Rival("absent", ("absent",)), tmp_path / "cache")
    assert installed(OURS, tmp_path) == Path(sys.executable)


@pytest.mark.skipif(os.name == "nt", reason="the environments' layout is POSIX")
def test_rivals_take_turns_and_failures_become_rows(scripts):
    (scripts / "draw_good.py").write_text(DRAWS)
    (scripts / "draw_blank.py").write_text(DRAWS.replace("picture[0] = 7", "pass"))
    (scripts / "draw_absent.py").write_text("import a_library_that_is_absent\n")
    (scripts / "draw_dies.py").write_text(LOOP + "scene.ready('Mortal', '')\nnext(scene.views())\nraise ValueError('enough')\n")
    rivals = [Rival(name, ("x",)) for name in ("good", "blank", "absent", "dies")]
    good, blank, absent, dies = measured(rivals, scripts, 3, scripts)
    assert (good.library, good.gives, good.problem, len(good.seconds)) == ("Fake 1.0", "two greys", "", 3)
    assert all(0 < seconds < 10 for seconds in good.seconds)
    assert blank.problem == "its picture is empty"
    assert absent.problem == "ModuleNotFoundError: No module named 'a_library_that_is_absent'"
    assert (dies.library, dies.problem) == ("Mortal", "ValueError: enough")


@pytest.mark.slow
def test_open3d_sees_the_car_where_viewsphere_does(tmp_path, monkeypatch):
    pytest.importorskip("open3d")
    import numpy as np
    from bench_scene import reference_recipe
    from rivals.scene import write_scene

    from viewsphere import render

    monkeypatch.setattr(bench_rivals, "installed", lambda rival, cache: Path(sys.executable))
    write_scene(tmp_path, 3)
    (row,) = measured([bench_rivals.RIVALS["open3d"]], tmp_path, 1, tmp_path)
    assert row.problem == "" and len(row.seconds) == 1
    sample = next(iter(render(reference_recipe(3, 4, tmp_path))))
    size = tuple(sample.instances.shape)
    picture = np.frombuffer((tmp_path / "draw_open3d.pnm").read_bytes()[-size[0] * size[1] :], np.uint8).reshape(size)
    assert np.mean((picture == 255) == (sample.instances > 0)) > 0.999
