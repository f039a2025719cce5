"""The Tab key, and commands that are given nothing."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import viewsphere_zoo as zoo
from deadline import DEADLINE
from installed import installed
from quick import quick
from viewsphere import cli, plugins
from viewsphere.cli import completion

COMMANDS = ("new", "inspect", "plan", "preview", "render", "export", "check", "report", "view", "merge", "import", "convert")
ZOO = [f"zoo:{name}" for name in zoo.family_names()]


def viewsphere(*words, **variables):
    return subprocess.run(
        [sys.executable, "-c", "import sys; sys.argv[0] = 'viewsphere'; from viewsphere.cli import main; main()", *words],
        capture_output=True,
        text=True,
        env={**os.environ, **variables},
        timeout=DEADLINE,
    )


def offered(*words, cwd=None):
    """What bash is offered for these words, the last of which is not finished; split as bash splits them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(cwd or ".")
        patch.setattr(sys, "argv", ["viewsphere"])
        patch.setattr(sys.modules["__main__"], "__package__", "")  # else it is called after pytest
        for name, value in (
            ("_VIEWSPHERE_COMPLETE", "complete_bash"),
            ("COMP_WORDS", "\n".join(["viewsphere", *words])),
            ("COMP_CWORD", str(len(words))),
        ):
            patch.setenv(name, value)
        said = []
        patch.setattr(completion.typer, "echo", said.append)
        with pytest.raises(SystemExit):
            cli.main()
        return said


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("rend",), ["render"]),
        (("inspect", "z"), ZOO),
        (("inspect", "zoo", ":", "ca"), [name for name in zoo.family_names() if name.startswith("ca")]),
        (("inspect", "zoo", ":"), [name.removeprefix("zoo:") for name in ZOO]),
        (("inspect", "a.obj", "--up", "+"), ["+x", "+y", "+z"]),
        (("render", "a.yaml", "-f", ""), [*plugins.names("formats")]),
        (("render", "a.yaml", "--format", "coco,"), [f"coco,{name}" for name in plugins.names("formats") if name != "coco"]),
        (("render", "a.yaml", "--format", "=", "na"), ["native"]),
        (("export", "out", "--format", "col"), ["colmap"]),
        (("import", "na"), ["native"]),
        (("convert", "photos", "--from", "coco", "--to", "yolo,na"), ["yolo,native"]),
        (("preview", "a.yaml", "--draw", "boxes"), ["boxes", "boxes3d"]),
        (("plan", "a.yaml", "--set", "camera.f"), ["camera.fov_deg="]),
        (("plan", "a.yaml", "--set", "seed", "=", "1", "--set", "engine", "=", "r"), ["raster"]),
        (("render", "rec"), []),
    ],
)
def test_what_is_offered(words, expected):
    assert [line for line in offered(*words) if line] == expected


@pytest.mark.parametrize("code", ["1 / 0", "def names():\n    raise OSError", "names = None"])
def test_a_source_whose_names_cannot_be_listed_hides_no_other(code, tmp_path):
    with installed(tmp_path, "source_names", "names", code):
        assert offered("inspect", "z") == ZOO


def test_models_are_offered_beside_the_zoo(tmp_path):
    (tmp_path / "zebra.glb").touch()
    (tmp_path / "chair.obj").touch()
    (tmp_path / "scans").mkdir()
    assert offered("inspect", "", cwd=tmp_path) == [*ZOO, "chair.obj", "scans/", "zebra.glb"]
    assert offered("inspect", "z", cwd=tmp_path) == [*ZOO, "zebra.glb"]


def test_the_fields_offered_for_set_are_the_recipe_s():
    from viewsphere.recipe.recipe import schema

    definitions = schema()["$defs"]
    known = set(schema()["properties"])
    for field in completion.changes(""):
        assert field.removesuffix("=").partition(".")[0].removesuffix("[0]") in known
    models = {f.removeprefix("models[0].").removesuffix("=") for f in completion.changes("") if f.startswith("models")}
    assert models <= set(definitions["ModelEntry"]["properties"])
    assert {"viewpoints.elevation=", "models[0].count=", "camera.size=", "engine="} <= set(completion.changes(""))


def test_completing_loads_nothing_heavy():
    code = (
        "import sys\n"
        "from viewsphere.cli import completion as c\n"
        "assert c.models('zoo:') and c.formats('') and c.axes() and c.changes('') and c.changes('engine=')\n"
        "print(sorted({'numba', 'trimesh', 'numpy', 'pydantic', 'PIL', 'scipy', 'yaml'} & set(sys.modules)))"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("bash") is None, reason="bash")
def test_bash_itself(tmp_path):
    program = tmp_path / "viewsphere"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -c "import sys; sys.argv[0] = \'viewsphere\'; '
                       'from viewsphere.cli import main; main()" "$@"\n')  # fmt: skip
    program.chmod(0o755)
    script = """
        eval "$(_VIEWSPHERE_COMPLETE=source_bash viewsphere)"
        complete -p viewsphere
        COMP_WORDS=(viewsphere inspect zoo : boa) COMP_CWORD=4
        _viewsphere_completion viewsphere
        printf '%s\\n' "${COMPREPLY[@]}"
    """
    path = os.pathsep.join([str(tmp_path), os.environ["PATH"]])
    run = subprocess.run(
        ["bash", "-c", script], capture_output=True, text=True, env={**os.environ, "PATH": path}, timeout=DEADLINE
    )
    assert run.stdout.splitlines() == ["complete -o default -F _viewsphere_completion viewsphere", "boat"]


@pytest.mark.parametrize(
    ("shell", "answer"),
    quick([("zsh", r'''"zoo\\:boat"'''), ("fish", "zoo:boat"), ("powershell", "zoo:boat::: ")], ("fish", "zoo:boat")),
)
def test_other_shells(shell, answer):
    words = {"_TYPER_COMPLETE_ARGS": "viewsphere inspect zoo:boa", "_TYPER_COMPLETE_WORD_TO_COMPLETE": "zoo:boa"}
    run = viewsphere(_VIEWSPHERE_COMPLETE=f"complete_{shell}", _TYPER_COMPLETE_FISH_ACTION="get-args", **words)
    assert answer in run.stdout
    source = viewsphere(_VIEWSPHERE_COMPLETE=f"source_{shell}").stdout
    assert f"complete_{shell}" in source


@pytest.mark.parametrize("shell", quick(["bash", "zsh", "fish"], "bash"))
def test_installing(shell, tmp_path):
    names = {"HOME": str(tmp_path), "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1"}
    shown = viewsphere("--show-completion", shell, **names)
    assert shown.returncode == 0
    installed = viewsphere("--install-completion", shell, **names)
    assert installed.returncode == 0, installed.stderr
    files = [p for p in tmp_path.rglob("*") if p.is_file()]
    assert any(shown.stdout.strip() in p.read_text() for p in files)


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_without_arguments_says_what_to_write(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for found in ("", "found"):
        if found:
            for file in ("toys/recipe.yaml", "toys/a.obj", "toys-ds/store/plan.json", "more-ds/store/plan.json"):
                Path(file).parent.mkdir(parents=True, exist_ok=True)
                Path(file).touch()
        monkeypatch.setattr(sys, "argv", ["viewsphere", name])
        with pytest.raises(SystemExit) as end:
            cli.main()
        assert end.value.code == 2
        first, second = capsys.readouterr().err.splitlines()
        assert first.startswith(f"viewsphere: {name}: expected ")
        assert f"next: viewsphere {name} " in second
        if found and name not in {"new", "import", "convert"}:
            assert "toys/" in second or "more-ds" in second


def test_one_argument_short(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    formats = f"expected one or more of {', '.join(plugins.names('formats'))}"
    for words, expected in (("export out", formats), ("merge a -o b", "found no such folder")):
        monkeypatch.setattr(sys, "argv", ["viewsphere", *words.split()])
        with pytest.raises(SystemExit) as end:
            cli.main()
        assert end.value.code == 2
        assert expected in capsys.readouterr().err
