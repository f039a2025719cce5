"""Mistakes in options, which typer finds, said as all other mistakes are: in one line."""

from __future__ import annotations

import sys
from typing import Any, cast

import typer

from viewsphere.cli.terminal import complain
from viewsphere.errors import UserError

UsageError = cast("type[Exception]", typer.BadParameter.__base__)
"""What typer raises for arguments that it cannot use; it exports this class by no name that all its versions have."""


def explain(error: Any) -> None:
    """Print a mistake in options in one line, or the help where nothing was given; exits with status 2."""
    if type(error).__name__ == "NoArgsIsHelpError":
        error.show()
        sys.exit(2)
    complain(UserError(said(error)), 2)


def said(error: Any) -> str:
    """What was expected and found, and which help to ask for."""
    from pydantic import ValidationError

    from viewsphere.model.mistakes import first_of, nearest

    context: Any = error.ctx
    name = "" if context is None or context.parent is None else context.info_name
    command, where = (f"viewsphere {name}", f"{name}: ") if name else ("viewsphere", "")
    option = getattr(error, "option_name", None)
    if option and getattr(error, "possibilities", None) is not None:
        options = [name for p in error.ctx.command.params for name in p.opts]
        return f"{where}{option} is no option{nearest(option, options) or ':'} See {command} -h"
    if isinstance(error.__cause__, ValidationError) and _option(error):
        return f"{where}{_option(error)}: {first_of(error.__cause__)}: see {command} -h"
    message = " ".join(error.format_message().split()).removesuffix(".")
    return f"{where}{message[0].lower()}{message[1:]}: see {command} -h"


def _option(error: Any) -> str:
    """The option or argument whose value cannot be used, as it is written; empty where the mistake is of none."""
    names: list[str] = getattr(getattr(error, "param", None), "opts", [])
    return max(names, key=len, default="")
