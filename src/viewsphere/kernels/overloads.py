"""The kernels that viewsphere calls, and the types of their arguments: the table `overloads.json`, by `scripts/kernels`.

It lets kernels be compiled before anything calls them: all at once on several cores, or for a wheel. Overloads that the table
lacks are compiled when they are called.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from viewsphere.files import read_text

TABLE = Path(__file__).with_name("overloads.json")


@dataclass(frozen=True)
class Overload:
    """A kernel and the types of its arguments, in numba's notation. `needs` are the features of a shot that calls it; None if
    no frame calls it, only models, exports or checks.
    """

    module: str
    kernel: str
    types: str
    needs: tuple[str, ...] | None = None
    seconds: float = 0.0

    @property
    def name(self) -> str:
        """The name in lists of compiled overloads."""
        return f"{self.module}:{self.kernel}:{self.types}"

    def compile(self) -> bool:
        """Compile the overload if it is not in the cache; return True if it was compiled now."""
        kernel = getattr(import_module(self.module), self.kernel)
        before = sum(kernel.stats.cache_misses.values())
        kernel.compile(tuple(decoded(json.loads(self.types))))
        return sum(kernel.stats.cache_misses.values()) > before


@cache
def table() -> tuple[Overload, ...]:
    """The overloads, in order of their compile time, longest first."""
    rows = json.loads(read_text(TABLE)) if TABLE.is_file() else []
    return tuple(Overload(row[0], row[1], row[2], row[3] if row[3] is None else tuple(row[3]), row[4]) for row in rows)


def write(overloads: Iterable[Overload], file: Path = TABLE) -> None:
    """Write the table."""
    ordered = sorted(overloads, key=lambda each: (-each.seconds, each.name))
    rows = [json.dumps([each.module, each.kernel, each.types, each.needs, each.seconds]) for each in ordered]
    file.write_text("[\n" + ",\n".join(rows) + "\n]\n", "utf-8", newline="\n")


def needed(features: frozenset[str]) -> tuple[Overload, ...]:
    """The overloads that a shot of these features calls."""
    return tuple(each for each in table() if each.needs is not None and features.issuperset(each.needs))


def encoded(kind: Any) -> Any:
    """A numba type as plain data; raises TypeError for types that kernels do not accept."""
    import numba

    types: Any = numba.types  # whose stubs lack most
    if isinstance(kind, types.BaseNamedTuple):
        made = kind.instance_class
        return {f"{made.__module__}:{made.__qualname__}": [encoded(each) for each in kind.types]}
    if isinstance(kind, types.BaseTuple):
        return {"tuple": [encoded(each) for each in kind.types]}
    if isinstance(kind, types.Array) and kind.aligned:
        return [str(kind.dtype), kind.ndim, kind.layout, *([] if kind.mutable else ["readonly"])]
    if isinstance(kind, types.Integer | types.Float | types.Boolean) and not isinstance(kind, types.Literal):
        return str(kind)
    raise TypeError(f"expected numbers, arrays of numbers, or tuples of them; found {kind}")


def decoded(plain: Any) -> Any:
    """A numba type from plain data, or a list of types from a list of such data."""
    from numba import types

    if isinstance(plain, str):
        return getattr(types, {"bool": "boolean"}.get(plain, plain))
    if isinstance(plain, dict):
        ((name, members),) = plain.items()
        kinds = [_member(each) for each in members]
        if name == "tuple":
            return types.BaseTuple.from_types(kinds)
        module, _, made = name.partition(":")
        return types.BaseTuple.from_types(kinds, getattr(import_module(module), made))
    return [_member(each) for each in plain]


def _member(plain: Any) -> Any:
    from numba import types

    if isinstance(plain, list):
        dtype, ndim, layout, *more = plain
        return types.Array(decoded(dtype), ndim, layout, readonly=bool(more))
    return decoded(plain)
