"""Labels: everything computed about a picture from truth's triangles; each label is one file, which defines `LABEL`.

`ChannelLabel`s are arrays of pixels, computed if a recipe's `channels` name them; `ObjectLabel`s are fields of objects, and
always computed. Third parties add a label by an entry point of the group `viewsphere.labels` that names such a module.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere import plugins
from viewsphere.labels._label import TAIL, ChannelLabel, Color, Drawing, Extent, Field, Label, ModelFacts, Needs, ObjectLabel
from viewsphere.labels._placement import Placement
from viewsphere.labels._record import annotation_of, finite, from_short_record, from_whole_record, short_record, whole_record
from viewsphere.labels._sight import Around, Sight
from viewsphere.model.camera import Camera
from viewsphere.model.channel import DEFAULT_CHANNELS, PASSES, Channel
from viewsphere.model.keypoints import Keypoints
from viewsphere.model.model_spec import Size
from viewsphere.model.sample import ObjectAnnotation
from viewsphere.model.shot import Shot
from viewsphere.model.symmetries import Symmetries
from viewsphere.model.thing import Thing
from viewsphere.model.traits import Traits
from viewsphere.truth.geometry import Geometry
from viewsphere.truth.visibility import Visibility

__all__ = [
    "TAIL",
    "ChannelLabel",
    "Color",
    "Drawing",
    "Extent",
    "Field",
    "Label",
    "ModelFacts",
    "Needs",
    "ObjectLabel",
    "Placement",
    "Sight",
    "annotate",
    "annotated",
    "channel_labels",
    "channels",
    "drawings",
    "finite",
    "from_short_record",
    "from_whole_record",
    "labels",
    "object_labels",
    "observe",
    "short_record",
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
    """Labels of objects."""
    return tuple(label for label in labels().values() if isinstance(label, ObjectLabel))


@cache
def channels() -> dict[str, Channel]:
    """All channels that a recipe's `channels` may name: first the passes, then the labels of pixels."""
    return PASSES | {name: label.channel for name, label in channel_labels().items()}


def drawings() -> tuple[Drawing, ...]:
    """The drawings of all labels that have one, in the order of the labels' names."""
    return tuple(label.drawing for _, label in sorted(labels().items()) if label.drawing)


def observe(
    geometry: Geometry, camera: Camera, visibility: Visibility, names: Iterable[str], around: Around | None = None
) -> dict[str, NDArray[Any]]:
    """The named labels of pixels, each (H, W) or (H, W, components) as its file says.

    `visibility` is `rasterize(geometry, camera)`; `around`: what labels of motion and of stereo pairs compare it with. The
    array of `instances` is shared with the visibility and must not be written to. Raises ValueError for names that are no
    labels of pixels.
    """
    known, sight, names = channel_labels(), Sight(geometry, camera, visibility, around=around), tuple(names)
    unknown = [name for name in names if name not in known]
    if unknown:
        raise ValueError(f"channel {unknown[0]!r}: expected one of {', '.join(known)}")
    return {name: known[name].compute(sight) for name in names}


def annotate(
    shot: Shot,
    instant: int,
    camera: Camera,
    geometry: Geometry,
    visibility: Visibility,
    boxes: Sequence[NDArray[np.float64]],
    models: Sequence[str],
    real_sizes: Sequence[Size | None] | None = None,
    traits: Sequence[Callable[[], Traits]] | None = None,
) -> tuple[ObjectAnnotation, ...]:
    """Annotations of all objects (things with an id) present at an instant (counted from 0 in the shot), visible or not, in the
    order of their ids.

    `boxes[i]` is the 3D box (8, 3) of object i + 1's model then in the object's axes, `models[i]` the path of that model in the
    data set, `real_sizes[i]` its true size (by default the one its spec gives in numbers), and `traits[i]` gives what it says
    of itself to labels that ask for it; `geometry` is the shot's stage and `visibility` what this camera sees of it. An object
    that covers no pixel has an empty mask, no `box2d` and visibility 0.
    """
    objects = shot.objects
    if not len(objects) == len(boxes) == len(models) == geometry.object_count:
        raise ValueError(
            f"annotate: shot {shot.key}: expected {geometry.object_count} objects, boxes and models, "
            f"got {len(objects)}, {len(boxes)}, {len(models)}"
        )
    sizes = real_sizes or [None if isinstance(thing.model.real_size, str) else thing.model.real_size for thing in objects]
    facts = [
        Rendered(model, box, size, thing.model.category, thing.model.category_id, _track(thing, instant), said)
        for thing, box, model, size, said in zip(objects, boxes, models, sizes, traits or [_unsaid] * len(objects), strict=True)
    ]
    placed = tuple(
        None if pose is None else Placement(thing.model, pose, camera, shot.category_deg, lambda known=known: known, step)
        for thing, known in zip(objects, facts, strict=True)
        for pose, step in ((thing.motion.at(instant), thing.motion.step_at(instant)),)
    )
    return annotated(Sight(geometry, camera, visibility, placed))


def _unsaid() -> Traits:
    raise ValueError("expected what the model says of itself; annotate() was not given it")


def _track(thing: Thing, instant: int) -> str:
    """The key of the thing's model where it shows a time step, else empty."""
    return thing.model.key if thing.motion.step_at(instant) else ""


def annotated(sight: Sight) -> tuple[ObjectAnnotation, ...]:
    """Annotations of the objects that are placed in a sight."""
    known = object_labels()
    return tuple(
        annotation_of(i + 1, [label.compute(sight, i) for label in known]) for i, place in enumerate(sight.placements) if place
    )


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
