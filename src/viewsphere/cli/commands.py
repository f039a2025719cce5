"""The commands of the command line. Each command imports the heavy modules that it needs."""

from __future__ import annotations

import sys
from typing import Any, cast

import typer

from viewsphere.cli import cache, datasets, doctor, joining, making
from viewsphere.cli.arguments import Version
from viewsphere.cli.next_step import Command
from viewsphere.cli.terminal import complain
from viewsphere.errors import UserError

UsageError = cast("type[Exception]", typer.BadParameter.__base__)
"""Typer's error for unusable arguments; no name exports it in all versions."""

app = typer.Typer(
    name="viewsphere",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.callback()
def viewsphere(version: Version = False) -> None:
    """3D models in, exactly labelled image data sets out."""


for command in (
    making.new,
    making.schema,
    making.inspect,
    making.plan,
    making.preview,
    making.render,
    datasets.export,
    datasets.formats,
    datasets.plugins,
    datasets.status,
    datasets.check,
    datasets.report,
    datasets.view,
    cache.cache,
    doctor.doctor,
):
    app.command(cls=Command)(command)
app.command("merge", cls=Command)(joining.merge)
app.command("import", cls=Command)(joining.import_)
app.command("convert", cls=Command)(joining.convert)


def explain(error: Any) -> None:
    """Print a mistake in options in one line, or the help if nothing was given; exits with status 2."""
    if type(error).__name__ == "NoArgsIsHelpError":
        error.show()
        sys.exit(2)
    complain(UserError(_message_of(error)), 2)


def _message_of(error: Any) -> str:
    """Return the message of an error, with a hint to the help of its command."""
    from pydantic import ValidationError

    from viewsphere.validation.errors import first_of, nearest

    context: Any = error.ctx
    name = "" if context is None or context.parent is None else context.info_name
    command, where = (f"viewsphere {name}", f"{name}: ") if name else ("viewsphere", "")
    if type(error).__name__ == "NoSuchOption":
        options = [name for p in error.ctx.command.params for name in p.opts]
        return _with_help(f"{where}{error.option_name} is no option{nearest(error.option_name, options)}", command)
    if isinstance(error.__cause__, ValidationError) and _option(error):
        return _with_help(f"{where}{_option(error)}: {first_of(error.__cause__)}", command)
    message = " ".join(error.format_message().split()).removesuffix(".").replace(". Did", "; did")
    return _with_help(f"{where}{message[0].lower()}{message[1:]}", command)


def _with_help(message: str, command: str) -> str:
    """The message and the command that shows help, joined according to the message's last character."""
    return f"{message} See {command} -h" if message.endswith("?") else f"{message}: see {command} -h"


def _option(error: Any) -> str:
    """The option or argument whose value cannot be used, as it is written; empty if the error concerns none."""
    names: list[str] = getattr(getattr(error, "param", None), "opts", [])
    return max(names, key=len, default="")
