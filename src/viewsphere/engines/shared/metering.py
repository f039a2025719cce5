"""The light that the automatic settings of an imager follow in a sequence: small pictures of instants before, on a fixed grid.

Which instants are metered depends on the instant's number in its sequence alone. So exposures are equal for any division of a
sequence into shots, in any order.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from viewsphere.model.sensors.camera import Camera
from viewsphere.model.shot import Shot
from viewsphere.rendering.background import display_background
from viewsphere.rendering.imager.metering import Reading
from viewsphere.rendering.view import scene_linear

WIDTH = 64
"""Width in pixels of the pictures that are metered; their log-average is within a few hundredths of a stop of large ones."""

Glance = Callable[[int, Camera], NDArray[np.float32]]
"""Paints the light (H, W, 4) that a camera sees at an instant of the shot, sharp and without weather that falls."""


@dataclass(frozen=True, eq=False)
class Meter:
    """Meters the instants of one shot, each once for each sensor."""

    shot: Shot
    _known: dict[tuple[int, int], Reading | None] = field(default_factory=dict[tuple[int, int], Reading | None])

    def follows(self, instant: int, sensor: int) -> bool:
        """Return whether the settings of a picture follow other instants; otherwise its own light is metered."""
        imager = self.shot.rig.sensors[sensor].imager
        return imager is not None and bool(imager.metering(self.shot.instants[instant].index))

    def reading(self, instant: int, sensor: int, glance: Glance) -> Reading | None:
        """The mean reading of the instants that a picture's settings follow."""
        imager, index = self.shot.rig.sensors[sensor].imager, self.shot.instants[instant].index
        assert imager is not None
        weights = {self.shot.instant_after(instant, at - index): share for at, share in imager.metering(index).items()}
        readings = [self._read(at, sensor, glance) for at in weights if at is not None]
        return Reading.mean(readings, [share for at, share in weights.items() if at is not None])

    def _read(self, instant: int, sensor: int, glance: Glance) -> Reading | None:
        if (instant, sensor) not in self._known:
            camera, finish = self.shot.camera(instant, sensor), self.shot.finish(instant, sensor)
            camera = Camera(camera.intrinsics.narrowed(WIDTH), camera.R, camera.t)
            background = display_background(finish.background, camera.width, camera.height)
            light = scene_linear(glance(instant, camera), background, finish.view)
            self._known[instant, sensor] = Reading.of(light)
        return self._known[instant, sensor]
