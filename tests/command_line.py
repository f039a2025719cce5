"""The command line, called in this process: starting another one for each command is what would take longest."""

from __future__ import annotations

import contextlib
import io
import sys
from pathlib import Path
from typing import NamedTuple
from unittest.mock import patch

from viewsphere import cli


class Answer(NamedTuple):
    """The exit status, and what was printed."""

    returncode: int
    stdout: str
    stderr: str


def viewsphere(*words: object, cwd: Path | str = ".") -> Answer:
    """`viewsphere` with these words, in this folder."""
    out, err, status = io.StringIO(), io.StringIO(), 0
    with (
        patch.object(sys, "argv", ["viewsphere", *map(str, words)]),
        contextlib.chdir(cwd),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        try:
            cli.main()
        except SystemExit as end:
            status = end.code or 0
    return Answer(status, out.getvalue(), err.getvalue())
