"""The command line: recipes in, data sets out. Heavy modules are imported by the command that needs them."""

from __future__ import annotations

import os
import sys

import typer

from viewsphere.cli import completion, datasets, doctor, joining, making
from viewsphere.cli.next_step import Command
from viewsphere.cli.terminal import complain
from viewsphere.errors import CheckFailedError, UserError, ViewsphereError

app = typer.Typer(
    name="viewsphere",
    help="3D models in, exactly labelled image data sets out.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)
for command in (
    making.new,
    making.schema,
    making.inspect,
    making.plan,
    making.preview,
    making.render,
    datasets.export,
    datasets.check,
    datasets.report,
    doctor.doctor,
):
    app.command(cls=Command)(command)
app.command("merge", cls=Command)(joining.merge)
app.command("import", cls=Command)(joining.import_)


def main() -> None:
    """Run the command line; the user's mistakes are one line and exit status 2, never a traceback."""
    try:
        if os.environ.get("_VIEWSPHERE_COMPLETE") == completion.BASH:
            completion.in_bash(app, os.environ)
        app()
    except CheckFailedError as error:
        complain(error, 1)
    except UserError as error:
        complain(error, 2)
    except ViewsphereError as error:
        complain(error, 3)
    except KeyboardInterrupt:
        sys.exit(130)
