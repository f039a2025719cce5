"""Texts of files on their way to a terminal."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from command_line import viewsphere
from deadline import DEADLINE
from small import ROOT
from viewsphere.cli.terminal import CLOSED
from viewsphere.printable import is_utf8, printable

FULL = Path("/dev/full")
SHOWN = {
    "plain": "plain",
    "Grüße, 漢字, 🚗, a b": "Grüße, 漢字, 🚗, a b",
    "\x1b]0;pwned\x07": r"\x1b]0;pwned\x07",
    "\x1b[31mred": r"\x1b[31mred",
    "\x9b31m": r"\x9b31m",
    "a\nb\rc\td\x7f": r"a\nb\rc\td\x7f",
    "\u202eevil": r"\u202eevil",
    "\u2028\u2029": r"\u2028\u2029",
    "\udcff": r"\udcff",
}


@pytest.mark.parametrize(("text", "shown"), SHOWN.items())
def test_control_characters_are_shown_by_their_codes(text, shown):
    assert printable(text) == shown
    assert is_utf8(text) == ("\udcff" not in text)


@pytest.mark.parametrize(
    "words", [("plan",), ("status",), ("check",), ("inspect",), ("report",), ("import", "coco"), ("new", "-f")]
)
def test_no_command_prints_control_characters(tmp_path, words):
    answer = viewsphere(*words, "a\x1b]0;pwned\x07\x9b31m\u202e", cwd=tmp_path)
    for text in (answer.stdout, answer.stderr):
        assert not set(text) & set("\x1b\x07\x9b\u202e")
    assert answer.returncode == 2


@pytest.mark.slow
def test_one_function_prints():
    """All else is packages' own programs, and the server's line."""
    allowed = {"cli/terminal.py", "cli/completion.py"}
    found = {
        f"{path}:{call.lineno}"
        for file in (ROOT / "src").rglob("*.py")
        for path in [file.relative_to(ROOT / "src").as_posix().removeprefix("viewsphere/")]
        if path not in allowed and not path.startswith(("recipe/starts/", "blender/worker/"))
        for call in ast.walk(ast.parse(file.read_text("utf-8")))
        if isinstance(call, ast.Call)
        and (getattr(call.func, "id", None) == "print" or getattr(call.func, "attr", None) in ("echo", "secho"))
        and "printable(" not in ast.unparse(call)
    }
    assert not found


@pytest.mark.skipif(not FULL.exists(), reason="Linux")
@pytest.mark.parametrize("words", [("schema",), ("--version",)])
@pytest.mark.slow
def test_a_full_output_is_one_line_and_status_2(words):
    with FULL.open("wb") as full:
        done = subprocess.run(
            [sys.executable, "-m", "viewsphere", *words], stdout=full, stderr=subprocess.PIPE, text=True, timeout=DEADLINE
        )
    assert done.returncode == 2
    assert done.stderr == (
        "viewsphere: standard output: expected a place to write, found: No space left on device. Free some space\n"
    )


@pytest.mark.slow
def test_a_reader_that_has_ended_is_no_error():
    process = subprocess.Popen(
        [sys.executable, "-m", "viewsphere", "schema"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    process.stdout.close()
    assert process.stderr.read() == ""
    assert process.wait(DEADLINE) == CLOSED
