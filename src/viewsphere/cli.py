"""The command line: recipes in, data sets out. Heavy modules are imported by the command that needs them."""

from __future__ import annotations

import os
import sys
from collections import Counter
from dataclasses import asdict
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from viewsphere.errors import CheckFailedError, StoreError, UserError, ViewsphereError

if TYPE_CHECKING:
    from viewsphere.check import Report
    from viewsphere.model.recipe import Recipe
    from viewsphere.run.generate import Listener, Progress, Summary
    from viewsphere.sampling.plan import Plan

app = typer.Typer(
    name="viewsphere",
    help="3D models in, exactly labelled image data sets out.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)

MOST_FINDINGS = 20

RecipeFile = Annotated[Path, typer.Argument(help="Recipe (YAML).", show_default=False)]
DataFolder = Annotated[Path, typer.Argument(help="Folder that `render` wrote.", show_default=False)]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON for scripts.")]
Formats = Annotated[str | None, typer.Option("--format", "-f", help="Formats, with commas; default: the recipe's.")]


class Draw(StrEnum):
    """What a contact sheet shows over its pictures."""

    boxes = "boxes"
    boxes3d = "boxes3d"
    masks = "masks"
    depth = "depth"


@app.command()
def new(
    folder: Annotated[Path, typer.Argument(help="Folder to make the recipe in.", show_default=False)],
) -> None:
    """Write a commented recipe to start from."""
    from viewsphere.model.recipe_file import template

    file = folder if folder.suffix in {".yaml", ".yml"} else folder / "recipe.yaml"
    if file.exists():
        raise UserError(f"{file}: expected a new file, found one that exists: choose another folder")
    _write(file, template().encode())
    typer.echo(f"wrote {file}; next: viewsphere preview {file}")


@app.command()
def schema() -> None:
    """Print the recipe's JSON schema, for editors."""
    import json

    from viewsphere.model.recipe_file import schema as recipe_schema

    typer.echo(json.dumps(recipe_schema(), indent=2))


@app.command()
def inspect(
    model: Annotated[str, typer.Argument(help="Model file, or zoo:<family>.", show_default=False)],
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Where the picture goes; default: beside you, <model>-sides.png."),
    ] = None,
    up: Annotated[str | None, typer.Option(help="Up axis, such as +z; default: the format's.")] = None,
    forward: Annotated[str | None, typer.Option(help="Axis the front faces; default: the format's.")] = None,
    unit: Annotated[float | None, typer.Option(help="Metres in one unit; default: the file's.")] = None,
    seed: Annotated[int, typer.Option(help="Which draw of a zoo family.")] = 0,
    json_: AsJson = False,
) -> None:
    """Show a model's size, axes, parts, materials, textures and warnings, and a picture from four sides."""
    from viewsphere.preview import four_sides
    from viewsphere.run.inspection import inspect_model, model_spec, report_lines

    _announce_compilation()
    spec = model_spec(model, up=up, forward=forward, unit=unit, seed=seed)
    report = inspect_model(spec)
    picture = output or Path(f"{Path(model.replace(':', '-')).stem}-sides.png")
    _write_picture(picture, four_sides(spec))
    if json_:
        _print_json({**asdict(report), "picture": str(picture)})
        return
    for line in report_lines(report):
        typer.echo(line)
    typer.echo(f"picture from four sides: {picture} (the first view must show the front; if not, set up and forward)")


@app.command()
def plan(recipe: RecipeFile, json_: AsJson = False) -> None:
    """Say what a recipe would make: models, poses, frames, splits. Nothing is rendered, no model is read."""
    from viewsphere.sampling.plan import plan as make_plan

    planned = make_plan(_recipe(recipe))
    counts = {
        "name": planned.recipe.name,
        "models": planned.models,
        "poses": planned.poses,
        "frames": planned.frames,
    }
    if json_:
        _print_json(
            {
                **counts,
                "splits": dict(planned.split_counts),
                "shots": planned.shot_count,
                "warnings": list(planned.warnings),
            }
        )
        return
    _print_plan(planned)


@app.command()
def preview(
    source: Annotated[Path, typer.Argument(help="Recipe (YAML), or a folder that `render` wrote.", show_default=False)],
    output: Annotated[Path, typer.Option("-o", "--output", help="Picture to write.")] = Path("preview.png"),
    count: Annotated[int, typer.Option("-n", "--count", min=1, help="Frames shown.")] = 12,
    draw: Annotated[list[Draw] | None, typer.Option(help="Draw over the pictures; may be given several times.")] = None,
    columns: Annotated[int, typer.Option(min=1, help="Pictures in a row.")] = 4,
) -> None:
    """Write a contact sheet: a recipe's frames rendered small, or a data set's."""
    from viewsphere.preview import contact_sheet, dataset_samples, preview_samples
    from viewsphere.store import Dataset

    if not source.is_dir():
        _announce_compilation()
    samples = dataset_samples(Dataset(source), count) if source.is_dir() else list(preview_samples(_recipe(source), count))
    if not samples:
        raise StoreError(f"{source}: expected finished frames, found none: render first")
    _write_picture(output, contact_sheet(samples, [d.value for d in draw or ()], columns))
    typer.echo(f"wrote {output} ({len(samples)} frames)")


@app.command()
def render(
    recipe: RecipeFile,
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder of the data set.", show_default=False)],
    format_: Formats = None,
    workers: Annotated[
        int | None,
        typer.Option(min=0, help="Processes; default: one a core. 0: this one.", show_default=False),
    ] = None,
    keep_going: Annotated[bool, typer.Option(help="Leave out models that cannot be used.")] = False,
    json_: AsJson = False,
) -> None:
    """Render a recipe into a data set. Run it again to resume: finished frames are never rendered twice."""
    from viewsphere.run.generate import generate
    from viewsphere.sampling.plan import plan as make_plan

    loaded = _recipe(recipe)
    planned = make_plan(loaded)
    if not json_:
        _print_plan(planned)
    crew = _cores() if workers is None else workers
    with _ProgressBar(quiet=json_) as bar:
        try:
            summary = generate(
                loaded,
                output,
                workers=crew,
                formats=_split(format_),
                keep_going=keep_going,
                listener=bar.show,
            )
        except KeyboardInterrupt:
            bar.stop()
            typer.echo(f"stopped; {bar.kept}. Run the same command to go on", err=True)
            raise typer.Exit(130) from None
    _print_summary(summary, json_)


@app.command()
def export(
    folder: DataFolder,
    format_: Annotated[str, typer.Option("--format", "-f", help="Formats, with commas.", show_default=False)],
    json_: AsJson = False,
) -> None:
    """Write a finished or half-finished data set in other formats, without rendering."""
    from viewsphere.run.generate import export as write_formats

    names = _split(format_)
    if not names:
        from viewsphere import plugins

        raise UserError(f"--format: expected one or more of {', '.join(plugins.names('formats'))}; found none")
    notes = write_formats(folder, names)
    if json_:
        _print_json({"formats": list(names), "notes": list(notes)})
        return
    for note in notes:
        typer.echo(note)
    for name in names:
        typer.echo(f"wrote {folder / name}")


@app.command()
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
        _print_json(report.to_json())
    else:
        _print_report(report)
    if not report.ok:
        raise typer.Exit(1)


def main() -> None:
    """Run the command line; the user's mistakes are one line and exit status 2, never a traceback."""
    try:
        app()
    except CheckFailedError as error:
        _complain(error, 1)
    except UserError as error:
        _complain(error, 2)
    except ViewsphereError as error:
        _complain(error, 3)
    except KeyboardInterrupt:
        sys.exit(130)


def _complain(error: ViewsphereError, status: int) -> None:
    for line in str(error).splitlines():
        typer.echo(f"viewsphere: {line}", err=True)
    sys.exit(status)


def _announce_compilation() -> None:
    """Say why the first picture on a machine takes longer."""
    from viewsphere.geometry.jit import kernel_folder

    if not kernel_folder().is_dir():
        typer.echo("compiling kernels, once on this machine: about 20 seconds", err=True)


def _recipe(file: Path) -> Recipe:
    from viewsphere.model.recipe import Recipe

    return Recipe.load(file)


def _split(formats: str | None) -> tuple[str, ...] | None:
    return None if formats is None else tuple(f.strip() for f in formats.split(",") if f.strip())


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _write(file: Path, data: bytes) -> None:
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(data)
    except OSError as error:
        raise UserError(f"{file}: expected a place to write, found: {error.strerror or error}") from None


def _write_picture(file: Path, picture: Any) -> None:
    from viewsphere.geometry.image_files import encode_png

    _write(file, encode_png(picture))


def _print_json(value: object) -> None:
    import json

    typer.echo(json.dumps(value, indent=2))


def _print_plan(planned: Plan) -> None:
    splits = ", ".join(f"{name} {count:,}" for name, count in planned.split_counts.items())
    typer.echo(
        f"{planned.recipe.name}: {planned.models:,} models x {planned.poses:,} poses = {planned.frames:,} frames ({splits})"
    )
    for warning in planned.warnings:
        typer.echo(f"warning: {warning}", err=True)


def _print_report(report: Report) -> None:
    failed = Counter(finding.check for finding in report.findings)
    for name, count in report.checked.items():
        typer.echo(f"{name:12} {f'{failed[name]:,} findings' if failed[name] else 'ok':14} {count:,} checked")
    for note in report.notes:
        typer.echo(f"note: {note}")
    for finding in report.findings[:MOST_FINDINGS]:
        typer.echo(f"failed: {finding}", err=True)
    if len(report.findings) > MOST_FINDINGS:
        typer.echo(f"and {len(report.findings) - MOST_FINDINGS:,} findings more; --json lists all", err=True)
    typer.echo("all proofs hold" if report.ok else f"{len(report.findings):,} findings")


def _print_summary(summary: Summary, as_json: bool) -> None:
    if as_json:
        _print_json({**summary.__dict__, "root": str(summary.root)})
        return
    for key, why in summary.skipped.items():
        typer.echo(f"left out {key}: {why}", err=True)
    for key, warnings in list(summary.warnings.items())[:MOST_FINDINGS]:
        for warning in warnings:
            typer.echo(f"warning: model {key}: {warning}", err=True)
    if len(summary.warnings) > MOST_FINDINGS:
        typer.echo(f"and warnings of {len(summary.warnings) - MOST_FINDINGS:,} models more; --json lists all", err=True)
    for note in summary.notes:
        typer.echo(note)
    rate = f", {summary.rendered / summary.seconds:.1f} frames/s" if summary.rendered else ""
    formats = ", ".join(summary.formats) or "no format asked for"
    typer.echo(f"{summary.root}: {summary.frames:,} frames ({summary.rendered:,} new{rate}); {formats}")


class _ProgressBar:
    """A line a phase: what is done, frames a second, time left."""

    def __init__(self, quiet: bool) -> None:
        self.kept = "nothing was finished yet"
        self._quiet = quiet
        self._bars: dict[str, Any] = {}
        self._rich: Any = None

    def __enter__(self) -> _ProgressBar:
        if not self._quiet:
            from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

            self._rich = Progress(
                TextColumn("{task.description:8}"),
                BarColumn(),
                MofNCompleteColumn(),
                TextColumn("{task.fields[rate]}"),
                TimeRemainingColumn(),
            )
            self._rich.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def stop(self) -> None:
        if self._rich is not None:
            self._rich.stop()

    @property
    def show(self) -> Listener:
        """A listener for `generate`."""

        def listen(progress: Progress) -> None:
            if progress.phase == "frames":
                self.kept = f"{progress.done:,} of {progress.total:,} frames are kept"
            if self._rich is None:
                return
            if progress.phase not in self._bars:
                self._bars[progress.phase] = self._rich.add_task(progress.phase, total=progress.total, rate="")
            bar = self._bars[progress.phase]
            elapsed = self._rich.tasks[bar].elapsed or 0.0
            made = progress.done - progress.resumed
            rate = f"{made / elapsed:.1f} frames/s" if progress.phase == "frames" and made and elapsed else ""
            self._rich.update(bar, completed=progress.done, rate=rate)

        return listen
