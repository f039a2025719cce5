"""Asphalt: crushed stone in bitumen, worn, patched, cracked."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere.materials.shared.noise import cells, noise, smooth
from viewsphere.materials.shared.surface import Color, Map, Surface
from viewsphere.materials.shared.tones import colored, mixed, shaded
from viewsphere.plugins.material import MaterialSpec


@dataclass(frozen=True)
class _Asphalt:
    """Linear colours of bitumen and of dark and light stones, size of the largest stones in metres; amounts of visible stone
    and of cracks.
    """

    bitumen: Color = (0.048, 0.048, 0.05)
    stones: tuple[Color, Color] = ((0.08, 0.08, 0.081), (0.25, 0.243, 0.23))
    stone: float = 0.011
    worn: float = 0.5
    cracks: float = 0.2
    metres: float = 2.4
    seed: int = 0


def _asphalt(parameters: _Asphalt | None = None, size: int = 512) -> Surface:
    """The road: angular stones of two sizes, each with a flat worn face, in finer grit."""
    p = parameters or _Asphalt()
    patches = noise(size, max(round(2 * p.metres), 2), p.seed, 6, 0.55)
    grit = noise(size, max(round(p.metres / 0.004), 2), p.seed + 1, 2, 0.8)
    coarse = cells(size, max(round(p.metres / p.stone), 2), p.seed + 2)
    fine = cells(size, max(round(1.9 * p.metres / p.stone), 2), p.seed + 3)
    large = smooth(0.10, 0.34, coarse.border) * (coarse.chance < 0.28 + 0.3 * p.worn + 0.3 * patches)
    small = smooth(0.08, 0.3, fine.border) * (fine.chance < 0.5)
    crack = _cracks(size, p, patches)
    bare = np.clip(p.worn + 0.3 * patches, 0.1, 1)
    own = np.where(large > small, (coarse.chance * 7.0) % 1.0, (fine.chance * 5.0) % 1.0).astype(np.float32)
    stones = colored(0.75 * own * own + 0.5 * own * bare, (0.0, p.stones[0]), (1.0, p.stones[1]))
    color = mixed(
        shaded(p.bitumen, 1 + 0.25 * patches + 0.5 * grit), stones, np.clip(np.maximum(large, 0.7 * small) * bare, 0, 1)
    )
    height = 0.0012 * large + 0.0007 * small + 0.0004 * grit - 0.004 * crack
    rough = 0.92 - 0.22 * large * bare + 0.05 * grit
    return Surface(shaded(color, (1 - 0.6 * crack) * (1 + 0.1 * patches)), np.clip(rough, 0.4, 1), height, p.metres)


def _cracks(size: int, p: _Asphalt, patches: Map) -> Map:
    """Thin lines, here and there."""
    line = np.abs(noise(size, 2, p.seed + 4, 7, 0.44) + 0.02)
    return smooth(0.012, 0.004, line) * smooth(
        0.75 - p.cracks, 1.0 - p.cracks, 0.5 + noise(size, 2, p.seed + 5, 2) + 0.2 * patches
    )


def _draw(rng: np.random.Generator) -> _Asphalt:
    """New and black to old and grey."""
    worn = float(rng.uniform(0.1, 0.95))
    light = 0.75 + 1.0 * worn * float(rng.uniform(0.6, 1.2))
    bitumen, dark, pale = 0.04 * light, 0.066 * light, 0.2 * light
    return _Asphalt(
        bitumen=(bitumen, bitumen, 1.05 * bitumen),
        stones=((dark, dark, dark), (pale, 0.97 * pale, 0.92 * pale)),
        stone=float(rng.uniform(0.008, 0.014)),
        worn=worn,
        cracks=float(rng.uniform(0.0, 0.4)),
        metres=float(rng.uniform(2.2, 3.0)),
        seed=int(rng.integers(2**31)),
    )


MATERIAL = MaterialSpec(word="asphalt", surface=_asphalt, draw=_draw)
