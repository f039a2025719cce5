"""The conversion of radiance to finished pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.model.scene import Finish
from viewsphere.rendering.effects import Steps, steps_of
from viewsphere.rendering.imager.metering import Reading, Settings
from viewsphere.rendering.imager.optics import through_lens
from viewsphere.rendering.imager.sensor import developed, digital_numbers
from viewsphere.rendering.seen import Seen
from viewsphere.rendering.smoother import smooth_border
from viewsphere.rendering.view import Bytes, Float32, develop, scene_linear, to_bytes, to_display_linear, to_words


def pictures(
    names: Iterable[str],
    radiance: Float32,
    background: Float32 | None,
    finish: Finish,
    seen: Callable[[], Seen],
    metered: Callable[[], Reading | None] | None = None,
) -> dict[str, NDArray[Any]]:
    """Pictures of one light by their names in `model.channel.FINISHED`.

    `radiance` (H, W, 4) float32 scene-linear, premultiplied; `background` (H * W, 3) or (1, 3) float32 display-linear, None if
    the radiance covers every pixel. View, smoother, effects on light, sRGB curve, effects on bytes, in this order: `rgb16` is
    the picture before the step to bytes, `rgb_linear` the light before all of them. With an imager, the order is that of
    `viewsphere.rendering.imager`; `metered` returns the light that its automatic settings follow, by default the picture's
    own. `seen` is called only if an effect, the smoother or the imager needs it.
    """
    frame = _Frame(radiance, background, finish, cache(seen), metered)
    return {name: getattr(frame, _PICTURES[name]) for name in names}


def finished(radiance: Float32, background: Float32 | None, finish: Finish, seen: Callable[[], Seen]) -> Bytes:
    """The picture, (H, W, 3) uint8 sRGB, or (H, W, 4) with straight alpha if the background is transparent."""
    return _Frame(radiance, background, finish, cache(seen)).coded


def is_plain(finish: Finish) -> bool:
    """Return whether a finish has no smoother, no imager and no effects; effects on bytes do not count."""
    steps = steps_of(finish.effects)
    return finish.smoother.kind == "none" and finish.imager is None and not (steps.before or steps.after)


@dataclass(frozen=True, eq=False)
class _Frame:
    """One frame's light, and the pictures of it, each step of which is computed once."""

    radiance: Float32
    background: Float32 | None
    finish: Finish
    seen: Callable[[], Seen]
    metered: Callable[[], Reading | None] | None = None

    @cached_property
    def _steps(self) -> Steps:
        return steps_of(self.finish.effects)

    @cached_property
    def _display_linear(self) -> Float32:
        """The picture, display-linear, with smoother and effects; (H, W, 3), or (H, W, 4) premultiplied."""
        finish = self.finish
        if finish.imager is not None:
            picture = developed(self.mosaic, finish.imager, self._settings.white)
        else:
            picture = to_display_linear(self.radiance, self.background, finish.view, finish.background.transparent)
            picture = self._before_sensor(picture)
        for step in self._steps.after:
            picture = step(picture, self.seen)
        return picture

    def _before_sensor(self, picture: Float32) -> Float32:
        """Light with the smoother, and the effects before the sensor."""
        if self.finish.smoother.kind != "none":
            picture = smooth_border(picture, self.seen().targets, self.finish.smoother)
        for step in self._steps.before:
            picture = step(picture, self.seen)
        return picture

    @cached_property
    def _settings(self) -> Settings:
        assert self.finish.imager is not None
        reading = None
        if self.finish.imager.is_metered:
            reading = Reading.of(self.light) if self.metered is None else self.metered()
        return Settings.of(self.finish.imager, reading)

    @cached_property
    def mosaic(self) -> NDArray[np.uint16]:
        """The digital numbers of the imager, (H, W) uint16."""
        imager, chosen = self.finish.imager, self._settings
        assert imager is not None
        light = self._before_sensor(self.light * np.float32(chosen.scale))
        light = through_lens(light, imager, self.seen().intrinsics)
        return digital_numbers(light, imager, chosen.iso, self.finish.effects.seed)

    @property
    def coded(self) -> Bytes:
        """The picture, as of `finished`."""
        finish, steps = self.finish, self._steps
        if is_plain(finish):
            pixels = develop(self.radiance, self.background, finish.view, finish.background.transparent)
        else:
            pixels = to_bytes(self._display_linear)
        for step in steps.coded:
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


_PICTURES = {"rgb": "coded", "rgba": "coded", "rgb16": "words", "rgb_linear": "light", "bayer": "mosaic"}
