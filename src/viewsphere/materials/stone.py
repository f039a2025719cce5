"""A wall or pavement of natural stone, hewn to uneven blocks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere.materials.shared.courses import courses, uneven
from viewsphere.materials.shared.noise import noise, smooth
from viewsphere.materials.shared.surface import Color, Surface
from viewsphere.materials.shared.tones import colored, mixed, shaded, times
from viewsphere.plugins.material import MaterialSpec


@dataclass(frozen=True)
class _Stone:
    """`rows` of blocks over `metres`, `columns` in each; linear colours of the darkest, the usual and the lightest block,
    and of the mortar; `joint` in metres; rough: how far faces stand out, 0 to 1.
    """

    colors: tuple[Color, Color, Color] = ((0.17, 0.155, 0.13), (0.31, 0.285, 0.24), (0.46, 0.42, 0.35))
    mortar: Color = (0.30, 0.285, 0.26)
    rows: int = 7
    columns: int = 4
    joint: float = 0.016
    rough: float = 0.6
    metres: float = 1.6
    seed: int = 0


def _stone(parameters: _Stone | None = None, size: int = 512) -> Surface:
    """The wall: courses of uneven height, ragged edges, faces broken into facets, speckles of the stone's minerals."""
    p = parameters or _Stone()
    rng = np.random.default_rng(p.seed)
    heights = 0.65 + 0.7 * rng.random(p.rows)
    rows = np.concatenate([[0.0], np.cumsum(heights) / heights.sum()])
    rows[-1] = 1.0
    wall = courses(size, p.metres, rows, uneven(rng, p.rows, p.columns, 0.8))
    draws = rng.random((5, wall.count))
    ragged = noise(size, max(round(14 * p.metres), 2), p.seed + 1, 5, 0.6)
    grit = noise(size, max(round(150 * p.metres), 2), p.seed + 2, 2, 0.8)
    broken = noise(size, max(round(6 * p.metres), 2), p.seed + 3, 6, 0.52)
    bed = noise(size, (max(round(5 * p.metres), 1), max(round(40 * p.metres), 2)), p.seed + 4, 3, 0.6)
    edge = wall.edge + 0.012 * ragged * (0.4 + 0.6 * p.rough) - 0.5 * p.joint
    face = smooth(-0.002, 0.010, edge)
    swell = smooth(0.0, 0.05 + 0.05 * p.rough, edge)
    tone = 0.15 + 0.7 * wall.each(draws[0]) + 0.3 * broken + 0.14 * bed + 0.14 * grit
    color = colored(tone, (0.0, p.colors[0]), (0.5, p.colors[1]), (1.0, p.colors[2]))
    warm = wall.each(draws[1] - 0.5)[..., None] * np.array([0.18, 0.0, -0.18], np.float32)
    joint = shaded(p.mortar, 1 + 0.2 * grit + 0.2 * ragged)
    color = shaded(mixed(joint, color * (1 + warm), face), 0.7 + 0.3 * smooth(-0.004, 0.012, np.abs(edge)))
    tilt = (wall.down - 0.5 * wall.width) * wall.each(0.10 * (draws[2] - 0.5)) + (wall.across - 0.5 * wall.length) * wall.each(
        0.06 * (draws[3] - 0.5)
    )
    out = 0.012 * swell + (0.012 * np.abs(broken) + 0.006 * ragged + tilt + 0.004 * wall.each(draws[4])) * swell
    height = 0.006 * face + p.rough * out + 0.0008 * grit
    return Surface(color, np.clip(0.88 + 0.1 * grit, 0.5, 1), height, p.metres)


QUARRIES: tuple[tuple[Color, Color, Color], ...] = (
    _Stone.colors,
    ((0.36, 0.29, 0.19), (0.50, 0.41, 0.28), (0.62, 0.53, 0.38)),
    ((0.12, 0.125, 0.13), (0.22, 0.225, 0.23), (0.34, 0.34, 0.34)),
    ((0.24, 0.12, 0.08), (0.36, 0.20, 0.14), (0.46, 0.29, 0.21)),
    ((0.40, 0.39, 0.36), (0.54, 0.53, 0.49), (0.66, 0.65, 0.61)),
)


def _draw(rng: np.random.Generator) -> _Stone:
    """Limestone, sandstone, slate, granite."""
    colors = QUARRIES[int(rng.integers(len(QUARRIES)))]
    return _Stone(
        colors=colors,
        mortar=times(colors[1], (float(rng.uniform(0.7, 1.2)),) * 3),
        rows=int(rng.integers(4, 10)),
        columns=int(rng.integers(2, 6)),
        joint=float(rng.uniform(0.006, 0.024)),
        rough=float(rng.uniform(0.15, 1.0)),
        metres=float(rng.uniform(1.2, 2.0)),
        seed=int(rng.integers(2**31)),
    )


MATERIAL = MaterialSpec(word="stone", surface=_stone, draw=_draw)
