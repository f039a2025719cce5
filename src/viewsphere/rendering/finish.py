"""The conversion of radiance to finished pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.model.scene import Finish
from viewsphere.rendering.effects import steps_of
from viewsphere.rendering.seen import Seen
from viewsphere.rendering.smoother import smooth_border
from viewsphere.rendering.view import Bytes, Float32, develop, scene_linear, to_bytes, to_display_linear, to_words


def pictures(
    names: Iterable[str], radiance: Float32, background: Float32 | None, finish: Finish, seen: Callable[[], Seen]
) -> dict[str, NDArray[Any]]:
    """Pictures of one light by their names in `model.channel.ALL_PICTURES`.

    `radiance` (H, W, 4) float32 scene-linear, premultiplied; `background` (H * W, 3) or (1, 3) float32 display-linear, None if
    the radiance covers every pixel. View, smoother, effects on light, sRGB curve, effects on bytes, in this order: `rgb16` is
    the picture before the step to bytes, `rgb_linear` the light before all of them. `seen` is called only if an effect or the
    smoother needs it.
    """
    return {name: _MAKERS[name](radiance, background, finish, seen) for name in names}


def finished(radiance: Float32, background: Float32 | None, finish: Finish, seen: Callable[[], Seen]) -> Bytes:
    """The picture, (H, W, 3) uint8 sRGB, or (H, W, 4) with straight alpha if the background is transparent."""
    if is_plain(finish):
        pixels = develop(radiance, background, finish.view, finish.background.transparent)
    else:
        pixels = to_bytes(_display_linear(radiance, background, finish, seen))
    for step in steps_of(finish.effects)[1]:
        pixels = step(pixels, seen)
    return pixels


def _words(radiance: Float32, background: Float32 | None, finish: Finish, seen: Callable[[], Seen]) -> NDArray[np.uint16]:
    """The picture, (H, W, 3) uint16 sRGB."""
    return to_words(_display_linear(radiance, background, finish, seen))


def _light(radiance: Float32, background: Float32 | None, finish: Finish, seen: Callable[[], Seen]) -> Float32:
    """The light of the picture, (H, W, 3) float32 scene-linear."""
    return scene_linear(radiance, background, finish.view)


_Maker = Callable[[Float32, Float32 | None, Finish, Callable[[], Seen]], NDArray[Any]]
_MAKERS: dict[str, _Maker] = {"rgb": finished, "rgba": finished, "rgb16": _words, "rgb_linear": _light}


def is_plain(finish: Finish) -> bool:
    """Return whether a finish has neither a smoother nor effects; effects on bytes do not count."""
    return finish.smoother.kind == "none" and not steps_of(finish.effects)[0]


def _display_linear(radiance: Float32, background: Float32 | None, finish: Finish, seen: Callable[[], Seen]) -> Float32:
    """The picture, display-linear, with smoother and effects; (H, W, 3), or (H, W, 4) premultiplied."""
    picture = to_display_linear(radiance, background, finish.view, finish.background.transparent)
    surfaces = cache(seen)
    if finish.smoother.kind != "none":
        picture = smooth_border(picture, surfaces().targets, finish.smoother)
    for step in steps_of(finish.effects)[0]:
        picture = step(picture, surfaces)
    return picture
