"""Plaster on a wall: rolled, trowelled or rough-cast, and painted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere.materials.shared.noise import cells, noise, smooth
from viewsphere.materials.shared.surface import Color, Surface
from viewsphere.materials.shared.tones import shaded
from viewsphere.plugins.material import MaterialSpec


@dataclass(frozen=True)
class _Plaster:
    """Linear colour of the paint; strength of grains, strokes of the trowel, and stains, 0 to 1."""

    color: Color = (0.70, 0.67, 0.60)
    grains: float = 0.5
    strokes: float = 0.5
    stains: float = 0.3
    metres: float = 1.0
    seed: int = 0


def _plaster(parameters: _Plaster | None = None, size: int = 512) -> Surface:
    """The wall: overlapping strokes leave ridges where one ends on another, grains stand out of it."""
    p = parameters or _Plaster()
    clouds = noise(size, max(round(3 * p.metres), 2), p.seed, 6, 0.55)
    warp = noise(size, max(round(7 * p.metres), 2), p.seed + 1, 4, 0.5)
    lines = noise(size, (max(round(6 * p.metres), 2), max(round(16 * p.metres), 2)), p.seed + 2, 4, 0.55) + 0.5 * warp
    ridge = smooth(0.16, 0.0, np.abs(lines))
    scratched = noise(size, (max(round(10 * p.metres), 2), max(round(90 * p.metres), 2)), p.seed + 3, 3, 0.7)
    sand = cells(size, max(round(150 * p.metres), 2), p.seed + 4)
    grain = smooth(0.45, 0.1, sand.nearest) * (0.3 + 0.7 * sand.chance)
    fine = noise(size, max(round(120 * p.metres), 2), p.seed + 5, 3, 0.7)
    stain = smooth(0.1, 0.6, clouds + 0.3 * warp)
    height = p.grains * (0.0011 * grain + 0.0006 * fine) + p.strokes * (0.0022 * ridge + 0.003 * lines + 0.0007 * scratched)
    cavity = 0.10 * p.grains * (grain - 0.4) + 0.05 * p.strokes * (ridge - 0.4 + scratched)
    shade = 0.96 + 0.05 * clouds + cavity + 0.03 * fine - 0.22 * p.stains * stain
    return Surface(shaded(p.color, shade), np.clip(0.9 + 0.08 * fine, 0.6, 1), height.astype(np.float32), p.metres)


PAINTS: tuple[Color, ...] = (
    (0.72, 0.71, 0.68), (0.70, 0.66, 0.57), (0.66, 0.55, 0.36), (0.60, 0.42, 0.28), (0.50, 0.52, 0.55), (0.36, 0.47, 0.55),
    (0.45, 0.52, 0.38), (0.62, 0.36, 0.30), (0.55, 0.53, 0.50),
)  # fmt: skip


def _draw(rng: np.random.Generator) -> _Plaster:
    """White, cream, ochre, grey, pastel."""
    r, g, b = PAINTS[int(rng.integers(len(PAINTS)))]
    light = float(rng.uniform(0.8, 1.05))
    return _Plaster(
        color=(r * light, g * light, b * light),
        grains=float(rng.uniform(0.1, 1.0)),
        strokes=float(rng.uniform(0.0, 1.0)),
        stains=float(rng.uniform(0.0, 0.6)),
        metres=float(rng.uniform(0.8, 1.4)),
        seed=int(rng.integers(2**31)),
    )


MATERIAL = MaterialSpec(word="plaster", surface=_plaster, draw=_draw)
