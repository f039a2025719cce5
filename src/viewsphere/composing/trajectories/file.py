"""A trajectory from a file, interpolated between poses: positions and lenses linearly, rotations by slerp."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from viewsphere.composing.trajectories.shared.aim import around, on_axis, posed
from viewsphere.composing.trajectories.shared.world import RigPose, World
from viewsphere.composing.viewpoints.pose_files import Extrinsics, PoseFile
from viewsphere.composing.viewpoints.poses import placed, pose_file, world_turn
from viewsphere.errors import RecipeError
from viewsphere.files import written_path
from viewsphere.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix, slerp
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.plugins.trajectory import TrajectorySpec
from viewsphere.recipe.cameras.viewpoints import PoseList

Float = NDArray[np.float64]
Between = tuple[int, float]
"""A time between two poses of a file: the number of the first, and the position towards the next, 0 to 1."""

LATE = 1e-6
"""Seconds by which a sequence may be longer than its file."""

LENS = ("fx", "fy", "cx", "cy")


@dataclass(frozen=True, eq=False)
class FileTrajectory:
    """The poses of a file, at its time stamps relative to the first one; without stamps, one pose for each frame of the
    recipe's rate.
    """

    entry: PoseList
    file: PoseFile

    @property
    def digest(self) -> str:
        """SHA-256 of poses, lenses and times."""
        return hashlib.sha256(repr((self.file, self.file.times, self.file.lenses)).encode()).hexdigest()

    @property
    def intrinsics(self) -> Intrinsics | None:
        """The lens of the first pose, if the file names one."""
        return self.file.lenses[0] if self.file.lenses else self.file.intrinsics

    def poses(self, times: Float, world: World) -> tuple[RigPose, ...]:
        """See `Trajectory.poses`; raises RecipeError for stamps that do not ascend, or a file shorter than the sequence."""
        stamps = self._stamps(world.fps)
        if times[-1] > stamps[-1] + LATE:
            raise RecipeError(
                f"viewpoints.path: expected poses for {times[-1]:.6g} s; found {len(stamps):,} in {self.entry.path}, which "
                f"last {stamps[-1]:.6g} s: make time shorter"
            )
        places = [_between(stamps, t) for t in times.tolist()]
        if isinstance(self.file.entries[0], Extrinsics):
            return tuple(self._moved(place, world) for place in places)
        return tuple(self._orbited(place, world, instant) for instant, place in enumerate(places))

    def _stamps(self, fps: float) -> Float:
        seconds = self.file.times
        if seconds is None:
            return np.arange(len(self.file.entries)) / fps
        for i, (a, b) in enumerate(pairwise(seconds), 1):
            if b <= a:
                raise RecipeError(
                    f"viewpoints.path: expected times that ascend; found {b:.6f} after {a:.6f} (pose {i} of {self.entry.path})"
                )
        return np.array(seconds) - seconds[0]

    @cached_property
    def _motions(self) -> tuple[Float, tuple[tuple[float, ...], ...]]:
        """Centres (N, 3) and quaternions of all cameras, in the recipe's world."""
        turn = world_turn(self.entry, self.file)
        whole = [placed(one, turn, self.entry) for one in self.file.entries if isinstance(one, Extrinsics)]
        return np.array([pose[:3, 3] for pose in whole]), tuple(quaternion_from_matrix(pose[:3, :3]) for pose in whole)

    def _moved(self, place: Between, world: World) -> RigPose:
        centers, turns = self._motions
        center = _mixed(centers, place)
        i, share = place
        axes = matrix_from_quaternion(slerp(turns[i], turns[i + 1], share) if share else turns[i])
        pose = posed(axes, center, on_axis(center, axes[:, 2], world))
        return RigPose(pose.world_from_rig, pose.focus, self._lens(place))

    def _lens(self, place: Between) -> Intrinsics | None:
        if not self.file.lenses:
            return None
        values = np.array([[getattr(lens, name) for name in LENS] for lens in self.file.lenses])
        return self.file.lenses[0].model_copy(update=dict(zip(LENS, _mixed(values, place).tolist(), strict=True)))

    def _orbited(self, place: Between, world: World, instant: int) -> RigPose:
        azimuth, elevation, distance, tilt = _mixed(self._orbits, place).tolist()
        target = self.entry.target
        focus = world.center(1, instant) if target == "follow" else world.target if target == "center" else target
        return around(np.array(focus), azimuth, elevation, distance, tilt)

    @cached_property
    def _orbits(self) -> Float:
        """Azimuth, elevation, distance and tilt (N, 4) of all orbits; angles take the shorter way to the next orbit."""
        orbits = np.array([tuple(one) for one in self.file.entries], np.float64)
        orbits[:, (0, 3)] = np.unwrap(orbits[:, (0, 3)], axis=0, period=360.0)
        return orbits


def _between(stamps: Float, seconds: float) -> Between:
    """A time's place among ascending stamps; after the last stamp, the last place."""
    i = int(np.searchsorted(stamps, seconds, side="right")) - 1
    if i + 1 >= len(stamps):
        return len(stamps) - 1, 0.0
    return i, (seconds - float(stamps[i])) / float(stamps[i + 1] - stamps[i])


def _mixed(values: Float, place: Between) -> Float:
    """The row (D,) of values (N, D) at a place."""
    i, share = place
    return values[i] + share * (values[i + 1] - values[i]) if share else values[i]


def trajectory(entry: PoseList, folder: Path) -> FileTrajectory:
    """The motion that an entry of a recipe means; for a 3D file's camera, at all of its frames unless the entry names some."""
    whole = entry if entry.frames is not None or not _is_3d(entry) else entry.model_copy(update={"frames": "all"})
    poses = pose_file(folder / written_path(entry.path), whole, zooms=True)
    if len({(lens.width, lens.height, lens.lens.parameters) for lens in poses.lenses}) > 1:
        raise RecipeError("viewpoints.path: expected lenses of one size and distortion along a motion; found several")
    return FileTrajectory(entry, poses)


def _is_3d(entry: PoseList) -> bool:
    from viewsphere.composing.viewpoints.pose_files.cameras import SUFFIXES

    return entry.format == "cameras" or (entry.format == "auto" and Path(entry.path).suffix.lower() in SUFFIXES)


__all__: Sequence[str] = ["FileTrajectory", "trajectory"]


TRAJECTORY = TrajectorySpec(options=PoseList, trajectory=trajectory)
