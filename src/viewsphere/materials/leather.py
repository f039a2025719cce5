"""Leather: pebbles between creases, pores, rubbed spots."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere.materials.shared.noise import cells, noise, smooth
from viewsphere.materials.shared.surface import Color, Surface
from viewsphere.materials.shared.tones import mixed, shaded, times
from viewsphere.plugins.material import MaterialSpec


@dataclass(frozen=True)
class _Leather:
    """Linear colour; the `pebble`'s size in metres, the depth of creases, the wear, 0 to 1, and the roughness."""

    color: Color = (0.21, 0.085, 0.04)
    pebble: float = 0.0028
    creases: float = 0.6
    rubbed: float = 0.4
    finish: float = 0.42
    metres: float = 0.2
    seed: int = 0


def _leather(parameters: _Leather | None = None, size: int = 512) -> Surface:
    """The hide: creases are the borders of cells of three sizes, fewer of the large ones."""
    p = parameters or _Leather()
    count = max(round(p.metres / p.pebble), 4)
    pebbles, small = cells(size, count, p.seed), cells(size, (2 * count, 2 * count - 1), p.seed + 1)
    large = cells(size, max(count // 6, 2), p.seed + 2)
    rubbing = noise(size, 4, p.seed + 3, 5, 0.55)
    fine = noise(size, 2 * count, p.seed + 4, 2, 0.7)
    groove = smooth(0.16, 0.02, pebbles.border)
    thin = smooth(0.14, 0.03, small.border) * 0.5
    fold = smooth(0.05, 0.0, large.border + 0.05 * rubbing)
    crease = np.clip(np.maximum(groove, thin) + 0.6 * fold, 0, 1)
    round_ = smooth(0.0, 0.75, pebbles.border)
    worn = p.rubbed * smooth(0.0, 0.6, rubbing + 0.3 * round_) * round_
    color = mixed(p.color, times(p.color, 1.9), worn)
    color = shaded(color, (1 - 0.55 * p.creases * crease) * (1 + 0.1 * (pebbles.chance - 0.5) + 0.2 * rubbing + 0.08 * fine))
    rough = p.finish + 0.22 * crease - 0.1 * worn + 0.1 * fine
    deep = p.creases * p.pebble
    height = deep * (0.12 * round_ - 0.12 * groove - 0.05 * thin - 0.12 * fold) + 0.02 * deep * fine
    return Surface(color, np.clip(rough, 0.1, 1), height, p.metres)


HIDES: tuple[Color, ...] = (
    _Leather.color, (0.035, 0.033, 0.032), (0.34, 0.17, 0.075), (0.10, 0.05, 0.03), (0.20, 0.03, 0.028), (0.56, 0.50, 0.40),
    (0.06, 0.09, 0.065), (0.05, 0.065, 0.11),
)  # fmt: skip


def _draw(rng: np.random.Generator) -> _Leather:
    """Brown, black, tan, red, cream, ..., smooth to pebbled."""
    metres = float(rng.uniform(0.15, 0.3))
    return _Leather(
        color=times(HIDES[int(rng.integers(len(HIDES)))], float(rng.uniform(0.8, 1.2))),
        pebble=float(rng.uniform(0.0022, 0.0045)),
        creases=float(rng.uniform(0.3, 1.0)),
        rubbed=float(rng.uniform(0.0, 0.8)),
        finish=float(rng.uniform(0.28, 0.6)),
        metres=metres,
        seed=int(rng.integers(2**31)),
    )


MATERIAL = MaterialSpec(word="leather", surface=_leather, draw=_draw)
