"""Baked light in the cache: computed once for equal places, skies and models, and shared in memory by all processes that use
it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from viewsphere.caches.arrays import Arrays, Content, number_type
from viewsphere.caches.entries import cached
from viewsphere.kernels.build import HOST
from viewsphere.kernels.digests import package_digest

T = TypeVar("T")

PACKAGES = ("engines", "rendering", "materials", "geometry", "kernels")
"""Packages whose sources affect baked light, in addition to its meshes and lights."""


def kept_light(content: Iterable[Any], make: Callable[[], T], types: tuple[type, ...]) -> T:
    """The result of `make`, from the cache if it has the result for equal content. `types`: those of the result's records."""
    return cached("light", digest_of(content), make, pack_records, lambda held: unpack_records(held, types))


def digest_of(content: Iterable[Any]) -> str:
    """The digest of the sources, and of arrays, bytes and values that `repr` distinguishes."""
    digest = hashlib.sha256(_sources().encode())
    for part in content:
        if isinstance(part, np.ndarray):
            digest.update(repr((part.dtype.str, part.shape)).encode())
            digest.update(np.ascontiguousarray(part).data if part.size else b"")
        else:
            digest.update(part if isinstance(part, bytes) else f"{part!r}\0".encode())
    return digest.hexdigest()


@cache
def _sources() -> str:
    """The digest of the sources, of the kernels' build, and of the processor's type, which affects numpy's sines."""
    package = Path(__file__).parents[1]
    return " ".join([HOST, np.__version__, *(package_digest(package / name) for name in PACKAGES)])


def pack_records(value: Any) -> Content:
    """A value made of tuples, named tuples, dataclasses, arrays and numbers as plain data. Raises TypeError for others."""
    arrays: dict[str, NDArray[Any]] = {}
    return Content(_packed(value, arrays), arrays)


def unpack_records(content: Content, types: Iterable[type]) -> Any:
    """The value that `pack_records` converted to plain data, with records of these types; others raise KeyError."""
    return _unpacked(content.about, content.arrays, {kind.__name__: kind for kind in types})


def _packed(value: Any, arrays: dict[str, NDArray[Any]]) -> Any:
    if value is None or (isinstance(value, bool | int | float | str) and not isinstance(value, np.generic)):
        return value
    if isinstance(value, np.ndarray):
        arrays[str(len(arrays))] = value
        return {"array": str(len(arrays) - 1)}
    if isinstance(value, np.generic):
        return {"number": [value.dtype.str, value.item()]}
    values = [_packed(part, arrays) for part in _parts(value)]
    return {"record": [type(value).__name__, values]} if type(value) is not tuple else {"tuple": values}


def _parts(value: Any) -> Iterable[Any]:
    if isinstance(value, tuple):
        return cast("tuple[Any, ...]", value)
    if is_dataclass(value):
        return [getattr(value, field.name) for field in fields(value)]
    raise TypeError(f"{type(value).__name__} is no record")


def _unpacked(about: Any, arrays: Arrays, types: dict[str, type]) -> Any:
    if not isinstance(about, dict):
        return about
    ((kind, held),) = cast("dict[str, Any]", about).items()
    if kind == "array":
        return arrays[held]
    if kind == "number":
        return number_type(held[0]).type(held[1])
    name, values = (None, held) if kind == "tuple" else held
    parts = [_unpacked(part, arrays, types) for part in values]
    return tuple(parts) if name is None else types[name](*parts)
