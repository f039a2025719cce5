"""Chains link by link, and the toothed wheels they run over, in the plane of (y, z)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from viewsphere_zoo.shapes.rods import across, circle, copies, plate, turns, washer
from viewsphere_zoo.shapes.solids import Float, Solid, join, loft, moved

PITCH = 0.0127
"""A chain's pitch, metres: half an inch (ISO 9633)."""


@dataclass(frozen=True)
class Pulley:
    """A wheel that the chain runs over: centre (y, z) and pitch radius, metres; turn: +1 from +y to +z, -1 the other way."""

    y: float
    z: float
    radius: float
    turn: int = 1


def pitch_radius(teeth: int) -> float:
    """Radius of the circle through the rollers' centres, metres."""
    return PITCH / (2 * float(np.sin(np.pi / teeth)))


def rollers(pulleys: Sequence[Pulley], per: float = PITCH) -> Float:
    """Centres (N, 2) in (y, z) of an even number of rollers, about one pitch apart along the closed path."""
    line = _path(pulleys)
    step = np.linalg.norm(np.diff(line, axis=0), axis=1)
    along = np.concatenate([[0], np.cumsum(step)])
    count = 2 * round(along[-1] / per / 2)
    at = np.linspace(0, along[-1], count, endpoint=False)
    return np.stack([np.interp(at, along, line[:, k]) for k in (0, 1)], axis=1)


def _path(pulleys: Sequence[Pulley]) -> Float:
    """The closed belt around pulleys, (N, 2): arcs joined by common tangents."""
    starts: list[float] = []
    for p, q in zip(pulleys, [*pulleys[1:], pulleys[0]], strict=True):
        y, z = q.y - p.y, q.z - p.z
        bend = (q.turn * q.radius - p.turn * p.radius) / float(np.hypot(y, z))
        starts.append(float(np.arctan2(z, y) - np.arcsin(bend)))
    arcs: list[Float] = []
    for i, p in enumerate(pulleys):
        come, leave = starts[i - 1], starts[i]
        sweep = ((leave - come) * p.turn) % (2 * np.pi)
        heading = come + p.turn * np.linspace(0, sweep, max(2, int(sweep / 0.04)))
        offset = p.turn * p.radius
        arcs.append(np.stack([p.y + offset * np.sin(heading), p.z - offset * np.cos(heading)], axis=1))
    return np.concatenate([*arcs, arcs[0][:1]])


def phase_on(centres: Float, pulley: Pulley) -> float:
    """The angle of a roller near the middle of the arc where the chain lies on the pulley, radians from y to z."""
    offset = centres - (pulley.y, pulley.z)
    near = np.flatnonzero(np.abs(np.linalg.norm(offset, axis=1) - pulley.radius) < 5e-4)
    middle = offset[near[len(near) // 2]] if len(near) else np.array((1.0, 0.0))
    return float(np.arctan2(middle[1], middle[0]))


def chain(centres: Float, x: float) -> tuple[Solid, Solid]:
    """Plates and rollers of a chain through these roller centres, in the plane at x."""
    ahead = np.roll(centres, -1, axis=0) - centres
    rotations = turns(0, np.arctan2(ahead[:, 1], ahead[:, 0]))
    origins = np.column_stack([np.full(len(centres), x), centres])
    pair = [_plates(gap) for gap in (0.00165, 0.00265)]
    links = join(*(copies(pair[k], rotations[k::2], origins[k::2]) for k in (0, 1)))
    barrel = loft(_rods(0.0016, 0.0036, 5), (False, False))
    pin = loft(_rods(0.0035, 0.0018, 4))
    return links, copies(join(barrel, pin), rotations, origins)


def _rods(half: float, radius: float, sides: int) -> Float:
    """Two rings of a short rod along x."""
    yz = circle(radius, sides)
    return np.array([np.column_stack([np.full(sides, x), yz]) for x in (-half, half)])


def _plates(gap: float) -> Solid:
    """Two plates of one link from the origin to +y, at +-gap from x = 0."""
    r, p = 0.0041, PITCH
    ends = [np.array((p + r * np.cos(a), r * np.sin(a))) for a in np.radians((-60, 0, 60))]
    ends += [np.array((p / 2, 0.003))]
    ends += [np.array((r * np.cos(a), r * np.sin(a))) for a in np.radians((120, 180, 240))]
    ends += [np.array((p / 2, -0.003))]
    one = across(plate(np.array(ends), 0.0009))
    return join(moved(one, (gap, 0, 0)), moved(one, (-gap, 0, 0)))


def sprocket(teeth: int, phase: float, thickness: float = 0.0022, inner: float | None = None) -> Solid:
    """A toothed ring in the plane x = 0 about the axle; a gap between teeth lies at the phase, radians from y to z."""
    r = pitch_radius(teeth)
    root, tip = r - 0.0042, r + 0.0036
    tooth = 2 * np.pi / teeth
    turn = np.float64(phase) + (np.arange(teeth)[:, None] + np.array((-0.22, 0.22, 0.5))) * tooth
    radius = np.broadcast_to((root, root, tip), turn.shape)
    outer = np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=-1).reshape(-1, 2)
    hole = inner if inner is not None else root - 0.011
    return across(washer(_inside(turn, hole), outer, thickness))


def _inside(turn: Float, radius: float) -> Float:
    return radius * np.stack([np.cos(turn), np.sin(turn)], axis=-1).reshape(-1, 2)


def disc(radius: float, thickness: float, inner: float, count: int = 48) -> Solid:
    """A plain ring in the plane x = 0."""
    return across(washer(circle(inner, count), circle(radius, count), thickness))
