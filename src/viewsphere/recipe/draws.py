"""Distributions, which may replace any number, vector, colour or word of a recipe's scene, and some whole entries.

`Drawn[T]` is a field of type T that also takes a distribution over T. Each bound, mean and choice of a distribution is read
like a T, with T's short forms, limits and error messages. Valid values of T form a convex set, so that anything drawn between
valid values is valid. `drawn` replaces distributions with draws.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from itertools import pairwise
from statistics import NormalDist
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, TypeVar, cast

from pydantic import (
    BeforeValidator,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    PrivateAttr,
    TypeAdapter,
    ValidatorFunctionWrapHandler,
    model_validator,
)
from pydantic_core import CoreSchema, core_schema

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Count, Metres, Natural, Number
from viewsphere.model.fields.omit_none import OmitNone
from viewsphere.recipe.seed_names import seed_name
from viewsphere.recipe.values import OrShort
from viewsphere.validation.errors import error_at, nearest, shown
from viewsphere.validation.quantity import quantity

if TYPE_CHECKING:
    from numpy.random import Generator

KINDS = ("uniform", "log_uniform", "normal", "choice")

DEEPEST = 16
"""Deepest nesting of distributions, far below the depth at which Python's recursion ends."""

NEARLY_ALWAYS = 3.0
"""Standard deviations around a normal distribution's mean within which 399 of 400 draws lie."""

Steps = tuple[str, ...]
RngOf = Callable[[Steps], "Generator"]
"""The generator for a path of seed names: every distribution has its own generator, so that no draw depends on another."""

Of = Literal["number", "whole number", "vector", "word", "entry"]
T = TypeVar("T")


class Gaussian(OmitNone):
    """A normal distribution. Values beyond `min`, `max` or the field's own limits are never drawn."""

    OMIT_IF_NONE = ("mean", "deviation", "min", "max")

    mean: Any = Field(description="mean")
    deviation: Any = Field(description="standard deviation")
    min: Any = Field(default=None, description="lowest value drawn")
    max: Any = Field(default=None, description="highest value drawn")


def _gaussian(value: Any) -> Any:
    if isinstance(value, (list, tuple)):
        pair = cast(list[Any], value)
        if len(pair) != 2:
            raise ValueError(f"expected [mean, deviation] or a mapping of them; found {shown(value)}")
        return {"mean": pair[0], "deviation": pair[1]}
    return value


class Distribution(OmitNone):
    """One of uniform, log_uniform, normal and choice. Their arguments may be distributions themselves."""

    OMIT_IF_NONE = (*KINDS, "weights")

    uniform: tuple[Any, Any] | None = Field(default=None, description="[low, high]; for vectors, each component separately")
    log_uniform: tuple[Any, Any] | None = Field(
        default=None, description="[low, high], above 0: equal chances between 1 and 2 and between 2 and 4"
    )
    normal: Annotated[Gaussian, BeforeValidator(_gaussian), OrShort({"type": "array", "minItems": 2, "maxItems": 2})] | None = (
        Field(default=None, description="[mean, deviation], or {mean, deviation, min, max}; kept within the field's limits")
    )
    choice: Annotated[tuple[Any, ...], Field(min_length=1)] | None = Field(default=None, description="one of these")
    weights: tuple[Annotated[float, Field(strict=True, ge=0)], ...] | None = Field(
        default=None, description="for choice: weight of each, in any unit; by default equal"
    )

    _limits: tuple[float, float] = PrivateAttr(default=(-math.inf, math.inf))

    @model_validator(mode="after")
    def _check(self) -> Distribution:
        given = [name for name in KINDS if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(f"expected one of {', '.join(KINDS)}; found {' and '.join(given) or 'none'}")
        if self.weights is not None:
            if self.choice is None or len(self.weights) != len(self.choice):
                raise ValueError(f"expected as many weights as choices; found {quantity(len(self.weights), 'weight')}")
            if not sum(self.weights):
                raise ValueError("expected a weight above 0; found none")
        return self

    @property
    def kind(self) -> str:
        """The kind of this distribution, one of four."""
        return next(name for name in KINDS if getattr(self, name) is not None)

    def draw(self, rng_of: RngOf, path: Steps) -> Any:
        """A concrete value; arguments that are distributions are drawn first, each with its own path."""
        rng = rng_of(path)
        if self.choice is not None:
            return drawn(self.choice[_pick(rng, len(self.choice), self.weights)], rng_of, (*path, "choice"))
        if self.normal is not None:
            args = (getattr(self.normal, name) for name in ("mean", "deviation", "min", "max"))
            values = [drawn(value, rng_of, (*path, f"normal {i}")) for i, value in enumerate(args)]
            return _each(partial(_normal, rng, self._limits), *values)
        low, high = (drawn(end, rng_of, (*path, f"end {i}")) for i, end in enumerate(self.uniform or self.log_uniform or ()))
        if isinstance(low, int):
            return int(rng.integers(min(low, high), max(low, high), endpoint=True))
        return _each(partial(_uniform if self.uniform is not None else _log_uniform, rng), low, high)


def _pick(rng: Generator, count: int, weights: tuple[float, ...] | None) -> int:
    if weights is None:
        return int(rng.integers(count))
    return int(rng.choice(count, p=[weight / sum(weights) for weight in weights]))


def _each(draw: Callable[..., float], *args: Any) -> Any:
    """One draw for numbers, and one for each component of vectors; a number used with vectors applies to each component."""
    size = next((len(arg) for arg in args if isinstance(arg, tuple)), None)
    if size is None:
        return draw(*args)
    return tuple(draw(*(arg[i] if isinstance(arg, tuple) else arg for arg in args)) for i in range(size))


def _uniform(rng: Generator, low: float, high: float) -> float:
    return low + rng.random() * (high - low)


def _log_uniform(rng: Generator, low: float, high: float) -> float:
    return min(max(_portable(low * (high / low) ** rng.random()), low), high)


def _portable(value: float) -> float:
    """The value to twelve digits: the last digits of powers and logarithms differ between processors."""
    return float(f"{value:.12g}")


def _normal(
    rng: Generator, limits: tuple[float, float], mean: float, deviation: float, low: float | None, high: float | None
) -> float:
    """A draw of a truncated normal distribution by inversion, which takes one uniform number for any limits."""
    low, high = max(limits[0], limits[0] if low is None else low), min(limits[1], limits[1] if high is None else high)
    u, value = float(rng.random()), mean
    if deviation > 0:
        curve = NormalDist(mean, deviation)
        below = curve.cdf(low) if low > -math.inf else 0.0
        above = curve.cdf(high) if high < math.inf else 1.0
        level = below + u * (above - below)
        value = _portable(curve.inv_cdf(level)) if 0 < level < 1 else mean
    return min(max(value, low), high)


class _Reader(NamedTuple):
    """Reads values of a field, and distributions over them."""

    plain: ValidatorFunctionWrapHandler
    of: Of
    limits: tuple[float, float]
    depth: int = 0

    def read(self, value: Any) -> Any:
        """The validated value or distribution; raises ValueError or ValidationError."""
        if isinstance(value, Distribution):
            value = value.model_dump()
        if self.of == "number" and isinstance(value, (list, tuple)):
            ends = cast(list[Any], value)
            if len(ends) != 2:
                raise ValueError(f"expected a number, [low, high] or a distribution; found {shown(value)}")
            value = {"uniform": ends}
        if not isinstance(value, Mapping) or (self.of == "entry" and not _means_choice(value)):
            return self.plain(value)
        if self.depth == DEEPEST:
            raise ValueError(f"expected distributions nested at most {DEEPEST} deep; found more")
        raw = Distribution.model_validate(value)
        if raw.kind != "choice" and self.of in ("word", "entry"):
            raise ValueError(f"expected choice; found {raw.kind}, which is for numbers")
        if raw.kind in ("normal", "log_uniform") and self.of == "whole number":
            raise ValueError(f"expected uniform or choice; found {raw.kind}, which is not for whole numbers")
        distribution = raw.model_copy(update=self._replace(depth=self.depth + 1)._arguments(raw))
        distribution._limits = self.limits  # pyright: ignore[reportPrivateUsage]
        return distribution

    def _arguments(self, raw: Distribution) -> dict[str, Any]:
        if raw.normal is not None:
            return {"normal": self._gaussian(raw.normal)}
        kind = raw.kind
        values: list[Any] = []
        for i, value in enumerate(getattr(raw, kind)):
            with error_at(kind, i):
                values.append(self.read(value))
        if kind != "choice":
            _check_ends(kind, values[0], values[1])
        return {kind: tuple(values)}

    def _gaussian(self, raw: Gaussian) -> Gaussian:
        values: dict[str, Any] = {}
        for name, value in raw:
            if value is None and name in ("min", "max"):
                continue
            with error_at("normal", name):
                values[name] = self._deviation(value) if name == "deviation" else self.read(value)
        order = [values[name] for name in ("min", "mean", "max") if name in values]
        if not all(_ordered(a, b) for a, b in pairwise(order)):
            raise ValueError("expected a mean from min to max; found one outside")
        mean, deviation = values["mean"], values["deviation"]
        if isinstance(mean, tuple) and isinstance(deviation, tuple) and len(mean) != len(deviation):
            raise ValueError(
                f"expected one deviation, or one for each of {len(mean)} components of the mean; found {len(deviation)}"
            )
        return raw.model_copy(update=values)

    def _deviation(self, value: Any) -> Any:
        """A standard deviation: one number, also for vectors, or one number for each component."""
        if self.of == "number" or not isinstance(value, (list, tuple)):
            return _DEVIATION.validate_python(value)
        parts: list[Any] = []
        for i, part in enumerate(cast(list[Any], value)):
            with error_at(i):
                parts.append(_DEVIATION.validate_python(part))
        return tuple(parts)


def _means_choice(value: Mapping[Any, Any]) -> bool:
    """True if a mapping is a choice of entries, perhaps with a misspelt `choice`, rather than an entry."""
    return "choice" in value or any(nearest(key, ("choice",)) for key in value)


def _ordered(low: Any, high: Any) -> bool:
    """True if no component of `low` is above that of `high`; components that are distributions do not count."""
    if isinstance(low, tuple) and isinstance(high, tuple):
        return all(_ordered(a, b) for a, b in zip(cast(tuple[Any, ...], low), cast(tuple[Any, ...], high), strict=False))
    return not isinstance(low, (int, float)) or not isinstance(high, (int, float)) or low <= high


def _check_ends(kind: str, low: Any, high: Any) -> None:
    if not _ordered(low, high):
        each = ", low first in every component (red, green and blue of a colour)" if isinstance(low, tuple) else ""
        raise ValueError(f"expected [low, high]{each}; found {shown((low, high))}")
    lowest = min(_lowest(low), _lowest(high))
    if kind == "log_uniform" and lowest <= 0:
        raise ValueError(f"expected ends above 0; found one that may be {lowest:g}")


def _lowest(value: Any) -> float:
    """The least number that can be drawn from a value."""
    if isinstance(value, Distribution):
        if value.normal is not None:
            low = value._limits[0]  # pyright: ignore[reportPrivateUsage]
            return low if value.normal.min is None else max(low, _lowest(value.normal.min))
        return min(map(_lowest, getattr(value, value.kind)))
    return min(map(_lowest, cast(tuple[Any, ...], value))) if isinstance(value, tuple) else float(value)


def span(value: Any) -> tuple[float, float]:
    """Least and greatest number drawn from a value, over all components; for normal distributions nearly always."""
    if isinstance(value, Distribution):
        if value.normal is None:
            return span(getattr(value, value.kind))
        normal, limits = value.normal, value._limits  # pyright: ignore[reportPrivateUsage]
        mean, reach = span(normal.mean), NEARLY_ALWAYS * span(normal.deviation)[1]
        low = max(mean[0] - reach, limits[0], -math.inf if normal.min is None else span(normal.min)[0])
        high = min(mean[1] + reach, limits[1], math.inf if normal.max is None else span(normal.max)[1])
        return low, high
    if isinstance(value, tuple):
        parts = [span(part) for part in cast(tuple[Any, ...], value)]
        return min(low for low, _ in parts), max(high for _, high in parts)
    return float(value), float(value)


def component(value: Any, index: int) -> Any:
    """One component of a vector or distribution, as a number or distribution; a single number applies to each component."""
    if isinstance(value, tuple):
        return cast(tuple[Any, ...], value)[index]
    if not isinstance(value, Distribution):
        return value
    if value.normal is not None:
        parts = {name: component(part, index) for name, part in value.normal if part is not None}
        return value.model_copy(update={"normal": value.normal.model_copy(update=parts)})
    return value.model_copy(update={value.kind: tuple(component(part, index) for part in getattr(value, value.kind))})


class OrDrawn:
    """Marks a field that may be a distribution over its values."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        inner = handler(source)
        of, limits = _of(inner)
        pair = core_schema.list_schema(min_length=2, max_length=2)
        forms: list[Any] = [inner, *([pair] if of == "number" else ()), handler.generate_schema(Distribution)]
        return core_schema.no_info_wrap_validator_function(
            lambda value, plain: _Reader(plain, of, limits).read(value),
            inner,
            serialization=core_schema.simple_ser_schema("any"),
            json_schema_input_schema=core_schema.union_schema(forms),
        )


_WRAPPERS = {"function-before", "function-after", "function-wrap", "nullable", "default"}


def _of(schema: Any) -> tuple[Of, tuple[float, float]]:
    """The kind of value that a field holds, and the lowest and highest number allowed."""
    while schema["type"] in _WRAPPERS:
        schema = schema["schema"]
    match schema["type"]:
        case "float":
            low = schema.get("ge", math.nextafter(schema["gt"], math.inf) if "gt" in schema else -math.inf)
            high = schema.get("le", math.nextafter(schema["lt"], -math.inf) if "lt" in schema else math.inf)
            return "number", (low, high)
        case "int":
            return "whole number", (-math.inf, math.inf)
        case "tuple":
            return "vector", _of(schema["items_schema"][0])[1]
        case "str" | "literal" | "bool":
            return "word", (-math.inf, math.inf)
        case _:
            return "entry", (-math.inf, math.inf)


Drawn = Annotated[T, OrDrawn()]
"""A field of a recipe that is a T or a distribution over T. A draw, as used in scenes, is a T."""

_DEVIATION: TypeAdapter[Any] = TypeAdapter(
    Drawn[Annotated[float, Field(strict=True, ge=0, allow_inf_nan=False)]], config=ConfigDict(defer_build=True)
)


def drawn(value: T, rng_of: RngOf, path: Steps = ()) -> T:
    """The value with every distribution in it replaced by a draw."""
    if isinstance(value, Distribution):
        return value.draw(rng_of, path)
    if isinstance(value, tuple):
        parts = enumerate(cast(tuple[Any, ...], value))
        return cast(T, tuple(drawn(part, rng_of, (*path, str(i))) for i, part in parts))
    if isinstance(value, Frozen):
        random = {name: part for name, part in value if is_random(part)}
        return value.model_copy(update={name: drawn(part, rng_of, (*path, seed_name(name))) for name, part in random.items()})
    return value


def is_random(value: object) -> bool:
    """True if a value contains a distribution."""
    if isinstance(value, tuple):
        return any(map(is_random, cast(tuple[Any, ...], value)))
    return isinstance(value, Distribution) or (isinstance(value, Frozen) and any(is_random(part) for _, part in value))


def alternatives(value: Any) -> Iterator[Any]:
    """Yield the values that a word or an entry may take: the value itself, or the values of each of its choices."""
    if isinstance(value, Distribution) and value.choice is not None:
        for option in value.choice:
            yield from alternatives(option)
    else:
        yield value


def _ranged(value: Any) -> Any:
    """[low, high] as the uniform distribution that it abbreviates."""
    return {"uniform": value} if isinstance(value, (list, tuple)) else value


CountDrawn = Annotated[
    Drawn[Count],
    BeforeValidator(_ranged),
    OrShort({"type": "array", "items": {"type": "integer", "minimum": 1}, "minItems": 2, "maxItems": 2}),
]
"""A whole number above 0; [low, high] means a uniform distribution."""

CountOrNone = Annotated[
    Drawn[Natural],
    BeforeValidator(_ranged),
    OrShort({"type": "array", "items": {"type": "integer", "minimum": 0}, "minItems": 2, "maxItems": 2}),
]

Coordinate = Drawn[Number]
PointDrawn = Drawn[tuple[Drawn[Metres], Drawn[Metres], Drawn[Metres]]]
