"""The commands of the command line. Each command imports the heavy modules that it needs."""

from __future__ import annotations

import typer

from viewsphere.cli import cache, datasets, doctor, joining, making
from viewsphere.cli.arguments import Version
from viewsphere.cli.next_step import Command

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
