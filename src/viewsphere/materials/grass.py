"""A lawn seen from above: blades over soil."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere.materials.shared.blades import strokes
from viewsphere.materials.shared.noise import noise, smooth
from viewsphere.materials.shared.surface import Color, Surface
from viewsphere.materials.shared.tones import colored, mixed, shaded
from viewsphere.plugins.material import MaterialSpec


@dataclass(frozen=True)
class _Grass:
    """Linear colours of fresh and dry blades and of the soil, metres of the longest blade, blades a square metre; dryness: 0 to
    1.
    """

    fresh: Color = (0.062, 0.135, 0.02)
    dry: Color = (0.26, 0.22, 0.07)
    soil: Color = (0.07, 0.05, 0.032)
    blade: float = 0.05
    blades: int = 40_000
    dryness: float = 0.15
    metres: float = 1.2
    seed: int = 0


def _grass(parameters: _Grass | None = None, size: int = 512) -> Surface:
    """The lawn: later blades lie higher and are lighter, tufts differ in tone, some blades are dry."""
    p = parameters or _Grass()
    rng = np.random.default_rng(p.seed)
    count = int(p.blades * p.metres**2)
    long = p.blade / p.metres
    lawn = strokes(size, count, (0.35 * long, long), (0.0022 / p.metres, 0.0042 / p.metres), 0.45, rng)
    draws = rng.random((3, count))
    tufts, patches = (
        noise(size, max(round(9 * p.metres), 2), p.seed + 1, 3),
        noise(size, max(round(2 * p.metres), 2), p.seed + 2, 4),
    )
    dry = np.clip(smooth(1 - p.dryness, 1.25 - p.dryness, lawn.each(draws[0]) + 0.5 * patches + 0.2 * tufts), 0, 1)
    light = lawn.height * (0.72 + 0.5 * lawn.each(draws[1])) * (0.95 + 0.5 * np.abs(lawn.along))
    light = light * np.where(lawn.along < 0, np.float32(0.82), np.float32(1)) * (1.1 + 0.35 * tufts + 0.2 * patches)
    yellow = lawn.each(draws[2])
    blades = mixed(p.fresh, (1.5 * p.fresh[0], 1.12 * p.fresh[1], p.fresh[2]), yellow)
    blades = shaded(mixed(blades, p.dry, dry), 0.74 * light)
    soil = colored(noise(size, max(round(30 * p.metres), 2), p.seed + 3, 4, 0.7), (-0.6, (0.02, 0.02, 0.02)), (0.6, p.soil))
    color = mixed(soil, blades, (lawn.height > 0).astype(np.float32))
    height = 0.018 * lawn.height + 0.004 * tufts
    return Surface(color, np.clip(0.75 + 0.2 * (1 - lawn.height), 0, 1), height, p.metres)


def _draw(rng: np.random.Generator) -> _Grass:
    """Fresh to dry, short to long."""
    light, yellow = float(rng.uniform(0.75, 1.3)), float(rng.uniform(0.85, 1.35))
    return _Grass(
        fresh=(0.062 * light * yellow, 0.135 * light, 0.02 * light),
        blade=float(rng.uniform(0.03, 0.07)),
        blades=int(rng.uniform(30_000, 50_000)),
        dryness=float(rng.choice((rng.uniform(0.05, 0.3), rng.uniform(0.3, 0.8)))),
        metres=float(rng.uniform(1.0, 1.5)),
        seed=int(rng.integers(2**31)),
    )


MATERIAL = MaterialSpec(word="grass", surface=_grass, draw=_draw)
