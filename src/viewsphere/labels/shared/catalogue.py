"""Every label by name, by kind and by field, loaded one at a time."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Iterator, Mapping
from functools import cache
from importlib.util import find_spec
from typing import Any, TypeVar

from viewsphere import plugins
from viewsphere.errors import PluginError
from viewsphere.labels.shared.spec import ChannelLabel, Drawing, LabelSpec, ObjectLabel, Picture, SampleLabel
from viewsphere.model.channel import DEFAULT_CHANNELS, PASSES, Channel, picture_of
from viewsphere.model.sample import Sample

T = TypeVar("T")


class _Table(Mapping[str, T]):
    """Labels, or facts about them, by name. Reading a name imports only its label; iterating over the table imports all."""

    def __init__(self, names: Callable[[], Iterable[str]], of: Callable[[str], T | None]) -> None:
        self._names, self._of = names, of

    def __getitem__(self, name: str) -> T:
        found = self._of(name)
        if found is None:
            raise KeyError(name)
        return found

    def __iter__(self) -> Iterator[str]:
        return (name for name in self._names() if self._of(name) is not None)

    def __len__(self) -> int:
        return sum(1 for _ in self)


@cache
def labels() -> _Table[LabelSpec]:
    """Return every label by name: first the channels that recipes keep by default, then the others in alphabetical order."""
    return _Table(label_names, _loadable)


@cache
def label_names() -> tuple[str, ...]:
    """Names of all labels, in the order of `labels`; imports none."""
    return tuple(sorted(plugins.names("labels"), key=lambda name: (name not in DEFAULT_CHANNELS, name)))


@cache
def _loadable(name: str) -> LabelSpec | None:
    """The label of this name; None if it is a third party's and cannot be loaded."""
    try:
        return label_named(name)
    except PluginError:
        if not plugins.is_third_party("labels", name):
            raise
        return None


@cache
def label_named(name: str) -> LabelSpec | None:
    """The label of this name, None if there is none; loads no other label. Raises PluginError if it cannot be loaded."""
    if name not in plugins.names("labels"):
        return None
    return plugins.load(LabelSpec, name)


def is_on_request(name: str) -> bool:
    """True for a label that a recipe's `annotations` may name."""
    label = label_named(name)
    return isinstance(label, SampleLabel) or (isinstance(label, ObjectLabel) and label.on_request)


def is_channel(name: str) -> bool:
    """True for a channel that a recipe's `channels` may name: a pass, or a label of pixels."""
    return name in PASSES or isinstance(label_named(name), ChannelLabel)


@cache
def channel_labels() -> _Table[ChannelLabel]:
    """Labels of pixels by name."""
    return _Table(label_names, lambda name: label if isinstance(label := _loadable(name), ChannelLabel) else None)


@cache
def object_labels() -> tuple[ObjectLabel, ...]:
    """Labels of objects, including labels on request."""
    return tuple(label for label in labels().values() if isinstance(label, ObjectLabel))


def labels_of(requested: Container[str]) -> tuple[ObjectLabel, ...]:
    """The labels of objects in data sets with these requests; imports no others."""
    found = (_loadable(name) for name in label_names() if name in regular() or name in requested)
    return tuple(
        label for label in found if isinstance(label, ObjectLabel) and (not label.on_request or label.name in requested)
    )


@cache
def regular() -> frozenset[str]:
    """Names of labels that objects may have without a request. They are read from the source text of the modules, so that
    frames import no label on request. Reading 45 files takes 2 ms; importing those labels takes 100 ms.
    """
    texts = {module: _text(module) for module in set(plugins.shipped("labels").values())}
    found = {name for name, module in plugins.shipped("labels").items() if _makes_regular(texts[module])}
    return frozenset(found | {name for name in label_names() if plugins.is_third_party("labels", name)})


def _text(module: str) -> bytes:
    """The source of a module, read without importing the module."""
    found = find_spec(module)
    loader: Any = found and found.loader
    return loader.get_data(found.origin) if found and found.origin else b""


def _makes_regular(text: bytes) -> bool:
    """Return whether a module defines any label of objects that is not on request."""
    return text.count(b"ObjectLabel(") + text.count(b"ObjectLabel.from_placement(") > text.count(b"on_request=True")


@cache
def sample_labels() -> _Table[SampleLabel]:
    """Labels of whole pictures by name."""
    return _Table(label_names, lambda name: label if isinstance(label := _loadable(name), SampleLabel) else None)


def sample_labels_of(requested: Container[str]) -> tuple[SampleLabel, ...]:
    """The requested labels of whole pictures; imports no others."""
    found = (_loadable(name) for name in label_names() if name in requested)
    return tuple(label for label in found if isinstance(label, SampleLabel))


@cache
def on_request() -> dict[str, ObjectLabel | SampleLabel]:
    """Return every label that a recipe's `annotations` may name."""
    return {label.name: label for label in object_labels() if label.on_request} | dict(sample_labels())


@cache
def makers() -> _Table[ObjectLabel]:
    """Labels of objects by the names of their fields."""
    return _Table(lambda: [field.name for label in object_labels() for field in label.fields], _maker)


@cache
def _maker(field: str) -> ObjectLabel | None:
    """The label of this field. All labels are imported only if no regular label has the field."""
    every = (label for found in (lambda: labels_of(()), object_labels) for label in found())
    return next((label for label in every if any(field == its.name for its in label.fields)), None)


@cache
def channels() -> _Table[Channel]:
    """Return every channel that a recipe's `channels` may name: first the passes, then the labels of pixels."""
    return _Table(lambda: (*PASSES, *channel_labels()), _channel)


def _channel(name: str) -> Channel | None:
    label = _loadable(name)
    return label.channel if isinstance(label, ChannelLabel) else PASSES.get(name)


@cache
def drawable() -> dict[str, Drawing]:
    """The drawings of all labels and passes that have one, by the name of the label or pass, in alphabetical order."""
    from viewsphere.labels.shared.drawing.passes import DRAWINGS  # loads the code that develops pictures

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
    if the samples have a picture, or no label has a substitute.
    """
    if picture_of(channels) is not None:
        return None
    found = (label.drawing and label.drawing.stand_in for name, label in channel_labels().items() if name in channels)
    return next(filter(None, found), None)


def is_shown(channels: Container[str]) -> bool:
    """Return whether samples with these channels have a picture or a substitute for it."""
    return picture_of(channels) is not None or stand_in_for(channels) is not None
