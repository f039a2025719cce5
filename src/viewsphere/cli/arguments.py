"""Arguments that several commands take."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from viewsphere.model.recipe import Recipe

RecipeFile = Annotated[Path, typer.Argument(help="Recipe (YAML).", show_default=False)]
DataFolder = Annotated[Path, typer.Argument(help="Folder that `render` wrote.", show_default=False)]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON for scripts.")]
Formats = Annotated[str | None, typer.Option("--format", "-f", help="Formats, with commas; default: the recipe's.")]


def load_recipe(file: Path) -> Recipe:
    """The recipe of a file; RecipeError names every mistake."""
    from viewsphere.model.recipe import Recipe

    return Recipe.load(file)


def split(formats: str | None) -> tuple[str, ...] | None:
    """Names with commas between them, None for None."""
    return None if formats is None else tuple(f.strip() for f in formats.split(",") if f.strip())
