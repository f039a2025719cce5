"""The HTML of recipes, plans, data sets and samples in notebooks, which needs no other file."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable, Sequence
from html import escape
from typing import Any

from viewsphere.codecs.png_tiff import encode_png
from viewsphere.model.channel import picture_of
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.planning.plan import Plan
from viewsphere.preview.frame import Picture, draw_sample
from viewsphere.preview.shown import dataset_samples
from viewsphere.preview.tiles import contact_sheet
from viewsphere.recipe.recipe import Recipe
from viewsphere.run.memory import Frames
from viewsphere.store import Dataset
from viewsphere.validation.errors import shown

WIDTH = 480
"""Maximum width of a sample's picture, pixels."""

SAMPLES = 8
"""Number of a data set's samples that are shown."""

OBJECTS = 12
"""Number of a sample's objects that are listed."""

DRAWN = ("masks", "boxes", "boxes3d")


def html(value: Any) -> str:
    """HTML of a recipe, a plan, frames, a data set or a sample, with labels over its pictures."""
    match value:
        case Sample():
            return _sample(value)
        case Dataset():
            return _dataset(value)
        case Frames():
            return _plan(value.plan)
        case Plan():
            return _plan(value)
        case Recipe():
            return _recipe(value)
        case _:
            raise TypeError(f"expected a recipe, a plan, frames, a data set or a sample; found {shown(value)}")


def _recipe(recipe: Recipe) -> str:
    return f"<b>{escape(recipe.name)}</b>, a recipe<pre>{escape(recipe.to_yaml())}</pre>"


def _plan(planned: Plan) -> str:
    splits = ", ".join(f"{name} {count:,}" for name, count in planned.split_counts.items())
    sizes = dict.fromkeys(f"{s.intrinsics.width} x {s.intrinsics.height}" for s in planned.rig.sensors)
    facts = [
        ("frames", f"{planned.factors} = {planned.frames:,}"),
        ("splits", splits),
        ("categories", ", ".join(category.name for category in planned.categories)),
        ("pictures", ", ".join(sizes)),
        ("channels", ", ".join(planned.recipe.channels)),
        *(("warning", warning) for warning in planned.warnings),
    ]
    return f"<b>{escape(planned.recipe.name)}</b>, a plan{_table(facts)}"


def _dataset(dataset: Dataset) -> str:
    facts = [
        ("folder", str(dataset.root)),
        ("frames", f"{len(dataset):,}"),
        ("splits", ", ".join(dataset.splits)),
        ("categories", ", ".join(category.name for category in dataset.categories)),
    ]
    samples = [s for s in (dataset_samples(dataset, SAMPLES) if len(dataset) else ()) if picture_of(s.channels)]
    sheet = _picture(contact_sheet(samples, DRAWN, width=WIDTH // 2)) if samples else ""
    return f"<b>{escape(dataset.name)}</b>, a data set{_table(facts)}{sheet}"


def _sample(sample: Sample) -> str:
    pose, sequence = sample.known_pose, sample.sequence and f" of {sample.sequence}, {sample.time:.3f} s"
    facts = [("sensor", sample.sensor), ("size", f"{sample.width} x {sample.height}"), ("split", sample.split)]
    if pose is not None:
        facts.append(("pose", f"azimuth {pose.azimuth_deg:.4g}, elevation {pose.elevation_deg:.4g}, {pose.distance:.4g} m"))
    facts.append(("channels", ", ".join(sample.channels)))
    facts += [(f"object {o.id}", _object(o)) for o in sample.objects[:OBJECTS]]
    if len(sample.objects) > OBJECTS:
        facts.append(("", f"and {len(sample.objects) - OBJECTS} more objects"))
    picture = _picture(draw_sample(sample, DRAWN, WIDTH)) if picture_of(sample.channels) else ""
    return f"<b>frame {sample.index}</b>{escape(sequence)}{picture}{_table(facts)}"


def _object(seen: ObjectAnnotation) -> str:
    box = "not seen" if seen.box2d is None else f"box {', '.join(f'{x:g}' for x in seen.box2d)}"
    return f"{seen.category} {seen.key}: {box}; visibility {seen.visibility:.2f}"


def _picture(picture: Picture) -> str:
    """A picture embedded in the page."""
    return f'<div><img alt="" src="data:image/png;base64,{b64encode(encode_png(picture)).decode()}"></div>'


def _table(facts: Iterable[tuple[str, str]]) -> str:
    """Names and values, in two columns."""
    rows: Sequence[str] = [f"<tr><th>{escape(name)}</th><td>{escape(value)}</td></tr>" for name, value in facts]
    return f"<table>{''.join(rows)}</table>"
