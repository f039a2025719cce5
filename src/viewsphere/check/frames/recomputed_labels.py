"""Labels recomputed from the exported models and their stored poses, and compared with the stored labels."""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import RecipeError, ViewsphereError
from viewsphere.labels import (
    ChannelLabel,
    LabelContext,
    annotated,
    channel_labels,
    computed_channel,
    labels_of,
    sample_labels,
    sample_values,
)
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.run.shots.reconstruct import ViewReconstructor
from viewsphere.run.shots.scenery import Scenery
from viewsphere.store import Dataset, ModelInfo, depth_step
from viewsphere.store.samples.channel_files import MOST_STEPS

Findings = Iterator[tuple[str, str]]
"""Names of labels, with their errors."""


class RecomputedLabels:
    """Recomputes labels of a data set; `not_run` has the reason for each label that cannot be recomputed, by its name."""

    def __init__(self, dataset: Dataset, scenery: Scenery, models: Mapping[str, ModelInfo]) -> None:
        self._dataset = dataset
        self._reconstructor = ViewReconstructor(dataset, scenery, models)
        self.not_run: dict[str, str] = {}

    def is_possible(self, sample: Sample) -> bool:
        """Return whether a sample's view can be reconstructed."""
        return self._reconstructor.is_possible(sample)

    def differences(self, sample: Sample) -> Findings:
        """Yield the differences between a sample's stored and recomputed labels; none if the scenery has changed."""
        context = self._reconstructor.context(sample, sample.files)
        if context is None:
            return
        for name, label in channel_labels().items():
            if name in sample.files:
                yield from ((name, problem) for problem in self._pixels(sample, name, self._computed(label, context)))
        objects = annotated(context)
        for o, again in zip(sample.objects, objects, strict=True):
            yield from _fields(o, again, context.requested)
        yield from _of_picture(sample.extra, sample_values(context, objects))

    def _computed(self, label: ChannelLabel, context: LabelContext) -> NDArray[Any] | None:
        """A recomputed channel; None if a picture of the scene, which is not part of the data set, no longer exists."""
        try:
            return computed_channel(label, context)
        except RecipeError as error:
            self.not_run[label.name] = str(error)
            return None

    def _pixels(self, sample: Sample, name: str, again: NDArray[Any] | None) -> Iterator[str]:
        """Yield the differences of a channel; other checks report a channel that cannot be read, or has another size."""
        if again is None:
            return
        try:
            kept = sample.channels[name]
        except ViewsphereError:
            return
        if kept.shape != again.shape:
            if kept.dtype.names:  # nothing else gives the number of rows
                yield f"expected {len(again):,} rows, found {len(kept):,}"
            return
        step = depth_step(self._dataset.read(sample.files[name])) if channel_labels()[name].in_steps else 0.0
        wrong = _beyond(kept, again, step) if step else unequal(kept, again)
        if wrong.any():
            where = tuple(int(i[0]) for i in np.nonzero(wrong))
            what, at = ("pixels", f"pixel {where[::-1]}") if wrong.ndim == 2 else ("rows", f"row {where[0]}")
            yield (
                f"{wrong.sum()} of {wrong.size} {what} are not those of the exported models: at {at} expected "
                f"{again[where].tolist()}, found {kept[where].tolist()}"
            )


def unequal(kept: NDArray[Any], again: NDArray[Any]) -> NDArray[np.bool_]:
    """A mask (H, W): True where any component differs; NaN equals itself. For rows a mask (N,) of those that differ in any
    byte.
    """
    if kept.dtype.names:
        return (_bytes(kept) != _bytes(again)).any(axis=1)
    different = kept != again
    if np.issubdtype(kept.dtype, np.floating):
        different &= ~(np.isnan(kept) & np.isnan(again))
    return different if different.ndim == 2 else different.any(axis=2)


def _bytes(rows: NDArray[Any]) -> NDArray[np.uint8]:
    """The bytes of each row, (N, bytes)."""
    return np.ascontiguousarray(rows).view(np.uint8).reshape(len(rows), rows.dtype.itemsize)


def _beyond(kept: NDArray[Any], again: NDArray[Any], step: float) -> NDArray[np.bool_]:
    """A mask (H, W) of depths stored in whole steps that are not the nearest step; depth behind the camera is stored as
    empty.
    """
    seen = np.isfinite(again) & (again > 0)
    rounded = np.clip(np.rint(np.where(seen, again, 1.0).astype(np.float64) / step), 1, MOST_STEPS)
    return np.where(seen, kept != (rounded * step).astype(np.float32), np.isfinite(kept))


def _of_picture(kept: Mapping[str, Any], again: Mapping[str, Any]) -> Findings:
    for label in sample_labels().values():
        for field in label.fields:
            if field.name in again and not field.equals(kept[field.name], again[field.name]):
                expected, found = again[field.name], kept[field.name]
                yield label.name, f"expected {field.name} {expected!r} of the exported models, found {found!r}"


def _fields(o: ObjectAnnotation, again: ObjectAnnotation, asked: Container[str]) -> Findings:
    for label in labels_of(asked):
        for known in label.fields:
            kept, computed = getattr(o, known.name), getattr(again, known.name)
            if not known.equals(kept, computed):
                yield label.name, f"object {o.id}: expected {known.name} {computed!r} of the exported models, found {kept!r}"
