"""Rendering a recipe as it is shipped, no field replaced: a small one whole, of a large one the first frames."""

from __future__ import annotations

from itertools import islice

import viewsphere as vs
from command_line import viewsphere

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
