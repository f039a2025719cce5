"""Arguments that several commands take."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from viewsphere.cli import completion
from viewsphere.cli.terminal import say
from viewsphere.errors import UserError

if TYPE_CHECKING:
    from viewsphere.recipe.formats import FormatEntry
    from viewsphere.recipe.recipe import Recipe

RecipeFile = Annotated[Path, typer.Argument(help="Recipe (YAML).", show_default=False)]


def located_path(path: Path | None) -> Path | None:
    """The folder of this path, or the data at its URL."""
    from viewsphere.store import located

    return None if path is None else located(path)


DataFolder = Annotated[
    Path, typer.Argument(help="Folder or URL that `render` wrote.", show_default=False, callback=located_path)
]
Changes = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="FIELD=VALUE",
        help="Set a field: 'viewpoints.elevation=[10,20]'; repeatable.",
        autocompletion=completion.changes,
    ),
]


def _tell_version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        say(f"viewsphere {version('viewsphere')}")
        raise typer.Exit


Version = Annotated[
    bool, typer.Option("--version", help="Print the version.", callback=_tell_version, is_eager=True, show_default=False)
]


def _allow_scripts(allowed: bool) -> bool:
    """Allow scripts of recipes in this process and its child processes."""
    if allowed:
        from viewsphere.blender.interpreter import SCRIPTS

        os.environ[SCRIPTS] = "1"
    return allowed


AllowScripts = Annotated[
    bool, typer.Option("--allow-scripts", help="Allow the recipe's engine.script, a program, to run.", callback=_allow_scripts)
]


def _keep(durability: str | None) -> str | None:
    """Set the durability of finished files in this process and its child processes."""
    from viewsphere.store.shots.moving import DURABILITY
    from viewsphere.store.shots.moving import durability as asked

    if durability is not None:
        os.environ[DURABILITY] = durability
        asked()
    return durability


Durability = Annotated[
    str | None,
    typer.Option(
        "--durability",
        metavar="none|fsync",
        help="fsync: finished work survives a crash of the machine; slower.",
        callback=_keep,
        show_default=False,
    ),
]
Workers = Annotated[
    int | None,
    typer.Option(min=0, help="Processes; default: one a core. 0: this one.", show_default=False),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON for scripts.")]
Formats = Annotated[
    str | None,
    typer.Option("--format", "-f", help="Formats, with commas; default: the recipe's.", autocompletion=completion.formats),
]

FormatOptions = Annotated[
    list[str] | None,
    typer.Option(
        "--format-option",
        metavar="FORMAT.OPTION=VALUE",
        help="Set an option of a format: coco.category_ids=coco; repeatable.",
    ),
]


def load_recipe(file: Path, changes: Sequence[str] | None = None) -> Recipe:
    """The recipe of a file with some fields set; RecipeError names every mistake."""
    from viewsphere.assets.readers import suffixes
    from viewsphere.recipe.reading.extends import parse_change
    from viewsphere.recipe.recipe import Recipe

    if file.suffix.lower()[1:] in suffixes():
        raise UserError(
            f"{file}: expected a recipe (YAML); found a model: look at it (viewsphere inspect {file}), or name it as "
            "source in a recipe (viewsphere new FOLDER)"
        )
    return Recipe.load(file, dict(map(parse_change, changes or ())))


def split(names: str | None) -> tuple[str, ...] | None:
    """The names in a comma-separated list; None for None."""
    return None if names is None else tuple(name.strip() for name in names.split(",") if name.strip())


def asked_formats(formats: str | None, option: str = "--format") -> tuple[str, ...] | None:
    """The formats that an option names, None for None; UserError names one that cannot be written."""
    from viewsphere.run.exports.writable import writable

    asked = split(formats)
    for name in asked or ():
        writable(name, option)
    return asked


def with_options(names: Sequence[str], options: Sequence[str] | None) -> tuple[FormatEntry, ...]:
    """The formats of these names with the options that are set for them; RecipeError names invalid options."""
    from viewsphere.recipe.formats import FormatEntry
    from viewsphere.recipe.reading.extends import parse_change
    from viewsphere.validation.errors import one_of

    entries = {name: FormatEntry(name=name) for name in names}
    for text in options or ():
        field, value = parse_change(text, "--format-option", "coco.category_ids=coco")
        name, dot, option = field.partition(".")
        if not dot:
            met = "no option" if field in entries else f"no format: say {names[0]}.{text}" if names else "no format"
            raise UserError(f"--format-option {text}: expected format.option=value; found {met}")
        if name not in entries:
            raise UserError(f"--format-option {field}: {one_of(name, tuple(entries))}, or add it to the formats")
        entries[name] = FormatEntry(name=name, options={option: value}).over(entries[name].options)
        entries[name].arguments(f"--format-option {name}")
    return tuple(entries.values())
