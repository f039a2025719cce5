"""What Windows and macOS lack or do otherwise, tried here by taking it away; neither system is at hand."""

import ast
import os
import subprocess
import sys
import textwrap

import pytest

from command_line import viewsphere
from deadline import DEADLINE
from small import ROOT, small_recipe
from viewsphere import Dataset, generate, plan
from viewsphere.assets import cache
from viewsphere.errors import RecipeError
from viewsphere.planning import models
from viewsphere.recipe.reading import extends
from viewsphere.recipe.recipe import Recipe
from viewsphere.store.shots import moving

SOURCE = sorted(
    file
    for file in (ROOT / "src").rglob("*.py")
    if "worker" not in file.parts  # Blender's, whose files nobody compares
)
POSIX_ONLY = {"fcntl", "resource", "pwd", "grp", "termios", "pty", "tty", "posix"}


def calls():
    for file in SOURCE:
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
                yield file, node, node.func.attr


@pytest.mark.slow
def test_texts_have_the_same_bytes_on_every_system():
    """Windows would write CR LF, and older ones another encoding."""
    for file, call, name in calls():
        words = {keyword.arg for keyword in call.keywords}
        if name == "write_text":
            assert "newline" in words, f"{file}:{call.lineno}"
        mode = next((a.value for a in call.args if isinstance(a, ast.Constant) and isinstance(a.value, str)), "r")
        if name == "open" and mode in {"w", "a", "x"}:
            assert {"newline", "encoding"} <= words, f"{file}:{call.lineno}"


@pytest.mark.slow
def test_modules_of_posix_are_imported_only_where_they_are_needed():
    for file, node in ((one, node) for one in SOURCE for node in ast.parse(one.read_text("utf-8")).body):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else [getattr(node, "module", None)]
        assert not POSIX_ONLY & set(names), f"{file}:{node.lineno}"


@pytest.mark.slow
def test_a_data_set_is_made_the_same_without_what_only_posix_has(tmp_path):
    """Other modules and functions are absent in this process and in its workers; the files are equal."""
    (tmp_path / "sitecustomize.py").write_text(
        textwrap.dedent(
            f"""
            import os, sys
            for name in {sorted(POSIX_ONLY - {"posix"})}:
                sys.modules[name] = None
            for name in ("sched_getaffinity", "sched_setaffinity", "fork", "killpg"):
                delattr(os, name)
            def link(*_, **__):
                raise OSError(1, "no hard links here")
            os.link = link
            """
        )
    )
    (tmp_path / "make.py").write_text(
        "import os, sys\n"
        f"sys.path.insert(0, {str(ROOT / 'tests')!r})\n"
        "from small import small_recipe\n"
        "from viewsphere import generate\n"
        "if __name__ == '__main__':\n"
        "    assert not hasattr(os, 'fork') and sys.modules['fcntl'] is None\n"
        "    generate(small_recipe(), 'bare', workers=1)\n"
    )
    own = {**os.environ, "PYTHONPATH": str(tmp_path)}
    run = subprocess.run([sys.executable, "make.py"], cwd=tmp_path, env=own, capture_output=True, text=True, timeout=DEADLINE)
    assert run.returncode == 0, run.stderr
    generate(small_recipe(), tmp_path / "usual")
    (tmp_path / "usual" / "store" / "lock").unlink()  # goes with its run where only such locks are to be had
    assert contents(tmp_path / "bare") == contents(tmp_path / "usual")
    assert len(Dataset(tmp_path / "bare")) > 0


def contents(root):
    return {file.relative_to(root).as_posix(): file.read_bytes() for file in root.rglob("*") if file.is_file()}


@pytest.mark.slow
def test_a_worker_s_pipe_may_be_of_any_class(tmp_path, monkeypatch):
    """On Windows `Pipe()` makes a PipeConnection, which is no Connection."""
    monkeypatch.setattr("viewsphere.run.executors.local.Connection", type("Another", (), {}))
    generate(small_recipe(formats=[]), tmp_path / "out", workers=1)
    assert len(Dataset(tmp_path / "out")) > 0


def test_what_another_program_has_open_is_moved_a_little_later(tmp_path, monkeypatch):
    (tmp_path / "new").write_text("new")
    (tmp_path / "old").write_text("old")
    refusals, rename = [PermissionError(13, "in use")] * 3, os.replace

    def refuse(*paths):
        if refusals:
            raise refusals.pop()
        rename(*paths)

    monkeypatch.setattr(moving, "WAITS_S", (0, 0, 0))
    monkeypatch.setattr(os, "replace", refuse)
    moving.move(tmp_path / "new", tmp_path / "old")
    assert (tmp_path / "old").read_text() == "new" and not (tmp_path / "new").exists()
    refusals += [PermissionError(13, "in use")] * 4
    (tmp_path / "new").write_text("newer")
    with pytest.raises(PermissionError):
        moving.move(tmp_path / "new", tmp_path / "old")
    assert not refusals and (tmp_path / "old").read_text() == "new"


def another_drive(*_):
    raise ValueError("path is on mount 'D:', start on mount 'C:'")


def test_a_recipe_extends_one_on_another_drive(tmp_path, monkeypatch):
    (tmp_path / "far" / "models").mkdir(parents=True)
    (tmp_path / "far" / "models" / "a.glb").touch()
    (tmp_path / "far" / "base.yaml").write_text(
        "models: [{source: models/a.glb, category: a}]\n"
        "viewpoints: {azimuth: 0, distance: 1}\n"
        "camera: {size: [8, 8], fov_deg: 40}\n"
    )
    (tmp_path / "near").mkdir()
    (tmp_path / "near" / "recipe.yaml").write_text(f"extends: {tmp_path}/far/base.yaml\n")
    monkeypatch.setattr(extends.os.path, "relpath", another_drive)
    (spec,) = plan(Recipe.load(tmp_path / "near" / "recipe.yaml")).model_specs
    assert spec.source == (tmp_path / "far" / "models" / "a.glb").as_posix()


def test_a_model_s_texture_may_lie_on_another_drive(tmp_path, monkeypatch):
    monkeypatch.setattr(cache.os.path, "relpath", another_drive)
    model, texture = tmp_path / "a.obj", tmp_path / "wood.png"
    (name,) = cache._names(model, [texture])
    assert model.parent / name == texture.resolve()


@pytest.mark.parametrize("stem", ["con", "AUX", "nul.high", "com1"])
def test_a_model_s_folder_has_no_name_of_a_device(tmp_path, stem):
    (tmp_path / f"{stem}.glb").touch()
    recipe = small_recipe(models=[{"source": str(tmp_path / f"{stem}.glb"), "category": "a"}])
    (spec,) = plan(recipe).model_specs
    assert spec.key == f"{stem}_"
    assert not models.is_reserved("console") and not models.is_reserved("com10") and models.is_reserved("Lpt1.txt")


@pytest.mark.parametrize(("names", "found"), [(("train", "Train"), "'train' and 'Train'"), (("train", "nul"), "split 'nul'")])
def test_splits_are_folders_on_every_system(names, found):
    with pytest.raises(RecipeError, match=found):
        small_recipe(splits={"by": "frame", **dict.fromkeys(names, 0.5)})


@pytest.mark.slow
def test_letters_that_the_output_lacks_are_numbers(tmp_path):
    assert viewsphere("new", tmp_path / "first").returncode == 0
    own = {**os.environ, "PYTHONIOENCODING": "cp1252"}
    command = [sys.executable, "-m", "viewsphere", "plan", "first/recipe.yaml", "--set", "name=椅子"]
    run = subprocess.run(command, cwd=tmp_path, env=own, capture_output=True, text=True, encoding="cp1252")
    assert run.returncode == 0, run.stderr
    assert "\\u6905\\u5b50" in run.stdout
