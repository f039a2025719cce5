"""The raster engine's options, as the recipe gives them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Literal

from pydantic import JsonValue

from viewsphere.errors import RecipeError
from viewsphere.validation.errors import one_of

ANTIALIAS = (1, 4, 16, 64)
"""Allowed numbers of samples in an edge pixel; above four, every pixel has a quarter of this number."""


@dataclass(frozen=True)
class Options:
    """antialias: samples in an edge pixel, see `ANTIALIAS`; shadow_resolution: width of the shadow maps in texels, 0 to derive
    it from the pictures' size; ambient_occlusion: off, fast or fine.

    bounces: whether still things reflect light onto one another: on, off, auto (on in places that shut out the sky), or fine
    (also gathered by rays from each pixel).
    """

    antialias: int = 4
    shadow_resolution: int = 0
    ambient_occlusion: Literal["off", "fast", "fine"] = "fast"
    bounces: Literal["auto", "on", "fine", "off"] = "auto"

    @property
    def times(self) -> int:
        """The factor by which the picture is painted larger in each direction; edges have four samples in each such pixel."""
        return max(math.isqrt(self.antialias // 4), 1)

    def for_width(self, pixels: int) -> int:
        """Width of the shadow maps for pictures whose longer side has this many pixels: the next power of two, 1,024 to
        4,096.
        """
        return self.shadow_resolution or min(max(1 << (pixels - 1).bit_length(), 1024), 4096)


def parse_options(given: Mapping[str, JsonValue]) -> Options:
    """The options, checked. Raises RecipeError, whose message begins with the recipe's field, for an unknown name (with the
    nearest) or a value out of range.
    """
    names = [f.name for f in fields(Options)]
    for name in given:
        if name == "exposure":
            raise RecipeError("engine.exposure: expected it as scene.view.exposure, found it among the engine's options")
        if name not in names:
            raise RecipeError(f"engine.{name}: {one_of(name, names)}")
    default = Options()
    antialias = given.get("antialias", default.antialias)
    if isinstance(antialias, bool) or antialias not in ANTIALIAS:
        raise RecipeError(f"engine.antialias: expected 1, 4, 16 or 64, found {antialias!r}")
    resolution = given.get("shadow_resolution", default.shadow_resolution)
    if isinstance(resolution, bool) or not isinstance(resolution, int) or not (resolution == 0 or 64 <= resolution <= 8192):
        raise RecipeError(f"engine.shadow_resolution: expected an integer in 64..8192, found {resolution!r}")
    occlusion = given.get("ambient_occlusion", default.ambient_occlusion)
    if occlusion is False:  # YAML reads off as False
        occlusion = "off"
    if occlusion not in ("off", "fast", "fine"):
        raise RecipeError(f"engine.ambient_occlusion: expected off, fast or fine, found {occlusion!r}")
    bounces = given.get("bounces", default.bounces)
    if isinstance(bounces, bool):  # YAML reads on and off as True and False
        bounces = "on" if bounces else "off"
    if bounces not in ("auto", "on", "fine", "off"):
        raise RecipeError(f"engine.bounces: expected auto, on, fine or off, found {bounces!r}")
    return Options(ANTIALIAS[ANTIALIAS.index(antialias)], resolution - resolution % 16, occlusion, bounces)
