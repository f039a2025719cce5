"""The grain of boards sawn from trunks: rings about a pith outside the board, fibres, pores."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from viewsphere.materials.shared.courses import Courses
from viewsphere.materials.shared.noise import cells, noise, smooth
from viewsphere.materials.shared.surface import Color, Map
from viewsphere.materials.shared.tones import times


@dataclass(frozen=True)
class Timber:
    """A kind of wood: colours of early and late wood, a ring's width in metres, strength of rings and pores, 0 to 1."""

    early: Color = (0.42, 0.25, 0.13)
    late: Color = (0.24, 0.12, 0.05)
    ring: float = 0.005
    rings: float = 0.7
    pores: float = 0.5


OAK = Timber()
KINDS = (
    OAK,
    Timber((0.56, 0.39, 0.22), (0.40, 0.22, 0.09), 0.006, 0.9, 0.0),  # pine
    Timber((0.62, 0.47, 0.31), (0.50, 0.35, 0.21), 0.004, 0.35, 0.2),  # maple, birch
    Timber((0.20, 0.105, 0.055), (0.085, 0.042, 0.024), 0.005, 0.7, 0.4),  # walnut
    Timber((0.33, 0.13, 0.06), (0.19, 0.06, 0.03), 0.004, 0.5, 0.5),  # mahogany, cherry
    Timber((0.36, 0.33, 0.29), (0.22, 0.195, 0.165), 0.005, 0.8, 0.5),  # weathered
)


def draw_timber(rng: np.random.Generator) -> Timber:
    """One of the kinds, lighter or darker, redder or yellower than most."""
    kind = KINDS[int(rng.integers(len(KINDS)))]
    light, warm = rng.uniform(0.75, 1.2), rng.uniform(0.92, 1.08)
    change = light * warm, light, light / warm
    return Timber(
        times(kind.early, change),
        times(kind.late, change),
        kind.ring * float(rng.uniform(0.7, 1.6)),
        min(kind.rings * float(rng.uniform(0.6, 1.2)), 1.0),
        min(kind.pores * float(rng.uniform(0.5, 1.5)), 1.0),
    )


class _Grain(NamedTuple):
    """The lateness of the wood, about 0 to 1, which darkens it, and the depth of its pores, 0 to 1."""

    late: Map
    pores: Map


def grain(size: int, metres: float, boards: Courses, timber: Timber, seed: int) -> _Grain:
    """The grain along u of boards, each from another place in another trunk."""
    rng = np.random.default_rng(seed)
    draws = rng.random((4, boards.count))
    width = float(boards.width.max())
    pith = boards.each((draws[0] * 2.2 - 0.6) * width)
    depth = boards.each((0.006 + 0.09 * draws[1] ** 2) * (1 if width > 0.03 else 0.5))
    slow, across = max(round(metres / 0.35), 1), max(round(metres / 0.09), 1)
    wander = noise(size, (slow, across), seed + 1, 3, 0.45)
    deep = depth + 0.035 * np.abs(wander) + 0.006 * wander
    off = boards.down - pith + 0.008 * noise(size, (2 * slow, 2 * across), seed + 2, 2)
    radius = np.sqrt(off * off + deep * deep)
    years = radius / np.float32(timber.ring) * (0.8 + 0.5 * boards.each(draws[2])) + boards.each(17 * draws[3])
    years += 0.9 * noise(size, (slow, max(round(metres / 0.03), 1)), seed + 3, 2)  # fat years and lean ones
    since = years - np.floor(years)
    ring = smooth(0.25, 0.85, since) * smooth(1.0, 0.9, since)
    fibre = noise(size, (max(round(metres / 0.12), 1), max(round(metres / 0.003), 2)), seed + 4, 3, 0.7)
    cloud = noise(size, (slow, across), seed + 5, 3)
    open_ = cells(size, (max(round(metres / 0.018), 2), max(round(metres / 0.0022), 2)), seed + 6)
    pores = smooth(0.30, 0.12, open_.nearest) * (open_.chance < 0.5 * (0.35 + 0.65 * (1 - ring))) * np.float32(timber.pores)
    late = 0.5 + timber.rings * (ring - 0.45) + 0.30 * fibre + 0.22 * cloud
    return _Grain(late.astype(np.float32), pores.astype(np.float32))
