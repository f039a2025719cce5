"""The classes of labels; each file of `viewsphere.labels` defines one label as `LABEL`."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from viewsphere.errors import ViewsphereError
from viewsphere.labels._placement import ModelFacts, Placement
from viewsphere.labels._sight import Sight
from viewsphere.model.channel import Channel
from viewsphere.model.sample import ObjectAnnotation, Sample

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

Array = NDArray[Any]
Picture = NDArray[np.uint8]


Models = Mapping[str, ModelFacts]
"""Models of a data set by their keys."""

Proof = Callable[[Sample, Models], Iterator[str]]
"""Yields a message for each value of a stored sample that contradicts the rest of the sample."""


def trusted(sample: Sample, models: Models) -> Iterator[str]:
    """The proof of a label about which nothing else in a sample says anything: only computing the label again proves it."""
    yield from ()


@dataclass(frozen=True)
class Needs:
    """The inputs of a label besides its own instant and sensor: offsets of instants (-1 is the one before), whether a sensor
    that is rectified with its own, whether points that are followed, and whether points on the objects' surfaces.
    """

    instants: tuple[int, ...] = ()
    rectified: bool = False
    tracks: bool = False
    surface: bool = False

    @property
    def is_some(self) -> bool:
        """Whether the label does not follow from what the picture's own camera sees at its instant."""
        return bool(self.instants or self.rectified or self.tracks or self.surface)


TAIL = 8
"""Instants before a sample's own that drawings with trails are given."""

Color = tuple[int, int, int]
"""sRGB, 0 to 255."""

Extent = tuple[float, float]
"""The least and the greatest value that a picture of numbers tells apart."""


@dataclass(frozen=True)
class Drawing:
    """How `preview` shows a label, and under which name: pixels of the picture changed, lines drawn over it at a scale, or
    another picture (of the sample's size) beside it.

    `trails` are lines that show what was before, too: they are given what the sensor's samples so far are, the sample itself
    last, none of them more than `labels.TAIL` instants before it. Instead of `beside`, `within` gives a picture that tells
    apart the values of an extent, and `extent` a sample's own, so that all pictures of a sequence may have the same colours.
    `key` says what colours mean, None: words alone.
    """

    name: str
    pixels: Callable[[Picture, Sample], Picture] | None = None
    lines: Callable[[ImageDraw, Sample, float], None] | None = None
    trails: Callable[[ImageDraw, Sequence[Sample], float], None] | None = None
    beside: Callable[[Sample], Picture] | None = None
    extent: Callable[[Sample], Extent] | None = None
    within: Callable[[Sample, Extent], Picture] | None = None
    key: tuple[tuple[str, Color | None], ...] = ()

    def picture(self, sample: Sample, extent: Extent | None = None) -> Picture | None:
        """The picture beside a sample's, (H, W, 3) uint8 sRGB, None where nothing is shown there; `extent`: else its own."""
        if self.within and self.extent:
            return self.within(sample, extent or self.extent(sample))
        return self.beside(sample) if self.beside else None


@dataclass(frozen=True, kw_only=True)
class Label:
    """The properties of all labels: `name` (that of their file), `meaning`, and `axes`, their frame of reference.

    `prove` compares a stored sample with itself, which is quick; besides, `check` computes every label again.
    """

    name: str
    meaning: str
    axes: str = ""
    needs: Needs = Needs()
    prove: Proof = trusted
    drawing: Drawing | None = None


@dataclass(frozen=True, kw_only=True)
class ChannelLabel(Label):
    """A label of pixels, stored as a separate file: (height, width) or (height, width, components); `empty` where nothing is
    seen. `encoding` is the default kind of file: png16 for ids, tiff for whatever has to be exact; `colors` are those of the
    first ids in files with a palette.

    `renumbered(array, ids)` gives the array of a data set whose categories have other ids, by their old ones; None: it has no
    ids of categories.
    """

    compute: Callable[[Sight], Array]
    dtype: DTypeLike
    components: int = 1
    unit: str = "1"
    empty: float = 0
    encoding: Any = "tiff"
    colors: tuple[Color, ...] = ()
    renumbered: Callable[[Array, Mapping[int, int]], Array] | None = None

    @property
    def channel(self) -> Channel:
        """The channel that describes the label's file."""
        return Channel(self.name, self.dtype, self.components, self.unit, self.empty, self.encoding, self.meaning, self.colors)


def by_table(array: Array, ids: Mapping[int, int]) -> Array:
    """The array with other ids for those that have one."""
    table = np.arange(max([int(array.max(initial=0)), *ids]) + 1, dtype=array.dtype)
    table[list(ids)] = list(ids.values())
    return table[array]


@dataclass(frozen=True)
class Field:
    """One field of an object: a number, a text or a plain dataclass of these (`shape` is empty), a tuple of numbers, or an
    array. `optional`: None says that the object has no such value.
    """

    name: str
    meaning: str
    type: Any
    shape: tuple[int, ...] = ()
    unit: str = ""
    axes: str = ""
    is_array: bool = False
    optional: bool = False

    def plain(self, value: Any) -> Any:
        """The value as plain JSON data; NaN becomes null."""
        if hasattr(value, "__dataclass_fields__"):
            return {name: _without_nan(part) for name, part in value.__dict__.items()}
        if isinstance(value, np.ndarray):
            return _without_nan(value.tolist())
        return _without_nan(list(value) if isinstance(value, tuple) else value)

    def value(self, plain: Any) -> Any:
        """The value that `plain` was made of, to the last bit."""
        if self.is_array:
            value = np.array(plain, self.type)
        elif plain is None:
            value = None if self.optional else math.nan
        elif self.shape:
            value = tuple(map(_number, plain))
        elif hasattr(self.type, "__dataclass_fields__"):
            value = self.type(**{name: _number(part) for name, part in plain.items()})
        else:
            value = plain
        self.check(value)
        return value

    def check(self, value: Any) -> None:
        """Raise ValueError for a value that the field cannot have; NaN stands for numbers that are not known."""
        if value is None and self.optional:
            return
        if isinstance(value, np.ndarray):
            is_right = value.shape == self.shape and not np.isinf(value).any()
        elif self.shape:
            is_right = isinstance(value, tuple) and len(value) == self.shape[0] and all(map(_is_number, value))
        elif isinstance(value, str):
            is_right = self.type is str
        elif hasattr(self.type, "__dataclass_fields__"):
            types = {name: str(field.type) for name, field in self.type.__dataclass_fields__.items()}
            is_right = all(
                isinstance(getattr(value, n), str) if t == "str" else _is_number(getattr(value, n)) for n, t in types.items()
            )
        else:
            is_right = self.type in {int, float} and _is_number(value)
        if not is_right:
            raise ValueError(f"{self.name}: expected {self.type.__name__} {self.shape or ''}, found {value!r:.60}")

    def equals(self, one: Any, other: Any) -> bool:
        """Whether two values are the same number for number; NaN equals itself."""
        return np.array_equal(one, other, equal_nan=True) if self.is_array and self.type is not bool else _plainly(one, other)


def _number(value: Any) -> Any:
    return math.nan if value is None else value


def _is_number(value: Any) -> bool:
    return (
        isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool) and not abs(value) > _GREATEST
    )


_GREATEST = 1e300
"""A number above it is a mistake."""


def _without_nan(value: Any) -> Any:
    if isinstance(value, list):
        return [_without_nan(v) for v in value]
    return None if isinstance(value, float) and math.isnan(value) else value


def _plainly(one: Any, other: Any) -> bool:
    if isinstance(one, np.ndarray):
        return np.array_equal(one, other)
    return bool(one == other)


def nothing(annotation: ObjectAnnotation) -> None:
    """The `keep` of labels that follow from the shot and its models: nothing is stored."""
    return


@dataclass(frozen=True, kw_only=True)
class ObjectLabel(Label):
    """A label of objects: one field or several that are computed together.

    `compute(sight, i)` gives the fields of the object of id i + 1. `keep` gives, as JSON, the part of them that does not follow
    from the shot and its models, None if everything follows. `restore(kept, placement, annotation)` computes all fields from
    this part again, equal to the last bit; other labels' fields are available as attributes of the annotation.
    """

    fields: tuple[Field, ...]
    compute: Callable[[Sight, int], Mapping[str, Any]]
    restore: Callable[[Any, Placement, ObjectAnnotation], Mapping[str, Any]]
    keep: Callable[[ObjectAnnotation], Any] = nothing

    @staticmethod
    def derived(
        of: Callable[[Placement], Mapping[str, Any]],
        *,
        name: str,
        meaning: str,
        fields: Sequence[Field],
        prove: Proof = trusted,
        axes: str = "",
        drawing: Drawing | None = None,
    ) -> ObjectLabel:
        """A label computed from the poses of object and camera and from the model alone: nothing of it is stored."""
        return ObjectLabel(
            name=name,
            meaning=meaning,
            fields=tuple(fields),
            axes=axes,
            compute=lambda sight, i: of(sight.placement(i)),
            restore=lambda kept, placement, o: of(placement),
            prove=prove,
            drawing=drawing,
        )


def rendered(sample: Sample) -> list[ObjectAnnotation]:
    """The objects that were not imported."""
    return [o for o in sample.objects if o.source is None]


def channel_of(sample: Sample, name: str) -> Array | None:
    """A channel, None if it is missing or cannot be read, which another proof reports."""
    try:
        array = sample.channels[name]
    except (KeyError, ViewsphereError):
        return None
    is_picture = array.shape[:2] == (sample.height, sample.width)
    return array if is_picture or array.dtype.names else None
