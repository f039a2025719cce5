"""Frames: main tubes, stays and dropouts; the rear swing arm of a full suspension."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material
from viewsphere_zoo.cycle.coats import Coats
from viewsphere_zoo.cycle.layout import Layout
from viewsphere_zoo.cycle.wheels import Wheel, on_axle
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.rods import across, aimed, between, bezier, pin, plate, rod, shifted, smooth, split, unit
from viewsphere_zoo.shapes.solids import Float, Solid, both_sides, join, lathe, moved, rounded_box, tube

Shape = Literal["diamond", "swan", "wave", "mixte"]
Decor = Literal["plain", "letters", "bands", "two_tone"]
SIDES = 16


@dataclass(frozen=True)
class Frame:
    """shape: diamond, or a step-through: swan (two bowed tubes), wave (one deep beam), mixte (two straight tubes).

    decor: `letters` are fields on the sides of the down tube, `two_tone` paints half of the tubes in the accent colour; shock:
    a swing arm with a spring; bridge: a cross tube between the seat stays, for a brake.
    """

    shape: Shape = "diamond"
    decor: Decor = "letters"
    shock: bool = False
    bridge: bool = True


@dataclass(frozen=True)
class Room:
    """Half widths that the wheels need, metres: between the rear dropouts' middles, and of tyre and mudguard."""

    half: float = 0.066
    clearance: float = 0.019


def frame_pieces(at: Layout, f: Frame, w: Wheel, room: Room, coats: Coats) -> list[Piece]:
    """Part frame, with the head badge and the seat clamp."""
    k = at.g.tube
    low, high = at.head
    up = at.steering
    head = join(
        rod(low, high, 0.018 + 0.0035 * (k - 1), 20),
        *(rod(p - 0.007 * up, p + 0.007 * up, 0.0205 + 0.004 * (k - 1), 20) for p in (low + 0.007 * up, high - 0.007 * up)),
    )
    top = at.on_seat(at.g.seat_tube)
    seat = rod(at.bracket, top, 0.0155 + 0.006 * (k - 1), SIDES)
    shell = pin(at.bracket, 0.034, 0.021 + 0.003 * (k - 1), 20)
    cups = pin(at.bracket, 0.041, 0.0185 + 0.003 * (k - 1), 20)
    clamp = rod(top - 0.014 * at.seat, top + 0.003 * at.seat, 0.0185 + 0.006 * (k - 1), 16)
    bolt = rod(top - (-0.014, -0.021, 0.006), top - (0.014, -0.021, 0.006), 0.0045, 8)
    badge = plate([(0.009 * np.cos(a), 0.016 * np.sin(a)) for a in np.linspace(0, 2 * np.pi, 16, endpoint=False)], 0.003)
    middle = between(low, high, 0.55) + (0.0185 + 0.0035 * (k - 1)) * at.ahead
    return [
        Piece("frame", coats.frame, join(head, seat, shell)),
        Piece("bottom_bracket", coats.black, cups),
        Piece("frame", coats.parts, join(clamp, bolt)),
        Piece("frame", coats.accent, aimed(badge, middle, at.ahead)),
        *_main_tubes(at, f, room, coats),
        *(_swing_arm(at, f, w, room, coats) if f.shock else _stays(at, f, w, room, coats)),
    ]


def _main_tubes(at: Layout, f: Frame, room: Room, coats: Coats) -> list[Piece]:
    """The tubes that join the head tube to the rest of the frame."""
    k = at.g.tube
    low, high = at.head
    up = at.steering
    r_top, r_down = 0.0143 + 0.011 * (k - 1), 0.0165 + 0.017 * (k - 1)
    from_top, from_low = high - (r_top + 0.008) * up, low + (r_down + 0.008) * up
    seat_top = at.on_seat(at.g.seat_tube - r_top - 0.014)
    if f.shape == "diamond":
        down = _decorated(from_low, at.bracket, (0.94 * r_down, r_down), f.decor, coats)
        top = _decorated(from_top, seat_top, (r_top, 0.83 * r_top), "plain" if f.decor == "letters" else f.decor, coats)
        return [*down, *top]
    if f.shape == "mixte":
        end = at.on_seat(0.62 * at.g.seat_tube)
        twin = [(s * 0.004, *from_top[1:]) for s in (1, -1)], [(s * 0.024, *(end + 0.005 * at.seat)[1:]) for s in (1, -1)]
        tail = [(s * (room.half - 0.004), *at.rear_axle[1:]) for s in (1, -1)]
        bars = [tube(np.array([a, b, c]), (0.0095, 0.0095, 0.007), 12) for a, b, c in zip(*twin, tail, strict=True)]
        brace = pin(end, 0.026, 0.009, 12)
        down = _decorated(from_low, at.bracket, (r_down, r_down), f.decor, coats)
        return [*down, Piece("frame", coats.frame, join(*bars, brace))]
    sag = 0.6 if f.shape == "wave" else 0.42
    fat = 1.75 if f.shape == "wave" else 0.98
    start = from_low if f.shape == "wave" else from_top - 0.25 * at.g.head_tube * up
    lower = _bow(from_low, at.bracket + 0.004 * at.seat, sag, at)
    beam = tube(lower, np.linspace(0.9, 1.05, len(lower)) * fat * r_down, 18)
    pieces = _bow_decor(beam, f, lower, coats)
    if f.shape == "swan":
        upper = _bow(start, at.on_seat(0.36 * at.g.seat_tube), sag * 0.85, at)
        pieces.append(Piece("frame", coats.frame, tube(upper, r_top, SIDES)))
    else:
        gusset = rod(lower[-7], at.on_seat(0.3 * at.g.seat_tube), 0.015, SIDES)
        pieces.append(Piece("frame", coats.frame, gusset))
    return pieces


def _bow(a: Float, b: Float, sag: float, at: Layout) -> Float:
    """A curve from the head tube down and back to the seat tube: a cubic Bezier, perpendicular to both tubes at its ends."""
    reach = float(np.linalg.norm(b - a))
    first = a - sag * reach * unit(at.ahead + 0.75 * at.steering)
    second = b - 0.42 * reach * unit(np.array((0.0, 1.0, 0.02)))
    return bezier(a, first, second, b, 19)


def _bow_decor(beam: Solid, f: Frame, path: Float, coats: Coats) -> list[Piece]:
    """A bowed tube with a band of the accent colour."""
    if f.decor in ("plain", "two_tone"):
        return [Piece("frame", coats.frame, beam)]
    middles = (path[1:] + path[:-1]) / 2

    def marked(c: Float) -> np.ndarray:
        nearest = np.linalg.norm(c[:, None] - middles, axis=2).argmin(axis=1)
        return (nearest > 3) & (nearest < 7) & (nearest != 5)

    mark, rest = split(beam, marked)
    return [Piece("frame", coats.frame, rest), Piece("frame", coats.accent, mark)]


_LETTERS = (0.24, 0.3, 0.315, 0.365, 0.38, 0.43, 0.445, 0.49, 0.505, 0.55, 0.565, 0.62)
_BANDS = (0.12, 0.145, 0.16, 0.2, 0.8, 0.84, 0.855, 0.88)


def _decorated(a: Float, b: Float, radii: tuple[float, float], decor: Decor, coats: Coats) -> list[Piece]:
    """A straight tube with bands around it, a row of letter-like fields on its sides, or a half in the accent colour."""
    marks = {"plain": (), "letters": _LETTERS, "bands": _BANDS, "two_tone": (0.58,)}[decor]
    share = np.unique(np.concatenate([np.linspace(0, 1, 9), marks]))
    solid = tube(a + share[:, None] * (b - a), radii[0] + share * (radii[1] - radii[0]), SIDES)
    if not marks:
        return [Piece("frame", coats.frame, solid)]
    axis = (b - a) / float((b - a) @ (b - a))

    def marked(c: Float) -> np.ndarray:
        t = (c - a) @ axis
        odd = np.searchsorted(marks, t) % 2 == 1
        return odd & (np.abs(c[:, 0]) > 0.69 * np.mean(radii)) if decor == "letters" else odd

    mark, rest = split(solid, marked)
    return [Piece("frame", coats.frame, rest), Piece("frame", coats.accent, mark)]


def _chain_stay(at: Layout, room: Room, w: Wheel, radius: float) -> Solid:
    """The left chain stay, bent around the tyre."""
    axle, foot = at.rear_axle, at.bracket
    wide = room.clearance + radius
    tyre_at = 1 - (w.radius - 0.03) / float(np.linalg.norm(axle - foot))
    knee, mid = between(foot, axle, tyre_at), between(foot, axle, tyre_at + 0.28)
    points = [
        (0.02, *foot[1:]),
        (wide, *knee[1:]),
        (wide + 0.006, *mid[1:]),
        (room.half - 0.004, *between(foot, axle, 0.955)[1:]),
    ]
    path = smooth(points, 5)
    return tube(path, np.linspace(1.12, 0.72, len(path)) * radius, 12)


def _stays(at: Layout, f: Frame, w: Wheel, room: Room, coats: Coats) -> list[Piece]:
    """Chain stays, seat stays, bridge and dropouts."""
    k = at.g.tube
    axle = at.rear_axle
    drop = 0.02 if f.shape == "diamond" else 0.1
    top = at.on_seat(at.g.seat_tube - drop - 0.01 * k)
    radius = 0.0078 + 0.003 * (k - 1)
    wide = room.clearance + 0.8 * radius
    long = float(np.linalg.norm(top - axle))
    clear = between(axle, top, min((w.radius + 0.028) / long, 0.93))
    points = [
        (room.half - 0.004, *between(axle, top, 0.055)[1:]),
        (0.5 * (room.half + wide), *between(axle, top, 0.45)[1:]),
        (wide, *clear[1:]),
        (max(0.013, 0.45 * wide), *top[1:]),
    ]
    path = smooth(points, 5)
    solids = [tube(path, np.linspace(0.8, 1.05, len(path)) * radius, 12), _chain_stay(at, room, w, 0.0095 + 0.004 * (k - 1))]
    frame = both_sides(join(*solids))
    bridges = [pin(clear, wide, 0.0065, 10)] if f.bridge else []
    cluster = rod((-0.5 * wide - 0.004, *top[1:]), (0.5 * wide + 0.004, *top[1:]), 1.1 * radius, 12)
    return [Piece("frame", coats.frame, join(frame, *bridges, cluster)), _dropouts(at, room, coats, top)]


def _dropouts(at: Layout, room: Room, coats: Coats, top: Float) -> Piece:
    """Plates at the rear axle that hold it between the stays' ends; the right one carries the derailleur's hanger."""
    axle = at.rear_axle
    a, b = unit(at.bracket - axle), unit(top - axle)
    flat = [np.array(p) for p in (0.034 * a, 0.02 * a + 0.02 * b, 0.03 * b, 0.012 * b - 0.014 * a)]
    flat += [np.array((0, 0.012, -0.006)), np.array((0, 0.004, -0.016)), np.array((0, -0.008, -0.014))]
    outline = np.array(flat)[:, 1:]
    angle = np.arctan2(outline[:, 1], outline[:, 0])
    solid = across(plate(outline[np.argsort(angle)], 0.006))
    x = room.half - 0.002
    nut = on_axle(lathe([(0, 0.0), (0.0105, 0.001), (0.0105, 0.006), (0.006, 0.009), (0.0055, 0.015), (0, 0.0152)], 6))
    plates = both_sides(moved(solid, (x, *axle[1:])))
    return Piece("frame", coats.alloy, join(plates, both_sides(moved(nut, (x + 0.002, *axle[1:])))))


def _swing_arm(at: Layout, f: Frame, w: Wheel, room: Room, coats: Coats) -> list[Piece]:
    """Chain stays and seat stays that turn about the frame, a rocker, and the shock it squeezes."""
    axle = at.rear_axle
    pivot = at.on_seat(0.66 * at.g.seat_tube)
    horn = pivot + np.array((0.0, 0.072, 0.03))
    front = pivot + np.array((0.0, -0.058, 0.012))
    wide = room.clearance + 0.011
    long = float(np.linalg.norm(horn - axle))
    clear = between(axle, horn, min((w.radius + 0.0) / long, 0.8))
    points = [(room.half - 0.004, *between(axle, horn, 0.06)[1:]), (wide + 0.008, *between(axle, horn, 0.5)[1:])]
    points += [(wide, *clear[1:]), (0.034, *horn[1:])]
    path = smooth(points, 5)
    stays = both_sides(join(tube(path, np.linspace(0.9, 1.1, len(path)) * 0.0105, 12), _chain_stay(at, room, w, 0.0125)))
    rocker = across(_rocker(np.array((front - pivot, horn - pivot))[:, 1:]))
    side = moved(rocker, (0.026, *pivot[1:]))
    pins = [pin(p, 0.038, 0.008, 14) for p in (pivot, horn, front)]
    pins.append(pin(shifted(at.bracket, 0, 0.03, 0.018), 0.036, 0.011, 14))
    low, _ = at.head
    foot = between(at.bracket, low, 0.3)
    return [
        Piece("frame", coats.accent if f.decor == "two_tone" else coats.frame, stays),
        Piece("frame", coats.black, both_sides(side)),
        Piece("frame", coats.alloy, join(*pins)),
        *_shock(front, foot, coats.black, coats),
        _dropouts(at, room, coats, horn),
    ]


def _rocker(ends: Float) -> Solid:
    """A flat link through the origin and two points, rounded at its ends."""
    a, b = ends
    angle = [np.arctan2(p[1], p[0]) for p in (a, b)]
    ring: list[Float] = []
    for p, t in zip((a, b), angle, strict=True):
        turn = t + np.radians((-80, -40, 0, 40, 80))
        ring += [p + 0.013 * np.array((np.cos(u), np.sin(u))) for u in turn]
    ring += [np.array((0.0, 0.019)), np.array((0.0, -0.016))]
    points = np.array(ring)
    return plate(points[np.argsort(np.arctan2(points[:, 1], points[:, 0]))], 0.008)


def _shock(top: Float, foot: Float, body: Material, coats: Coats) -> list[Piece]:
    """An air spring: can, shaft, eyelets, and the lug on the frame."""
    split_at = between(top, foot, 0.52)
    can = join(
        rod(between(top, foot, 0.06), split_at, 0.021, 20), rod(between(top, foot, 0.03), between(top, foot, 0.1), 0.012, 12)
    )
    shaft = rod(split_at, between(top, foot, 0.94), 0.0115, 16)
    eye = pin(foot, 0.02, 0.009, 12)
    collar = rod(between(top, foot, 0.49), between(top, foot, 0.54), 0.0225, 20)
    lug = moved(rounded_box((0.03, 0.03, 0.03), 0.006, 2), foot)
    return [
        Piece("shock", body, join(can, lug)),
        Piece("shock", coats.stanchion, shaft),
        Piece("shock", coats.accent, collar),
        Piece("shock", coats.alloy, eye),
    ]
