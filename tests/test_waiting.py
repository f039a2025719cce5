"""A terminal shows that a command is at work; files and pipes hold nothing of it."""

import io
import sys
import time

import pytest

from viewsphere.cli.terminal import waiting


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.mark.parametrize(
    ("stream", "quiet", "is_shown"), [(Terminal(), False, True), (Terminal(), True, False), (io.StringIO(), False, False)]
)
def test_what_is_shown(stream, quiet, is_shown, monkeypatch):
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setenv("TERM", "xterm")
    with waiting("planning cars.yaml", quiet):
        time.sleep(0.15)
    assert ("planning cars.yaml" in stream.getvalue()) == is_shown
    assert bool(stream.getvalue()) == is_shown
