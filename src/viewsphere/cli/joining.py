"""Commands that make a data set, or other formats, of other data sets."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from viewsphere.cli import completion
from viewsphere.cli.arguments import (
    AsJson,
    Durability,
    FormatOptions,
    Formats,
    Workers,
    asked_formats,
    located_path,
    with_options,
)
from viewsphere.cli.terminal import MOST_FINDINGS, ProgressBar, print_json, say
from viewsphere.errors import UserError
from viewsphere.run.workers.worker_count import cores
from viewsphere.validation.quantity import quantity

if TYPE_CHECKING:
    from viewsphere.recipe.formats import FormatEntry

NewFolder = Annotated[
    Path | None, typer.Option("-o", "--output", help="Folder of the new data set.", show_default=False, callback=located_path)
]


def merge(
    folders: Annotated[list[Path], typer.Argument(help="Data sets to join, two or more.", show_default=False)],
    output: NewFolder = None,
    mixed: Annotated[bool, typer.Option(help="Join data sets of different cameras or channels.")] = False,
    keep_going: Annotated[bool, typer.Option(help="Use the finished frames of unfinished data sets.")] = False,
    format_: Formats = None,
    format_option: FormatOptions = None,
    durability: Durability = None,
    json_: AsJson = False,
) -> None:
    """Join data sets into a new one: categories by name, models by content. Links pictures and leaves the sources unchanged."""
    from viewsphere.run.datasets.merging import merge as join

    target, formats = _needed(output), with_options(asked_formats(format_) or (), format_option)
    with ProgressBar(quiet=json_) as bar:
        dataset = join(folders, target, mixed=mixed, keep_going=keep_going, listener=bar.show)
    notes = _exported(target, formats)
    counts = {"root": str(target), "frames": len(dataset), "models": len(dataset.plan.models)}
    if json_:
        print_json({**counts, "categories": [c.name for c in dataset.categories], "notes": notes})
        return
    for note in notes:
        say(note)
    names = ", ".join(c.name for c in dataset.categories)
    say(f"{target}: {quantity(len(dataset), 'frame')}, {quantity(len(dataset.plan.models), 'model')}; {names}")


def import_(
    kind: Annotated[
        str,
        typer.Argument(
            metavar="FORMAT",
            help="Format of the data set; `viewsphere formats` lists importable formats.",
            show_default=False,
            autocompletion=completion.formats,
        ),
    ],
    source: Annotated[Path, typer.Argument(help="Folder of the data set, or COCO's JSON file.", show_default=False)],
    output: NewFolder = None,
    keep_going: Annotated[bool, typer.Option(help="Skip broken entries.")] = False,
    format_: Formats = None,
    format_option: FormatOptions = None,
    durability: Durability = None,
    json_: AsJson = False,
) -> None:
    """Open a data set made elsewhere, so that you can merge, view and export it. Links the pictures."""
    from viewsphere.run.datasets.importing import import_dataset

    target, formats = _needed(output), with_options(asked_formats(format_) or (), format_option)
    with ProgressBar(quiet=json_) as bar:
        foreign = import_dataset(kind, source, target, keep_going=keep_going, listener=bar.show)
    notes = _exported(target, formats)
    if json_:
        print_json({"root": str(target), "frames": foreign.count, "left_out": list(foreign.left_out), "notes": notes})
        return
    _tell_left_out(foreign.left_out)
    for note in notes:
        say(note)
    say(f"{target}: {quantity(foreign.count, 'frame')}; {', '.join(c.name for c in foreign.categories)}")


def convert(
    source: Annotated[Path, typer.Argument(help="Folder of the data set, or COCO's JSON file.", show_default=False)],
    kind: Annotated[
        str | None,
        typer.Option(
            "--from",
            metavar="FORMAT",
            help="Format of the data set; `viewsphere formats` lists importable formats.",
            show_default=False,
            autocompletion=completion.formats,
        ),
    ] = None,
    formats: Annotated[
        str | None,
        typer.Option("--to", help="Formats, with commas.", show_default=False, autocompletion=completion.formats),
    ] = None,
    format_option: FormatOptions = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Folder for the formats' folders.", show_default=False, callback=located_path),
    ] = None,
    keep_going: Annotated[bool, typer.Option(help="Skip broken entries.")] = False,
    workers: Workers = None,
    durability: Durability = None,
    json_: AsJson = False,
) -> None:
    """Convert a data set made elsewhere to other formats, each in a folder of its name. Links or copies the pictures."""
    from viewsphere.run.datasets.converting import convert as write_formats
    from viewsphere.run.datasets.importing import readable_formats
    from viewsphere.run.exports.writable import writable_formats

    if kind is None:
        raise UserError(f"--from: expected one of {', '.join(readable_formats())}; found none")
    names, target = asked_formats(formats, "--to") or (), _needed(output, "the formats' folders")
    if not names:
        raise UserError(f"--to: expected one or more of {', '.join(writable_formats())}; found none")
    crew = cores() if workers is None else workers
    try:
        with ProgressBar(quiet=json_) as bar:
            summary = write_formats(
                kind,
                source,
                with_options(names, format_option),
                target,
                keep_going=keep_going,
                workers=crew,
                listener=bar.show,
            )
    except KeyboardInterrupt:
        say("stopped; nothing was written", err=True)
        raise typer.Exit(130) from None
    if json_:
        report = {"left_out": list(summary.left_out), "notes": list(summary.notes)}
        print_json({"formats": list(names), "frames": summary.frames, **report})
        return
    _tell_left_out(summary.left_out)
    for note in summary.notes:
        say(note)
    for name in dict.fromkeys(names):
        say(f"wrote {target / name}")


def _tell_left_out(problems: Sequence[str]) -> None:
    for problem in problems[:MOST_FINDINGS]:
        say(f"left out {problem}", err=True)
    if len(problems) > MOST_FINDINGS:
        say(f"and {len(problems) - MOST_FINDINGS:,} more; --json lists all", err=True)


def _needed(output: Path | None, what: str = "the new data set") -> Path:
    if output is None:
        raise UserError(f"-o: expected a folder for {what}; found none")
    return output


def _exported(folder: Path, formats: Sequence[FormatEntry]) -> list[str]:
    from viewsphere.run.exports.exporting import export

    return list(export(folder, formats, workers=cores())) if formats else []
