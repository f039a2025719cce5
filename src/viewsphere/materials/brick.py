"""A wall of bricks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere.materials.shared.courses import bonded, courses, even
from viewsphere.materials.shared.noise import cells, noise, smooth
from viewsphere.materials.shared.surface import Color, Surface
from viewsphere.materials.shared.tones import colored, mixed, shaded, times
from viewsphere.plugins.material import MaterialSpec


@dataclass(frozen=True)
class Brick:
    """Bricks of one length and height and the `joint` between them, metres, `columns` by `rows` of them; `colors`: of the
    darkest, the usual and the lightest brick, linear, and of the mortar; `shift` of each second course, shares of a brick.
    """

    colors: tuple[Color, Color, Color] = ((0.24, 0.065, 0.04), (0.35, 0.115, 0.068), (0.45, 0.18, 0.11))
    mortar: Color = (0.42, 0.39, 0.35)
    columns: int = 4
    rows: int = 12
    length: float = 0.225
    joint: float = 0.011
    shift: float = 0.5
    wear: float = 0.4
    seed: int = 0

    @property
    def metres(self) -> float:
        """The square's side."""
        return self.columns * self.length


def _brick(parameters: Brick | None = None, size: int = 512) -> Surface:
    """The wall: every brick has a tone of its own, is worn at its edges, and stands out of the mortar by some millimetres."""
    p = parameters or Brick()
    rng = np.random.default_rng(p.seed)
    wall = courses(size, p.metres, even(p.rows), bonded(p.rows, p.columns, p.shift))
    per_metre = 1 / p.metres
    ragged, grit = noise(size, round(45 / per_metre), p.seed + 1, 3), noise(size, round(160 / per_metre), p.seed + 2, 3, 0.7)
    patches = noise(size, round(9 / per_metre), p.seed + 3, 5, 0.55)
    draws = rng.random((3, wall.count))
    edge = wall.edge + 0.004 * p.wear * ragged - 0.5 * p.joint * (0.85 + 0.3 * wall.each(draws[1]))
    stone = smooth(-0.001, 0.0035, edge)
    pits = cells(size, round(70 / per_metre), p.seed + 4)
    pit = smooth(0.24, 0.1, pits.nearest) * (pits.chance < 0.25 * p.wear) * stone
    tone = wall.each(draws[0]) * 0.8 + 0.1 + 0.3 * patches + 0.16 * grit
    fired = colored(tone, (0.0, p.colors[0]), (0.5, p.colors[1]), (1.0, p.colors[2]))
    chalk = p.wear * 0.35 * smooth(0.25, 0.6, patches + 0.5 * ragged)
    fired = mixed(fired, times(p.mortar, 0.9), chalk)
    joint = shaded(p.mortar, 1 + 0.22 * grit + 0.25 * patches)
    color = shaded(mixed(joint, fired, stone), (1 - 0.45 * pit) * (0.72 + 0.28 * smooth(-0.003, 0.004, np.abs(edge))))
    height = 0.007 * stone + 0.0008 * grit + 0.0012 * ragged + 0.0016 * wall.each(draws[2]) * stone - 0.002 * pit
    return Surface(color, np.clip(0.88 + 0.1 * grit - 0.05 * stone, 0.5, 1), height, p.metres)


FIRED: tuple[tuple[Color, Color, Color], ...] = (
    Brick.colors,
    ((0.17, 0.06, 0.05), (0.28, 0.10, 0.07), (0.36, 0.16, 0.10)),
    ((0.38, 0.26, 0.13), (0.52, 0.38, 0.21), (0.62, 0.49, 0.31)),
    ((0.10, 0.09, 0.085), (0.17, 0.15, 0.14), (0.25, 0.22, 0.20)),
    ((0.45, 0.42, 0.38), (0.58, 0.55, 0.50), (0.68, 0.66, 0.61)),
    ((0.30, 0.13, 0.08), (0.42, 0.20, 0.12), (0.50, 0.33, 0.22)),
)


def _draw(rng: np.random.Generator) -> Brick:
    """Red more often than yellow, brown, grey or whitewashed."""
    mortar = float(rng.uniform(0.2, 0.6))
    rows = int(rng.choice((12, 16, 20)))
    return Brick(
        colors=FIRED[int(rng.choice(len(FIRED), p=(0.35, 0.2, 0.12, 0.08, 0.08, 0.17)))],
        mortar=(mortar, 0.95 * mortar, 0.86 * mortar),
        columns=4 if rows < 20 else 6,
        rows=rows,
        length=float(rng.uniform(0.2, 0.25)),
        joint=float(rng.uniform(0.007, 0.014)),
        shift=float(rng.choice((0.5, 0.5, 0.25))),
        wear=float(rng.uniform(0.1, 0.9)),
        seed=int(rng.integers(2**31)),
    )


MATERIAL = MaterialSpec(word="brick", surface=_brick, draw=_draw)
