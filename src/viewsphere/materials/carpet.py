"""Carpet: tufts of yarn, cut or in loops, flecked or patterned."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere.materials.shared.noise import cells, noise, smooth
from viewsphere.materials.shared.surface import Color, Surface
from viewsphere.materials.shared.tones import mixed, shaded
from viewsphere.plugins.material import MaterialSpec


@dataclass(frozen=True)
class _Carpet:
    """Linear colours of the yarn, and of flecks and lines; `tufts` over `metres`; pile in metres; flecks: share of other tufts.

    ordered: 1 for loops in rows, 0 for a shaggy pile; diamonds: how many a side, 0 for none.
    """

    color: Color = (0.25, 0.10, 0.085)
    fleck: Color = (0.40, 0.24, 0.17)
    tufts: int = 110
    pile: float = 0.006
    ordered: float = 0.4
    flecks: float = 0.15
    diamonds: int = 0
    metres: float = 0.6
    seed: int = 0


def _carpet(parameters: _Carpet | None = None, size: int = 512) -> Surface:
    """The pile: every tuft is lit on top and dark between, leans its own way, and footsteps brush whole patches aside."""
    p = parameters or _Carpet()
    tufts = cells(size, p.tufts, p.seed, 1 - p.ordered)
    fibre = noise(size, 2 * p.tufts, p.seed + 1, 2, 0.8)
    brushed = noise(size, max(round(4 * p.metres), 2), p.seed + 2, 4, 0.5)
    top = smooth(0.72, 0.05, tufts.nearest) * smooth(0.0, 0.25, tufts.border)
    second = (tufts.chance < p.flecks).astype(np.float32)
    if p.diamonds:
        at = np.abs((np.arange(size, dtype=np.float32) + 0.5) / size * p.diamonds % 1 - 0.5)
        lines = at[:, None] + at[None] + 0.02 * fibre
        second = np.maximum(second, ((np.abs(lines - 0.5) < 0.07) | (lines < 0.1)).astype(np.float32))
    tone = (tufts.chance * 13.0) % 1.0
    shade = (0.42 + 0.62 * top) * (0.88 + 0.24 * tone) * (1 + 0.3 * fibre) * (1 + 0.22 * brushed)
    color = shaded(mixed(p.color, p.fleck, second), shade)
    height = p.pile * (0.5 * top * (0.7 + 0.6 * tone) + 0.12 * fibre + 0.3 * brushed)
    return Surface(color, np.full_like(top, 0.95), height, p.metres)


YARNS: tuple[Color, ...] = (
    _Carpet.color, (0.42, 0.38, 0.31), (0.20, 0.20, 0.205), (0.07, 0.10, 0.19), (0.10, 0.16, 0.11), (0.50, 0.47, 0.42),
    (0.17, 0.11, 0.075), (0.33, 0.20, 0.10), (0.12, 0.20, 0.24),
)  # fmt: skip


def _draw(rng: np.random.Generator) -> _Carpet:
    """Loops or pile, plain, flecked or with diamonds."""
    color, fleck = (YARNS[int(i)] for i in rng.choice(len(YARNS), size=2, replace=False))
    metres = float(rng.uniform(0.5, 0.9))
    return _Carpet(
        color=color,
        fleck=fleck,
        tufts=round(metres / float(rng.uniform(0.0045, 0.008))),
        pile=float(rng.uniform(0.003, 0.01)),
        ordered=float(rng.uniform(0.0, 0.85)),
        flecks=float(rng.choice((0.0, rng.uniform(0.05, 0.4)))),
        diamonds=int(rng.choice((0, 0, 0, 2, 3))),
        metres=metres,
        seed=int(rng.integers(2**31)),
    )


MATERIAL = MaterialSpec(word="carpeted", surface=_carpet, draw=_draw)
