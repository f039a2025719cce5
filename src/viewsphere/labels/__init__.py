"""Labels: everything computed about a picture from truth's triangles; each label is one file, which defines `LABEL`.

`ChannelLabel`s are arrays of pixels, computed if a recipe's `channels` name them. `ObjectLabel`s are fields of objects,
`SampleLabel`s of whole pictures; those that are on request are computed if a recipe's `annotations` name them. Third parties
add a label by an entry point of the group `viewsphere.labels` that names such a module.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere import plugins
from viewsphere.labels._field import Field
from viewsphere.labels._ids import IdKind, by_number, by_table, in_attributes, in_column, renumbered
from viewsphere.labels._label import (
    TAIL,
    ChannelLabel,
    Color,
    Drawing,
    Extent,
    Label,
    ModelFacts,
    Needs,
    ObjectLabel,
    Picture,
    SampleLabel,
    later,
)
from viewsphere.labels._passes import DRAWINGS
from viewsphere.labels._placement import Placement, view_of
from viewsphere.labels._record import Makers, computed, finite, from_short_record, from_whole_record, short_record, whole_record
from viewsphere.labels._sight import Around, Sight
from viewsphere.model.camera import Camera
from viewsphere.model.channel import DEFAULT_CHANNELS, PASSES, Channel, picture_of
from viewsphere.model.keypoints import Keypoints
from viewsphere.model.looks import Looks
from viewsphere.model.model_spec import Size
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.model.shot import Shot
from viewsphere.model.symmetries import Symmetries
from viewsphere.model.thing import Thing
from viewsphere.model.traits import Traits
from viewsphere.truth.raster.geometry import Geometry
from viewsphere.truth.raster.visibility import Visibility

__all__ = [
    "TAIL",
    "ChannelLabel",
    "Color",
    "Drawing",
    "Extent",
    "Field",
    "IdKind",
    "Label",
    "Makers",
    "ModelFacts",
    "Needs",
    "ObjectLabel",
    "Placement",
    "SampleLabel",
    "Sight",
    "alone",
    "annotated",
    "by_number",
    "by_table",
    "channel_labels",
    "channels",
    "drawable",
    "drawings",
    "finite",
    "from_short_record",
    "from_whole_record",
    "in_attributes",
    "in_column",
    "is_in",
    "is_shown",
    "labels",
    "labels_of",
    "makers",
    "object_labels",
    "observe",
    "on_request",
    "renumbered",
    "sample_labels",
    "sample_values",
    "short_record",
    "sight_of",
    "view_of",
    "whole_record",
]


@cache
def labels() -> dict[str, Label]:
    """All labels by name, first the channels that recipes keep by default, then the others in alphabetical order."""
    names = sorted(plugins.names("labels"), key=lambda name: (name not in DEFAULT_CHANNELS, name))
    found: dict[str, Label] = {name: plugins.load("labels", name).LABEL for name in names}
    for name, label in found.items():
        if label.name != name:
            raise ValueError(f"label {name!r}: expected the name of its file, found {label.name!r}")
    return found


@cache
def channel_labels() -> dict[str, ChannelLabel]:
    """Labels of pixels by name."""
    return {name: label for name, label in labels().items() if isinstance(label, ChannelLabel)}


@cache
def object_labels() -> tuple[ObjectLabel, ...]:
    """Labels of objects, those on request among them."""
    return tuple(label for label in labels().values() if isinstance(label, ObjectLabel))


def labels_of(asked: Container[str]) -> tuple[ObjectLabel, ...]:
    """The labels of objects that data sets have where these were asked for."""
    return tuple(label for label in object_labels() if not label.on_request or label.name in asked)


@cache
def sample_labels() -> dict[str, SampleLabel]:
    """Labels of whole pictures by name."""
    return {name: label for name, label in labels().items() if isinstance(label, SampleLabel)}


@cache
def on_request() -> dict[str, ObjectLabel | SampleLabel]:
    """All labels that a recipe's `annotations` may name."""
    return {label.name: label for label in object_labels() if label.on_request} | sample_labels()


@cache
def makers() -> dict[str, ObjectLabel]:
    """Labels of objects by the names of their fields."""
    return {field.name: label for label in object_labels() for field in label.fields}


@cache
def channels() -> dict[str, Channel]:
    """All channels that a recipe's `channels` may name: first the passes, then the labels of pixels."""
    return PASSES | {name: label.channel for name, label in channel_labels().items()}


@cache
def drawable() -> dict[str, Drawing]:
    """The drawings of all labels and passes that have one, by the name of the label or pass, in alphabetical order."""
    found = {name: label.drawing for name, label in labels().items() if label.drawing}
    return dict(sorted((found | DRAWINGS).items()))


def is_in(source: str, sample: Sample) -> bool:
    """Whether a sample has a label or pass of `drawable`."""
    return labels()[source].is_in(sample) if source in labels() else source in sample.channels


def drawings() -> tuple[Drawing, ...]:
    """What `drawable` lists."""
    return tuple(drawable().values())


def alone(channels: Container[str]) -> Callable[[Sample, int], Picture] | None:
    """What stands for the picture of samples with these channels, at a size; None where they have one, or nothing does."""
    if picture_of(channels) is not None:
        return None
    found = (label.drawing and label.drawing.alone for name, label in channel_labels().items() if name in channels)
    return next(filter(None, found), None)


def is_shown(channels: Container[str]) -> bool:
    """Whether samples with these channels have a picture, or something that stands for it."""
    return picture_of(channels) is not None or alone(channels) is not None


def observe(
    geometry: Geometry,
    camera: Camera,
    visibility: Visibility,
    names: Iterable[str],
    around: Around | None = None,
    options: Mapping[str, Mapping[str, Any]] | None = None,
) -> dict[str, NDArray[Any]]:
    """The named labels of pixels, each (H, W) or (H, W, components) as its file says.

    `visibility` is `rasterize(geometry, camera)`; `around`: what labels of motion and of stereo pairs compare it with;
    `options`: those of labels, by their names. The array of `instances` is shared with the visibility and must not be written
    to. Raises ValueError for names that are no labels of pixels.
    """
    known, names = channel_labels(), tuple(names)
    sight = Sight(geometry, camera, visibility, around=around, options=options or {})
    unknown = [name for name in names if name not in known]
    if unknown:
        raise ValueError(f"channel {unknown[0]!r}: expected one of {', '.join(known)}")
    return {name: known[name].compute(sight) for name in names}


def sight_of(
    shot: Shot,
    instant: int,
    camera: Camera,
    geometry: Geometry,
    visibility: Visibility,
    boxes: Sequence[NDArray[np.float64]],
    models: Sequence[str],
    real_sizes: Sequence[Size | None] | None = None,
    around: Around | None = None,
    traits: Sequence[Callable[[], Traits]] | None = None,
) -> Sight:
    """What a camera sees of a shot at an instant (counted from 0 there), with the places of its objects.

    `boxes[i]` is the 3D box (8, 3) of object i + 1's model then in the object's axes, `models[i]` the path of that model in the
    data set, `real_sizes[i]` its true size (by default the one its spec gives in numbers), and `traits[i]` gives what it says
    of itself to labels that ask for it; `geometry` is the shot's stage and `visibility` what this camera sees of it.
    """
    objects = shot.objects
    if not len(objects) == len(boxes) == len(models) == geometry.object_count:
        raise ValueError(
            f"sight_of: shot {shot.key}: expected {geometry.object_count} objects, boxes and models, "
            f"got {len(objects)}, {len(boxes)}, {len(models)}"
        )
    sizes = real_sizes or [None if isinstance(thing.model.real_size, str) else thing.model.real_size for thing in objects]
    facts = [
        Rendered(model, box, size, thing.model.category, thing.model.category_id, _track(thing, instant), said)
        for thing, box, model, size, said in zip(objects, boxes, models, sizes, traits or [_unsaid] * len(objects), strict=True)
    ]
    places = tuple(
        None if pose is None else Placement(thing.model, pose, camera, shot.category_deg, lambda known=known: known, step)
        for thing, known in zip(objects, facts, strict=True)
        for pose, step in ((thing.motion.at(instant), thing.motion.step_at(instant)),)
    )
    return Sight(geometry, camera, visibility, places, around, shot.annotations, shot.labels)


def _unsaid() -> Traits:
    raise ValueError("expected what the model says of itself; sight_of() was not given it")


def _track(thing: Thing, instant: int) -> str:
    """The key of the thing's model where it shows a time step, else empty."""
    return thing.model.key if thing.motion.step_at(instant) else ""


def annotated(sight: Sight) -> tuple[ObjectAnnotation, ...]:
    """Annotations of the objects that are placed in a sight, visible or not, in the order of their ids. An object that covers
    no pixel has an empty mask, no `box2d` and visibility 0.
    """
    seen = [label for label in labels_of(sight.asked) if label.compute is not later]
    every = Makers(makers(), sight.asked, "this frame")
    return tuple(
        computed(i + 1, [label.compute(sight, i) for label in seen], place, every)
        for i, place in enumerate(sight.placements)
        if place
    )


def sample_values(sight: Sight, objects: Sequence[ObjectAnnotation]) -> Mapping[str, Any]:
    """The fields of the labels of whole pictures that were asked for; `objects` are `annotated(sight)`."""
    found: dict[str, Any] = {}
    for name, label in sample_labels().items():
        if name in sight.asked:
            found |= label.compute(sight, objects)
    return found


@dataclass(frozen=True, eq=False)
class Rendered:
    """`ModelFacts` of a model that is rendered."""

    obj: str
    box3d_object: NDArray[np.float64]
    real_size: Size | None
    category: str
    category_id: int
    track: str
    traits: Callable[[], Traits]
    materials: tuple[str, ...] = ()
    body_parts: tuple[str, ...] = ()

    @property
    def diameter(self) -> float:
        """The largest distance between two vertices, metres."""
        return self.traits().diameter

    @property
    def symmetries(self) -> Symmetries | None:
        """Motions that leave the model as it is."""
        return self.traits().symmetries

    @property
    def keypoints(self) -> Keypoints | None:
        """Named points."""
        return self.traits().keypoints

    @property
    def looks(self) -> Looks | None:
        """What it looks like."""
        return self.traits().looks()
