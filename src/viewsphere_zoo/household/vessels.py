"""Hollow bodies of revolution: walls with a lip, an inside and a floor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from viewsphere_zoo.shapes.solids import Float, Solid, lathe


@dataclass(frozen=True, eq=False)
class Vessel:
    """Profiles (N, 2) of radius and height, each ready to be turned: foot, outer wall from its foot to its lip, and inside."""

    foot: Float
    wall: Float
    lip: Float
    inside: Float

    def radius_inside(self, height: float) -> float:
        """The inside's radius at this height, metres."""
        return float(np.interp(height, self.inside[::-1, 1], self.inside[::-1, 0]))

    def holding(self, solid: Solid, slack: float) -> Solid:
        """Return a solid in the vessel, pressed against the inside where it would stick out by more than `slack`, metres."""
        x, y, z = solid.vertices.T
        z = np.maximum(z, self.inside[-1, 1] - slack)
        room = np.interp(z, self.inside[::-1, 1], self.inside[::-1, 0]) + slack
        room = np.where(z > self.inside[0, 1], np.inf, room)
        share = np.minimum(room / np.maximum(np.hypot(x, y), 1e-9), 1)
        return Solid(np.stack([x * share, y * share, z], axis=1), solid.triangles)


def vessel(outer: ArrayLike, wall: float, floor: float, foot: float = 0.0) -> Vessel:
    """A vessel within an outer profile (N, 2) from (foot's radius, 0) up to the lip.

    wall, floor: how thick they are; foot: how high its ring lifts the underside off the ground. All in metres.
    """
    out = np.asarray(outer, np.float64)
    along = np.gradient(out, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    inner = out - wall * np.stack([along[:, 1], -along[:, 0]], axis=1)
    inner = inner[(inner[:, 1] > floor * 1.3) & (inner[:, 0] > 0)]
    r = out[0, 0]
    under = [(0, foot), (0.5 * r, foot), (max(r - 2 * wall - foot, 0.6 * r), foot), (r - 1.5 * wall, 0), (r, 0)]
    turn = np.linspace(0, np.pi, 6)[:, None]
    top, rim = out[-1], inner[-1]
    middle, half = (top + rim) / 2, (top - rim) / 2
    lip = middle + np.cos(turn) * half + np.sin(turn) * np.array((-half[1], half[0]))
    low = inner[0]
    round_off = np.array([(low[0] * np.sqrt(1 - s * s), floor + (low[1] - floor) * (1 - s) ** 1.5) for s in (0.35, 0.7, 0.9)])
    ground = np.array([(0.22 * low[0], floor), (0, floor)])
    return Vessel(np.array(under, np.float64), out, lip, np.concatenate([inner[::-1], round_off, ground]))


def disc(radius: float, height: float, segments: int = 48) -> Solid:
    """A level disc that faces up: a liquid's surface."""
    return lathe([(radius, height), (0.6 * radius, height), (0, height)], segments)
