"""The classes of labels; each file of `viewsphere.labels` defines one label as `LABEL`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, InstanceOf, SkipValidation, model_validator
from pydantic import Field as described

from viewsphere.errors import PluginError, ViewsphereError
from viewsphere.labels.shared.field import Field
from viewsphere.labels.shared.ids import Ids, check_ids, has_whole_numbers
from viewsphere.labels.shared.needs import Need
from viewsphere.labels.shared.placement import ModelFacts, Placement
from viewsphere.model.channel import Channel
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.model.sensors.camera import Intrinsics
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


def _no_proof(sample: Sample, models: Models) -> Iterator[str]:
    """The proof of a label that nothing else in a sample can contradict; only recomputation proves it."""
    yield from ()


TAIL = 8
"""Number of instants before a sample's own that drawings with trails receive."""

Color = tuple[int, int, int]
"""sRGB, 0 to 255."""

Extent = tuple[float, float]
"""The least and the greatest value that a picture of numbers distinguishes."""


@dataclass(frozen=True)
class Drawing:
    """The way that `preview` shows a label, and its name there. A drawing changes pixels of the picture, draws lines over it at
    a scale, or puts another picture (of the sample's size) beside it.

    `trails` are lines that also show the past. They receive the sensor's samples of up to `labels.TAIL` instants before, and
    the sample itself last. Instead of `beside`, `within` gives a picture that distinguishes the values of an extent. `extent`
    returns a sample's own extent, so that all pictures of a sequence may have the same colours. `stand_in` makes a picture of
    this size for a sample that has none. `key` gives the meaning of colours; an entry with None is only words.
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
        """The picture beside a sample's, (H, W, 3) uint8 sRGB, or None; `extent` replaces the sample's own extent."""
        if self.within and self.extent:
            return self.within(sample, extent or self.extent(sample))
        return self.beside(sample) if self.beside else None


class LabelSpec(Spec):
    """The properties of all labels."""

    model_config = ConfigDict(allow_inf_nan=True)

    KIND: ClassVar[Kind] = "labels"

    name: str = described(description="the name in recipes and data sets; a module with one label has the same name")
    meaning: str = described(description="a phrase for lists")
    axes: str = described(default="", description="the frame of reference")
    needs: tuple[InstanceOf[Need[Any]], ...] = described(
        default=(), description="inputs besides the view of the picture's own camera, such as `Next(1)` and `Partner()`"
    )
    options: type[Frozen] | None = described(default=None, description="the class of the options in a recipe's `labels`")
    prove: Proof = described(
        default=_no_proof,
        description="`prove(sample, models)`: yields a message for each contradiction within a stored sample. `check` also "
        "recomputes every label",
    )
    refuses: Callable[[Intrinsics], str | None] | None = described(
        default=None,
        description="`refuses(intrinsics)`: the reason why pictures of this lens cannot have the label, None if they can",
    )
    one_pose: bool = described(
        default=False,
        description="whether it requires that all rows of a picture have one pose; rolling shutters then refuse it",
    )
    drawing: InstanceOf[Drawing] | None = described(default=None, description="the `Drawing` of previews and reports")
    names_categories: bool = described(
        default=False,
        description="whether its text contains names of categories, which merging must then not change",
    )

    @property
    def view_offsets(self) -> frozenset[int]:
        """Instants whose triangles the label reads, relative to the picture's own."""
        return frozenset(need.view_offset for need in self.needs) - {0}

    @property
    def pose_offsets(self) -> frozenset[int]:
        """Instants whose poses the label reads, with or without triangles, relative to the picture's own."""
        return frozenset(need.pose_offset for need in self.needs) - {0}

    def is_in(self, sample: Sample) -> bool:
        """Return whether a sample has the label."""
        return self.name in sample.requested


class ChannelLabel(LabelSpec):
    """A label of pixels, stored as a file for each picture."""

    compute: Callable[[LabelContext], Array] = described(
        description="`compute(context)`: the array, (height, width) or (height, width, components)"
    )
    dtype: Any = described(description="the type of the array")
    components: int = described(default=1, description="numbers a pixel; 0: the array has rows, as many as there are")
    unit: str = described(default="1", description="the unit of the numbers")
    empty: float = described(default=0, description="the number where nothing is seen")
    encoding: Any = described(
        default="tiff", description="the default file: png16 for ids, png for small numbers, tiff for exact ones, npz for rows"
    )
    in_steps: bool = described(default=False, description="whether PNG files hold whole steps of `files.depth_unit`")
    colors: tuple[Color, ...] = described(default=(), description="colours of the first ids, in files with a palette")
    holds_classes: bool = described(default=False, description="whether its numbers are classes, which the plan then lists")
    ids: SkipValidation[Ids | None] = described(
        default=None,
        description="the kinds of ids in the array, each with a function that replaces them; required for whole numbers",
    )

    @model_validator(mode="after")
    def _check_ids(self) -> Self:
        try:
            check_ids(f"label {self.name!r}", self.ids, has_whole_numbers(self.dtype), "by_table")
        except ValueError as error:
            raise PluginError(f"{type(self).__name__}.ids: {error}") from None
        return self

    def is_in(self, sample: Sample) -> bool:
        """Return whether the sample has the channel."""
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
    """A label of objects: one field or several that are computed together."""

    fields: tuple[InstanceOf[Field], ...] = described(description="its fields, attributes of objects")
    compute: Callable[[LabelContext, int], Mapping[str, Any]] = described(
        default=derived, description="`compute(context, i)`: the fields of the object with id i + 1; without, `restore` does"
    )
    keep: Callable[[ObjectAnnotation], Any] = described(
        default=no_record,
        description="`keep(object)`: JSON of the part that does not follow from the shot and its models; None: all follows",
    )
    restore: Callable[[Any, Placement, ObjectAnnotation], Mapping[str, Any]] = described(
        description="`restore(kept, placement, object)`: all fields from this part, equal to the last bit; the object has the "
        "fields of other labels"
    )
    on_request: bool = described(default=False, description="whether it is computed only if a recipe's `annotations` name it")

    @property
    def follows(self) -> bool:
        """Return whether the label follows from the content of every data set, requested or not."""
        return self.keep is no_record and self.options is None and not self.needs

    def is_in(self, sample: Sample) -> bool:
        """Return whether the sample's objects have the label: it was requested, or needs no request."""
        return not self.on_request or self.name in sample.requested or (self.follows and sample.origin is not None)

    @staticmethod
    def from_placement(
        fields_of: Callable[[Placement], Mapping[str, Any]],
        *,
        name: str,
        meaning: str,
        fields: Sequence[Field],
        prove: Proof = _no_proof,
        axes: str = "",
        drawing: Drawing | None = None,
        on_request: bool = False,
    ) -> ObjectLabel:
        """A label computed only from the poses of object and camera and from the model; nothing is stored for it."""
        return ObjectLabel(
            name=name,
            meaning=meaning,
            fields=tuple(fields),
            axes=axes,
            restore=lambda kept, placement, o: fields_of(placement),
            prove=prove,
            drawing=drawing,
            on_request=on_request,
        )


class SampleLabel(LabelSpec):
    """A label of whole pictures, computed if a recipe's `annotations` name it."""

    fields: tuple[InstanceOf[Field], ...] = described(description="its fields, attributes of samples, stored as they are")
    compute: Callable[[LabelContext, Sequence[ObjectAnnotation]], Mapping[str, Any]] = described(
        description="`compute(context, objects)`: the fields"
    )


def rendered(sample: Sample) -> list[ObjectAnnotation]:
    """The objects that were not imported."""
    return [o for o in sample.objects if o.source is None]


def period_of(sample: Sample) -> int | None:
    """The width of a picture of a full turn, whose last column is beside its first one; None for others."""
    return None if sample.known_camera is None else sample.known_camera.lens.period


def channel_of(sample: Sample, name: str) -> Array | None:
    """A channel, None if it is missing or cannot be read, which another proof reports."""
    try:
        array = sample.channels[name]
    except (KeyError, ViewsphereError):
        return None
    is_picture = array.shape[:2] == (sample.height, sample.width)
    return array if is_picture or array.dtype.names else None


def mixed(triangles: Array, numbers: Array) -> int:
    """Return how many of the given triangles have several numbers; each pixel has a triangle and a number."""
    one = np.zeros(int(triangles.max()) + 1, numbers.dtype)
    one[triangles] = numbers  # one of the numbers for each triangle
    return len(np.unique(triangles[one[triangles] != numbers]))
