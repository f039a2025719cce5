"""The positions of a plan's cameras before rendering, and the check for cameras inside a model."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np
from numpy.typing import NDArray

from viewsphere.composing.composition import BoxOf
from viewsphere.composing.redraws import is_redrawn
from viewsphere.composing.viewpoints.camera import distance_problem, inside_box, looking
from viewsphere.composing.viewpoints.poses import Poses
from viewsphere.errors import RecipeError
from viewsphere.geometry.camera import orbit_center
from viewsphere.geometry.rotation import transform
from viewsphere.model.instant import Viewpoint
from viewsphere.model.scene import Vector
from viewsphere.model.thing import Thing
from viewsphere.planning.plan import Plan
from viewsphere.planning.samplers import Standing

Float = NDArray[np.float64]

MOST_CAMERAS = 20_000
"""Number of poses of a model that are checked before rendering, evenly spaced; the others are checked when their shot is
rendered.
"""

MOST_RIGS = 1000
"""Number of poses of a model for which all sensors of a rig are checked before rendering, evenly spaced."""

MOST_PAIRS = 1_000_000
"""The same number for all models together."""

MOST_DRAWS = 20_000
"""The same number if each model has its own random poses: a draw takes some 40 microseconds, so that all take about a second.
"""


@dataclass(frozen=True, eq=False)
class Distances:
    """Cameras of a plan; those of poses that are the same for all models are computed once."""

    plan: Plan
    box_of: BoxOf
    _offsets: dict[range, tuple[Float, Float]] = field(default_factory=dict[range, tuple[Float, Float]])

    def problem(self, subject: str) -> RecipeError | None:
        """An error for the first pose with its camera inside an object's box; None if there is none.

        Not checked here, but with their shots: cameras that can be redrawn, draws for each frame, and distances by a share of
        the picture. The search for room for all objects always runs.
        """
        subject = self.plan.world(subject)
        for there in self.plan.standing(subject, self.box_of):
            if not there.views.are_known or is_redrawn(self.plan.recipe):
                continue
            most = MOST_PAIRS if there.views is self.plan.pose_list else MOST_DRAWS
            step = -(-self.plan.poses // max(1, min(MOST_CAMERAS, most // len(self.plan.subjects))))
            poses = there.poses[::step]
            cameras = self.cameras(there.things, poses, there.target, subject, there.views)
            for thing in there.things:
                box = transform(thing.world_from_object, self.box_of(thing.model, thing.step))
                inside = inside_box(box, cameras)
                if inside.any():
                    view = there.views[poses[int(np.flatnonzero(inside)[0])]]
                    pose = self.plan.viewpoint(subject, view, there.target)
                    return RecipeError(f"viewpoints.distance: {distance_problem(pose, box)} (model {thing.key})")
            if problem := self._of_other_sensors(there, poses[:: -(-len(poses) // MOST_RIGS)], subject):
                return problem
        return None

    def _of_other_sensors(self, there: Standing, poses: Sequence[int], subject: str) -> RecipeError | None:
        """The error for the first pose at which a sensor besides the rig's first is inside an object's box; None without
        such a pose.
        """
        others = self.plan.rig.sensors[1:]
        if not others:
            return None
        x, y, z = self._middle(there.things).tolist() if there.target is None else there.target
        views = [self.plan.viewpoint(subject, there.views[i], (x, y, z)) for i in poses]
        rigs = [looking(view, (x, y, z), index=0).world_from_rig for view in views]
        boxes = [(thing, transform(thing.world_from_object, self.box_of(thing.model, thing.step))) for thing in there.things]
        for sensor, (thing, box) in product(others, boxes):
            centers = np.array([transform(rig, np.array(sensor.rig_from_sensor)[:3, 3]) for rig in rigs])
            for i in np.flatnonzero(inside_box(box, centers)):
                place = ", ".join(f"{v:.3g}" for v in centers[i])
                return RecipeError(
                    f"rig: expected all sensors outside of the models; found {sensor.name} at ({place}) inside the box of "
                    f"model {thing.key} (pose {views[i].index}): move the sensor nearer to the first one, or the rig away"
                )
        return None

    def _middle(self, things: Sequence[Thing]) -> Float:
        """The middle (3,) of the targets."""
        targets = [thing for thing in things if thing.is_target]
        corners = np.concatenate([transform(t.world_from_object, self.box_of(t.model, t.step)) for t in targets])
        return corners.mean(axis=0) if len(targets) == 1 else (corners.min(axis=0) + corners.max(axis=0)) / 2

    def cameras(
        self,
        things: Sequence[Thing],
        poses: Sequence[int],
        target: Vector | None = None,
        subject: str | None = None,
        views: Poses | None = None,
    ) -> Float:
        """Return the camera positions of these poses of a subject, (poses, 3) world metres, for these placed things.
        The subject is by default the plan's first. The cameras look at `target`, by default at the middle of the placed things.
        """
        middle = self._middle(things) if target is None else np.array(target)
        subject, views = subject or self.plan.subjects[0], views or self.plan.pose_list
        if not self.plan.scenes.is_jittered:
            offsets, own = self._stand(poses, views)
            return offsets + np.where(np.isnan(own), middle, own)
        x, y, z = middle.tolist()
        return np.array([_stand(self.plan.viewpoint(subject, views[i], (x, y, z))) for i in poses])

    def _stand(self, poses: Sequence[int], views: Poses) -> tuple[Float, Float]:
        """The offsets from the cameras' targets to the cameras, and the targets: NaN for the models' centre."""
        if views is not self.plan.pose_list or not isinstance(poses, range):
            return _standing(poses, views)
        if poses not in self._offsets:
            self._offsets[poses] = _standing(poses, views)
        return self._offsets[poses]


def _standing(poses: Sequence[int], views: Poses) -> tuple[Float, Float]:
    viewpoints = [views.view(i) for i in poses]
    values = np.array([(view.azimuth, view.elevation, view.distance) for view in viewpoints])
    azimuth, elevation = np.radians(values[:, :2]).T
    level = np.cos(elevation)
    direction = np.stack([level * np.sin(azimuth), -level * np.cos(azimuth), np.sin(elevation)], axis=1)
    targets = np.array([views.target(i) or (math.nan,) * 3 for i in poses])
    return values[:, 2:] * direction, targets


def _stand(pose: Viewpoint) -> Float:
    """Return the camera position of a pose with a target, (3,) world metres."""
    assert pose.target is not None
    return np.array(pose.target) + orbit_center(math.radians(pose.azimuth_deg), math.radians(pose.elevation_deg), pose.distance)
