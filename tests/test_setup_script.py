"""scripts/setup: which packages it installs, with what, and when it has nothing to do. No package is installed here."""

import os
import shutil
import signal
import subprocess
import sys

import pytest

from deadline import DEADLINE, until
from small import ROOT

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="a script of bash")

UV = """#!/bin/sh
echo "uv $*" >> "$LOG"
if [ -n "$FAILS" ]; then echo "no such package"; exit 3; fi
if [ "$1" = venv ]; then mkdir -p .venv/bin; ln -sf "$(command -v python3)" .venv/bin/python; fi
"""
PIP = """#!/bin/sh
if [ "$1" = -c ]; then exit 0; fi
echo "python $*" >> "$LOG"
if [ "$2" = venv ]; then mkdir -p .venv/bin; cp "$0" .venv/bin/python; fi
"""


@pytest.fixture
def clone(tmp_path):
    """A clone that holds the script alone, and folders of programs: the system's, uv, and a Python that installs nothing."""
    (tmp_path / "scripts").mkdir()
    shutil.copy(ROOT / "scripts" / "setup", tmp_path / "scripts")
    (tmp_path / "pyproject.toml").write_text("[project]\n")
    for name, text in {"uv/uv": UV, "pip/fake-python": PIP}.items():
        program = tmp_path / name
        program.parent.mkdir()
        program.write_text(text)
        program.chmod(0o755)
    return tmp_path


def installed(clone, *words, programs="uv", status=0, **environment):
    """The requests of one call of the script to its installer, a line each."""
    log = clone / "log"
    log.unlink(missing_ok=True)
    system = os.pathsep.join(["/usr/bin", "/bin"])
    path = f"{clone / programs}{os.pathsep}{system}"
    python = sys.executable if programs == "uv" else "fake-python"
    known = {"PATH": path, "PYTHON": python, "LOG": str(log), "HOME": str(clone), **environment}
    run = subprocess.run([clone / "scripts" / "setup", *words], env=known, capture_output=True, text=True, timeout=DEADLINE)
    assert run.returncode == status, run.stderr
    return (log.read_text().splitlines() if log.exists() else []), run.stderr


@pytest.mark.slow
def test_runtime_then_dev_then_nothing(clone):
    lines, _ = installed(clone, "runtime")
    assert [line.split()[1] for line in lines] == ["venv", "pip"]
    assert lines[1].endswith("--editable .[check]")
    assert installed(clone, "runtime")[0] == []
    (line,), _ = installed(clone)
    assert line.endswith("--editable . --group dev")
    for kind in ("dev", "runtime"):
        assert installed(clone, kind)[0] == []


@pytest.mark.slow
def test_other_dependencies_are_installed_and_the_dev_group_stays(clone):
    installed(clone, "dev")
    (clone / "pyproject.toml").write_text("[project]\nname = 'other'\n")
    (line,), _ = installed(clone, "runtime")
    assert line.endswith("--group dev")
    assert installed(clone, "dev")[0] == []


@pytest.mark.slow
def test_pip_where_there_is_no_uv(clone):
    lines, said = installed(clone, "runtime", programs="pip")
    assert [line.split()[2] for line in lines] == ["venv", "pip"]
    assert lines[-1].endswith("--editable .[check]")
    assert "with pip" in said
    lines, _ = installed(clone, "dev", programs="pip")
    assert [line.rpartition(" ")[2] for line in lines] == ["pip>=25.1", "dev"]  # which knows groups


@pytest.mark.slow
def test_a_failure_keeps_its_status_and_words_and_is_tried_again(clone):
    assert "no such package" in installed(clone, "runtime", status=3, FAILS="1")[1]
    assert len(installed(clone, "runtime")[0]) == 2


@pytest.mark.slow
def test_a_signal_to_the_script_alone_ends_its_dots_and_its_command(clone):
    (clone / "uv" / "uv").write_text(
        '#!/bin/sh\necho $$ > "$HOME/pid.part"; mv "$HOME/pid.part" "$HOME/pid"; exec sleep 1000\n'
    )
    environment = {"PATH": f"{clone / 'uv'}{os.pathsep}/usr/bin{os.pathsep}/bin", "PYTHON": sys.executable, "HOME": str(clone)}
    script = subprocess.Popen([clone / "scripts" / "setup"], env=environment | {"TMPDIR": str(clone)}, stderr=subprocess.PIPE)
    try:
        assert until((clone / "pid").exists)
        script.terminate()
        script.communicate(timeout=DEADLINE)  # returns when the dots, which hold its stderr, have ended too
    finally:
        script.kill()
    assert script.returncode == 128 + signal.SIGTERM
    with pytest.raises(ProcessLookupError):
        os.kill(int((clone / "pid").read_text()), 0)
    assert not list(clone.glob("tmp.*"))


def test_an_unknown_kind_is_named(clone):
    assert "found tests" in installed(clone, "tests", status=2)[1]
