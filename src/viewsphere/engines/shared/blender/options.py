"""The options of Blender's renderers, as the recipe gives them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, ClassVar, Literal, TypeVar, get_args

from pydantic import JsonValue

from viewsphere.errors import RecipeError
from viewsphere.validation.errors import one_of

Renderer = Literal["cycles", "eevee", "workbench"]
Denoise = Literal["off", "fast", "best"]
Device = Literal["cpu", "cuda", "optix", "hip", "metal", "oneapi"]


@dataclass(frozen=True)
class _Common:
    """Options of every renderer.

    samples: per pixel; threads: of one Blender, 0 for all cores; python: the interpreter that has bpy, None to search for it;
    replace_after: number of shots after which Blender is restarted, 0 for never; script: a Python file that changes the staged
    scene; settings: the renderer's own, by their names in Python.
    """

    renderer: ClassVar[Renderer]
    title: ClassVar[str]

    samples: int = 32
    threads: int = 1
    python: str | None = None
    replace_after: int = 100
    script: str | None = None
    settings: Mapping[str, JsonValue] = field(default_factory=dict[str, JsonValue])

    @property
    def uses_opengl(self) -> bool:
        """Return whether the renderer draws through OpenGL."""
        return self.renderer != "cycles"


@dataclass(frozen=True)
class Options(_Common):
    """Options of Cycles. denoise: off, fast or best (Open Image Denoise); bounces: of light; device: the kind of device that
    renders.
    """

    renderer = "cycles"
    title = "Cycles"

    denoise: Denoise = "fast"
    bounces: int = 4
    device: Device = "cpu"


@dataclass(frozen=True)
class Eevee(_Common):
    """Options of EEVEE. raytracing: adds reflections of visible surfaces in others, and shading by nearby ones."""

    renderer = "eevee"
    title = "EEVEE"

    samples: int = 16
    raytracing: bool = True


@dataclass(frozen=True)
class Workbench(_Common):
    """Options of Workbench."""

    renderer = "workbench"
    title = "Workbench"

    samples: int = 8


AnyOptions = Options | Eevee | Workbench
_Own = TypeVar("_Own", bound=_Common)

PRESETS = {
    "draft": Options(samples=3, denoise="fast", bounces=2),
    "good": Options(),
    "final": Options(samples=256, denoise="best", bounces=8),
}
"""Cycles' options for each `quality`; other given options override them."""

EEVEE_PRESETS = {"draft": Eevee(samples=4, raytracing=False), "good": Eevee(), "final": Eevee(samples=64)}
WORKBENCH_PRESETS = {"draft": Workbench(samples=5), "good": Workbench(), "final": Workbench(samples=32)}

WORKBENCH_SAMPLES = (1, 5, 8, 11, 16, 32)

_PATHS = {"python": "a Python that has bpy", "script": "a Python file"}
_CHOICES = {"denoise": get_args(Denoise), "device": get_args(Device)}
_RANGES = {"samples": (1, 65536), "bounces": (0, 1024), "threads": (0, 1024), "replace_after": (0, 1_000_000)}


def parse_options(given: Mapping[str, JsonValue]) -> Options:
    """Cycles' checked options; see `options_of`."""
    return _parsed(given, PRESETS)


def options_of(renderer: str, given: Mapping[str, JsonValue]) -> AnyOptions:
    """A renderer's checked options. Raises RecipeError, whose message begins with the recipe's field, for an unknown name (with
    the nearest) or a value out of range.
    """
    if renderer == "eevee":
        return _parsed(given, EEVEE_PRESETS)
    return _parsed(given, WORKBENCH_PRESETS) if renderer == "workbench" else parse_options(given)


def _parsed(given: Mapping[str, JsonValue], presets: Mapping[str, _Own]) -> _Own:
    default = presets["good"]
    names = [*(f.name for f in fields(default)), "quality"]
    for name in given:
        if name not in names:
            raise RecipeError(f"engine.{name}: {one_of(name, names)}")
    quality = given.get("quality", "good")
    if not isinstance(quality, str) or quality not in presets:
        raise RecipeError(f"engine.quality: expected {_listed(list(presets))}, found {quality!r}")
    checked: dict[str, Any] = {n: _checked(n, value, default) for n, value in given.items() if n != "quality"}
    return replace(presets[quality], **checked)


def _checked(name: str, value: JsonValue, default: _Common) -> JsonValue:
    if name in _CHOICES:
        value = "off" if value is False else value  # YAML reads a bare `off` as false
        if value not in _CHOICES[name]:
            raise RecipeError(f"engine.{name}: expected {_listed(_CHOICES[name])}, found {value!r}")
    elif name == "samples" and isinstance(default, Workbench):
        if isinstance(value, bool) or value not in WORKBENCH_SAMPLES:
            raise RecipeError(f"engine.samples: expected {_listed(WORKBENCH_SAMPLES)}, found {value!r}")
    elif name in _RANGES:
        low, high = _RANGES[name]
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise RecipeError(f"engine.{name}: expected an integer in {low}..{high}, found {value!r}")
    elif name in _PATHS:
        if value is not None and not isinstance(value, str):
            raise RecipeError(f"engine.{name}: expected the path of {_PATHS[name]}, found {value!r}")
    elif name == "raytracing":
        if not isinstance(value, bool):
            raise RecipeError(f"engine.raytracing: expected true or false, found {value!r}")
    elif not isinstance(value, dict):
        raise RecipeError(f"engine.settings: expected names of {default.title} settings and their values, found {value!r}")
    return value


def _listed(names: Sequence[object]) -> str:
    return f"{', '.join(map(str, names[:-1]))} or {names[-1]}"
