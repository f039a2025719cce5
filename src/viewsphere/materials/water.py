"""Water seen from above: waves of many lengths over a dark ground, as smooth as a mirror."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere.materials.shared.noise import noise, smooth, wave
from viewsphere.materials.shared.surface import Color, Map, Surface
from viewsphere.materials.shared.tones import mixed, shaded
from viewsphere.plugins.material import MaterialSpec


@dataclass(frozen=True)
class _Water:
    """Linear colours of deep water and of crests; metres from trough to crest, and how many of the longest waves there are over
    `metres`; foam: 0 to 1.
    """

    deep: Color = (0.022, 0.06, 0.075)
    crest: Color = (0.05, 0.13, 0.14)
    high: float = 0.10
    longest: int = 3
    foam: float = 0.0
    metres: float = 4.0
    seed: int = 0


def _water(parameters: _Water | None = None, size: int = 512) -> Surface:
    """The surface: sums of waves that run within a quarter turn of the wind, sharpened to crests, bent by noise."""
    p = parameters or _Water()
    sea = _sea(size, p)
    foamy = smooth(0.5, 0.9, sea + 0.5 * noise(size, 24, p.seed + 5, 5, 0.7) - 0.35 * (1 - p.foam)) * p.foam
    color = mixed(mixed(p.deep, p.crest, smooth(0.1, 1.0, sea)), (0.7, 0.72, 0.72), foamy)
    rough = 0.05 + 0.02 * sea + 0.6 * foamy
    return Surface(shaded(color, np.ones_like(sea)), np.clip(rough, 0.03, 1), p.high * sea, p.metres)


def _sea(size: int, p: _Water) -> Map:
    """Waves of about 0 to 1, each with a whole number of lengths across and down the square."""
    rng = np.random.default_rng(p.seed)
    at = (np.arange(size, dtype=np.float32) + 0.5) / size
    bend = noise(size, 2 * p.longest, p.seed, 4, 0.5), noise(size, 3 * p.longest, p.seed + 1, 4, 0.5)
    out, total, amplitude, count = np.zeros((size, size), np.float32), 0.0, 1.0, float(p.longest)
    for _ in range(10):
        if count > size / 6:
            break
        for across, phase in rng.random((2, 2)):
            x, y = round(count * (1.7 * across - 0.85)), round(count)
            turn = x * at[None] + y * at[:, None] + np.float32(phase) + np.float32(0.22 * amplitude + 0.1) * bend[0]
            crest = 1 - np.abs(wave(0.5 * turn + 0.2 * bend[1]))  # sharp above, round below
            out += np.float32(amplitude) * crest
            total += amplitude
        amplitude, count = amplitude * 0.66, count * 1.62
    return out / np.float32(total)


SEAS: tuple[Color, ...] = (_Water.deep, (0.02, 0.065, 0.05), (0.02, 0.04, 0.08), (0.06, 0.055, 0.035))


def _draw(rng: np.random.Generator) -> _Water:
    """Ponds to a choppy sea, blue, green or brown."""
    deep = SEAS[int(rng.choice(len(SEAS), p=(0.4, 0.3, 0.2, 0.1)))]
    metres = float(rng.uniform(2.0, 6.0))
    r, g, b = deep
    return _Water(
        deep=deep,
        crest=(2.0 * r, 2.0 * g, 1.8 * b),
        high=metres * float(rng.uniform(0.008, 0.03)),
        longest=int(rng.integers(2, 5)),
        foam=float(rng.choice((0.0, 0.0, rng.uniform(0.1, 0.6)))),
        metres=metres,
        seed=int(rng.integers(2**31)),
    )


MATERIAL = MaterialSpec(word="watery", surface=_water, draw=_draw)
