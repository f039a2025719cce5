"""Rowing boats: an open shell with ribs, thwarts, floorboards, rowlocks and oars."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import Color
from viewsphere_zoo.shapes.rods import aimed, rod
from viewsphere_zoo.shapes.sheets import bar, moulding, sheet
from viewsphere_zoo.shapes.solids import Float, Solid, both_sides, flipped, grid, join, moved, rounded_box, tube
from viewsphere_zoo.shipyard.coats import TEAK, Coats, coats
from viewsphere_zoo.shipyard.lines import Lines, Round, stations
from viewsphere_zoo.shipyard.shell import Paint, along, backbone, painted, pair, sheer_rail

SKIN = 0.018
"""Thickness of the planking, metres."""


@dataclass(frozen=True)
class RowingBoat:
    """Parameters of a rowing boat; lengths in metres, angles in degrees, colours sRGB 0..1.

    length, beam: of the shell; depth: from the keel to the sheer amidships; spring: how much higher bow and stern rise,
    fractions of the depth; planks: strakes of a clinker hull, 0 for a smooth one; thwarts: benches to sit on; oars: pairs;
    sweep: how far the oars trail aft of square, None if they are laid in the boat.
    """

    length: float = 4.0
    beam: float = 1.45
    depth: float = 0.52
    spring: tuple[float, float] = (0.5, 0.28)
    stern: Literal["transom", "pointed"] = "transom"
    planks: int = 7
    thwarts: int = 2
    oars: int = 1
    sweep: float | None = 38.0
    fullness: float = 0.5
    stem_rake: float = 0.07
    color: Color = (0.12, 0.3, 0.5)
    bottom: Color = (0.45, 0.13, 0.1)
    stripe: Color = (0.93, 0.92, 0.88)
    wood: Color = TEAK
    inside: Color | None = None
    blades: Color | None = None
    varnished: bool = False
    striped: bool = True


def rowing_lines(p: RowingBoat) -> Lines:
    """The hull's lines."""
    draft = 0.27 * p.depth
    low, bow, aft = p.depth - draft, p.depth * (1 + p.spring[0]) - draft, p.depth * (1 + p.spring[1]) - draft
    pointed = p.stern == "pointed"
    f = p.fullness
    middle = (0.6 + 0.22 * f, 0.0, 0.94 + 0.07 * f, 0.3)
    fore = (0.25, 0.14, 0.66 + 0.1 * f, 0.5)
    rake = p.stem_rake
    end = ((0, rake), (0.35, 0.45 * rake), (1, 0.0))
    return Lines(
        length=p.length,
        beam=p.beam,
        sheer=((0, bow), (0.25, low + 0.27 * (bow - low)), (0.55, low), (0.8, low + 0.25 * (aft - low)), (1, aft)),
        keel=(
            (0, -0.35 * draft),
            (0.2, -0.85 * draft),
            (0.5, -draft),
            (0.8, -0.9 * draft),
            (1, (-0.35 if pointed else -0.55) * draft),
        ),
        stem=end,
        stern=end if pointed else ((0, 0.045), (1, 0.0)),
        section=Round(fore, middle, fore if pointed else (0.5, 0.04, 0.9 + 0.06 * f, 0.36)),
        widest=0.5 if pointed else 0.54,
        entry=(2.0, 0.92),
        quarter=(2.0, 0.92) if pointed else (2.4, 1.0),
        tuck=0.0 if pointed else 0.6,
    )


def rowing_boat(p: RowingBoat) -> list[Piece]:
    """Return the pieces of a rowing boat in the ship's frame."""
    lines = rowing_lines(p)
    c = coats(
        p.color,
        p.bottom,
        p.stripe,
        p.stripe,
        p.color,
        p.wood,
        varnished=p.varnished,
        inside=p.inside or p.color,
        accent=p.blades or p.color,
    )
    paint = Paint(-0.25 * 0.27 * p.depth, 0.022 if p.striped else 0.0, None)
    pieces = [*_shell(p, lines, c, paint), *_frames(lines, c), *_benches(p, lines, c)]
    return pieces + _rowlocks_and_oars(p, lines, c)


def _shell(p: RowingBoat, lines: Lines, c: Coats, paint: Paint) -> list[Piece]:
    """Planking outside and inside, stem and keel, transom, gunwales."""
    t = stations(60)[:, None]
    inner = both_sides(flipped(grid(lines.raised(t, np.linspace(0, 1, 20), -SKIN))))
    pieces = [*painted(lines, both_sides(grid(_planking(p, lines, t))), c, paint), Piece("inside", c.inside, inner)]
    timber = bar(0.04, 0.075, (0.0, -0.012), 0.15)
    spine = backbone(lines, timber)
    edge = bar(SKIN + 0.05, 0.045, (-SKIN / 2, -0.008))
    pieces += [Piece("gunwale", c.wood, sheer_rail(lines, edge, 0.004, 0.998 if lines.tuck else 0.996))]
    if lines.tuck:
        pieces += painted(lines, spine, c, paint)
        return pieces + _transom_board(lines, c)
    stem = lines.point(1.0, np.linspace(0, 1, 16))
    head = stem[-1] + (stem[-1] - stem[-2]) / np.linalg.norm(stem[-1] - stem[-2]) * 0.04
    return pieces + painted(lines, join(spine, moulding(np.concatenate([stem, [head]]), timber, (1.0, 0, 0))), c, paint)


def _planking(p: RowingBoat, lines: Lines, t: Float) -> Float:
    """The outer skin; clinker planks stand off at their lower edges."""
    if not p.planks:
        return lines.point(t, np.linspace(0, 1, 22))
    v, off = [0.0], [0.0]
    edges = np.linspace(0, 1, p.planks + 1)
    lap, bevel = 0.015, 0.016
    for low, high in pairwise(edges.tolist()):
        share = np.linspace(0, 1, 4)
        v += (low + bevel + share * (high - low - bevel)).tolist()
        off += (lap * (1 - share)).tolist()
    ease = np.clip(np.minimum(t, 1 - t) / 0.03 if not lines.tuck else t / 0.03, 0, 1)
    return lines.raised(t, np.array(v[1:]), ease * np.array(off[1:]))


def _transom_board(lines: Lines, c: Coats) -> list[Piece]:
    """A board with an arched top, and its knees."""
    edge = lines.point(1.0, np.linspace(0.03, 1, 16))
    share = np.linspace(-1, 1, 15)
    points = np.repeat(edge[:, None], 15, axis=1)
    points[..., 0] *= share
    crown = points[-1].copy()
    crown[:, 2] += 0.012 + 0.07 * (1 - share**2) ** 0.8
    board = sheet(np.concatenate([points, crown[None]]), 0.034)
    at = lines.sheer_line(0.985)
    knee = moved(rounded_box((0.05, 0.2, 0.05), 0.012, 2), np.add(at, (-0.045, -0.09, -0.035)))
    return [Piece("transom", c.wood, board), *pair("knee", c.wood, knee)]


def _frames(lines: Lines, c: Coats) -> list[Piece]:
    """Ribs, floorboards on them, breasthook."""
    v = np.linspace(0.0, 0.97, 18)
    spots = np.arange(0.09, 0.95, 0.22 / lines.length)
    profile = bar(0.026, 0.022, (0.0, -0.005))
    ribs = [moulding(lines.raised(t, v, -SKIN), profile, (0, 1.0, 0)) for t in spots]
    floor = lines.raised(np.linspace(0.13, 0.9, 30)[:, None], np.linspace(0, 0.8, 60), -SKIN - 0.026)
    boards = [along(_plank(floor, 0.055 + 0.105 * k), bar(0.09, 0.012, (0.0, 0.0), 0.25)) for k in range(4)]
    hook = _across(lines, 0.03, 0.14, lines.sheer_line(0.08)[2] - 0.022, 0.03)
    pieces = [Piece("ribs", c.wood, both_sides(join(*ribs))), Piece("floorboards", c.planks, both_sides(join(*boards)))]
    return [*pieces, Piece("breasthook", c.wood, hook)]


def _plank(floor: Float, x: float) -> Float:
    """The line x from the middle of a floor (T, V, 3), without the ends that would climb the sides."""
    wide = floor[floor[:, -1, 0] >= x]
    line = wide[np.arange(len(wide)), np.argmax(wide[..., 0] >= x, axis=1)]
    line[:, 0] = x
    return line[line[:, 2] < line[:, 2].min() + 0.09]


def _across(lines: Lines, start: float, stop: float, z: float, thickness: float, rows: int = 6) -> Solid:
    """A level board from side to side between two places on the ship's length (fractions)."""
    y = np.linspace(start, stop, rows) * lines.length
    half = np.maximum(lines.half_at(y, z) - 0.6 * SKIN, 0.01)
    x = half * np.linspace(-1, 1, 9)[:, None]
    return sheet(np.stack([x, np.broadcast_to(y, x.shape), np.full(x.shape, z)], axis=-1), thickness)


def _benches(p: RowingBoat, lines: Lines, c: Coats) -> list[Piece]:
    """Thwarts with posts, risers under them, a stern seat and a small one in the bow."""
    z = seat_height(lines)
    places = np.linspace(0.36, 0.62, p.thwarts) if p.thwarts > 1 else np.array([0.5])
    wide = 0.115 / lines.length
    pieces = [Piece("thwart", c.wood, _across(lines, a - wide, a + wide, z, 0.028, 4)) for a in places.tolist()]
    for a in places.tolist():
        keel = float(lines.point(lines.at_y(a * lines.length), 0.0)[2])
        post = moved(rounded_box((0.045, 0.045, z - keel - 0.01), 0.008, 1), (0, a * lines.length, (z + keel) / 2))
        pieces.append(Piece("thwart", c.wood, post))
    rear = 0.985 - (0.0 if lines.tuck else 0.1)
    slots = np.linspace(rear - 0.17, rear, 5)
    for a, b in zip(slots[:-1].tolist(), slots[1:].tolist(), strict=True):
        pieces.append(Piece("stern_seat", c.wood, _across(lines, a, b - 0.012 / lines.length, z + 0.01, 0.024, 3)))
    pieces.append(Piece("bow_seat", c.wood, _across(lines, 0.12, 0.2, z + 0.03, 0.024, 4)))
    s = np.linspace(0.1, 0.9, 36)
    path = lines.raised(*lines.at_place(s * lines.length, z - 0.035), -SKIN - 0.004)
    return [*pieces, Piece("riser", c.wood, both_sides(along(path, bar(0.022, 0.05))))]


def seat_height(lines: Lines) -> float:
    """z of the thwarts."""
    low = float(lines.point(0.55, 0.0)[2])
    return low + 0.62 * (float(lines.sheer_line(0.55)[2]) - low)


def _rowlocks_and_oars(p: RowingBoat, lines: Lines, c: Coats) -> list[Piece]:
    """A rowlock on each side for each pair of oars, and the oars in them or laid down."""
    pieces: list[Piece] = []
    places = (0.57,) if p.oars == 1 else (0.45, 0.7)
    length = 1.68 * p.beam
    for k, y in enumerate(a * p.length for a in places):
        gunwale = np.add(lines.sheer_line(lines.at_y(y)), (-SKIN / 2, 0, 0.014))
        lock = np.add(gunwale, (0, 0, 0.085))
        pieces += pair("rowlock", c.bronze, _rowlock(gunwale))
        if p.sweep is None:
            at = np.array([0.13 + 0.19 * k, 0.87 * p.length - 0.1 * k, seat_height(lines) + 0.055])
            axis = np.array([-0.006, -1.0, 0.018])
        else:
            a = np.radians(p.sweep + 4 * k)
            axis = np.array([np.cos(a), np.sin(a), -0.17])
            axis /= np.linalg.norm(axis)
            at = lock - axis * 0.29 * length
        for part, material, solid in _oar(length, c):
            pieces += pair(part, material, aimed(solid, at, axis, np.cross(axis, (0, 0, 1.0))))
    ring = tube([(0.03 * np.cos(a), -0.005, 0.03 * np.sin(a)) for a in np.linspace(0.3, 2 * np.pi + 0.2, 16)], 0.006, 8)
    stem = lines.point(0.0, 0.8)
    return [*pieces, Piece("painter_ring", c.bronze, moved(ring, np.add(stem, (0, -0.052, 0))))]


def _rowlock(gunwale: Float) -> Solid:
    """A socket with a horned fork."""
    angle = np.linspace(-0.38 * np.pi, 1.38 * np.pi, 17)
    fork = np.stack([np.zeros(17), 0.042 * np.cos(angle + np.pi), 0.085 + 0.042 * np.sin(angle + np.pi)], axis=1)
    pin = [(0, 0, -0.02), (0, 0, 0.02), (0, 0, 0.045)]
    socket = moved(rounded_box((0.045, 0.12, 0.03), 0.008, 2), (0, 0, 0.012))
    return moved(join(socket, tube(fork, 0.0085, 8), tube(pin, 0.009, 8)), gunwale)


def _oar(length: float, c: Coats) -> list[tuple[str, Material, Solid]]:
    """Loom, leather and blade up the z axis, the grip's end at the origin, the blade flat across x."""
    z = np.array([0.0, 0.004, 0.13, 0.14, 0.32, 0.72, 1.0 - 0.6 / length, 1.0]) * length
    r = np.array([0.014, 0.018, 0.017, 0.024, 0.026, 0.022, 0.019, 0.006])
    shaft = tube(np.stack([0 * z, 0 * z, z], axis=1), r, 12)
    leather = rod((0, 0, 0.25 * length), (0, 0, 0.33 * length), 0.0285, 12)
    s = np.linspace(0, 1, 14)
    half = 0.075 * (1 - (1 - np.clip(s / 0.55, 0, 1)) ** 2) ** 0.8 * (1 - 0.28 * np.clip((s - 0.85) / 0.15, 0, 1) ** 2) + 0.016
    across = np.linspace(-1, 1, 7)[:, None]
    face = np.stack(np.broadcast_arrays(across * half, 0.03 * s**2 + 0.012 * across**2, length - 0.62 + 0.64 * s), axis=-1)
    return [("oar", c.wood, shaft), ("oar", c.rubber, leather), ("oar_blade", c.accent, sheet(face, 0.011))]
