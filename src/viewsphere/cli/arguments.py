"""Arguments that several commands take."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from viewsphere.cli import completion

if TYPE_CHECKING:
    from viewsphere.recipe.recipe import Recipe

RecipeFile = Annotated[Path, typer.Argument(help="Recipe (YAML).", show_default=False)]
DataFolder = Annotated[Path, typer.Argument(help="Folder that `render` wrote.", show_default=False)]
Changes = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="FIELD=VALUE",
        help="Set a field: 'viewpoints.elevation=[10,20]'; several times for several.",
        autocompletion=completion.changes,
    ),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON for scripts.")]
Formats = Annotated[
    str | None,
    typer.Option("--format", "-f", help="Formats, with commas; default: the recipe's.", autocompletion=completion.formats),
]


def load_recipe(file: Path, changes: Sequence[str] | None = None) -> Recipe:
    """The recipe of a file with some fields set; RecipeError names every mistake."""
    from viewsphere.recipe.extends import parse_change
    from viewsphere.recipe.recipe import Recipe

    return Recipe.load(file, dict(map(parse_change, changes or ())))


def split(formats: str | None) -> tuple[str, ...] | None:
    """The names in a comma-separated list; None for None."""
    return None if formats is None else tuple(f.strip() for f in formats.split(",") if f.strip())


def cores() -> int:
    """How many processes may run at once."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
