"""Some fields of a data set's frames, as arrays that data loaders batch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import UserError
from viewsphere.geometry.mask import decode_rle
from viewsphere.labels import Field, object_labels, on_request, sample_labels
from viewsphere.model.sample import ObjectView, Rle, Sample
from viewsphere.validation.errors import one_of
from viewsphere.validation.quantity import quantity

OF_SAMPLE = ("index", "split", "sequence", "variation", "sensor", "instant", "time", "width", "height")
OF_CAMERA = ("camera.K", "camera.R", "camera.t", "camera.P")
OF_POSE = ("pose.azimuth_deg", "pose.elevation_deg", "pose.distance", "pose.tilt_deg", "pose.category")


class Selection(Sequence[dict[str, Any]]):
    """Some fields of some frames: item i is a dict of the fields of the i-th frame; returned by `Dataset.select`.

    A map-style data set for PyTorch's DataLoader, which needs no PyTorch itself: it has a length and random access. Its
    memory does not grow, and workers receive it as the data set's path.

    Args:
        name: Name of the data set.
        samples: The samples of the data set.
        fields: Names of fields; see `Dataset.select`.
        numbers: Positions of the selected samples, counted from 0; None: all.
    """

    def __init__(
        self, name: str, samples: Sequence[Sample], fields: Sequence[str], numbers: Sequence[int] | None = None
    ) -> None:
        self.name, self.fields = name, tuple(fields)
        self._samples, self._numbers = samples, numbers

    def __repr__(self) -> str:
        return f"<Selection of {self.name}: {quantity(len(self), 'frame')}; {', '.join(self.fields)}>"

    def __len__(self) -> int:
        return len(self._samples if self._numbers is None else self._numbers)

    @overload
    def __getitem__(self, index: int) -> dict[str, Any]: ...
    @overload
    def __getitem__(self, index: slice) -> list[dict[str, Any]]: ...
    def __getitem__(self, index: int | slice) -> dict[str, Any] | list[dict[str, Any]]:
        """The fields of the i-th frame; raises IndexError past the end, AttributeError where the frame lacks a channel."""
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        sample = self._samples[index if self._numbers is None else self._numbers[index]]
        return {name: _value(sample, name) for name in self.fields}


def check_fields(fields: Sequence[str], channels: Sequence[str], samples: Sequence[Sample]) -> None:
    """Raise UserError for unknown fields, and for fields of labels that were not requested; the first sample is checked.
    `channels`: the data set's.
    """
    of_labels = (*_of_pictures(), *(f"objects.{name}" for name in _of_objects()))
    known = (*channels, *OF_SAMPLE, *OF_CAMERA, *OF_POSE, *of_labels)
    for name in fields:
        if name not in known:
            raise UserError(one_of(name, known))
    labels = {field.name: label for label in on_request().values() for field in label.fields}
    for name in fields:
        label = labels.get(name.removeprefix("objects."))
        if label and samples and not label.is_in(samples[0]):
            raise UserError(f"expected what the data set has; found {name}: add {label.name} to the recipe's annotations")


def _value(sample: Sample, name: str) -> Any:
    whole, _, part = name.partition(".")
    if whole == "objects":
        return _stacked(sample, part)
    if part:
        return getattr(getattr(sample, whole), part)
    field = _of_pictures().get(name)
    value = getattr(sample, name)
    return _filled(value, field.shape) if field and field.is_regular else value


def _of_objects() -> dict[str, Field]:
    """The fields of objects."""
    fields = {field.name: field for label in object_labels() for field in label.fields}
    return {"id": Field("id", "", int, ids={}), "mask": Field("mask", "", bool), **fields}


def _of_pictures() -> dict[str, Field]:
    """The fields of labels of whole pictures."""
    return {field.name: field for label in sample_labels().values() for field in label.fields}


DTYPES: dict[Any, Any] = {float: np.float64, int: np.int64, bool: np.bool_}
"""Dtypes of arrays, by the types of numbers."""


def _stacked(sample: Sample, name: str) -> NDArray[Any] | list[Any]:
    """A field of all objects: an array (N, ...), with NaN for missing values, or masks for run-length codes. Texts and values
    of several shapes are a list.
    """
    field, values = _of_objects()[name], [getattr(o, name) for o in sample.objects]
    size = sample.height, sample.width
    if field.type is Rle:
        return np.array([decode_rle(mask.height, mask.width, mask.counts) for mask in values], np.bool_).reshape(-1, *size)
    if field.type is ObjectView:
        return np.array([[*view.__dict__.values()] for view in values], np.float64).reshape(-1, 4)
    if not field.is_regular or field.type not in DTYPES:
        return values
    shape = size if name == "mask" else field.shape
    return np.array([_filled(value, shape) for value in values], DTYPES[field.type]).reshape(-1, *shape)


def _filled(value: Any, shape: tuple[int, ...]) -> Any:
    return np.full(shape, np.nan) if value is None else value
