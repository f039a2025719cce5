"""Sand: ripples of the wind, grains, small stones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere.materials.shared.noise import cells, noise, smooth, wave
from viewsphere.materials.shared.surface import Color, Surface
from viewsphere.materials.shared.tones import mixed, shaded, times
from viewsphere.plugins.material import MaterialSpec


@dataclass(frozen=True)
class _Sand:
    """Linear colour; number of `ripples` over `metres`, and their height in metres; pebbles: their amount, 0 to 1."""

    color: Color = (0.45, 0.335, 0.195)
    ripples: int = 13
    high: float = 0.009
    pebbles: float = 0.2
    metres: float = 1.6
    seed: int = 0


def _sand(parameters: _Sand | None = None, size: int = 512) -> Surface:
    """The ground: ripples are gentle to windward and steep to lee, and end and fork as they run."""
    p = parameters or _Sand()
    bend = noise(size, 3, p.seed, 4, 0.42)
    calm = noise(size, 2, p.seed + 1, 3)
    grains = noise(size, max(round(p.metres / 0.005), 2), p.seed + 2, 2, 0.8)
    lumps = noise(size, max(round(12 * p.metres), 2), p.seed + 3, 4, 0.6)
    at = (np.arange(size, dtype=np.float32) + 0.5)[:, None] / size * p.ripples
    turn = at + 2.2 * bend + 0.15 * lumps
    ripple = 0.5 + 0.5 * wave(turn + 0.09 * wave(turn))
    strength = smooth(-0.45, 0.25, calm + 0.25)
    stones = cells(size, max(round(26 * p.metres), 2), p.seed + 4)
    stone = smooth(0.24, 0.1, stones.nearest) * (stones.chance < 0.25 * p.pebbles)
    trough = strength * (1 - ripple) if p.high else np.zeros_like(ripple)
    shade = 1 + 0.22 * grains - 0.16 * trough + 0.10 * lumps + 0.08 * calm
    color = mixed(shaded(p.color, shade), times(p.color, 0.55), 0.8 * stone * (0.4 + (stones.chance * 29) % 1.0))
    height = p.high * strength * ripple + 0.0012 * grains + 0.004 * lumps + 0.004 * stone
    return Surface(shaded(color, np.ones_like(shade)), np.full_like(shade, 0.95), height.astype(np.float32), p.metres)


SANDS: tuple[Color, ...] = (_Sand.color, (0.60, 0.53, 0.40), (0.42, 0.24, 0.11), (0.26, 0.22, 0.17), (0.50, 0.47, 0.42))


def _draw(rng: np.random.Generator) -> _Sand:
    """Of beaches, deserts and building sites; rippled or trodden flat."""
    metres = float(rng.uniform(1.2, 2.0))
    return _Sand(
        color=times(SANDS[int(rng.integers(len(SANDS)))], float(rng.uniform(0.8, 1.15))),
        ripples=round(metres / float(rng.uniform(0.08, 0.18))),
        high=float(rng.choice((0.0, rng.uniform(0.004, 0.012)))),
        pebbles=float(rng.choice((0.0, rng.uniform(0.1, 1.0)))),
        metres=metres,
        seed=int(rng.integers(2**31)),
    )


MATERIAL = MaterialSpec(word="sandy", surface=_sand, draw=_draw)
