"""Ceramic tiles with joints, glazed or matt."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere.materials.shared.courses import bonded, courses, even
from viewsphere.materials.shared.noise import noise, smooth
from viewsphere.materials.shared.surface import Color, Surface
from viewsphere.materials.shared.tones import mixed, shaded
from viewsphere.plugins.material import MaterialSpec


@dataclass(frozen=True)
class _Tile:
    """`columns` by `rows` tiles over `metres`, linear colours of two kinds of them and of the joints, metres of a joint.

    board: the second kind at every other place, as on a chessboard; gloss: how smooth the glaze is.
    """

    color: Color = (0.68, 0.67, 0.63)
    other: Color = (0.68, 0.67, 0.63)
    grout: Color = (0.34, 0.33, 0.31)
    columns: int = 4
    rows: int = 4
    joint: float = 0.004
    shift: float = 0.0
    board: bool = False
    spread: float = 0.06
    clouds: float = 0.1
    gloss: float = 0.8
    metres: float = 1.2
    seed: int = 0


def _tile(parameters: _Tile | None = None, size: int = 512) -> Surface:
    """The tiles, each a little tilted, with rounded edges; dirt lies in the joints."""
    p = parameters or _Tile()
    rng = np.random.default_rng(p.seed)
    floor = courses(size, p.metres, even(p.rows), bonded(p.rows, p.columns, p.shift))
    draws = 2 * rng.random((4, floor.count)) - 1
    clouds = noise(size, max(round(4 * p.metres), 2), p.seed + 1, 6, 0.55)
    grit = noise(size, max(round(150 * p.metres), 2), p.seed + 2, 2, 0.7)
    joint = max(min(p.joint, 0.08 * float(floor.width.min())), 1.2 * p.metres / size)  # as wide as a texel at least
    glaze = smooth(0.35 * joint, 0.75 * joint, floor.edge)
    row, column = np.divmod(np.arange(floor.count), p.columns)
    kind = floor.each(((row + column) % 2 if p.board else np.zeros(floor.count)).astype(np.float64))
    shade = 1 + p.spread * floor.each(draws[0]) + p.clouds * (clouds + 0.4 * floor.each(draws[1])) + 0.02 * grit
    dirt = 1 + 0.25 * clouds + 0.2 * grit
    color = mixed(shaded(p.grout, dirt), shaded(mixed(p.color, p.other, kind), shade), glaze)
    rough = 0.92 + (0.08 - 0.85 * p.gloss) * glaze + 0.06 * clouds * glaze
    tilt = 0.004 * (
        (floor.across - 0.5 * floor.length) * floor.each(draws[2]) + (floor.down - 0.5 * floor.width) * floor.each(draws[3])
    )
    round_ = smooth(0.2 * joint, 0.5 * joint + 0.04 * float(floor.width.min()), floor.edge)
    return Surface(color, np.clip(rough, 0.05, 1), 0.0018 * round_ + tilt + 0.0001 * (1 - p.gloss) * grit, p.metres)


PLAIN: tuple[Color, ...] = (
    (0.72, 0.72, 0.70), (0.66, 0.62, 0.54), (0.40, 0.40, 0.39), (0.09, 0.09, 0.095), (0.44, 0.20, 0.11), (0.14, 0.27, 0.36),
    (0.20, 0.36, 0.27), (0.55, 0.48, 0.36),
)  # fmt: skip
SHAPES = ((4, 4, 1.2, 0.0), (8, 8, 1.2, 0.0), (6, 6, 0.6, 0.0), (2, 2, 1.2, 0.0), (6, 12, 0.9, 0.5), (10, 10, 0.25, 0.0))


def _draw(rng: np.random.Generator) -> _Tile:
    """Floor tiles, wall tiles, mosaic; of one colour, or two as on a chessboard."""
    columns, rows, metres, shift = SHAPES[int(rng.integers(len(SHAPES)))]
    color, other = (PLAIN[int(i)] for i in rng.integers(len(PLAIN), size=2))
    grout = float(rng.choice((0.06, 0.3, 0.5)))
    return _Tile(
        color=color,
        other=other,
        grout=(grout, 0.97 * grout, 0.92 * grout),
        columns=columns,
        rows=rows,
        joint=float(rng.uniform(0.002, 0.006)),
        shift=shift,
        board=bool(rng.random() < 0.25 and shift == 0),
        spread=float(rng.uniform(0.01, 0.1)),
        clouds=float(rng.uniform(0.0, 0.3)),
        gloss=float(rng.choice((rng.uniform(0.3, 0.7), rng.uniform(0.85, 1.0)))),
        metres=metres,
        seed=int(rng.integers(2**31)),
    )


MATERIAL = MaterialSpec(word="tiled", surface=_tile, draw=_draw)
