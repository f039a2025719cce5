"""Sails: curved cloth between a luff and a leech, with seams, battens, colours and a number."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from viewsphere.assets.mesh import Material
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.cut import cut
from viewsphere_zoo.shapes.paint import Color, linear
from viewsphere_zoo.shapes.panels import in_quad, raised
from viewsphere_zoo.shapes.sheets import sheet
from viewsphere_zoo.shapes.solids import Float, Solid, flipped, join

CLOTH = 0.006
"""Thickness of a sail, metres."""

Pattern = Literal["plain", "head", "foot", "bands", "stripe"]
Point = ArrayLike


@dataclass(frozen=True, eq=False)
class Sail:
    """Cloth between four corners (3,): tack and throat end the luff, clew and peak the leech.

    lee: 1 when the wind blows it to port (+X), -1 to starboard; draft: depth of its belly over the chord; roach: how far
    the leech bulges (negative: hollow), twist: how far it falls to leeward half way up, in lengths of the foot.
    """

    tack: Float
    throat: Float
    clew: Float
    peak: Float
    lee: float
    draft: float = 0.1
    roach: float = 0.1
    twist: float = 0.06

    def surface(self, s: ArrayLike, h: ArrayLike) -> Float:
        """Points (..., 3) at s from 0 (luff) to 1 (leech) and h from 0 (foot) to 1 (head)."""
        s, h = np.broadcast_arrays(np.asarray(s, np.float64), np.asarray(h, np.float64))
        one, high = s[..., None], h[..., None]
        luff = self.tack + (self.throat - self.tack) * high
        leech = self.clew + (self.peak - self.clew) * high
        foot = float(np.linalg.norm(self.clew - self.tack))
        along, off = self._directions(self.clew - self.tack)
        swell = np.sin(np.pi * high**0.9)
        leech = leech + foot * swell * (self.roach * along + self.twist * off)
        chord = leech - luff
        belly = 2.6 * one**0.8 * (1 - one) * self.draft * (0.4 + 0.6 * np.clip(high / 0.25, 0, 1) ** 0.7)
        out = np.stack([chord[..., 1], -chord[..., 0], 0 * chord[..., 0]], axis=-1) * self.lee
        return luff + chord * one + out * belly

    def _directions(self, chord: Float) -> tuple[Float, Float]:
        """Level unit vectors along a chord and to leeward of it."""
        along = np.array([chord[0], chord[1], 0.0]) / np.hypot(chord[0], chord[1])
        return along, self.lee * np.array([along[1], -along[0], 0.0])

    def cloth(self, columns: int = 20, rows: int = 40) -> Solid:
        """The whole sail, closed."""
        s, h = np.linspace(0, 1, columns + 1)[:, None], np.linspace(0, 1, rows + 1)
        return sheet(self.surface(s, h), CLOTH)

    def strip(self, across: tuple[float, float], up: tuple[float, float], more: float, columns: int = 20) -> Solid:
        """A rectangle of (s, h) that stands `more` proud of both sides."""
        s = np.linspace(*across, columns + 1)[:, None]
        return sheet(self.surface(s, np.linspace(*up, 3)), CLOTH + 2 * more)

    def patch(self, at: tuple[float, float], corners: ArrayLike, side: float) -> Solid:
        """A quad of metres (towards the reader's right, up) around (s, h), glued on to the side that faces side X."""
        quad = np.asarray(corners, np.float64) * (side, 1.0)
        steps = np.linspace(0, 1, 4)
        cells = in_quad(quad, np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1))
        wide = float(np.linalg.norm(self.surface(1.0, at[1]) - self.surface(0.0, at[1])))
        uv = np.stack(
            [at[0] + cells[..., 0] / wide, at[1] + cells[..., 1] / float(np.linalg.norm(self.throat - self.tack))], axis=-1
        )
        solid = sheet(raised(self.surface, uv, side * (CLOTH / 2 + 0.001)), 0.003)
        return solid if side > 0 else flipped(solid)


@dataclass(frozen=True)
class Cut:
    """The look of sails: colours, pattern, seams, the number and the sign above it."""

    color: Color = (0.95, 0.94, 0.9)
    second: Color = (0.75, 0.1, 0.12)
    pattern: Pattern = "plain"
    number: int = 153
    sign: Literal["diamond", "bars", "wave", "none"] = "diamond"
    battens: int = 4


def dressed(sail: Sail, part: str, look: Cut, main: bool) -> list[Piece]:
    """The sail's pieces: cloth in its colours, seams, and for a main battens, number and sign."""
    cloth, second = (
        Material("sail", linear(look.color), roughness=0.85),
        Material("sail_color", linear(look.second), roughness=0.85),
    )
    low, high = float(sail.surface(0.5, 0.0)[2]), float(max(sail.throat[2], sail.peak[2]))
    pieces: list[Piece] = []
    rest, paint = sail.cloth(), cloth
    for share, after in _bands(look.pattern):
        lower, rest = cut(rest, rest.vertices[:, 2] - low - share * (high - low))
        if len(lower.triangles):
            pieces.append(Piece(part, paint, lower))
        paint = second if after else cloth
    pieces.append(Piece(part, paint, rest))
    shade = tuple(0.82 * k for k in look.color)
    seam = Material("sail_seam", linear((shade[0], shade[1], shade[2])), roughness=0.9)
    tall = float(np.linalg.norm(sail.throat - sail.tack))
    edge = 0.014 / tall
    seams = [sail.strip((0.002, 0.998), (h - edge, h + edge), 0.0015) for h in np.arange(0.12, 0.93, 0.9 / tall).tolist()]
    seams += [sail.strip((0.0, 0.03), (0.004, 0.99), 0.002, 3), sail.strip((0.975, 0.999), (0.004, 0.99), 0.002, 3)]
    pieces.append(Piece(part, seam, join(*seams)))
    if main:
        ink = Material("sail_ink", linear((0.1, 0.14, 0.3) if sum(look.color) > 1.5 else (0.93, 0.92, 0.88)), roughness=0.85)
        marks: list[Solid] = []
        for side in (1.0, -1.0):
            marks += [*_digits(sail, look.number, (0.46, 0.55), side), *_sign(sail, look.sign, (0.4, 0.69), side)]
        pieces.append(Piece("sail_number", ink, join(*marks)))
        if look.battens:
            places = np.linspace(0.2, 0.86, look.battens).tolist()
            wide = 0.018 / tall
            battens = [sail.strip((0.45 if h < 0.7 else 0.1, 1.012), (h - wide, h + wide), 0.005, 12) for h in places]
            pieces.append(Piece("batten", seam, join(*battens)))
    return pieces


def _bands(pattern: Pattern) -> Sequence[tuple[float, bool]]:
    """Borders between colours: heights (fractions), and whether the second colour begins there."""
    return {
        "plain": (),
        "head": ((0.66, True),),
        "foot": ((0.0, True), (0.2, False)),
        "bands": ((0.3, True), (0.4, False), (0.5, True), (0.6, False), (0.7, True), (0.8, False)),
        "stripe": ((0.42, True), (0.5, False)),
    }[pattern]


_SEGMENTS = ("abcdef", "bc", "abged", "abgcd", "fgbc", "afgcd", "afgedc", "abc", "abcdefg", "abcdfg")


def _digits(sail: Sail, number: int, at: tuple[float, float], side: float) -> list[Solid]:
    """Block figures."""
    size = 0.021 * float(np.linalg.norm(sail.throat - sail.tack)) + 0.05
    w, t = 0.5 * size, 0.16 * size
    bars = {
        "a": (-w, w, size - t, size),
        "g": (-w, w, -t / 2, t / 2),
        "d": (-w, w, -size, t - size),
        "f": (-w, t - w, 0, size),
        "b": (w - t, w, 0, size),
        "e": (-w, t - w, -size, 0),
        "c": (w - t, w, -size, 0),
    }
    solids: list[Solid] = []
    text = str(number)
    for k, digit in enumerate(text):
        x = (k - (len(text) - 1) / 2) * 2.9 * w
        for name in _SEGMENTS[int(digit)]:
            a, b, c, d = bars[name]
            solids.append(sail.patch(at, [(x + a, c), (x + b, c), (x + b, d), (x + a, d)], side))
    return solids


def _sign(sail: Sail, sign: str, at: tuple[float, float], side: float) -> list[Solid]:
    """The class's sign."""
    r = 0.022 * float(np.linalg.norm(sail.throat - sail.tack)) + 0.06
    quads = {
        "diamond": [[(0, -1.4), (0.9, 0), (0, 1.4), (-0.9, 0)]],
        "bars": [[(-1.2, z), (1.2, z), (1.2, z + 0.4), (-1.2, z + 0.4)] for z in (-1.0, 0.0, 1.0)],
        "wave": [[(-1.3, -0.3), (0, -1), (0, -0.3), (-1.3, 0.3)], [(0, -1), (1.3, 0.4), (1.3, 1), (0, -0.3)]],
        "none": [],
    }
    return [sail.patch(at, r * np.array(quad), side) for quad in quads[sign]]
