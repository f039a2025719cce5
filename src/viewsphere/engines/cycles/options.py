"""The Cycles engine's options, as the recipe gives them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any, Literal, get_args

from pydantic import JsonValue

from viewsphere.errors import RecipeError
from viewsphere.model.mistakes import one_of

Denoise = Literal["off", "fast", "best"]
Device = Literal["cpu", "cuda", "optix", "hip", "metal", "oneapi"]


@dataclass(frozen=True)
class Options:
    """samples: paths a pixel; denoise: off, fast or best (Open Image Denoise); bounces: of light; device: what computes;
    threads of one Blender, 0 for all cores; python: the interpreter that has bpy, None to look for it; replace_after: shots
    after which Blender is started anew, 0 for never; settings: Cycles settings by their names in Python.
    """

    samples: int = 32
    denoise: Denoise = "fast"
    bounces: int = 4
    device: Device = "cpu"
    threads: int = 1
    python: str | None = None
    replace_after: int = 100
    settings: Mapping[str, JsonValue] = field(default_factory=dict[str, JsonValue])


PRESETS = {
    "draft": Options(samples=3, denoise="fast", bounces=2),
    "good": Options(),
    "final": Options(samples=256, denoise="best", bounces=8),
}
"""What `quality` stands for; other options change it."""

_CHOICES = {"denoise": get_args(Denoise), "device": get_args(Device)}
_RANGES = {"samples": (1, 65536), "bounces": (0, 1024), "threads": (0, 1024), "replace_after": (0, 1_000_000)}


def parse_options(given: Mapping[str, JsonValue]) -> Options:
    """Checked options. Raises RecipeError, which begins with the recipe's field, for an unknown name (with the nearest) or a
    value out of range.
    """
    known = [*(f.name for f in fields(Options)), "quality"]
    for name in given:
        if name not in known:
            raise RecipeError(f"engine.{name}: {one_of(name, known)}")
    quality = given.get("quality", "good")
    if not isinstance(quality, str) or quality not in PRESETS:
        raise RecipeError(f"engine.quality: expected {_listed(list(PRESETS))}, found {quality!r}")
    checked: dict[str, Any] = {name: _checked(name, value) for name, value in given.items() if name != "quality"}
    return replace(PRESETS[quality], **checked)


def _checked(name: str, value: JsonValue) -> JsonValue:
    if name in _CHOICES:
        value = "off" if value is False else value  # YAML's off
        if value not in _CHOICES[name]:
            raise RecipeError(f"engine.{name}: expected {_listed(list(_CHOICES[name]))}, found {value!r}")
    elif name in _RANGES:
        low, high = _RANGES[name]
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise RecipeError(f"engine.{name}: expected an integer in {low}..{high}, found {value!r}")
    elif name == "python":
        if value is not None and not isinstance(value, str):
            raise RecipeError(f"engine.python: expected the path of a Python that has bpy, found {value!r}")
    elif not isinstance(value, dict):
        raise RecipeError(f"engine.settings: expected names of Cycles settings and their values, found {value!r}")
    return value


def _listed(names: list[str]) -> str:
    return f"{', '.join(names[:-1])} or {names[-1]}"
