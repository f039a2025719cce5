"""Which Python has Blender, what is wrong with one that does not work, and making one."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest
from fake_blender import ABORTING, LACKING, fake_blender, interpreter, with_modules, without_blender

from viewsphere.blender import environment
from viewsphere.blender.interpreter import VARIABLE, Device, Library, find_blender, missing_libraries, probe
from viewsphere.errors import MissingExtraError, UserError
from viewsphere_zoo.people import makehuman

LDD = """\
\tlinux-vdso.so.1 (0x00007eff2b926000)
\tlibXi.so.6 => not found
\tlibrare.so.3 => not found
\tlibm.so.6 => /lib/x86_64-linux-gnu/libm.so.6 (0x00007eff2b7ce000)
\tlibxkbcommon.so.0 => not found
"""


@pytest.fixture
def home(tmp_path, monkeypatch):
    """A machine without Blender; where the environment would lie."""
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    monkeypatch.setattr("platformdirs.user_data_dir", lambda _: str(tmp_path / "data"))
    return tmp_path / "data" / "blender"


def touch(file):
    file.parent.mkdir(parents=True, exist_ok=True)
    file.touch(0o755)
    return file


def test_the_nearest_wins(home, tmp_path, monkeypatch):
    with pytest.raises(MissingExtraError):
        find_blender()
    made = touch(environment.interpreter_of(home))
    assert find_blender() == made
    monkeypatch.setattr("importlib.util.find_spec", lambda name: name == "bpy" or None)
    assert find_blender() == Path(sys.executable)
    of_variable = touch(tmp_path / "variable" / "python")
    monkeypatch.setenv(VARIABLE, str(of_variable))
    assert find_blender() == of_variable
    given = touch(tmp_path / "given" / "python")
    assert find_blender(str(given)) == given


def test_one_is_named_by_file_by_folder_or_on_the_path(home, tmp_path, monkeypatch):
    file = touch(environment.interpreter_of(tmp_path / "env"))
    assert find_blender(str(file)) == file
    assert find_blender(str(tmp_path / "env")) == file
    monkeypatch.chdir(tmp_path)
    assert find_blender("env") == file
    monkeypatch.setenv("PATH", str(file.parent))
    assert find_blender(file.name) == file


def test_what_is_not_there_is_one_line_that_says_what_to_do(home, tmp_path, monkeypatch):
    with pytest.raises(MissingExtraError, match="found none") as none:
        find_blender()
    with pytest.raises(UserError, match=r"^engine.python: .*found no nowhere/python") as given:
        find_blender("nowhere/python")
    program = touch(tmp_path / "blender")
    with pytest.raises(UserError, match="Blender's own program") as own:
        find_blender(str(program))
    monkeypatch.setenv(VARIABLE, "/nowhere")
    with pytest.raises(UserError, match=r"^\$VIEWSPHERE_BLENDER_PYTHON: .*found no /nowhere") as variable:
        find_blender()
    for caught in (none, given, own, variable):
        said = str(caught.value)
        assert "\n" not in said
        assert "pip install 'viewsphere[blender]'" in said
        assert "doctor --setup-blender" in said


def test_libraries_that_ldd_misses():
    found = missing_libraries(LDD)
    assert found == (
        Library("libXi.so.6", "libxi6"),
        Library("librare.so.3", None),
        Library("libxkbcommon.so.0", "libxkbcommon0"),
    )


def test_what_works(tmp_path):
    found = probe(fake_blender(tmp_path))
    assert (found.version, found.problem, found.cure) == ("9.8.7", None, None)
    assert Device("CPU", "A processor") in found.devices


@pytest.mark.slow
def test_what_works_in_truth(blender):
    found = probe(blender)
    assert found.problem is None
    assert "CPU" in {device.kind for device in found.devices}


def test_what_lacks_a_library(tmp_path):
    found = probe(with_modules(tmp_path, {"bpy": LACKING}))
    assert (found.version, found.cure) == (None, "apt-get install libxi6")
    assert found.missing == (Library("libXi.so.6", "libxi6"),)


@pytest.mark.parametrize(("source", "problem"), [(ABORTING, "SIGABRT"), ("raise RuntimeError('no luck')", "no luck")])
def test_what_dies_or_fails(tmp_path, source, problem):
    found = probe(with_modules(tmp_path, {"bpy": source}))
    assert found.version is None
    assert problem in (found.problem or "")


def test_what_has_no_blender_or_is_no_python(tmp_path):
    assert "it has no bpy" in (probe(without_blender(tmp_path)).problem or "")
    assert "exit status 4" in (probe(interpreter(tmp_path, "exit 4")).problem or "")
    assert "cannot be started" in (probe(tmp_path / "nothing").problem or "")


def fake_steps(fails=None):
    """Steps that make an interpreter by hand; the one called `fails` is interrupted."""

    def run(command, listener):
        step = command[2]
        listener(f"step {step}")
        if step == fails:
            raise KeyboardInterrupt
        if step == "venv":
            touch(environment.interpreter_of(Path(command[3]))).write_text("new")

    return run


def test_an_environment_is_made_whole_or_not_at_all(home, monkeypatch):
    said = []
    monkeypatch.setattr(environment, "_run", fake_steps("pip"))
    monkeypatch.setattr(environment, "_python311", lambda: "python3.11")
    with pytest.raises(KeyboardInterrupt):
        environment.make_environment(said.append)
    assert list(home.parent.iterdir()) == []
    touch(environment.interpreter_of(home)).write_text("old")
    with pytest.raises(KeyboardInterrupt):
        environment.make_environment(said.append)
    assert find_blender().read_text() == "old"
    monkeypatch.setattr(environment, "_run", fake_steps())
    assert environment.make_environment(said.append) == find_blender()
    assert find_blender().read_text() == "new"
    assert list(home.parent.iterdir()) == [home]
    assert said[-2:] == ["step venv", "step pip"]


def test_a_step_that_fails_is_one_line(home, monkeypatch, tmp_path):
    base = interpreter(tmp_path, "echo ERROR: no disk; echo and more; exit 1")
    monkeypatch.setattr(environment, "_python311", lambda: str(base))
    with pytest.raises(UserError, match=r"`python -m venv` to succeed, found: ERROR: no disk$"):
        environment.make_environment(lambda _: None)
    assert list(home.parent.iterdir()) == []


def test_another_python_looks_for_a_311(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "version_info", (3, 13, 0, "final", 0))
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(UserError, match=r"expected a Python 3.11.* found 3.13") as caught:
        environment.make_environment(lambda _: None)
    assert "\n" not in str(caught.value)
    interpreter(tmp_path, "echo 3.12").rename(tmp_path / "python3")
    right = interpreter(tmp_path, "echo 3.11").rename(tmp_path / "python3.11")
    assert environment._python311() == str(right)


@pytest.mark.parametrize("file", [environment.REQUIREMENTS, makehuman.REQUIREMENTS], ids=["blender", "people"])
def test_what_doctor_installs_is_pinned_by_digests(file):
    entries = re.sub(r"#.*\n|\\\n", "", file.read_text("utf-8")).strip().splitlines()
    assert len(entries) == (9 if file == environment.REQUIREMENTS else 1)
    for entry in entries:
        assert re.fullmatch(r"[\w-]+==[\w.]+\s+(--hash=sha256:[0-9a-f]{64}\s*)+", entry), entry[:60]
    assert "--require-hashes" in environment.PINNED
    assert makehuman.PACKAGE in makehuman.REQUIREMENTS.read_text("utf-8")
    assert not re.search(r"^numpy==[2-9]", file.read_text("utf-8"), re.MULTILINE)  # which Blender cannot load
