"""Commands that start from a recipe or a model."""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from contextlib import ExitStack, nullcontext, redirect_stdout
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from viewsphere.cli import completion
from viewsphere.cli.arguments import (
    AllowScripts,
    AsJson,
    Changes,
    Durability,
    FormatOptions,
    Formats,
    RecipeFile,
    asked_formats,
    load_recipe,
    located_path,
    with_options,
)
from viewsphere.cli.next_step import for_command, for_render
from viewsphere.cli.terminal import (
    ProgressBar,
    print_estimate,
    print_json,
    print_plan,
    print_summary,
    say,
    waiting,
    write_picture,
)
from viewsphere.errors import StoreError, UserError
from viewsphere.kernels.garbage import importing
from viewsphere.recipe.starts import BY_FRAME, FEWEST, FIRST, REPEAT, FoundFiles, kinds, start
from viewsphere.run.workers.worker_count import cores
from viewsphere.scratch import write_whole
from viewsphere.validation.quantity import quantity

if TYPE_CHECKING:
    from viewsphere.planning.plan import Plan
    from viewsphere.recipe.recipe import Recipe
    from viewsphere.run.estimate import Estimate
    from viewsphere.run.reports.set_report import SetReport


def new(
    folder: Annotated[
        Path | None,
        typer.Argument(
            help="Folder for the recipe; with --from, the default is <name of PATH>-again.",
            show_default=False,
        ),
    ] = None,
    kind: Annotated[
        str | None,
        typer.Option(
            help="Task: poses (the default), detector, pose6d, in-memory, blender.",
            autocompletion=completion.starts,
            show_default=False,
        ),
    ] = None,
    from_: Annotated[
        tuple[str, Path] | None,
        typer.Option(
            "--from",
            metavar="FORMAT PATH",
            help="A data set to render again, with its models, poses and cameras: bop, pascal3d, colmap or nerfstudio.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Write a commented recipe to start from, with the models in FOLDER if there are any; or a recipe of a data set."""
    if from_ is not None:
        if kind is not None:
            raise UserError(f"new: expected --kind or --from; found --kind {kind} and --from {from_[0]}: leave one of them out")
        _new_again(from_[0], from_[1], folder)
        return
    if folder is None:
        raise UserError(for_command("new"))
    _new_start(folder, FIRST if kind is None else kind)


def _new_again(format_: str, source: Path, folder: Path | None) -> None:
    from viewsphere.run.reproduce import make_again

    _compile_kernels()
    recipe = make_again(format_, source, folder or Path(f"{source.resolve().stem}-again"))
    for note in recipe.notes:
        say(f"note: {note}", err=True)
    what = quantity(recipe.models, "model") if recipe.models else "a stand-in model, as the data set has none"
    say(f"wrote {recipe.recipe}: {quantity(recipe.shots, 'shot')}, {what}; next: viewsphere preview {recipe.recipe}")


def _new_start(folder: Path, kind: str) -> None:
    if kind not in kinds():
        from viewsphere.validation.errors import one_of

        raise UserError(f"--kind: {one_of(kind, kinds())}")
    file = folder if folder.suffix in {".yaml", ".yml"} else folder / "recipe.yaml"
    models = _models_in(file.parent)
    files = {file if name == "recipe.yaml" else file.parent / name: text for name, text in start(kind).items()}
    if models:
        files[file] = _with_models(files[file], file.parent.absolute().name, models)
    for path in files:
        if path.exists():
            raise UserError(f"{path}: expected a new file, found one that exists: choose another folder")
    with ExitStack() as undo:
        for path, text in files.items():
            write_whole(path, text.encode())
            undo.callback(path.unlink)
        undo.pop_all()
    of = f" of {quantity(sum(one.number for one in models), 'model file')}" if models else ""
    say(f"wrote {' and '.join(map(str, files))}{of}; next: viewsphere preview {file}")


def _models_in(folder: Path) -> tuple[FoundFiles, ...]:
    """The model files that lie in a folder, if it is there."""
    if not folder.is_dir():
        return ()
    from viewsphere.planning.models import files_below

    return tuple(FoundFiles(*found) for found in files_below(folder))


def schema() -> None:
    """Print the recipe's JSON schema, for editors."""

    from viewsphere.labels import channels, on_request
    from viewsphere.recipe.recipe import schema as recipe_schema

    print_json(recipe_schema(channels=tuple(channels()), annotations=tuple(on_request())))


def inspect(
    model: Annotated[
        str | None,
        typer.Argument(
            help="Model file, a name such as zoo:car, or a set of models such as gso:FOLDER.",
            show_default=False,
            autocompletion=completion.models,
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Picture to write; default: <model>-sides.png in the current folder."),
    ] = None,
    up: Annotated[
        str | None, typer.Option(help="Up axis, such as +z; default: the format's.", autocompletion=completion.axes)
    ] = None,
    forward: Annotated[
        str | None, typer.Option(help="Axis the front faces; default: the format's.", autocompletion=completion.axes)
    ] = None,
    unit: Annotated[
        str | None, typer.Option(help="Unit of the file: m, cm, mm, in, ft or metres in one; default: the file's.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed for a model that is drawn, such as zoo:car.")] = 0,
    rig: Annotated[
        Path | None,
        typer.Option(help="Instead of a model: a recipe; shows its sensors and writes <recipe>-rig.glb.", show_default=False),
    ] = None,
    changes: Changes = None,
    json_: AsJson = False,
    allow_scripts: AllowScripts = False,
) -> None:
    """Show a model's size, axes, parts, materials, animations, warnings, and a picture from four sides; or the models of a set,
    or a recipe's rig.
    """
    from viewsphere.preview import four_sides
    from viewsphere.run.reports.inspection import inspect_model, model_spec, report_lines
    from viewsphere.run.reports.set_report import set_report

    if (model is None) == (rig is None):
        raise UserError(
            for_command("inspect") if rig is None else f"inspect: expected a model or --rig; found {model} and --rig"
        )
    if rig is not None:
        _inspect_rig(rig, output, changes, json_)
        return
    assert model is not None
    if (found := set_report(model)) is not None:
        _inspect_set(found, output, json_)
        return
    _compile_kernels()
    spec = model_spec(model, up=up, forward=forward, unit=unit, seed=seed)
    report = inspect_model(spec)
    picture = output or Path(f"{Path(model.replace(':', '-')).stem}-sides.png")
    write_picture(picture, four_sides(spec, (report.up, report.forward)))
    if json_:
        print_json({**asdict(report), "picture": str(picture)})
        return
    for line in report_lines(report):
        say(line)
    hint = "the first view must show the front; if another does, give --forward as written below that one"
    say(f"picture from four sides: {picture} ({hint})")


def _inspect_set(report: SetReport, output: Path | None, json_: bool) -> None:
    """Show the models of a set: their numbers, broken ones, and a sheet of a few of them."""
    from viewsphere.preview import one_view_each
    from viewsphere.run.reports.set_report import set_lines

    _compile_kernels()
    sheet, faults = one_view_each(report.shown)
    report = replace(report, faults=report.faults | faults)
    picture = output or Path(f"{Path(report.source.replace(':', '-')).name}-models.png")
    if sheet is not None:
        write_picture(picture, sheet)
    if json_:
        shown = [spec.key for spec in report.shown if spec.key not in faults]
        print_json({**asdict(report), "shown": shown, "picture": None if sheet is None else str(picture)})
        return
    for line in set_lines(report):
        say(line)
    say(f"{len(report.shown) - len(faults)} of them: {picture}" if sheet is not None else "no model to show")


def _inspect_rig(recipe: Path, output: Path | None, changes: list[str] | None, json_: bool) -> None:
    """Show the sensors of a recipe: in words, as a model (GLB), and in a picture of this model from four sides."""
    from viewsphere.assets.exporting.glb import glb_bytes
    from viewsphere.preview import four_sides
    from viewsphere.run.reports.inspection import model_spec
    from viewsphere.run.reports.rig_view import recipe_rig, rig_lines, rig_mesh, sensor_facts

    loaded = load_recipe(recipe, changes)
    shown = recipe_rig(loaded)
    _compile_kernels()
    picture = output or Path(f"{recipe.stem}-rig.png")
    frusta = picture.with_suffix(".glb")
    write_whole(frusta, glb_bytes(rig_mesh(shown)))
    write_picture(picture, four_sides(model_spec(str(frusta))))
    if json_:
        sensors = [asdict(facts) for facts in sensor_facts(shown, loaded)]
        pairs = [pair._asdict() for pair in shown.rectified]
        print_json({"sensors": sensors, "rectified": pairs, "model": str(frusta), "picture": str(picture)})
        return
    for line in rig_lines(shown, loaded):
        say(line)
    say(f"frusta: {frusta} (front: ahead of the first sensor); from four sides: {picture}")


def plan(
    recipe: RecipeFile,
    changes: Changes = None,
    estimate: Annotated[
        bool,
        typer.Option(
            "--estimate", help="Also render a few frames in a temporary folder, and estimate the total time and size."
        ),
    ] = False,
    models: Annotated[
        bool,
        typer.Option("--models", help="Also read every model; report unusable files and cameras inside models."),
    ] = False,
    workers: Annotated[
        int | None,
        typer.Option(min=0, help="Processes to estimate for; default: one a core.", show_default=False),
    ] = None,
    json_: AsJson = False,
    allow_scripts: AllowScripts = False,
) -> None:
    """Report a recipe's models, poses, frames and splits. Reads no mesh without --models or --estimate."""
    with importing():
        from viewsphere.planning.plan import check_sidecars
        from viewsphere.run.opening import check_formats, prepare

        loaded = load_recipe(recipe, changes)
        planned = prepare(loaded)
        check_formats(planned, loaded.formats, planned.recipe.channels)
        check_sidecars(planned)
    if not json_:
        print_plan(planned)
        for note in planned.notes:
            say(f"note: {note}")
    model_warnings = _model_warnings(planned, json_) if models else ()
    cost = _estimate(loaded, workers) if estimate else None
    counts = {
        "name": planned.recipe.name,
        "models": planned.models,
        "poses": planned.poses,
        **({"time_steps": planned.time_steps} if planned.timings else {}),
        "frames": planned.frames,
    }
    if json_:
        print_json(
            {
                **counts,
                "splits": dict(planned.split_counts),
                "shots": planned.shot_count,
                "warnings": [*planned.warnings, *model_warnings],
                "notes": list(planned.notes),
                **({"estimate": asdict(cost)} if cost else {}),
            }
        )
    elif cost:
        print_estimate(cost)


def preview(
    source: Annotated[
        Path,
        typer.Argument(
            help="Recipe (YAML), or a folder or URL that `render` wrote.", show_default=False, callback=located_path
        ),
    ],
    output: Annotated[Path, typer.Option("-o", "--output", help="Picture to write.")] = Path("preview.png"),
    count: Annotated[int, typer.Option("-n", "--count", min=1, help="Frames shown; for sequences, instants.")] = 12,
    draw: Annotated[
        list[str] | None,
        typer.Option(
            help="Label to draw: boxes, boxes3d, masks, depth, normals, parts, flow, ...; repeatable.",
            autocompletion=completion.drawings,
        ),
    ] = None,
    columns: Annotated[int, typer.Option(min=1, help="Pictures in a row; for sequences, instants.")] = 4,
    video: Annotated[
        Path | None,
        typer.Option(help="Instead of a picture: a video of a data set's sequences, .mp4 or .webp.", show_default=False),
    ] = None,
    sequence: Annotated[
        str | None, typer.Option(help="Sequence for the video; default: all, one after another.", show_default=False)
    ] = None,
    changes: Changes = None,
    allow_scripts: AllowScripts = False,
) -> None:
    """Write a contact sheet of a recipe's frames, rendered small, or of a data set's; filmstrips for sequences; or a video."""
    from viewsphere.labels import is_shown
    from viewsphere.preview import Earlier, contact_sheet, dataset_samples, films_of, preview_samples, small_objects
    from viewsphere.store import Dataset

    names = draw or []
    if video is not None:
        _write_video(source, video, names, sequence)
        return
    if sequence is not None:
        raise UserError("--sequence: expected --video beside it; found none: say which file to write")
    recipe = None
    if source.is_dir():
        dataset = Dataset(source)
        films = films_of(dataset, is_shown)
        samples, before = dataset_samples(dataset, count, columns, films), Earlier(dataset, films)
    else:
        recipe = load_recipe(source, changes)
        _compile_kernels(recipe)
        with recipe.located():
            samples = list(preview_samples(recipe, count, draw=names, row=columns))
        before = Earlier(samples, ())
    if not samples:
        raise StoreError(f"{source}: expected finished frames, found none: render first")
    for warning in small_objects(samples, recipe):
        say(f"warning: {warning}", err=True)
    write_picture(output, contact_sheet(samples, names, columns, before=before))
    say(f"wrote {output} ({quantity(len(samples), 'frame')})")


def _write_video(source: Path, file: Path, draw: list[str], sequence: str | None) -> None:
    from viewsphere.preview import write_video
    from viewsphere.run.progress import Progress
    from viewsphere.store import Dataset

    if not source.is_dir():
        raise UserError(f"--video: expected a folder that `render` wrote; found {source}: render it first")
    with ProgressBar(quiet=False) as bar:

        def tell(done: int, total: int) -> None:
            bar.show(Progress("video", done, total))

        video = write_video(Dataset(source), file, draw, sequence, tell)
    many = f"{quantity(video.sequences, 'sequence')}, {quantity(video.pictures, 'picture')}"
    say(f"wrote {file} ({many}, {video.seconds:g} s)")


DataSetFolder = Annotated[
    Path | None,
    typer.Option(
        "-o", "--output", help="Folder of the data set, or a URL (s3://...).", show_default=False, callback=located_path
    ),
]
RenderWorkers = Annotated[
    int | None,
    typer.Option(
        min=0,
        help="Processes; default: one a core, none for short work. 0: this one. With --ray: most CPUs; default: all.",
        show_default=False,
    ),
]
ShardOption = Annotated[
    str | None,
    typer.Option(
        metavar="K/N",
        help="Render only the K-th of N fixed shares of the shots, K from 0: for job arrays.",
        show_default=False,
    ),
]
RayAddress = Annotated[
    str | None,
    typer.Option(metavar="ADDRESS", help="Render on a Ray cluster: auto, HOST:PORT or ray://HOST:PORT.", show_default=False),
]


def render(
    recipe: Annotated[Path | None, typer.Argument(help="Recipe (YAML).", show_default=False)] = None,
    output: DataSetFolder = None,
    changes: Changes = None,
    format_: Formats = None,
    format_option: FormatOptions = None,
    workers: RenderWorkers = None,
    keep_going: Annotated[bool, typer.Option(help="Skip unusable models.")] = False,
    append: Annotated[bool, typer.Option("--append", help="Add models, poses and channels to a finished data set.")] = False,
    durability: Durability = None,
    shard: ShardOption = None,
    ray: RayAddress = None,
    json_: AsJson = False,
    allow_scripts: AllowScripts = False,
) -> None:
    """Render a recipe into a data set. Run it again to resume: finished frames are never rendered twice."""
    if recipe is None or output is None:
        raise UserError(for_render(recipe, output))
    with waiting(f"planning {recipe}", quiet=json_), importing():
        from viewsphere.planning.plan import plan as make_plan
        from viewsphere.run.generate import generate
        from viewsphere.run.opening import to_append
        from viewsphere.run.shards import shard_named
        from viewsphere.store import Store

        chosen_shard = None if shard is None else shard_named(shard)
        loaded = load_recipe(recipe, changes)
        asked = asked_formats(format_)
        planned = make_plan(loaded)
        formats = with_options([entry.name for entry in loaded.formats] if asked is None else asked, format_option)
    addition = to_append(planned, Store(output)) if append else None
    if not json_:
        print_plan(planned)
        if addition is not None and any(Store(output).gaps(addition.record)):
            say(f"{output}: {addition}")
    diverted = redirect_stdout(sys.stderr) if json_ else nullcontext()  # what libraries print is no JSON
    with ProgressBar(quiet=json_) as bar, diverted:
        try:
            summary = generate(
                loaded,
                output,
                workers=workers,
                formats=formats,
                keep_going=keep_going,
                append=append,
                shard=chosen_shard,
                ray=ray,
                listener=bar.show,
            )
        except KeyboardInterrupt:
            bar.stop()
            say(f"stopped; {_kept(output)}. Run the same command to go on", err=True)
            raise typer.Exit(130) from None
    print_summary(summary, json_)


def _model_warnings(planned: Plan, quiet: bool) -> tuple[str, ...]:
    from viewsphere.run.shots.models import check_models

    with ProgressBar(quiet) as bar:
        warnings = check_models(planned, bar.show)
    for line in () if quiet else warnings:
        say(f"warning: {line}", err=True)
    return warnings


def _kept(output: Path) -> str:
    """The number of frames that the data set holds after a stop, as `status` counts them."""
    from viewsphere.run.status import status

    try:
        found = status(output)
    except StoreError:  # stopped before the store was made
        return "nothing was finished yet"
    return f"{found.finished:,} of {quantity(found.frames, 'frame')} are kept"


def _estimate(recipe: Recipe, workers: int | None) -> Estimate:
    from viewsphere.run.estimate import estimate

    _compile_kernels(recipe)
    return estimate(recipe, cores() if workers is None else workers)


def _compile_kernels(recipe: Recipe | None = None) -> None:
    """Compile the kernels that a recipe's frames call, or a plain one's: the first picture on a machine takes longer."""
    from viewsphere.plugins import gap
    from viewsphere.plugins.source import model_for
    from viewsphere.recipe.recipe import Recipe
    from viewsphere.run.shots.precompile import precompile_for, told_to

    if recipe is None and gap():  # there is no such model, and the first picture compiles what it needs
        return
    plain = {"models": [{"source": model_for("example")}], "viewpoints": {"azimuth": [0], "elevation": [20], "distance": 4}}
    with ProgressBar(quiet=False) as bar:
        precompile_for(recipe or Recipe.model_validate(plain), told_to(bar.show))


def _with_models(text: str, name: str, found: Sequence[FoundFiles]) -> str:
    """The text of a starting recipe, named `name`, with these files instead of the zoo's models."""
    entries = "".join(
        f"  - source: {_quoted(one.pattern)}    # {quantity(one.number, 'file')}\n    category: {_quoted(one.category)}\n"
        for one in found
    )
    hints = (
        "    # unit: mm                 # m, cm, mm, in, ft or the metres in one unit\n"
        "    # up: +z                   # the axis that points up ...\n"
        "    # forward: -y              # ... and the one that the front faces; viewsphere inspect FILE shows both\n"
    )
    text = re.sub(r"^name: \S+", lambda _: f"name: {_quoted(name)}", text, count=1, flags=re.MULTILINE)
    models = f"models:\n{entries}{hints}".rstrip("\n")
    text = re.sub(r"^models:.*?(?=\n\n)", lambda _: models, text, count=1, flags=re.DOTALL | re.MULTILINE)
    text = re.sub(r"^(viewpoints:)  .*$", r"\1", text, count=1, flags=re.MULTILINE)
    fill = "  distance: {fill: 0.6}        # the share of the picture that the model takes; or metres"
    text = re.sub(r"^  distance: [\d[].*$", fill, text, count=1, flags=re.MULTILINE)
    few = sum(one.number for one in found) < FEWEST
    if few:
        text = re.sub(r"^splits: \{by: model.*$", BY_FRAME, text, count=1, flags=re.MULTILINE)
        text = re.sub(r"^(  objects: .*)$", rf"\1\n{REPEAT}", text, count=1, flags=re.MULTILINE)
    return text


def _quoted(text: str) -> str:
    """The text as YAML in a line, in quotes where it needs them."""
    import yaml

    plain = re.fullmatch(r"[A-Za-z_][\w ./-]*", text) and yaml.safe_load(text) == text
    return text if plain else yaml.safe_dump(text, default_style='"', width=10_000).strip()
