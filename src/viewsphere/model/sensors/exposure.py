"""The motion while the shutter is open, for motion blur, which affects pictures but not labels."""

from __future__ import annotations

from bisect import bisect_right
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from viewsphere.geometry.rotation import matrix_from_quaternion, product, quaternion_from_matrix, rigid
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.scene import Matrix4
from viewsphere.model.thing import Motion, TimeStep

Float = NDArray[np.float64]


class Sweep(Frozen):
    """A motion around an instant: its poses and time steps at `moments`, which increase. Moments are times after the instant,
    as shares of the time between two instants; poses between two moments are interpolated.

    Moments may be outside the time for which the shutter is open: a mesh moves from its time step at the previous instant
    (moment -1) to those at the instant (0) and at the next one (1).
    """

    moments: tuple[float, ...] = Field(min_length=2)
    motion: Motion

    @model_validator(mode="after")
    def _as_many_as_moments(self) -> Sweep:
        count = len(self.moments)
        if any(a >= b for a, b in zip(self.moments, self.moments[1:], strict=False)):
            raise ValueError(f"expected moments that increase; found {self.moments}")
        if not self.motion.lasts(count):
            counts = f"{len(self.motion.poses)} and {len(self.motion.steps)}"
            raise ValueError(f"expected one pose and one time step, or one a moment ({count}); found {counts}")
        return self

    def pose(self, moment: float) -> Matrix4 | None:
        """The pose at a moment, interpolated between two known poses on a straight line and the shorter rotation; None if
        the thing is absent.
        """
        before, after, share = self._around(moment)
        start, end = self.motion.pose_at(before), self.motion.pose_at(after)
        return start if start is None or end is None or start == end else _between(start, end, share)

    def poses(self, moments: Float) -> Float:
        """The poses (n, 4, 4) at moments (n,), bitwise those of `pose`; NaN where the thing is absent."""
        known = np.array(self.moments)
        before = np.clip(np.searchsorted(known, moments, side="right") - 1, 0, len(known) - 2)
        shares = np.clip((moments - known[before]) / (known[before + 1] - known[before]), 0.0, 1.0)
        out = np.full((len(moments), 4, 4), np.nan)
        for i in np.unique(before).tolist():
            start, end, own = self.motion.pose_at(i), self.motion.pose_at(i + 1), before == i
            if start is not None:
                out[own] = start if end is None or start == end else _all_between(start, end, shares[own])
        return out

    def steps(self, moment: float) -> tuple[TimeStep | None, TimeStep | None, float]:
        """The known time steps before and after a moment, and its position between them, 0 to 1."""
        before, after, share = self._around(moment)
        return self.motion.step_at(before), self.motion.step_at(after), share

    def _around(self, moment: float) -> tuple[int, int, float]:
        before = min(max(bisect_right(self.moments, moment) - 1, 0), len(self.moments) - 2)
        start, end = self.moments[before], self.moments[before + 1]
        return before, before + 1, min(max((moment - start) / (end - start), 0.0), 1.0)


class Exposure(Frozen):
    """The motion around one instant: a sweep for each thing of a shot, and one for the rig (world from rig).

    A sweep is None for a thing that is still or absent, and for a rig that is still. `interval` is the time in seconds between
    two instants, None if no sensor has a rolling shutter.
    """

    things: tuple[Sweep | None, ...]
    rig: Sweep | None = None
    interval: float | None = Field(default=None, gt=0)


def _all_between(start: Matrix4, end: Matrix4, shares: Float) -> Float:
    """The poses (n, 4, 4) of `_between` for shares (n,), bitwise equal."""
    a, b = np.array(start), np.array(end)
    p, q = (np.array(quaternion_from_matrix(m[:3, :3])) for m in (a, b))
    q = q if float((p * q).sum()) >= 0 else -q
    share = shares[:, None]
    turns = (1 - share) * p + share * q
    w, x, y, z = (turns / np.array([np.linalg.norm(turn) for turn in turns])[:, None]).T
    out = np.zeros((len(shares), 4, 4))
    out[:, 0, :3] = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], axis=1)
    out[:, 1, :3] = np.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], axis=1)
    out[:, 2, :3] = np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=1)
    out[:, :3, 3] = (1 - share) * a[:3, 3] + share * b[:3, 3]
    out[:, 3, 3] = 1.0
    return out


def _between(start: Matrix4, end: Matrix4, share: float) -> Matrix4:
    """A rigid pose between two others. Uses no sines, which differ by processor; small rotations are uniform without them."""
    a, b = np.array(start), np.array(end)
    p, q = (np.array(quaternion_from_matrix(m[:3, :3])) for m in (a, b))
    q = q if float((p * q).sum()) >= 0 else -q
    turned = matrix_from_quaternion((1 - share) * p + share * q)
    rows = rigid(turned, (1 - share) * a[:3, 3] + share * b[:3, 3]).tolist()
    first, second, third, last = (tuple(row) for row in rows)
    return first, second, third, last


def beyond(now: Matrix4, other: Matrix4) -> Matrix4:
    """The pose `other` mirrored at `now`: the same step and the same rotation, continued beyond `now`."""
    a, b = np.array(now), np.array(other)
    turned = product(product(a[:3, :3], b[:3, :3].T), a[:3, :3])
    rows: Any = rigid(turned, 2 * a[:3, 3] - b[:3, 3]).tolist()
    first, second, third, last = (tuple(row) for row in rows)
    return first, second, third, last
