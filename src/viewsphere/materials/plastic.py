"""Moulded plastic: glossy to matt, with the skin of its mould and a few scuffs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere.materials.shared.noise import cells, noise, smooth
from viewsphere.materials.shared.surface import Color, Surface
from viewsphere.materials.shared.tones import shaded
from viewsphere.plugins.material import MaterialSpec


@dataclass(frozen=True)
class _Plastic:
    """Linear colour and roughness; strength of the mould's grain and of scuffs, 0 to 1."""

    color: Color = (0.05, 0.18, 0.42)
    finish: float = 0.3
    grain: float = 0.4
    scuffs: float = 0.3
    metres: float = 0.3
    seed: int = 0


def _plastic(parameters: _Plastic | None = None, size: int = 512) -> Surface:
    """The skin: one colour, little pits or bumps, long faint scratches."""
    p = parameters or _Plastic()
    peel, patches = noise(size, 40, p.seed, 3), noise(size, 4, p.seed + 1, 5, 0.55)
    pits = cells(size, 150, p.seed + 2)
    pit = smooth(0.5, 0.15, pits.nearest) * pits.chance
    ways = ((3, 90), (90, 3))
    scratch = sum(smooth(0.42, 0.6, noise(size, way, p.seed + 3 + i, 2, 0.6)) for i, way in enumerate(ways))
    scuff = p.scuffs * scratch * smooth(0.0, 0.4, patches)
    shade = 1 + 0.03 * patches + 0.03 * p.grain * (pit - 0.3) + 0.2 * scuff
    rough = p.finish + 0.18 * p.grain * pit + 0.3 * scuff + 0.06 * patches
    height = 0.00003 * peel + 0.00025 * p.grain * pit
    return Surface(shaded(p.color, shade), np.clip(rough, 0.05, 1), height.astype(np.float32), p.metres)


def _draw(rng: np.random.Generator) -> _Plastic:
    """Any colour, more often a strong one; glossy to matt."""
    low, high = sorted(float(x) for x in rng.uniform(0.02, 0.75, 2))
    rest = float(rng.uniform(low, high))
    r, g, b = (float(x) for x in rng.permutation((low, rest, high)))
    return _Plastic(
        color=(r, g, b),
        finish=float(rng.uniform(0.1, 0.7)),
        grain=float(rng.choice((0.0, rng.uniform(0.2, 1.0)))),
        scuffs=float(rng.uniform(0.0, 0.8)),
        metres=float(rng.uniform(0.2, 0.5)),
        seed=int(rng.integers(2**31)),
    )


MATERIAL = MaterialSpec(word="plastic", surface=_plastic, draw=_draw)
