"""Frames in memory compile their kernels on all cores, before the first frame, and show it on a terminal alone."""

from io import StringIO

import pytest

import viewsphere as vs
from viewsphere.kernels.precompile import Told
from viewsphere.model.shot import Shot
from viewsphere.run import memory
from viewsphere.run.progress import Progress, shown_on_terminal

RECIPE = {
    "models": [{"source": "zoo:box"}],
    "viewpoints": {"azimuth": [0, 90], "elevation": [20], "distance": 4},
    "camera": {"size": [16, 16]},
    "scene": {"ground": "off"},
}


class Terminal(StringIO):
    def isatty(self) -> bool:
        return True


def test_kernels_are_asked_for_once_before_the_first_frame(monkeypatch: pytest.MonkeyPatch):
    asked = list[Shot]()

    def asked_for(shot: Shot, tell: Told) -> None:
        asked.append(shot)

    monkeypatch.setattr(memory, "precompile", asked_for)
    frames = vs.render(vs.Recipe.model_validate(RECIPE), epochs=None)

    next(frames)
    assert len(asked) == 1
    next(frames)
    next(frames)
    assert len(asked) == 1


def test_a_terminal_shows_how_many_are_compiled_and_a_file_nothing(monkeypatch: pytest.MonkeyPatch):
    terminal, file = Terminal(), StringIO()
    for stream in (terminal, file):
        monkeypatch.setattr("sys.stderr", stream)
        for done in (0, 3):
            shown_on_terminal(Progress("kernels", done, 3))

    assert (
        terminal.getvalue()
        == "\rcompiling kernels, once on this machine: 0 of 3\rcompiling kernels, once on this machine: 3 of 3\n"
    )
    assert file.getvalue() == ""
