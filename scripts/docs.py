"""Generated pages: the command line, the table of channels, the recipe's schema."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from typer.main import get_command

from viewsphere.cli import app
from viewsphere.model.channel import CHANNELS
from viewsphere.model.recipe_file import schema

DOCS = Path(__file__).parent.parent / "docs"
NOTE = "<!-- written by scripts/docs; do not edit -->\n\n"


def cli_page() -> str:
    text = (
        NOTE
        + "# Command line\n\n"
    text += "Exit status: 0 done, 1 a data set failed its check, 2 a mistake that can be mended, 130 stopped with Ctrl-C.\n"
    )
    for name, command in get_command(app).commands.items():  # type: ignore[attr-defined]
        arguments = [p for p in command.params if p.param_type_name == "argument"]
        options = [p for p in command.params if p.param_type_name == "option" and p.name != "help"]
        usage = " ".join(
            ["viewsphere", name, *(p.name.upper() for p in arguments), *(["[OPTIONS]"] if options else [])]
        )
        text += f"\n## {name}\n\n{command.help.strip()}\n\n```\n{usage}\n```\n"
        if command.params:
            text += "\n| | |\n|---|---|\n" + "".join(f"| {label(p)} | {meaning(p)} |\n" for p in arguments + options)
    return text


def label(parameter: Any) -> str:
    if parameter.param_type_name == "argument":
        return f"`{parameter.name.upper()}`"
    return ", ".join(f"`{o}`" for o in (*parameter.opts, *parameter.secondary_opts))


def meaning(parameter: Any) -> str:
    text = parameter.help or ""
    choices = getattr(parameter.type, "choices", None)
    if choices:
        text += " One of " + ", ".join(str(getattr(c, "value", c)) for c in choices) + "."
    if parameter.required and parameter.param_type_name == "option":
        text += " Required."
    default = parameter.default
    if default not in (None, False, ()) and not callable(default) and isinstance(default, (int, str, Path)):
        text += f" Default: {default}."
    return text.strip()


def channels_page() -> str:
    text = NOTE + (
        "# Channels\n\nA recipe's `channels` name what is kept of each frame. Arrays have the image's height and width; "
        "channels of several components have them last. PNG files are lossless; TIFF files hold the exact values (deflate).\n\n"
        "| channel | type | components | unit | empty | file | what it is |\n|---|---|---|---|---|---|---|\n"
    )
    for c in CHANNELS.values():
        file = {"png": "PNG", "png16": "16-bit PNG", "tiff": "TIFF"}[c.encoding]
        text += (
            f"| `{c.name}` | {np.dtype(c.dtype)} | {c.components} | {c.unit} | {c.empty:g} | {file} | {c.meaning} |\n"
        )
    return text


PAGES = {
    "cli.md": cli_page,
    "channels.md": channels_page,
    "recipe.schema.json": lambda: json.dumps(schema(), indent=1) + "\n",
}


def main() -> None:
    stale = [
        name for name, make in PAGES.items() if not (DOCS / name).exists() or (DOCS / name).read_text("utf-8") != make()
    ]
    if "--check" in sys.argv:
        if stale:
            sys.exit(
                f"docs/{', docs/'.join(stale)}: expected what the code says, found something else: run scripts/docs"
            )
        return
    for name in stale:
        (DOCS / name).write_text(PAGES[name](), "utf-8")
        print(f"wrote docs/{name}")


if __name__ == "__main__":
    main()
