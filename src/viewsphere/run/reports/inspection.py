"""The report of `viewsphere inspect` on one model."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import cast, get_args

from viewsphere.assets.animation.clip import Timeline
from viewsphere.assets.inspect import ModelReport, describe
from viewsphere.errors import UserError
from viewsphere.model.model_spec import Axis, ModelSpec
from viewsphere.plugins.source import SourceModel, source_of
from viewsphere.recipe.models import UNITS, unit_metres
from viewsphere.validation.errors import one_of


def model_spec(
    source: str,
    *,
    up: str | None = None,
    forward: str | None = None,
    unit: str | None = None,
    seed: int = 0,
    facts: SourceModel | None = None,
) -> ModelSpec:
    """A model file or `zoo:car` with the given settings, and defaults for the others: `facts` of the model's source, by default
    what the source of a set states.

    Raises UserError for an invalid axis or unit, and for a model that a set does not have.
    """
    for name, axis in (("up", up), ("forward", forward)):
        if axis is not None and axis not in get_args(Axis):
            raise UserError(f"--{name}: {one_of(axis, get_args(Axis))}")
    named = source_of(source)
    is_drawn = named is not None and named.spec.drawn
    if named is not None and named.spec.folder is not None:
        facts = facts or named.spec.expand(named.name)[0]
        source = f"{named.prefix}:{facts.name}"
    facts = facts or SourceModel(source)
    return ModelSpec(
        key=Path(source.replace(":", "-")).stem or "model",
        source=source if named else str(Path(source).absolute()),
        seed=seed if is_drawn else None,
        category="model",
        category_id=1,
        up=cast("Axis | None", up) or facts.up,
        forward=cast("Axis | None", forward) or facts.forward,
        unit=facts.unit if unit is None else _metres(unit),
    )


def _metres(unit: str) -> float:
    """The length in metres of a unit as in recipes: a name or a number."""
    try:
        metres = unit_metres(unit) if unit in UNITS else float(unit)
    except ValueError:
        metres = 0.0
    if not 0 < metres < math.inf:
        raise UserError(f"--unit: {one_of(unit, tuple(UNITS))}, or the metres in one unit, more than 0")
    return metres


def inspect_model(spec: ModelSpec) -> ModelReport:
    """Return the report on a model: its contents, and its form after loading; raises ModelError for an unusable file."""
    return describe(spec)


def report_lines(report: ModelReport) -> Iterator[str]:
    """The lines of the report."""
    width, height, length = report.size
    raw = " x ".join(f"{x:.4g}" for x in report.raw_size)
    yield f"{report.source} ({report.format})"
    yield f"  size       width {width:.4g} m, height {height:.4g} m, length {length:.4g} m (in the file: {raw})"
    yield f"  axes       up {report.up}, forward {report.forward}; 1 unit = {report.unit:g} m"
    yield f"  triangles  {report.triangles:,} ({report.vertices:,} vertices)"
    yield f"  diameter   {report.diameter:.4g} m"
    attributes = [name for name, has in (("uv", report.has_uv), ("vertex colours", report.has_colors)) if has]
    if attributes:
        yield f"  carries    {', '.join(attributes)}"
    yield f"  parts      {len(report.parts)}"
    for name, count in report.parts[:20]:
        yield f"    {name}: {count:,} triangles"
    if len(report.parts) > 20:
        yield f"    and {len(report.parts) - 20} more"
    yield f"  materials  {len(report.materials)}"
    for name, values in report.materials[:20]:
        yield f"    {name or '(unnamed)'}: {_values(values) or 'plain'}"
    for name, (w, h) in report.textures:
        yield f"  texture    {name}: {w} x {h}"
    yield from _keypoints(report)
    yield from _symmetries(report)
    yield from _animation(report.animation)
    for warning in report.warnings:
        yield f"  warning    {warning}"
    for suggestion in report.suggestions:
        yield f"  hint       {suggestion}"


def _keypoints(report: ModelReport) -> Iterator[str]:
    if report.keypoints is None:
        return
    points: dict[str, Sequence[float]] = report.keypoints["points"]
    unit = "m, object's axes" if report.axes == "object" else "the file's axes and unit"
    yield f"  keypoints  {len(points)} ({unit})"
    for name, place in [*points.items()][:20]:
        yield f"    {name}: {_numbers(place)}"
    if len(points) > 20:
        yield f"    and {len(points) - 20} more"


def _symmetries(report: ModelReport) -> Iterator[str]:
    """Yield the lines about symmetries: their number, and detected symmetries in the form of a sidecar."""
    discrete, continuous = report.symmetries["discrete"], report.symmetries["continuous"]
    kinds = [f"{len(discrete)} rotation{'s' if len(discrete) > 1 else ''}"] if discrete else []
    kinds += [f"round about {len(continuous)} {'axes' if len(continuous) > 1 else 'axis'}"] if continuous else []
    yield f"  symmetric  {' and '.join(kinds) or 'no'} ({'as declared' if report.declares else 'by its shape'})"
    if report.declares or not kinds or not report.sidecar:
        return
    yield f"  hint       if they are meant, and no texture says otherwise, put these lines into {report.sidecar} beside it:"
    yield "symmetries:"
    if discrete:
        yield "  discrete:"
        yield from (f"  - [{', '.join(map(_numbers, rows))}]" for rows in discrete)
    if continuous:
        yield "  continuous:"
        yield from (f"  - {{axis: {_numbers(line['axis'])}, offset: {_numbers(line['offset'])}}}" for line in continuous)


def _numbers(values: Sequence[float]) -> str:
    """Numbers as YAML, to nine digits."""
    return f"[{', '.join(f'{round(value, 9) + 0.0:.9g}' for value in values)}]"


def _animation(line: Timeline | None) -> Iterator[str]:
    if line is None:
        return
    yield f"  animation  frames {line.first} to {line.last}, {line.fps:g} fps: {line.seconds(line.last):.4g} s"
    if line.clips:
        yield f"  clips      {len(line.clips)}{' (choose one by clip)' if len(line.clips) > 1 else ''}"
    for clip in line.clips[:20]:
        yield f"    {clip.name}: frames {clip.first} to {clip.last}"
    if len(line.clips) > 20:
        yield f"    and {len(line.clips) - 20} more"


def _values(values: dict[str, object]) -> str:
    def text(value: object) -> str:
        if isinstance(value, tuple):
            return (
                "(" + ", ".join(f"{x:.3g}" if isinstance(x, float) else str(x) for x in cast("tuple[object, ...]", value)) + ")"
            )
        if isinstance(value, float):
            return f"{value:.3g}"
        return f"image {image}" if (image := getattr(value, "image", None)) is not None else str(value)

    return ", ".join(f"{name} {text(value)}" for name, value in values.items())
