"""Exact conversion of objects to plain JSON and back. Short records leave out everything that follows from shot and models."""

from __future__ import annotations

import json
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

from viewsphere.errors import StoreError
from viewsphere.labels.shared.field import Field
from viewsphere.labels.shared.placement import Placement
from viewsphere.labels.shared.spec import ObjectLabel, derived, no_record
from viewsphere.model.sample import ObjectAnnotation

_OWN = frozenset(f.name for f in fields(ObjectAnnotation))


def _annotation_of(object_id: int, values: Iterable[Mapping[str, Any]], source: Mapping[str, Any] | None = None) -> Any:
    """The annotation with these fields; fields that `ObjectAnnotation` lacks go to `extra`."""
    own: dict[str, Any] = {}
    for some in values:
        own.update(some)
    if own.keys() <= _OWN:
        return ObjectAnnotation(id=object_id, source=source, **own)
    more = {name: own.pop(name) for name in own.keys() - _OWN}
    return ObjectAnnotation(id=object_id, source=source, extra=more, **own)


def computed(object_id: int, values: Iterable[Mapping[str, Any]], placement: Placement, makers: Makers) -> ObjectAnnotation:
    """The rendered object with these fields. All other fields follow from them and from the placement. Fields that a recipe's
    `annotations` name are computed here, the rest when first read.
    """
    made = from_short_record({"id": object_id}, placement, makers)
    for some in values:
        made.__dict__.update(some)
    for field in makers.requested:
        getattr(made, field)
    return made


def whole_record(o: ObjectAnnotation, labels: Sequence[ObjectLabel]) -> dict[str, Any]:
    """Return every field of an object, in the types that `json.dumps(..., allow_nan=False)` accepts."""
    known = {**o.extra, **{name: getattr(o, name) for name in _OWN}}
    record = {"id": o.id, **{f.name: f.plain(known[f.name]) for f in _fields(labels) if f.name in known}}
    return record if o.source is None else {**record, "source": dict(o.source)}


def from_whole_record(record: Mapping[str, Any], labels: Sequence[ObjectLabel]) -> ObjectAnnotation:
    """The object from which a whole record was made."""
    values = {f.name: f.value(record[f.name]) for f in _fields(labels) if f.name in record}
    if type(record["id"]) is not int or record["id"] < 1:
        raise ValueError(f"object {record['id']!r:.40}: expected a number from 1 on")
    finite(record.get("source"))
    return _annotation_of(record["id"], [values], record.get("source"))


def finite(source: Any) -> None:
    """Raise ValueError for a foreign entry with NaN or infinite numbers, which JSON does not allow."""
    if source is not None:
        json.dumps(source, allow_nan=False)


def _fields(labels: Sequence[ObjectLabel]) -> Iterable[Field]:
    return (field for label in labels for field in label.fields)


def short_record(o: ObjectAnnotation, labels: Iterable[ObjectLabel]) -> dict[str, Any]:
    """The stored parts of a rendered object, by the labels' names."""
    kept = {label.name: label.keep(o) for label in labels}
    return {"id": o.id, **{name: value for name, value in kept.items() if value is not None}}


@dataclass(frozen=True)
class Makers:
    """The labels that restore short records, by the names of fields; `labels` includes the `wanted` labels."""

    by_field: Mapping[str, ObjectLabel]
    labels: Sequence[ObjectLabel]
    wanted: Container[str]
    where: str

    @cached_property
    def requested(self) -> tuple[str, ...]:
        """The fields of requested labels that follow from other fields."""
        derived_ones = (label for label in self.labels if label.on_request and label.compute is derived)
        return tuple(field.name for label in derived_ones for field in label.fields)

    def has(self, field: str) -> bool:
        """Return whether objects have a field, either always or on request."""
        label = self.by_field[field]
        return not label.on_request or label.name in self.wanted

    def label(self, field: str) -> ObjectLabel | None:
        """The label that restores a field; None for an unknown field, or a field that was not requested and does not follow."""
        label = self.by_field.get(field)
        return label if label and (label.follows or self.has(field)) else None


def from_short_record(record: Mapping[str, Any], placement: Placement, makers: Makers) -> ObjectAnnotation:
    """The object from which a short record was made; a field is restored at the first access. `makers.where` names the record
    in messages.
    """
    made = object.__new__(_Restored)
    made.__dict__.update(id=record["id"], source=None, _record=record, _placement=placement, _makers=makers)
    return made


class _Restored(ObjectAnnotation):
    """An object whose fields are restored at the first access."""

    def __getattr__(self, name: str) -> Any:
        own = self.__dict__
        label = own["_makers"].label(name) if "_makers" in own else None
        if label is None:
            return self._other(name)
        try:
            restored = label.restore(own["_record"].get(label.name), own["_placement"], self)
            if label.keep is not no_record:  # all others follow from whole records
                for field in label.fields:
                    field.check(restored[field.name])
            own.update(restored)
            return own[name]
        except (LookupError, TypeError, ValueError, AttributeError, ArithmeticError) as error:
            raise StoreError(
                f"{own['_makers'].where}: object {own['id']}: expected what {label.name} is made of, found "
                f"{type(error).__name__}: {error}"
            ) from None

    def _other(self, name: str) -> Any:
        if name != "extra":
            return super().__getattr__(name)
        makers: Makers | None = self.__dict__.get("_makers")
        beyond = [field for field in makers.by_field if field not in _OWN and makers.has(field)] if makers else []
        self.__dict__["extra"] = {}
        self.__dict__["extra"] = {field: getattr(self, field) for field in beyond}
        return self.__dict__["extra"]

    def __dir__(self) -> list[str]:
        """Return all attributes, including those not restored yet."""
        makers: Makers = self.__dict__["_makers"]
        return sorted({*object.__dir__(self), *_OWN, *filter(makers.has, makers.by_field)})

    def __getstate__(self) -> dict[str, Any]:
        """Return every field, so that an object can be sent to other processes without its shot."""
        return {name: getattr(self, name) for name in _OWN}
