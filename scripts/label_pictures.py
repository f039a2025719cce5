"""The small pictures of docs/proofs.md: each label and pass as `preview` draws it, in a recipe of recipes/labels that shows it.

    .venv/bin/python scripts/label_pictures.py [NAME ...]

Of a recipe's frames the one is taken in which the label shows most.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from viewsphere import Recipe, render
from viewsphere.labels import ObjectLabel, drawable, is_in, is_shown, labels
from viewsphere.model.sample import Sample
from viewsphere.preview import draw_sample

ROOT = Path(__file__).parent.parent
RECIPES = sorted((ROOT / "recipes" / "labels").glob("*.yaml"))
FOLDER = ROOT / "docs" / "images" / "labels"
SIZE = (200, 150)
QUALITY = 86
EVERYWHERE = "hidden"
"""The recipe that shows what every data set has."""

Picture = NDArray[np.uint8]


@cache
def recipes() -> dict[str, Recipe]:
    """By name; their pictures are as large as the page shows them."""
    return {file.stem: Recipe.load(file, {"camera.size": SIZE}) for file in RECIPES}


def recipe_of(source: str) -> str:
    """The name of the recipe that shows a label or pass: the recipe of that name, else one that requests it."""
    asking = (name for name, recipe in recipes().items() if source in (*recipe.channels, *recipe.annotations))
    return source if source in recipes() else next(asking, EVERYWHERE)


@cache
def samples(name: str) -> tuple[Sample, ...]:
    return tuple(sample for sample in render(recipes()[name]) if is_shown(sample.channels))


def picture(source: str) -> Picture:
    """The drawing in the frame in which it shows most."""
    known = samples(recipe_of(source))
    drawn = [_drawn(known, i, source) for i in range(len(known)) if is_in(source, known[i])]
    return max(drawn, key=lambda one: one[:2])[2]


def _drawn(known: Sequence[Sample], i: int, source: str) -> tuple[int, float, Picture]:
    """Return the number of different values of a frame's objects, the share that the drawing shows, and the picture."""
    drawing, sample = drawable()[source], known[i]
    earlier = [one for one in known[:i] if (one.sequence, one.sensor) == (sample.sequence, sample.sensor) and one.sequence]
    plain, found = (draw_sample(sample, draw, SIZE[0], lambda _: earlier) for draw in ((), (drawing.name,)))
    label = labels().get(source)
    values = {repr(getattr(o, label.fields[0].name)) for o in sample.objects} if isinstance(label, ObjectLabel) else ()
    if found.shape == plain.shape:
        return len(values), bool(drawing.trails) * len(earlier) + float((found != plain).mean()), found
    beside = found[:, plain.shape[1] :]
    return 0, float(beside.std()), beside


def main() -> None:
    FOLDER.mkdir(parents=True, exist_ok=True)
    for source in sys.argv[1:] or drawable():
        Image.fromarray(picture(source)).save(FOLDER / f"{source}.jpg", quality=QUALITY, subsampling=0, optimize=True)


if __name__ == "__main__":
    main()
