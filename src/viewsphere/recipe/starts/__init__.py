"""The files that `viewsphere new` writes: a folder for each kind, named after it, with a commented recipe and possibly a
script.
"""

from __future__ import annotations

from importlib.resources import files
from typing import NamedTuple

FIRST = "poses"
"""The default kind."""

FEWEST = 6
"""Number of models that fill the scenes and the splits by model of a starting recipe; fewer models repeat within a scene."""

REPEAT = "  repeat: true                 # a model may stand in a scene more than once"

BY_FRAME = "splits: {by: frame, train: 0.8, val: 0.2}    # with more models: {by: model, train: 0.7, val: 0.3}"


def kinds() -> tuple[str, ...]:
    """The names of all kinds, sorted, the first kind first."""
    names = (folder.name for folder in files(__name__).iterdir() if folder.joinpath("recipe.yaml").is_file())
    return tuple(sorted(names, key=lambda name: (name != FIRST, name)))


def start(kind: str) -> dict[str, str]:
    """The files of a kind, name -> text, the recipe first; each recipe can be rendered unchanged."""
    folder = files(__name__).joinpath(kind)
    names = sorted((file.name for file in folder.iterdir() if file.is_file()), key=lambda name: (name != "recipe.yaml", name))
    return {name: folder.joinpath(name).read_text("utf-8") for name in names}


class FoundFiles(NamedTuple):
    """Model files of one kind in one folder: a pattern that matches them, their number, and their category."""

    pattern: str
    number: int
    category: str
