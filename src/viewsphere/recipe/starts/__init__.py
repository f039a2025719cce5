"""What `viewsphere new` writes: a folder a kind, named after it, with a commented recipe and perhaps a script."""

from __future__ import annotations

from importlib.resources import files

FIRST = "poses"
"""The kind that is written where none is named."""


def kinds() -> tuple[str, ...]:
    """The names of all kinds, sorted, the first kind first."""
    names = (folder.name for folder in files(__name__).iterdir() if folder.joinpath("recipe.yaml").is_file())
    return tuple(sorted(names, key=lambda name: (name != FIRST, name)))


def start(kind: str) -> dict[str, str]:
    """The files of a kind, name -> text, the recipe first; each recipe can be rendered unchanged."""
    folder = files(__name__).joinpath(kind)
    names = sorted((file.name for file in folder.iterdir() if file.is_file()), key=lambda name: (name != "recipe.yaml", name))
    return {name: folder.joinpath(name).read_text("utf-8") for name in names}
