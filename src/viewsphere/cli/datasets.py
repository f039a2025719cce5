"""Commands that start from a data set."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from viewsphere.cli import completion
from viewsphere.cli.arguments import (
    AllowScripts,
    AsJson,
    DataFolder,
    Durability,
    FormatOptions,
    Workers,
    asked_formats,
    located_path,
    split,
    with_options,
)
from viewsphere.cli.terminal import (
    ProgressBar,
    print_formats,
    print_json,
    print_plugins,
    print_report,
    print_status,
    say,
    waiting,
)
from viewsphere.errors import UserError
from viewsphere.run.workers.worker_count import cores

if TYPE_CHECKING:
    from viewsphere.report import Proof
    from viewsphere.store import Dataset


def export(
    folder: DataFolder,
    format_: Annotated[
        str | None,
        typer.Option("--format", "-f", help="Formats, with commas.", show_default=False, autocompletion=completion.formats),
    ] = None,
    format_option: FormatOptions = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            help="Folder for the formats' folders; default: the data set's.",
            show_default=False,
            callback=located_path,
        ),
    ] = None,
    models: Annotated[
        str | None,
        typer.Option(help="Only frames of these models: keys or patterns, with commas; needs --output.", show_default=False),
    ] = None,
    frames: Annotated[
        str | None,
        typer.Option(help="Only these frames: numbers from 0 and ranges, such as 0-15,40; needs --output.", show_default=False),
    ] = None,
    workers: Workers = None,
    durability: Durability = None,
    json_: AsJson = False,
) -> None:
    """Write a finished or half-finished data set, or some of its frames, in other formats, without rendering."""
    from viewsphere.run.exports.exporting import export as write_formats
    from viewsphere.run.exports.writable import writable_formats
    from viewsphere.store import Choice, Dataset, frame_ranges

    names = asked_formats(format_)
    if not names:
        raise UserError(f"--format: expected one or more of {', '.join(writable_formats())}; found none")
    keys = split(models)
    if keys == ():
        raise UserError(f"--models: expected keys or patterns; found {models!r}")
    choice = Choice(keys or (), () if frames is None else frame_ranges(frames))
    crew = cores() if workers is None else workers
    notes = write_formats(folder, with_options(names, format_option), output=output, choice=choice, workers=crew)
    if json_:
        dataset = Dataset(folder, choice)
        print_json({"formats": list(names), "frames": len(dataset), "of": dataset.plan.frames, "notes": list(notes)})
        return
    for note in notes:
        say(note)
    for name in names:
        say(f"wrote {(output or folder) / name}")


def formats(json_: AsJson = False) -> None:
    """List all formats with the channels they need, their content and their readers."""
    from viewsphere.run.reports.format_list import listed

    found = listed()
    if json_:
        print_json([format_.__dict__ for format_ in found])
    else:
        print_formats(found)


def plugins(json_: AsJson = False) -> None:
    """List all plug-ins with their distributions, and any reason why they cannot be loaded."""
    from viewsphere.run.reports.plugin_list import overview

    found = overview()
    if json_:
        print_json([plugin.__dict__ for plugin in found])
    else:
        print_plugins(found)


def status(folder: DataFolder, json_: AsJson = False) -> None:
    """Report the progress of a data set: finished, active, skipped and missing frames, active and failed runs, and the
    time left. Exit status 0 if nothing is missing, 3 otherwise.
    """
    from viewsphere.run.status import status as found_in

    progress = found_in(folder)
    if json_:
        print_json(progress.to_json())
    else:
        print_status(progress)
    if not progress.complete:
        raise typer.Exit(3)


def check(
    folder: DataFolder,
    sample: Annotated[int, typer.Option(min=0, help="Number of frames to recompute labels for.")] = 50,
    all_: Annotated[bool, typer.Option("--all", help="Recompute the labels of all frames.")] = False,
    fast: Annotated[
        bool, typer.Option("--fast", help="Compare only digests, of the store and of exports, without decoding pictures.")
    ] = False,
    mend: Annotated[
        bool, typer.Option("--repair", help="Render damaged shots again, and write damaged models and exports again.")
    ] = False,
    workers: Workers = None,
    against_cycles: Annotated[
        int, typer.Option(min=0, metavar="N", help="Compare N frames with Cycles' pass of object indices; needs Blender.")
    ] = 0,
    repaint: Annotated[
        str | None,
        typer.Option(
            metavar="N|all", help="Paint N frames again, or all, and compare pictures and passes.", show_default=False
        ),
    ] = None,
    durability: Durability = None,
    json_: AsJson = False,
    allow_scripts: AllowScripts = False,
) -> None:
    """Prove a data set: digests of all files, plan, models and shots from the stored recipe, labels from the exported models,
    rays, exports. Exit status 1 if it fails.
    """
    from viewsphere.check import check as prove
    from viewsphere.check.repair import repair
    from viewsphere.store import Dataset

    crew = cores() if workers is None else workers
    options: dict[str, Any] = {"sample": None if all_ else sample, "against_cycles": against_cycles, "fast": fast}
    options["repaint"] = _frames_asked(repaint)
    if mend:
        with ProgressBar(quiet=json_) as bar:
            repaired = repair(folder, workers=crew, listener=bar.show, **options)
        done, report = repaired.done, repaired.report
    else:
        with waiting(f"checking {folder}", quiet=json_):
            done, report = (), prove(Dataset(folder), workers=crew, **options)
    if json_:
        print_json({**({"repaired": list(done)} if mend else {}), **report.to_json()})
    else:
        print_report(report, done)
    if not report.ok:
        raise typer.Exit(1)


def report(
    folder: DataFolder,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Page to write; default: report.html in the folder.", callback=located_path),
    ] = None,
    frames: Annotated[int, typer.Option(min=1, max=2000, help="Frames shown; all are counted.")] = 240,
    proofs: Annotated[bool, typer.Option("--check/--no-check", help="Show the findings of `check`.")] = True,
    check_frames: Annotated[int, typer.Option(min=1, help="Most frames that `check` reads, spread evenly.")] = 1000,
    json_: AsJson = False,
) -> None:
    """Write one HTML page with pictures and their labels, viewpoints, distributions, models, recipe and proofs."""
    from viewsphere.report import write_report
    from viewsphere.store import Dataset

    dataset = Dataset(folder)
    page = output or folder / "report.html"

    def tell(phase: str, done: int, total: int) -> None:
        if not json_ and done == total:
            say(f"{phase}: {total:,}", err=True)

    proof = _proof(dataset, check_frames) if proofs and len(dataset) else None
    size = write_report(dataset, page, frames=frames, proof=proof, workers=cores(), listener=tell)
    if json_:
        print_json({"page": str(page), "bytes": size, "frames": len(dataset), "ok": None if proof is None else proof.ok})
        return
    say(f"wrote {page} ({size / 1e6:.1f} MB): open it in a browser")


def view(
    folder: DataFolder,
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port to listen at; 0: any free port.")] = 8642,
    host: Annotated[str, typer.Option(help="Address to listen at; the default is for this machine only.")] = "127.0.0.1",
    token: Annotated[
        str | None,
        typer.Option(help="Token that a browser must send; default: a new one.", envvar="VIEWSPHERE_TOKEN"),
    ] = None,
    open_: Annotated[bool, typer.Option("--open", help="Open the page in a browser.")] = False,
) -> None:
    """Show a data set of any size in a browser, also during rendering, until Ctrl-C."""
    import webbrowser

    from viewsphere.view import Address, Live, Server

    live = Live(folder, workers=cores())
    with Server(live, Address(host, port, token)) as server:
        live.start()
        say(f"{server.url} shows {folder}; Ctrl-C ends it")
        if open_:
            webbrowser.open(server.url)
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            say("ended", err=True)
            raise typer.Exit(130) from None
        finally:
            live.stop()


def _proof(dataset: Dataset, frames: int) -> Proof:
    """The findings of `check` on this many frames, for a report."""
    from viewsphere.check import check as prove
    from viewsphere.report import Proof

    report = prove(dataset, frames=frames)
    return Proof(report.ok, report.checked, tuple(map(str, report.findings)), report.notes, report.verdict, report.not_run)


def _frames_asked(text: str | None) -> int | None:
    """The number of frames that `--repaint` requests, None for all."""
    if text == "all":
        return None
    if text is None or text.isdecimal():
        return int(text or 0)
    raise UserError(f"--repaint: expected a number of frames or all; found {text!r}")
