"""The classes of labels; each file of `viewsphere.labels` defines one label as `LABEL`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, InstanceOf, SkipValidation, model_validator

from viewsphere.errors import PluginError, ViewsphereError
from viewsphere.labels.shared.field import Field
from viewsphere.labels.shared.ids import Ids, check_ids, has_whole_numbers
from viewsphere.labels.shared.needs import Need
from viewsphere.labels.shared.placement import ModelFacts, Placement
from viewsphere.model.channel import Channel
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.plugins.registry import Kind
from viewsphere.plugins.spec import Spec

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

    from viewsphere.labels.shared.context import LabelContext
else:
    ImageDraw = LabelContext = (
        Any  # these load Pillow and the rasterizer; the fields' types are evaluated when the classes are made
    )

Array = NDArray[Any]
Picture = NDArray[np.uint8]


Models = Mapping[str, ModelFacts]
"""Models of a data set by their keys."""

Proof = Callable[[Sample, Models], Iterator[str]]
"""Yields a message for each value of a stored sample that contradicts the rest of the sample."""


def no_proof(sample: Sample, models: Models) -> Iterator[str]:
    """The proof of a label about which nothing else in a sample says anything: only computing the label again proves it."""
    yield from ()


TAIL = 8
"""Instants before a sample's own that drawings with trails are given."""

Color = tuple[int, int, int]
"""sRGB, 0 to 255."""

Extent = tuple[float, float]
"""The least and the greatest value that a picture of numbers tells apart."""


@dataclass(frozen=True)
class Drawing:
    """The way that `preview` shows a label, and its name there. A drawing changes pixels of the picture, draws lines over it at
    a scale, or puts another picture (of the sample's size) beside it.

    `trails` are lines that show the past, too. They receive the sensor's samples so far, the sample itself last; none is more
    than `labels.TAIL` instants before it. Instead of `beside`, `within` gives a picture that distinguishes the values of an
    extent. `extent` is a sample's own extent, so that all pictures of a sequence may have the same colours. `stand_in` replaces
    the picture of a sample that has none, at this size. `key` gives the meaning of colours; None is words alone.
    """

    name: str
    pixels: Callable[[Picture, Sample], Picture] | None = None
    lines: Callable[[ImageDraw, Sample, float], None] | None = None
    trails: Callable[[ImageDraw, Sequence[Sample], float], None] | None = None
    beside: Callable[[Sample], Picture] | None = None
    extent: Callable[[Sample], Extent] | None = None
    within: Callable[[Sample, Extent], Picture] | None = None
    stand_in: Callable[[Sample, int], Picture] | None = None
    key: tuple[tuple[str, Color | None], ...] = ()

    def picture(self, sample: Sample, extent: Extent | None = None) -> Picture | None:
        """The picture beside a sample's, (H, W, 3) uint8 sRGB, None where nothing is shown there; `extent`: else its own."""
        if self.within and self.extent:
            return self.within(sample, extent or self.extent(sample))
        return self.beside(sample) if self.beside else None


class LabelSpec(Spec):
    """The properties of all labels: `name` (that of their file), `meaning`, `axes`, their frame of reference, `needs`, the
    inputs besides what the picture's camera sees at its instant, and `options`, the class of those that a recipe's `labels` may
    give.

    `names_categories`: its text has the names of categories, which merging then does not spell in another way. `prove` compares
    a stored sample with itself, which is quick; besides, `check` computes every label again.
    """

    model_config = ConfigDict(allow_inf_nan=True)

    KIND: ClassVar[Kind] = "labels"

    name: str
    meaning: str
    axes: str = ""
    needs: tuple[InstanceOf[Need[Any]], ...] = ()
    options: type[Frozen] | None = None
    prove: Proof = no_proof
    drawing: InstanceOf[Drawing] | None = None
    names_categories: bool = False

    @property
    def view_offsets(self) -> frozenset[int]:
        """Instants from a picture's own to those whose triangles the label reads."""
        return frozenset(need.view_offset for need in self.needs) - {0}

    @property
    def pose_offsets(self) -> frozenset[int]:
        """Instants from a picture's own to those whose poses the label reads, with or without triangles."""
        return frozenset(need.pose_offset for need in self.needs) - {0}

    def is_in(self, sample: Sample) -> bool:
        """Return whether a sample has it."""
        return self.name in sample.requested


class ChannelLabel(LabelSpec):
    """A label of pixels, stored as a separate file: (height, width) or (height, width, components); `empty` where nothing is
    seen. `encoding` is the default kind of file: png16 for ids, tiff for whatever has to be exact; `colors` are those of the
    first ids in files with a palette.

    `in_steps`: a PNG file has it in whole steps. `holds_classes`: its numbers are classes, which the plan of the data set then
    lists. `ids` are the kinds of ids in the array, each with a function that replaces them. Arrays of whole numbers without a
    declaration raise PluginError.
    """

    compute: Callable[[LabelContext], Array]
    dtype: Any
    components: int = 1
    in_steps: bool = False
    holds_classes: bool = False
    unit: str = "1"
    empty: float = 0
    encoding: Any = "tiff"
    colors: tuple[Color, ...] = ()
    ids: SkipValidation[Ids | None] = None

    @model_validator(mode="after")
    def _check_ids(self) -> Self:
        try:
            check_ids(f"label {self.name!r}", self.ids, has_whole_numbers(self.dtype), "by_table")
        except ValueError as error:
            raise PluginError(f"{type(self).__name__}.ids: {error}") from None
        return self

    def is_in(self, sample: Sample) -> bool:
        """Return whether the sample keeps the channel."""
        return self.name in sample.channels

    @property
    def channel(self) -> Channel:
        """The channel that describes the label's file."""
        return Channel(
            self.name,
            self.dtype,
            self.components,
            self.unit,
            self.empty,
            self.encoding,
            self.meaning,
            self.colors,
            self.in_steps,
        )


def derived(context: LabelContext, i: int) -> Mapping[str, Any]:
    """The `compute` of labels that follow from placements or from other labels: `restore` gives their fields."""
    return {}


def no_record(annotation: ObjectAnnotation) -> None:
    """The `keep` of labels that follow from the shot and its models: nothing is stored."""
    return


class ObjectLabel(LabelSpec):
    """A label of objects: one field or several that are computed together.

    `compute(context, i)` gives the fields of the object of id i + 1; `derived`: `restore` does. `keep` gives, as JSON, the part
    of them that does not follow from the shot and its models, None if everything follows. `restore(kept, placement,
    annotation)` computes all fields from this part again, equal to the last bit; other labels' fields are available as
    attributes of the annotation.

    A label that is `on_request` is computed only where a recipe's `annotations` name it.
    """

    fields: tuple[InstanceOf[Field], ...]
    compute: Callable[[LabelContext, int], Mapping[str, Any]] = derived
    restore: Callable[[Any, Placement, ObjectAnnotation], Mapping[str, Any]]
    keep: Callable[[ObjectAnnotation], Any] = no_record
    on_request: bool = False

    @property
    def follows(self) -> bool:
        """Return whether it follows from what every data set has: it is there whether it was asked for or not."""
        return self.keep is no_record and self.options is None and not self.needs

    def is_in(self, sample: Sample) -> bool:
        """Return whether the sample's objects have it: it was asked for, or did not have to be."""
        return not self.on_request or self.name in sample.requested or (self.follows and sample.origin is not None)

    @staticmethod
    def from_placement(
        of: Callable[[Placement], Mapping[str, Any]],
        *,
        name: str,
        meaning: str,
        fields: Sequence[Field],
        prove: Proof = no_proof,
        axes: str = "",
        drawing: Drawing | None = None,
        on_request: bool = False,
    ) -> ObjectLabel:
        """A label computed from the poses of object and camera and from the model alone: nothing of it is stored."""
        return ObjectLabel(
            name=name,
            meaning=meaning,
            fields=tuple(fields),
            axes=axes,
            restore=lambda kept, placement, o: of(placement),
            prove=prove,
            drawing=drawing,
            on_request=on_request,
        )


class SampleLabel(LabelSpec):
    """A label of a whole picture, computed where a recipe's `annotations` name it.

    `compute(context, objects)` gives its fields. The store keeps them as they are.
    """

    fields: tuple[InstanceOf[Field], ...]
    compute: Callable[[LabelContext, Sequence[ObjectAnnotation]], Mapping[str, Any]]


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


def mixed(triangles: Array, numbers: Array) -> int:
    """Return the number of the given triangles that have several numbers; each pixel has one triangle and one number."""
    one = np.zeros(int(triangles.max()) + 1, numbers.dtype)
    one[triangles] = numbers  # of each triangle one of its numbers
    return len(np.unique(triangles[one[triangles] != numbers]))
