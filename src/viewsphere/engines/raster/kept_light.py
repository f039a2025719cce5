"""Baked light in the cache: made once for equal places, skies and models, and shared in memory by the processes that use it."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from viewsphere.caches.entries import kept
from viewsphere.caches.records import pack_records, unpack_records
from viewsphere.kernels.build import HOST
from viewsphere.kernels.digests import package_digest

T = TypeVar("T")

PACKAGES = ("engines", "rendering", "materials", "geometry", "kernels")
"""Packages whose sources baked light depends on, besides the meshes and the light that it is made of."""


def kept_light(content: Iterable[Any], make: Callable[[], T], types: tuple[type, ...]) -> T:
    """The result of `make`, from the cache where it holds what was made of equal content. `types`: of the result's records."""
    return kept("light", digest_of(content), make, pack_records, lambda held: unpack_records(held, types))


def digest_of(content: Iterable[Any]) -> str:
    """The digest of arrays, bytes and values that `repr` tells apart, and of the sources."""
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
    """Digest of the sources, of the kernels' build, and of what numpy's sines depend on: the processor's type."""
    package = Path(__file__).parents[2]
    return " ".join([HOST, np.__version__, *(package_digest(package / name) for name in PACKAGES)])
