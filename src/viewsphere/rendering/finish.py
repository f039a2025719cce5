"""The conversion of radiance to finished pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.model.scene import Finish
from viewsphere.rendering.effects import Step, steps_of
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
    frame = _Frame(radiance, background, finish, cache(seen))
    return {name: getattr(frame, _PICTURES[name]) for name in names}


def finished(radiance: Float32, background: Float32 | None, finish: Finish, seen: Callable[[], Seen]) -> Bytes:
    """The picture, (H, W, 3) uint8 sRGB, or (H, W, 4) with straight alpha if the background is transparent."""
    return _Frame(radiance, background, finish, cache(seen)).coded


def is_plain(finish: Finish) -> bool:
    """Return whether a finish has neither a smoother nor effects; effects on bytes do not count."""
    return finish.smoother.kind == "none" and not steps_of(finish.effects)[0]


@dataclass(frozen=True, eq=False)
class _Frame:
    """One frame's light, and the pictures of it, each step of which is computed once."""

    radiance: Float32
    background: Float32 | None
    finish: Finish
    seen: Callable[[], Seen]

    @cached_property
    def _steps(self) -> tuple[list[Step], list[Step]]:
        return steps_of(self.finish.effects)

    @cached_property
    def _display_linear(self) -> Float32:
        """The picture, display-linear, with smoother and effects; (H, W, 3), or (H, W, 4) premultiplied."""
        finish = self.finish
        picture = to_display_linear(self.radiance, self.background, finish.view, finish.background.transparent)
        if finish.smoother.kind != "none":
            picture = smooth_border(picture, self.seen().targets, finish.smoother)
        for step in self._steps[0]:
            picture = step(picture, self.seen)
        return picture

    @property
    def coded(self) -> Bytes:
        """The picture, as of `finished`."""
        finish, (on_light, on_bytes) = self.finish, self._steps
        if finish.smoother.kind == "none" and not on_light:
            pixels = develop(self.radiance, self.background, finish.view, finish.background.transparent)
        else:
            pixels = to_bytes(self._display_linear)
        for step in on_bytes:
            pixels = step(pixels, self.seen)
        return pixels

    @property
    def words(self) -> NDArray[np.uint16]:
        """The picture, (H, W, 3) uint16 sRGB."""
        return to_words(self._display_linear)

    @property
    def light(self) -> Float32:
        """The light of the picture, (H, W, 3) float32 scene-linear."""
        return scene_linear(self.radiance, self.background, self.finish.view)


_PICTURES = {"rgb": "coded", "rgba": "coded", "rgb16": "words", "rgb_linear": "light"}
