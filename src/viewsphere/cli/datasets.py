"""Commands that start from a data set."""

from __future__ import annotations

from typing import Annotated

import typer

from viewsphere.cli.arguments import AsJson, DataFolder, split
from viewsphere.cli.terminal import print_json, print_report
from viewsphere.errors import UserError


def export(
    folder: DataFolder,
    format_: Annotated[str, typer.Option("--format", "-f", help="Formats, with commas.", show_default=False)],
    json_: AsJson = False,
) -> None:
    """Write a finished or half-finished data set in other formats, without rendering."""
    from viewsphere.run.generate import export as write_formats

    names = split(format_)
    if not names:
        from viewsphere import plugins

        raise UserError(f"--format: expected one or more of {', '.join(plugins.names('formats'))}; found none")
    notes = write_formats(folder, names)
    if json_:
        print_json({"formats": list(names), "notes": list(notes)})
        return
    for note in notes:
        typer.echo(note)
    for name in names:
        typer.echo(f"wrote {folder / name}")


def check(
    folder: DataFolder,
    sample: Annotated[int, typer.Option(min=0, help="Frames for the costly proofs (rays).")] = 50,
    json_: AsJson = False,
) -> None:
    """Prove a data set: files, counts, boxes, masks, polygons, 3D boxes, depth and exports. Exit status 1 if it fails."""
    from viewsphere.check import check as prove
    from viewsphere.store import Dataset

    report = prove(Dataset(folder), sample=sample)
    if json_:
        print_json(report.to_json())
    else:
        print_report(report)
    if not report.ok:
        raise typer.Exit(1)
