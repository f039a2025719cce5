"""The command line, called in this process: starting another one for each command is what would take longest."""

from __future__ import annotations

import contextlib
import io
import sys
from functools import cache
from pathlib import Path
from typing import NamedTuple
from unittest.mock import patch

import typer

from viewsphere import cli

built = cache(typer.main.get_command)
"""The commands and their options are made from their functions once; that would take as long as a short command itself."""


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
        patch.object(typer.main, "get_command", built),
        contextlib.chdir(cwd),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        try:
            cli.main()
        except SystemExit as end:
            status = end.code or 0
    return Answer(status, out.getvalue(), err.getvalue())
