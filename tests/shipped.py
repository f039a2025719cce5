"""Rendering a recipe as it is shipped, no field replaced: a small one whole, of a large one the first frames."""

from __future__ import annotations

from itertools import islice

import pytest

import viewsphere as vs
from built_once import built_once
from command_line import viewsphere
from small import ROOT

MOST_PIXELS = 13e6
"""Of a recipe that is rendered whole; a larger one takes minutes, and its frames differ little."""

FIRST = 2
"""Frames of a large recipe: the first shows that it renders, the second that time or the camera goes on."""


def pixels(file):
    planned = vs.plan(file)
    width, height = vs.Recipe.load(file).camera.size
    return planned.frames * width * height


def rendered(file, folder):
    """Render a recipe, and check what it makes."""
    if pixels(file) > MOST_PIXELS:
        samples = list(islice(vs.render(file), FIRST))
        assert len(samples) == FIRST and all(sample.rgb.std() > 3 for sample in samples)
        assert any(sample.objects for sample in samples)
        return
    done = viewsphere("render", file, "-o", folder / "out", "--workers", "0")
    assert done.returncode == 0, done.stderr
    dataset = vs.open(folder / "out")
    assert len(dataset) == vs.plan(file).frames
    assert all((folder / "out" / entry.name).is_dir() for entry in vs.Recipe.load(file).formats)
    checked = viewsphere("check", folder / "out", "--sample", "3")
    assert checked.returncode == 0, checked.stdout + checked.stderr


@pytest.fixture(scope="module", autouse=True)
def models_built_once():
    """For a module that imports it: models of the zoo are built once for all its recipes."""
    with built_once():
        yield


def each_renders(*folders):
    """A test that renders every recipe of these folders of recipes/."""
    files = sorted(file for folder in folders for file in (ROOT / "recipes" / folder).glob("*.yaml"))
    assert files

    @pytest.mark.shipped
    @pytest.mark.slow
    @pytest.mark.parametrize("file", files, ids=lambda file: file.stem)
    def test(file, tmp_path):
        rendered(file, tmp_path)

    return test
