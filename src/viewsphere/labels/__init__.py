"""Labels: everything computed about a picture from truth's triangles; each label is one file, which defines `LABEL`.

`ChannelLabel`s are arrays of pixels, computed if a recipe's `channels` name them. `ObjectLabel`s are fields of objects,
`SampleLabel`s of whole pictures; those that are on request are computed if a recipe's `annotations` name them. Third parties
add a label by an entry point of the group `viewsphere.labels` that names such a module.
"""

from __future__ import annotations

from collections.abc import Callable, Container
from functools import cache
from typing import TYPE_CHECKING

from viewsphere import plugins
from viewsphere.homes import names_of
from viewsphere.labels.shared.field import Field
from viewsphere.labels.shared.ids import IdKind, by_number, by_table, in_attributes, in_column, renumbered
from viewsphere.labels.shared.placement import Placement, view_of
from viewsphere.labels.shared.record import Makers, finite, from_short_record, from_whole_record, short_record, whole_record
from viewsphere.labels.shared.spec import (
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
)
from viewsphere.model.channel import DEFAULT_CHANNELS, PASSES, Channel, picture_of
from viewsphere.model.sample import Sample

if TYPE_CHECKING:
    from viewsphere.labels.shared.computing import annotated, context_of, observe, sample_values
    from viewsphere.labels.shared.context import LabelContext

__all__ = [
    "TAIL",
    "ChannelLabel",
    "Color",
    "Drawing",
    "Extent",
    "Field",
    "IdKind",
    "Label",
    "LabelContext",
    "Makers",
    "ModelFacts",
    "Needs",
    "ObjectLabel",
    "Placement",
    "SampleLabel",
    "annotated",
    "by_number",
    "by_table",
    "channel_labels",
    "channels",
    "context_of",
    "drawable",
    "drawings",
    "finite",
    "from_short_record",
    "from_whole_record",
    "in_attributes",
    "in_column",
    "is_channel",
    "is_in",
    "is_on_request",
    "is_shown",
    "label_named",
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
    "stand_in_for",
    "view_of",
    "whole_record",
]

_COMPUTING = "viewsphere.labels.shared.computing"
__getattr__ = names_of(
    __name__,
    {
        "LabelContext": "viewsphere.labels.shared.context",
        "annotated": _COMPUTING,
        "observe": _COMPUTING,
        "sample_values": _COMPUTING,
        "context_of": _COMPUTING,
    },
)


@cache
def labels() -> dict[str, Label]:
    """Return every label by name: first the channels that recipes keep by default, then the others in alphabetical order."""
    found = plugins.loadable(Label)
    return {name: found[name] for name in sorted(found, key=lambda name: (name not in DEFAULT_CHANNELS, name))}


@cache
def label_named(name: str) -> Label | None:
    """The label of this name, None where there is none; loads no other. Raises PluginError for one that cannot be loaded."""
    if name not in plugins.names("labels"):
        return None
    return plugins.load(Label, name)


def is_on_request(name: str) -> bool:
    """True for a label that a recipe's `annotations` may name."""
    label = label_named(name)
    return isinstance(label, SampleLabel) or (isinstance(label, ObjectLabel) and label.on_request)


def is_channel(name: str) -> bool:
    """True for a channel that a recipe's `channels` may name: a pass, or a label of pixels."""
    return name in PASSES or isinstance(label_named(name), ChannelLabel)


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
    """Return every label that a recipe's `annotations` may name."""
    return {label.name: label for label in object_labels() if label.on_request} | sample_labels()


@cache
def makers() -> dict[str, ObjectLabel]:
    """Labels of objects by the names of their fields."""
    return {field.name: label for label in object_labels() for field in label.fields}


@cache
def channels() -> dict[str, Channel]:
    """Return every channel that a recipe's `channels` may name: first the passes, then the labels of pixels."""
    return PASSES | {name: label.channel for name, label in channel_labels().items()}


@cache
def drawable() -> dict[str, Drawing]:
    """The drawings of all labels and passes that have one, by the name of the label or pass, in alphabetical order."""
    from viewsphere.labels.shared.drawing.passes import DRAWINGS  # which loads what develops pictures

    found = {name: label.drawing for name, label in labels().items() if label.drawing}
    return dict(sorted((found | DRAWINGS).items()))


def is_in(source: str, sample: Sample) -> bool:
    """Return whether a sample has a label or pass of `drawable`."""
    return labels()[source].is_in(sample) if source in labels() else source in sample.channels


def drawings() -> tuple[Drawing, ...]:
    """Return the drawings that `drawable` lists."""
    return tuple(drawable().values())


def stand_in_for(channels: Container[str]) -> Callable[[Sample, int], Picture] | None:
    """Return the substitute for the picture of samples with these channels, a function of a sample and a size. Returns None
    where the samples have a picture, or no label has a substitute.
    """
    if picture_of(channels) is not None:
        return None
    found = (label.drawing and label.drawing.stand_in for name, label in channel_labels().items() if name in channels)
    return next(filter(None, found), None)


def is_shown(channels: Container[str]) -> bool:
    """Return whether samples with these channels have a picture, or something that stands for it."""
    return picture_of(channels) is not None or stand_in_for(channels) is not None
