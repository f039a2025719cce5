"""Walls of rooms with skirting boards; windows, doors and their fittings on the wall y = 0 that faces -Y, a hole's foot at
z = 0, its middle at x = 0.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from viewsphere.assets.mesh import Material
from viewsphere_zoo.indoors.plan import SIDES, Opening, Room, Side
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.sheets import sheet
from viewsphere_zoo.shapes.solids import Float, Solid, flipped, join, lathe, moved, rounded_box, tube, turned
from viewsphere_zoo.townscape import masonry
from viewsphere_zoo.townscape.surfaces import cuboid

SKIRTING = (0.014, 0.085)
"""Thickness and height of skirting boards, metres."""

TRIM = 0.075
"""Width of the boards around a door."""


@dataclass(frozen=True)
class Joinery:
    """Materials of windows and doors; `curtain` None for none."""

    frame: Material
    door: Material
    handle: Material
    sill: Material
    radiator: Material
    curtain: Material | None


def window(o: Opening, j: Joinery, deep: float, rng: np.random.Generator) -> list[Piece]:
    """Frame, sill, radiator and curtains; `deep`: the wall's thickness. There is no pane, so the outside is seen directly."""
    w, h = o.width, o.height
    near, far = 0.5 * deep, 0.5 * deep + 0.07
    casements = max(1, round(w / 0.9))
    bars = _border(0.0, w, h, 0.055, near, far)
    for k in range(casements):
        middle = (k + 0.5) * w / casements - w / 2
        bars += _border(middle, w / casements - 0.005, h - 0.06, 0.05, near - 0.018, far - 0.02, 0.03)
    handle = cuboid((-0.008, near - 0.06, 0.45 * h), (0.008, near - 0.018, 0.45 * h + 0.1))
    pieces = [
        Piece("window_frame", j.frame, join(*bars)),
        Piece("window_handle", j.handle, moved(handle, (0.035 if casements > 1 else w / 2 - 0.04, 0, 0))),
        Piece("sill", j.sill, cuboid((-w / 2 - 0.04, -0.05, -0.03), (w / 2 + 0.04, near, 0.004))),
    ]
    if o.foot > 0.55:
        pieces.append(Piece("radiator", j.radiator, moved(_radiator(min(w, 1.6), o.foot - 0.24), (0, 0, -o.foot))))
    if j.curtain is not None:
        pieces += _curtains(o, j.curtain, j.handle, rng)
    return pieces


def _border(x: float, w: float, h: float, thick: float, near: float, far: float, foot: float = 0.0) -> list[Solid]:
    """Four bars along the inside of a w x h rectangle."""
    a, b = x - w / 2, x + w / 2
    return [
        cuboid((a, near, foot), (b, far, foot + thick)),
        cuboid((a, near, foot + h - thick), (b, far, foot + h)),
        cuboid((a, near, foot + thick), (a + thick, far, foot + h - thick)),
        cuboid((b - thick, near, foot + thick), (b, far, foot + h - thick)),
    ]


def _radiator(width: float, height: float) -> Solid:
    """A panel radiator with its fins, its foot 0.12 m above the floor."""
    fins = np.arange(-width / 2 + 0.03, width / 2 - 0.02, 0.066)
    ribs = [cuboid((x, -0.092, 0.15), (x + 0.03, -0.086, 0.12 + height - 0.03)) for x in fins]
    panel = moved(rounded_box((width, 0.055, height), 0.006, 1), (0, -0.06, 0.12 + height / 2))
    pipe = tube([(width / 2 - 0.03, -0.05, 0.14), (width / 2 - 0.03, -0.05, 0.0)], 0.008, 6)
    valve = moved(turned(lathe([(0, 0), (0.022, 0), (0.022, 0.06), (0, 0.065)], 10), 1, np.pi / 2), (width / 2, -0.05, 0.17))
    return join(panel, *ribs, pipe, valve)


def _curtains(o: Opening, cloth: Material, rod: Material, rng: np.random.Generator) -> list[Piece]:
    """Two drapes that hang in folds from a rod, drawn aside."""
    top = o.height + float(rng.uniform(0.08, 0.16))
    foot = -o.foot + 0.03 if rng.random() < 0.7 else -0.15
    reach = o.width / 2 + 0.3
    drapes = [_drape(s, reach, float(rng.uniform(0.32, 0.5)), foot, top - 0.02, rng) for s in (-1, 1)]
    knobs = [moved(rounded_box((0.05, 0.05, 0.05), 0.02, 2), (s * (reach + 0.03), -0.13, top)) for s in (-1, 1)]
    bar = tube([(-reach, -0.13, top), (reach, -0.13, top)], 0.012, 8)
    hooks = [cuboid((s * reach - 0.01, -0.13, top - 0.01), (s * reach + 0.01, 0.0, top + 0.01)) for s in (-0.9, 0.9)]
    return [Piece("curtain", cloth, join(*drapes)), Piece("curtain_rod", rod, join(bar, *knobs, *hooks))]


def _drape(side: int, reach: float, width: float, foot: float, top: float, rng: np.random.Generator) -> Solid:
    t = np.linspace(0, 1, 41)
    z = np.linspace(foot, top, 6)
    phase, folds = float(rng.uniform(0, 6)), int(rng.integers(5, 8))
    wave = 0.03 * np.sin(2 * np.pi * folds * t + phase) + 0.008 * np.sin(2 * np.pi * (folds + 2) * t)
    spread = np.linspace(1.0, 0.9, len(z))[:, None]
    x = side * (reach - width * spread * (1 - t)[None, :]) if side > 0 else side * (reach - width * spread * t[None, :])
    y = np.broadcast_to(-0.12 + wave, x.shape)
    return sheet(np.stack([x, y, np.broadcast_to(z[:, None], x.shape)], axis=-1)[::-1], 0.006)


def door(o: Opening, j: Joinery, is_open: bool) -> list[Piece]:
    """Leaf, handle and the boards around them; an open leaf hangs in the room."""
    w, h = o.width, o.height
    trim = [
        cuboid((-w / 2 - TRIM, -0.016, 0), (-w / 2, 0.0, h + TRIM)),
        cuboid((w / 2, -0.016, 0), (w / 2 + TRIM, 0.0, h + TRIM)),
        cuboid((-w / 2, -0.016, h), (w / 2, 0.0, h + TRIM)),
    ]
    swing = -o.hinge * math.radians(o.ajar_deg) if is_open else 0.0
    hinge = (o.hinge * w / 2, -0.016 if is_open else 0.01, 0.0)
    leaf, knobs = _leaf(w, h, o.hinge)
    return [
        Piece("door_frame", j.frame, join(*trim)),
        Piece("door", j.door, moved(turned(leaf, 2, swing), hinge)),
        Piece("door_handle", j.handle, moved(turned(knobs, 2, swing), hinge)),
    ]


def trimmed(o: Opening, j: Joinery) -> list[Piece]:
    """Only the boards around a hole, for the room that the door does not open into."""
    return [piece for piece in door(o, j, False) if piece.part == "door_frame"]


def _leaf(w: float, h: float, hinge: int) -> tuple[Solid, Solid]:
    """A shut leaf with its panels, and its handles, the hinge at the origin."""
    a, b = sorted((0.0, -hinge * w))
    body = [cuboid((a, 0.0, 0.006), (b, 0.04, h - 0.004))]
    for low, high in ((0.12, 0.42), (0.5, 0.93)):
        for y in (-0.008, 0.04):
            body.append(cuboid((a + 0.14 * w, y, low * h), (b - 0.14 * w, y + 0.008, high * h)))
    x = -hinge * (w - 0.06)
    bars: list[Solid] = []
    for y, s in ((0.0, -1), (0.04, 1)):
        bars.append(tube([(x, y, 1.03), (x, y + s * 0.045, 1.03), (x + hinge * 0.12, y + s * 0.05, 1.03)], 0.009, 8))
        bars.append(cuboid((x - 0.02, min(y, y + s * 0.006), 0.92), (x + 0.02, max(y, y + s * 0.006), 1.12)))
    return join(*body), join(*bars)


def on_side(solid: Solid, room: Room, side: Side, outwards: bool = False) -> Solid:
    """Return a solid moved to this side of the room; it faces the room, or outwards.
    It was built on the wall y = 0 that faces -Y, its middle at x = 0.
    """
    quarter = SIDES.index(side) + 2 * outwards
    return moved(turned(solid, 2, -quarter * math.pi / 2), (*room.middle(side), 0.0))


def placed(pieces: Sequence[Piece], room: Room, side: Side) -> list[Piece]:
    """Pieces brought to a side of the room, as `on_side` does."""
    return [Piece(piece.part, piece.material, on_side(piece.solid, room, side)) for piece in pieces]


def wall(length: float, height: float, openings: Sequence[Opening], reveal: float) -> Solid:
    """A wall with its holes; `reveal` is how deep the holes are lined."""
    holes = [masonry.Opening(o.x, o.foot, o.width, o.height) for o in openings]
    return masonry.facade(length, height, holes, reveal=reveal)


def skirting(length: float, openings: Sequence[Opening], trim: float) -> Solid:
    """Boards along the wall's foot, interrupted at doors and their trim."""
    out, high = SKIRTING
    doors = sorted((o.span[0] - trim, o.span[1] + trim) for o in openings if o.foot <= 0)
    ends = [-length / 2, *(edge for span in doors for edge in span), length / 2]
    pairs = zip(ends[::2], ends[1::2], strict=True)
    return join(*(cuboid((a, -out, 0.0), (b, 0.0, high)) for a, b in pairs if b - a > 1e-3))


def level(low: Sequence[float], high: Sequence[float], z: float, faces_up: bool = True) -> Solid:
    """A level rectangle that faces up or down."""
    corners: Float = np.array(
        [(low[0], low[1], z), (high[0], low[1], z), (high[0], high[1], z), (low[0], high[1], z)], np.float64
    )
    solid = Solid(corners, np.array([(0, 1, 2), (0, 2, 3)]))
    return solid if faces_up else flipped(solid)
