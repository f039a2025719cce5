"""A panel of wood, glued of boards, its grain along u: tables, chairs, doors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere.materials.shared.courses import courses, even
from viewsphere.materials.shared.surface import Surface
from viewsphere.materials.shared.timber import OAK, Timber, draw_timber, grain
from viewsphere.materials.shared.tones import colored, shaded
from viewsphere.plugins.material import MaterialSpec


@dataclass(frozen=True)
class _Wood:
    """`boards` over `metres`, a kind of timber, and the roughness of its finish; contrast: the difference between boards."""

    timber: Timber = OAK
    boards: int = 6
    contrast: float = 0.15
    finish: float = 0.45
    metres: float = 0.6
    seed: int = 0


def _wood(parameters: _Wood | None = None, size: int = 512) -> Surface:
    """The panel; boards have no ends, so that it repeats along the grain."""
    p = parameters or _Wood()
    rng = np.random.default_rng(p.seed)
    boards = courses(size, p.metres, even(p.boards), np.zeros((p.boards, 1)))
    own = grain(size, p.metres, boards, p.timber, p.seed)
    tone = 1 + p.contrast * boards.each(2 * rng.random(boards.count) - 1)
    color = colored(own.late, (0.0, p.timber.early), (1.0, p.timber.late))
    dark = tone * (1 - 0.45 * own.pores)
    rough = p.finish + 0.12 * own.late + 0.2 * own.pores
    return Surface(shaded(color, dark), np.clip(rough, 0.05, 1), -0.00012 * own.late - 0.0003 * own.pores, p.metres)


def _draw(rng: np.random.Generator) -> _Wood:
    """Oak, pine, maple, walnut, ..., oiled to lacquered."""
    return _Wood(
        timber=draw_timber(rng),
        boards=int(rng.integers(3, 9)),
        contrast=float(rng.uniform(0.03, 0.25)),
        finish=float(rng.uniform(0.2, 0.7)),
        metres=float(rng.uniform(0.5, 0.8)),
        seed=int(rng.integers(2**31)),
    )


MATERIAL = MaterialSpec(word="wooden", surface=_wood, draw=_draw, grained=True)
