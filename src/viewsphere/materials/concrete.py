"""Cast concrete: clouds, pores, the marks of its boards."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere.materials.shared.noise import cells, noise, smooth
from viewsphere.materials.shared.surface import Color, Map, Surface
from viewsphere.materials.shared.tones import shaded
from viewsphere.plugins.material import MaterialSpec


@dataclass(frozen=True)
class _Concrete:
    """Linear colour; strength of clouds, stains and pores, 0 to 1; panels per side, with seams between them, 0 for none."""

    color: Color = (0.41, 0.40, 0.38)
    clouds: float = 0.5
    stains: float = 0.4
    pores: float = 0.3
    panels: int = 1
    metres: float = 2.0
    seed: int = 0


def _concrete(parameters: _Concrete | None = None, size: int = 512) -> Surface:
    """The slab."""
    p = parameters or _Concrete()
    clouds = noise(size, max(round(2 * p.metres), 2), p.seed, 7, 0.6)
    blots = noise(size, max(round(4 * p.metres), 2), p.seed + 1, 5, 0.55)
    grit = noise(size, max(round(110 * p.metres), 2), p.seed + 2, 2, 0.8)
    holes = cells(size, max(round(22 * p.metres), 2), p.seed + 3)
    small = cells(size, max(round(60 * p.metres), 2), p.seed + 4)
    pore = smooth(0.17, 0.08, holes.nearest) * (holes.chance < 0.3 * p.pores)
    pore = np.maximum(pore, smooth(0.22, 0.1, small.nearest) * (small.chance < 0.2 * p.pores))
    stain = smooth(0.12, 0.55, blots + 0.35 * clouds)
    shade = 1 + 0.55 * p.clouds * clouds + 0.10 * grit - 0.35 * p.stains * stain
    seam = _seams(size, p)
    rough = 0.82 + 0.1 * grit + 0.1 * clouds
    height = 0.0005 * clouds + 0.0002 * grit - 0.0025 * pore - 0.004 * seam
    return Surface(shaded(p.color, shade * (1 - 0.55 * pore) * (1 - 0.45 * seam)), np.clip(rough, 0.4, 1), height, p.metres)


def _seams(size: int, p: _Concrete) -> Map:
    """1 in the seams between panels."""
    if not p.panels:
        return np.zeros((size, size), np.float32)
    at = (np.arange(size) + 0.5) / size * p.panels
    off = np.abs(at - np.floor(at + 0.5)) * np.float32(p.metres / p.panels)
    width = max(0.004, 1.0 * p.metres / size)
    return smooth(width, 0.3 * width, np.minimum(off[:, None], off[None]).astype(np.float32))


def _draw(rng: np.random.Generator) -> _Concrete:
    """Light to dark, smooth to porous, in panels or without."""
    light, warm = float(rng.uniform(0.22, 0.55)), float(rng.uniform(0.9, 1.0))
    return _Concrete(
        color=(light, light * (0.5 + 0.5 * warm), light * warm),
        clouds=float(rng.uniform(0.2, 0.9)),
        stains=float(rng.uniform(0.0, 0.8)),
        pores=float(rng.uniform(0.0, 1.0)),
        panels=int(rng.choice((0, 0, 1, 2))),
        metres=float(rng.uniform(1.6, 2.6)),
        seed=int(rng.integers(2**31)),
    )


MATERIAL = MaterialSpec(word="concrete", surface=_concrete, draw=_draw)
