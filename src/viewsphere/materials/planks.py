"""A floor of boards, end to end, their grain along u: parquet, decking."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere.materials.shared.courses import courses, even, uneven
from viewsphere.materials.shared.noise import noise, smooth
from viewsphere.materials.shared.surface import Surface
from viewsphere.materials.shared.timber import OAK, Timber, draw_timber, grain
from viewsphere.materials.shared.tones import colored, shaded
from viewsphere.plugins.material import MaterialSpec


@dataclass(frozen=True)
class _Planks:
    """`rows` of planks over `metres`, `columns` in each, and the `joint` between them, metres; contrast: the difference between
    planks; finish: the roughness of the varnish.
    """

    timber: Timber = OAK
    rows: int = 12
    columns: int = 2
    joint: float = 0.002
    contrast: float = 0.3
    finish: float = 0.35
    metres: float = 1.8
    seed: int = 0


def _planks(parameters: _Planks | None = None, size: int = 512) -> Surface:
    """The floor: each plank is cut from another place, has rounded edges, and lies a little higher or lower."""
    p = parameters or _Planks()
    rng = np.random.default_rng(p.seed)
    floor = courses(size, p.metres, even(p.rows), uneven(rng, p.rows, p.columns, 0.5))
    own = grain(size, p.metres, floor, p.timber, p.seed)
    draws = rng.random((3, floor.count))
    joint = max(p.joint, 0.8 * p.metres / size)
    gap = smooth(0.9 * joint, 0.25 * joint, floor.edge)
    bevel = smooth(0.0, 0.004, floor.edge)
    wear = noise(size, max(round(2 * p.metres), 2), p.seed + 9, 4)
    late = own.late + 0.5 * p.contrast * (floor.each(draws[0]) - 0.5)
    tone = 1 + p.contrast * (floor.each(draws[1]) - 0.5) + 0.06 * wear
    color = colored(late, (0.0, p.timber.early), (1.0, p.timber.late))
    color = shaded(color, tone * (1 - 0.4 * own.pores) * (1 - 0.8 * gap) * (0.85 + 0.15 * bevel))
    rough = p.finish + 0.1 * own.late + 0.15 * own.pores + 0.1 * wear + 0.4 * gap
    height = 0.0008 * bevel - 0.002 * gap - 0.0001 * own.late - 0.0002 * own.pores + 0.0003 * floor.each(draws[2])
    return Surface(color, np.clip(rough, 0.05, 1), height, p.metres)


def _draw(rng: np.random.Generator) -> _Planks:
    """Strips of a few centimetres to broad boards."""
    metres = float(rng.uniform(1.6, 2.2))
    return _Planks(
        timber=draw_timber(rng),
        rows=round(metres / float(rng.uniform(0.07, 0.2))),
        columns=int(rng.integers(1, 4)),
        joint=float(rng.uniform(0.0005, 0.004)),
        contrast=float(rng.uniform(0.1, 0.6)),
        finish=float(rng.uniform(0.15, 0.7)),
        metres=metres,
        seed=int(rng.integers(2**31)),
    )


MATERIAL = MaterialSpec(word="wooden", surface=_planks, draw=_draw, grained=True)
