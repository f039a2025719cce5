"""The computation of a picture's labels. This module loads the rasterizer, so modules that only name labels avoid it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.labels.shared.catalogue import channel_labels, labels_of, makers, sample_labels_of
from viewsphere.labels.shared.context import LabelContext
from viewsphere.labels.shared.placement import Placement
from viewsphere.labels.shared.record import Makers, computed
from viewsphere.labels.shared.spec import ChannelLabel, derived
from viewsphere.model.annotations.appearance import Appearance
from viewsphere.model.annotations.keypoints import Keypoints
from viewsphere.model.annotations.metadata import ModelMetadata
from viewsphere.model.annotations.symmetries import Symmetries
from viewsphere.model.model_spec import Size
from viewsphere.model.sample import ObjectAnnotation
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Thing
from viewsphere.truth.raster.geometry import Geometry
from viewsphere.truth.raster.visibility import Visibility
from viewsphere.truth.shot_views import NeighbourViews


def observe(
    geometry: Geometry,
    camera: Camera,
    visibility: Visibility,
    names: Iterable[str],
    neighbours: NeighbourViews | None = None,
    options: Mapping[str, Mapping[str, Any]] | None = None,
) -> dict[str, NDArray[Any]]:
    """The named labels of pixels, each (H, W) or (H, W, components).

    `visibility` is `rasterize(geometry, camera)`; `neighbours` are views that labels of motion and of stereo pairs compare it
    with; `options` are those of labels, by their names. The array of `instances` is shared with the visibility and must not
    be written to. Raises ValueError for names that are no labels of pixels.
    """
    known, names = channel_labels(), tuple(names)
    context = LabelContext(geometry, camera, visibility, neighbours=neighbours, options=options or {})
    unknown = [name for name in names if name not in known]
    if unknown:
        raise ValueError(f"channel {unknown[0]!r}: expected one of {', '.join(known)}")
    return {name: computed_channel(known[name], context) for name in names}


def computed_channel(label: ChannelLabel, context: LabelContext) -> NDArray[Any]:
    """A label of pixels, computed with access only to the inputs in its `needs`."""
    return label.compute(context.read_by(label.name, label.needs))


def context_of(
    shot: Shot,
    instant: int,
    camera: Camera,
    geometry: Geometry,
    visibility: Visibility,
    boxes: Sequence[NDArray[np.float64]],
    models: Sequence[str],
    real_sizes: Sequence[Size | None] | None = None,
    neighbours: NeighbourViews | None = None,
    metadata: Sequence[Callable[[], ModelMetadata]] | None = None,
) -> LabelContext:
    """Return the view of a shot by a camera at an instant (counted from 0 in the shot), with the placements of its objects.

    `boxes[i]` is the 3D box (8, 3) of object i + 1's model at that instant, in the object's axes. `models[i]` is the path of
    that model in the data set. `real_sizes[i]` is its true size, by default the size that its spec gives in numbers.
    `metadata[i]` returns the model's metadata, for labels that request it. `geometry` is the shot's stage, and `visibility` is
    this camera's view of it.
    """
    objects = shot.objects
    if not len(objects) == len(boxes) == len(models) == geometry.object_count:
        raise ValueError(
            f"context_of: shot {shot.key}: expected {geometry.object_count} objects, boxes and models, "
            f"got {len(objects)}, {len(boxes)}, {len(models)}"
        )
    sizes = real_sizes or [None if isinstance(thing.model.real_size, str) else thing.model.real_size for thing in objects]
    facts = [
        _Rendered(model, box, size, thing.model.category, thing.model.category_id, _track(thing, instant), said)
        for thing, box, model, size, said in zip(
            objects, boxes, models, sizes, metadata or [_unsaid] * len(objects), strict=True
        )
    ]
    places = tuple(
        None if pose is None else Placement(thing.model, pose, camera, shot.category_deg, lambda known=known: known, step, i)
        for i, (thing, known) in enumerate(zip(objects, facts, strict=True))
        for pose, step in ((thing.motion.pose_at(instant), thing.motion.step_at(instant)),)
    )
    return LabelContext(geometry, camera, visibility, places, neighbours, shot.annotations, shot.labels)


def _unsaid() -> ModelMetadata:
    raise ValueError("expected what the model says of itself; context_of() was not given it")


def _track(thing: Thing, instant: int) -> str:
    """The key of the thing's model if it shows a time step, else empty."""
    return thing.model.key if thing.motion.step_at(instant) else ""


def annotated(context: LabelContext) -> tuple[ObjectAnnotation, ...]:
    """Annotations of the objects that are placed in a context, visible or not, in the order of their ids. An object that covers
    no pixel has an empty mask, no `box2d` and visibility 0.
    """
    requested = labels_of(context.requested)
    seen = [(label, context.read_by(label.name, label.needs)) for label in requested if label.compute is not derived]
    every = Makers(makers(), requested, context.requested, "this frame")
    return tuple(
        computed(i + 1, [label.compute(own, i) for label, own in seen], place, every)
        for i, place in enumerate(context.placements)
        if place
    )


def sample_values(context: LabelContext, objects: Sequence[ObjectAnnotation]) -> Mapping[str, Any]:
    """The fields of the requested labels of whole pictures; `objects` are `annotated(context)`."""
    found: dict[str, Any] = {}
    for label in sample_labels_of(context.requested):
        found |= label.compute(context.read_by(label.name, label.needs), objects)
    return found


@dataclass(frozen=True, eq=False)
class _Rendered:
    """`ModelFacts` of a model that is rendered."""

    obj: str
    box3d_object: NDArray[np.float64]
    real_size: Size | None
    category: str
    category_id: int
    track: str
    metadata: Callable[[], ModelMetadata]
    materials: tuple[str, ...] = ()
    body_parts: tuple[str, ...] = ()

    @property
    def diameter(self) -> float:
        """The largest distance between two vertices, metres."""
        return self.metadata().diameter

    @property
    def symmetries(self) -> Symmetries | None:
        """The symmetries of the model."""
        return self.metadata().symmetries

    @property
    def keypoints(self) -> Keypoints | None:
        """Named points."""
        return self.metadata().keypoints

    @property
    def looks(self) -> Appearance | None:
        """The model's appearance: its colours and materials."""
        return self.metadata().looks()
