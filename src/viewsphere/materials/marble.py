"""Polished marble with veins."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere.materials.shared.noise import noise, smooth
from viewsphere.materials.shared.surface import Color, Map, Surface
from viewsphere.materials.shared.tones import colored, mixed, times
from viewsphere.plugins.material import MaterialSpec


@dataclass(frozen=True)
class _Marble:
    """Linear colours of the stone, its clouds and its veins; `veins`: their amount and darkness, 0 to 1."""

    color: Color = (0.74, 0.73, 0.71)
    cloud: Color = (0.56, 0.56, 0.56)
    vein: Color = (0.19, 0.19, 0.21)
    veins: float = 0.6
    finish: float = 0.1
    metres: float = 1.5
    seed: int = 0


def _marble(parameters: _Marble | None = None, size: int = 512) -> Surface:
    """The stone: veins are where warped noise changes its sign, broad and faint ones below thin and dark ones."""
    p = parameters or _Marble()
    clouds, patches = noise(size, 3, p.seed, 7, 0.55), noise(size, 3, p.seed + 1, 4)
    first = np.abs(noise(size, (2, 3), p.seed + 2, 7, 0.52) + 0.3 * clouds)
    second = np.abs(noise(size, (4, 3), p.seed + 3, 7, 0.5) + 0.4 * patches)
    fine = np.abs(noise(size, 6, p.seed + 4, 6, 0.5) + 0.35 * clouds)
    where = smooth(-0.25, 0.3, patches)
    thin = _line(first, 0.012) * (0.35 + 0.65 * where) + 0.6 * _line(second, 0.007) * where
    thin = np.clip(thin + 0.3 * _line(fine, 0.006) * (1 - where), 0, 1)
    broad = np.clip(_line(first, 0.09) + 0.5 * _line(second, 0.05), 0, 1)
    tone = 0.35 + 0.9 * clouds + 0.55 * p.veins * broad
    color = colored(tone, (0.0, p.color), (1.2, p.cloud))
    color = mixed(color, p.vein, np.clip(p.veins * 1.3 * thin, 0, 1))
    return Surface(color, np.clip(p.finish + 0.05 * thin + 0.03 * clouds, 0.03, 1), np.zeros_like(thin), p.metres)


def _line(distance: Map, width: float) -> Map:
    """1 on a line, half of it `width` away."""
    x = distance / np.float32(width)
    return 1 / (1 + x * x)


STONES: tuple[tuple[Color, Color, Color], ...] = (
    (_Marble.color, _Marble.cloud, _Marble.vein),
    ((0.68, 0.60, 0.48), (0.56, 0.46, 0.34), (0.36, 0.21, 0.11)),
    ((0.035, 0.035, 0.038), (0.075, 0.075, 0.08), (0.55, 0.54, 0.50)),
    ((0.07, 0.13, 0.095), (0.12, 0.22, 0.16), (0.48, 0.52, 0.46)),
    ((0.44, 0.17, 0.12), (0.33, 0.11, 0.08), (0.62, 0.55, 0.50)),
    ((0.42, 0.43, 0.45), (0.30, 0.31, 0.33), (0.68, 0.68, 0.67)),
)


def _draw(rng: np.random.Generator) -> _Marble:
    """White, cream, black, green, red or grey."""
    color, cloud, vein = STONES[int(rng.choice(len(STONES), p=(0.35, 0.2, 0.15, 0.1, 0.1, 0.1)))]
    light = float(rng.uniform(0.85, 1.08))
    return _Marble(
        color=times(color, light),
        cloud=times(cloud, light),
        vein=vein,
        veins=float(rng.uniform(0.3, 1.0)),
        finish=float(rng.uniform(0.05, 0.3)),
        metres=float(rng.uniform(0.8, 2.0)),
        seed=int(rng.integers(2**31)),
    )


MATERIAL = MaterialSpec(word="marble", surface=_marble, draw=_draw)
