"""The tests that CI chooses for a change: those that reach what changed, and all of them where that cannot be told."""

import importlib.util
import subprocess
import sys

import pytest

from small import ROOT

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not (ROOT / ".git").exists(), reason="needs a clone, whose files git lists")]


@pytest.fixture(scope="module")
def chosen():
    spec = importlib.util.spec_from_file_location("chosen_tests", ROOT / "scripts" / "chosen_tests.py")
    module = importlib.util.module_from_spec(spec)
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, spec.name, module)
        spec.loader.exec_module(module)
        known = module.Modules(), module.Tests(module.git("ls-files", "-co", "--exclude-standard"))
        for name, made in zip(("Modules", "Tests"), known, strict=True):
            patch.setattr(module, name, lambda *_, made=made: made)  # reading all files takes seconds
        yield module


@pytest.mark.parametrize(
    ("changed", "there", "not_there"),
    [
        # imports, through other modules; a plug-in by its name; one of the labels that the small recipe lists
        ("src/viewsphere/geometry/box.py", ["tests/geometry/test_box.py", "tests/formats/test_coco.py"],
         ["tests/geometry/test_hull.py"]),
        ("src/viewsphere/formats/tum/reading.py", ["tests/formats/test_tum.py"],
         ["tests/formats/test_coco.py", "tests/zoo/test_chair.py"]),
        ("src/viewsphere_zoo/families/boat.py", ["tests/zoo/test_boat.py"],
         ["tests/formats/test_tum.py"]),
        ("src/viewsphere/labels/position.py", ["tests/labels/test_position.py", "tests/test_check.py"],
         ["tests/geometry/test_box.py"]),
        # a fixture's imports; what a command imports when it is called; a package is run for all that is in it
        ("src/viewsphere/blender/process.py", ["tests/blender/test_process.py", "tests/engines/test_cycles.py"],
         ["tests/geometry/test_box.py"]),
        ("src/viewsphere/view/server.py", ["tests/view/test_server.py", "tests/test_cli.py"],
         ["tests/formats/test_tum.py"]),
        ("src/viewsphere/geometry/__init__.py", ["tests/geometry/test_curve.py"], []),
        # Blender's program; what a recipe's kind names; what notebooks call; what `python -m` runs
        ("src/viewsphere/blender/worker/files/nodes.py", ["tests/blender/test_materials.py", "tests/engines/test_cycles.py"],
         ["tests/geometry/test_box.py"]),
        ("src/viewsphere/composing/trajectories/spline.py", ["tests/composing/test_trajectories.py"],
         ["tests/geometry/test_box.py"]),
        ("src/viewsphere/composing/trajectories/shared/along.py", ["tests/composing/test_trajectories.py"],
         ["tests/geometry/test_box.py"]),
        ("src/viewsphere/preview/notebook.py", ["tests/test_notebook.py"],
         ["tests/geometry/test_box.py"]),
        ("src/viewsphere/__main__.py", ["tests/test_cli.py"],
         ["tests/geometry/test_box.py"]),
        # what tests read, and themselves
        ("docs/tutorial.md", ["tests/test_tutorial.py", "tests/test_docs.py"],
         ["tests/geometry/test_box.py"]),
        ("recipes/street.yaml", ["tests/test_recipes_as_shipped.py"],
         ["tests/geometry/test_box.py"]),
        ("benchmarks/bench_rivals.py", ["tests/test_bench_rivals.py"], ["tests/geometry/test_box.py"]),
        ("README.md", ["tests/test_docs.py"],
         ["tests/geometry/test_box.py"]),
        ("tests/geometry/test_box.py", ["tests/geometry/test_box.py"],
         ["tests/geometry/test_curve.py"]),
    ],
)  # fmt: skip
def test_a_change_chooses_what_reaches_it(chosen, changed, there, not_there):
    found = chosen.choose([changed])
    assert set(there) <= set(found)
    assert not set(not_there) & set(found)


def test_tests_that_go_through_all_sources_are_chosen_for_each(chosen):
    names = ("kernels/test_fence", "kernels/test_kernel_entries", "test_files", "test_package", "test_portability",
             "test_printable", "test_troubleshooting")  # fmt: skip
    scanning = {f"tests/{name}.py" for name in names}
    assert scanning <= set(chosen.choose(["src/viewsphere/preview/notebook.py"]))
    assert not {"tests/kernels/test_fence.py", "tests/test_files.py"} & set(chosen.choose(["docs/tutorial.md"]))


def test_a_module_that_no_test_reaches_chooses_all(chosen, monkeypatch):
    modules, name = chosen.Modules(), "lonely"
    monkeypatch.setattr(modules, "all", modules.all | {f"viewsphere_zoo.{name}"})
    with pytest.raises(chosen.CannotTell, match="no test reaches"):
        chosen.choose(["src/viewsphere_zoo/families/boat.py", f"src/viewsphere_zoo/{name}.py"])


LOADED = """
import sys, pytest
status = pytest.main(["-q", "-p", "no:xdist", "-m", "not slow", sys.argv[1]])
print("loaded", *(name for name in sys.modules if name.startswith("viewsphere")))
sys.exit(status)
"""


@pytest.mark.parametrize(
    "file",
    ["test_smallness.py", "test_notebook.py", "planning/test_models.py", "composing/test_trajectories.py", "zoo/test_boat.py",
     "geometry/test_box.py"],
)  # fmt: skip
def test_what_tests_load_is_what_they_reach(chosen, file):
    run = subprocess.run([sys.executable, "-c", LOADED, f"tests/{file}"], cwd=ROOT, capture_output=True, text=True)
    assert run.returncode == 0, run.stdout
    loaded = set(run.stdout.splitlines()[-1].split()[1:])
    modules, tests = chosen.Modules(), chosen.Tests()
    used = set().union(*(modules.used_by(tests.texts[node]) for node in tests.reached(f"tests/{file}")))
    reached = chosen.closure(used, lambda module: modules.needs[module])
    assert len(loaded) > 20
    assert loaded & modules.all <= reached


@pytest.mark.parametrize(
    "changed",
    ["pyproject.toml", ".ci/run", "scripts/test", "tests/conftest.py", "tests/zoo/conftest.py", "tests/small.py",
     "tests/blender/make_scene.py",
     "src/viewsphere/report/page.html", "src/viewsphere/gone.py", "tests/engines/golden/new.png"],
)  # fmt: skip
def test_all_are_chosen_where_it_cannot_tell(chosen, changed):
    with pytest.raises(chosen.CannotTell):
        chosen.choose(["docs/tutorial.md", changed])


def test_a_branch_is_compared_with_where_it_left_main_and_main_with_nothing(chosen, tmp_path, monkeypatch):
    def git(*words):
        who = ["-c", "user.name=a", "-c", "user.email=a@b", "-c", "commit.gpgsign=false"]
        subprocess.run(["git", *who, *words], cwd=tmp_path, check=True, capture_output=True)

    monkeypatch.setattr(chosen, "ROOT", tmp_path)
    with pytest.raises(chosen.CannotTell):
        chosen.changed_since(None)  # no repository
    git("init", "-b", "main")
    for name in ("kept", "moved", "gone"):
        (tmp_path / name).write_text(name)
    git("add", ".")
    git("commit", "-m", "main")
    with pytest.raises(chosen.CannotTell):
        chosen.changed_since(None)  # no main to compare with
    git("update-ref", "refs/remotes/origin/main", "HEAD")
    with pytest.raises(chosen.CannotTell):
        chosen.changed_since(None)
    git("checkout", "-b", "work")
    git("mv", "moved", "there")
    git("rm", "gone")
    git("commit", "-m", "work")
    (tmp_path / "kept").write_text("changed")
    (tmp_path / "new").write_text("new")
    assert sorted(chosen.changed_since(None)) == ["gone", "kept", "moved", "new", "there"]
    git("add", ".")
    git("commit", "-m", "more")
    assert sorted(chosen.changed_since("HEAD~1")) == ["kept", "new"]
