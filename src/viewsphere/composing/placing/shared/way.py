"""The path of a thing to its place."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass

import numpy as np

from viewsphere.geometry.rotation import matrix_from_quaternion, rigid, slerp
from viewsphere.model.scene import Matrix4

State = tuple[float, ...]
"""x, y, z in metres and a unit quaternion w, x, y, z: world from object."""


@dataclass(frozen=True)
class Way:
    """The states of a thing at moments that follow one another, seconds from its first; it stays in the last one."""

    seconds: tuple[float, ...]
    states: tuple[State, ...]

    def at(self, seconds: float) -> Matrix4:
        """World from object at a time: straight from state to state."""
        after = min(max(bisect_right(self.seconds, seconds), 1), len(self.states) - 1)
        a, b = np.array(self.states[after - 1]), np.array(self.states[after])
        begin, stop = self.seconds[after - 1], self.seconds[after]
        share = min(max((seconds - begin) / (stop - begin), 0.0), 1.0)
        matrix = rigid(matrix_from_quaternion(slerp(a[3:], b[3:], share)), a[:3] + share * (b[:3] - a[:3]))
        return tuple(map(tuple, matrix.tolist()))  # type: ignore[return-value]
