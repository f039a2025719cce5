"""Bare metal: brushed, cast or scratched, here and there dull."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere.materials.shared.noise import noise, smooth
from viewsphere.materials.shared.surface import Color, Surface
from viewsphere.plugins.material import MaterialSpec


@dataclass(frozen=True)
class _Metal:
    """Linear colour of reflections; roughness; strength of brushing, dents and tarnish, 0 to 1."""

    color: Color = (0.56, 0.57, 0.58)
    finish: float = 0.3
    brushed: float = 0.7
    dents: float = 0.1
    tarnish: float = 0.25
    metres: float = 0.4
    seed: int = 0


def _metal(parameters: _Metal | None = None, size: int = 512) -> Surface:
    """The sheet, brushed along u."""
    p = parameters or _Metal()
    lines = noise(size, (2, 125), p.seed, 2, 0.8) + 0.5 * noise(size, (7, 170), p.seed + 1)
    blots = noise(size, 3, p.seed + 2, 6, 0.6)
    bumps = noise(size, 9, p.seed + 3, 3, 0.5)
    fine = noise(size, 170, p.seed + 4)
    dull = p.tarnish * smooth(0.0, 0.6, blots)
    shade = 1 + 0.12 * p.brushed * lines - 0.45 * dull + 0.04 * blots
    color = np.clip(np.array(p.color, np.float32) * shade[..., None], 0.02, 1)
    rough = p.finish + 0.12 * p.brushed * lines + 0.35 * dull + 0.05 * blots + 0.03 * fine
    height = 0.00001 * p.brushed * lines + 0.0015 * p.dents * bumps + 0.000004 * fine
    return Surface(color, np.clip(rough, 0.06, 1), height.astype(np.float32), p.metres, metallic=1.0)


METALS: tuple[Color, ...] = (
    _Metal.color, (0.91, 0.92, 0.92), (0.95, 0.93, 0.88), (0.955, 0.638, 0.538), (1.0, 0.766, 0.336), (0.55, 0.556, 0.554),
    (0.91, 0.78, 0.42), (0.26, 0.255, 0.25),
)  # fmt: skip


def _draw(rng: np.random.Generator) -> _Metal:
    """Steel, aluminium, silver, copper, gold, chrome, brass, iron (reflectances: Hoffman, SIGGRAPH 2010), polished to dull."""
    r, g, b = METALS[int(rng.integers(len(METALS)))]
    light = float(rng.uniform(0.7, 1.0))
    return _Metal(
        color=(r * light, g * light, b * light),
        finish=float(rng.uniform(0.12, 0.55)),
        brushed=float(rng.choice((0.1, rng.uniform(0.4, 1.0)))),
        dents=float(rng.choice((0.0, rng.uniform(0.0, 0.6)))),
        tarnish=float(rng.uniform(0.0, 0.8)),
        metres=float(rng.uniform(0.3, 0.6)),
        seed=int(rng.integers(2**31)),
    )


MATERIAL = MaterialSpec(word="metal", surface=_metal, draw=_draw, grained=True)
