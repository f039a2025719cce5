"""The motion while the shutter is open, as the request for Blender's worker: Blender blurs the picture itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from viewsphere.engines.shared.blender.file_frame import FileFrame
from viewsphere.engines.shared.blender.lens import views_of
from viewsphere.engines.shared.blender.requests import staged
from viewsphere.model.shot import Shot

MOMENTS = 9
"""Evenly spaced moments, from opening to closing, at which Blender is told where things are: as many as Cycles looks at."""


@dataclass(frozen=True, eq=False)
class Sweeping:
    """A sensor's picture at an instant, both counted from 0 in the shot, while the shutter is open. What deforms does not."""

    shot: Shot
    instant: int
    sensor: int

    @property
    def is_still(self) -> bool:
        """Return whether nothing moves, so that the picture is sharp."""
        return self.request(0) is None

    def request(self, view: int) -> dict[str, Any] | None:
        """For the worker's `render` of one of the `views_of` the sensor's camera: matrices of objects that move, by their
        places among all, and the camera's rotations and centres; None where nothing moves.
        """
        exposure = self.shot.exposures[self.instant] if self.shot.shutter else None
        if exposure is None:
            return None
        moments = (np.linspace(-0.5, 0.5, MOMENTS) * self.shot.shutter).tolist()
        frame = FileFrame.of(self.shot.scene.blend)
        sweeps = [exposure.things[i] for i in staged(self.shot.things_at(self.instant), self.shot.scene)]
        objects = [
            {"object": place, "matrices": [frame.placed(pose) for pose in map(sweep.pose, moments) if pose is not None]}
            for place, sweep in enumerate(sweeps)
            if sweep is not None and None not in sweep.motion.poses
        ]
        camera = None if exposure.rig is None else [self._camera(frame, view, moment) for moment in moments]
        return {"objects": objects, "camera": camera} if objects or camera else None

    def _camera(self, frame: FileFrame, view: int, moment: float) -> dict[str, Any]:
        camera = views_of(self.shot.camera_during(self.instant, moment, self.sensor))[view].camera
        request = {"R": camera.R.tolist(), "center": camera.center.tolist(), "near": 1.0, "far": 1.0}
        return {name: value for name, value in frame.camera(request).items() if name in ("R", "center")}
