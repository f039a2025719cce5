"""Paper and cardboard: fibres, flecks, creases."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere.materials.shared.blades import strokes
from viewsphere.materials.shared.noise import cells, noise, smooth
from viewsphere.materials.shared.surface import Color, Surface
from viewsphere.materials.shared.tones import shaded
from viewsphere.plugins.material import MaterialSpec


@dataclass(frozen=True)
class _Paper:
    """Linear colour; strength of fibres and creases, 0 to 1; flutes: waves of cardboard over `metres`, 0 for none."""

    color: Color = (0.70, 0.68, 0.62)
    fibres: float = 0.4
    creases: float = 0.5
    flutes: int = 0
    metres: float = 0.3
    seed: int = 0


def _paper(parameters: _Paper | None = None, size: int = 512) -> Surface:
    """The sheet: crumpled, its facets meet in sharp creases; fibres of its pulp are seen."""
    p = parameters or _Paper()
    rng = np.random.default_rng(p.seed)
    pulp, clouds = noise(size, 60, p.seed, 4, 0.7), noise(size, 4, p.seed + 1, 5, 0.55)
    fibre = strokes(size, 2500, (0.01, 0.035), (0.0008, 0.0016), 0.6, rng)
    seen = (fibre.number >= 0) * (fibre.each(rng.random(2500)) - 0.5)
    facets, small = cells(size, 4, p.seed + 2), cells(size, 9, p.seed + 3)
    lines = noise(size, 12, p.seed + 4, 3)
    crease = smooth(0.05, 0.0, facets.border + 0.03 * lines) + 0.6 * smooth(0.05, 0.0, small.border + 0.04 * lines) * (
        small.chance < 0.5
    )
    fold = np.clip(crease, 0, 1) * p.creases
    at = (np.arange(size, dtype=np.float32) + 0.5) / size * p.flutes
    flute = np.abs(at - np.floor(at) - 0.5)[None] * np.ones((size, 1), np.float32)
    shade = (
        1
        + 0.03 * clouds
        + 0.05 * p.fibres * pulp
        + 0.35 * p.fibres * seen
        - 0.07 * fold
        - (0.10 * (flute > 0.44) if p.flutes else 0)
    )
    bulge = 0.006 * (facets.border + 0.4 * small.border)
    height = p.creases * bulge - 0.0004 * fold + 0.00005 * pulp + (0.0006 * flute if p.flutes else 0)
    return Surface(
        shaded(p.color, shade.astype(np.float32)), np.clip(0.9 + 0.05 * pulp, 0.5, 1), height.astype(np.float32), p.metres
    )


SHEETS: tuple[tuple[Color, float, float, int], ...] = (
    ((0.76, 0.75, 0.72), 0.15, 0.6, 0),
    ((0.40, 0.27, 0.15), 0.9, 0.25, 0),
    ((0.42, 0.29, 0.17), 0.7, 0.06, 44),
    ((0.66, 0.60, 0.46), 0.6, 0.5, 0),
    ((0.50, 0.49, 0.46), 0.8, 0.3, 0),
    ((0.62, 0.30, 0.26), 0.2, 0.4, 0),
    ((0.28, 0.42, 0.55), 0.2, 0.4, 0),
)


def _draw(rng: np.random.Generator) -> _Paper:
    """Writing paper, kraft paper, corrugated cardboard, old, recycled and coloured paper."""
    color, fibres, creases, flutes = SHEETS[int(rng.integers(len(SHEETS)))]
    r, g, b = color
    light = float(rng.uniform(0.85, 1.05))
    return _Paper(
        color=(r * light, g * light, b * light),
        fibres=fibres * float(rng.uniform(0.6, 1.1)),
        creases=creases * float(rng.uniform(0.0, 1.3)),
        flutes=flutes,
        metres=float(rng.uniform(0.25, 0.4)),
        seed=int(rng.integers(2**31)),
    )


MATERIAL = MaterialSpec(word="paper", surface=_paper, draw=_draw)
