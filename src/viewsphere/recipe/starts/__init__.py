"""The files that `viewsphere new` writes: a folder for each kind, named after it, with a commented recipe and possibly a
script.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from importlib.resources import files
from typing import NamedTuple

from viewsphere.validation.quantity import quantity

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


def with_models(text: str, name: str, found: Sequence[FoundFiles]) -> str:
    """The text of a starting recipe, named `name`, with these files instead of the zoo's models."""
    entries = "".join(
        f"  - source: {_quoted(one.pattern)}    # {quantity(one.number, 'file')}\n    category: {_quoted(one.category)}\n"
        for one in found
    )
    hints = (
        "    # unit: mm                 # m, cm, mm, in, ft or the metres in one unit\n"
        "    # up: +z                   # the axis that points up ...\n"
        "    # forward: -y              # ... and the one that the front faces; viewsphere inspect FILE shows both\n"
    )
    text = re.sub(r"^name: \S+", lambda _: f"name: {_quoted(name)}", text, count=1, flags=re.MULTILINE)
    models = f"models:\n{entries}{hints}".rstrip("\n")
    text = re.sub(r"^models:.*?(?=\n\n)", lambda _: models, text, count=1, flags=re.DOTALL | re.MULTILINE)
    text = re.sub(r"^(viewpoints:)  .*$", r"\1", text, count=1, flags=re.MULTILINE)
    fill = "  distance: {fill: 0.6}        # the share of the picture that the model takes; or metres"
    text = re.sub(r"^  distance: [\d[].*$", fill, text, count=1, flags=re.MULTILINE)
    few = sum(one.number for one in found) < FEWEST
    if few:
        text = re.sub(r"^splits: \{by: model.*$", BY_FRAME, text, count=1, flags=re.MULTILINE)
        text = re.sub(r"^(  objects: .*)$", rf"\1\n{REPEAT}", text, count=1, flags=re.MULTILINE)
    return text


def _quoted(text: str) -> str:
    """The text as YAML in a line, in quotes where it needs them."""
    import yaml

    plain = re.fullmatch(r"[A-Za-z_][\w ./-]*", text) and yaml.safe_load(text) == text
    return text if plain else yaml.safe_dump(text, default_style='"', width=10_000).strip()
