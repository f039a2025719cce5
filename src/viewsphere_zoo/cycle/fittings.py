"""Fittings of bicycles: mudguards, lights, reflectors and stands; bottles, a carrier, baskets and bags."""

from __future__ import annotations

from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material
from viewsphere_zoo.cycle.coats import Coats
from viewsphere_zoo.cycle.cockpit import Cockpit, clamp
from viewsphere_zoo.cycle.layout import Layout
from viewsphere_zoo.cycle.wheels import Wheel
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.rods import aimed, between, rod, shifted, smooth, swept, unit
from viewsphere_zoo.shapes.solids import (
    Float,
    Solid,
    both_sides,
    flipped,
    grid,
    join,
    lathe,
    loft,
    mirrored,
    moved,
    rounded_box,
    superellipse,
    tube,
)

GAP = 0.016
"""Gap between tyre and mudguard, metres."""

Basket = Literal["none", "wire", "wicker"]


_BOTTLE = [(0, 0), (34, 0), (36.5, 3), (36.5, 98), (33, 106), (33, 120), (36.5, 128), (36.5, 150), (34, 156)]
_LID = [(0, 154), (36.5, 154), (36.8, 172), (26, 182), (12, 187), (10.5, 200), (7.5, 202), (7.5, 208), (0, 209)]
_HOOP = [(0, 0, -6), (26, 0, -6), (40, 0, 10), (40.5, 4, 70), (34, 22, 112), (14, 39, 118), (11, 40.5, 50), (12, 39.5, -2)]
"""Millimetres: (radius, height) of a bottle and its lid, and half the wire of the cage around it."""


def bottle_pieces(at: Layout, on_seat_tube: bool, coats: Coats) -> list[Piece]:
    """A bottle in its cage on the down tube, or on the seat tube."""
    low, _ = at.head
    if on_seat_tube:
        base, along, stand, side = at.on_seat(0.11), at.seat, 0.016, 1.0
    else:
        base, along = between(at.bracket, low, 0.24), unit(low - at.bracket)
        stand, side = 0.0165 + 0.017 * (at.g.tube - 1), -1.0
    off = side * np.cross((1.0, 0.0, 0.0), along)
    middle = base + (stand + 0.042) * off
    wire = tube(smooth([*(np.array(_HOOP) / 1000), (0.011, 0.02, -0.0065), (0.0, 0.012, -0.0065)], 4), 0.0026, 6)
    strap = rod((0, 0.0415, 0.02), (0, 0.0415, 0.1), 0.0045, 8)
    bosses = [rod((0, 0.04, z), (0, 0.05, z), 0.0055, 8) for z in (0.03, 0.09)]
    solids = (
        ("bottle", coats.extra, lathe(np.array(_BOTTLE) / 1000, 28)),
        ("bottle", coats.black, lathe(np.array(_LID) / 1000, 28)),
        ("bottle_cage", coats.alloy, join(wire, mirrored(wire), strap, *bosses)),
    )
    return [Piece(name, material, aimed(solid, middle, along, (side, 0, 0))) for name, material, solid in solids]


def carrier_height(at: Layout, w: Wheel) -> float:
    """Height of the carrier's platform above the ground, metres."""
    return at.rear_axle[2] + w.radius + 0.05


def carrier_pieces(at: Layout, w: Wheel, half: float, coats: Coats) -> list[Piece]:
    """A platform of rods on two pairs of legs, with a spring clip and a rear lamp."""
    z, axle = carrier_height(at, w), at.rear_axle
    front, rear = axle[1] - 0.13, axle[1] + 0.24
    r = 0.0052
    rail = smooth(
        [
            (0.02, front, z - 0.002),
            (0.06, front + 0.03, z),
            (0.064, axle[1], z),
            (0.064, rear - 0.03, z),
            (0.045, rear, z),
            (0, rear + 0.004, z),
        ],
        4,
    )
    rails = both_sides(tube(rail, r, 8))
    slats = [rod((x, front + 0.012, z - 0.001), (x, rear, z - 0.001), 0.0042, 8) for x in (-0.02, 0.02)]
    cross = [rod((-0.063, y, z - 0.006), (0.063, y, z - 0.006), 0.004, 8) for y in np.linspace(front + 0.05, rear - 0.04, 4)]
    foot = (half + 0.01, axle[1] + 0.006, axle[2] + 0.03)
    legs = [
        tube(smooth([foot, (0.07, axle[1] + d * 0.6, axle[2] + 0.2), (0.064, axle[1] + d, z)], 5), 0.0045, 8)
        for d in (-0.03, 0.15)
    ]
    seat_at = (z + 0.02 - at.bracket[2]) / at.seat[2]
    post = at.on_seat(min(seat_at, at.g.seat_tube - 0.02))
    arms = [rod((0.02, front + 0.002, z - 0.002), (0.014, *post[1:]), 0.0042, 8)]
    lamp = moved(rounded_box((0.09, 0.024, 0.036), 0.008, 2), (0, rear + 0.016, z - 0.012))
    glass = moved(rounded_box((0.076, 0.01, 0.026), 0.004, 2), (0, rear + 0.027, z - 0.012))
    return [
        Piece("carrier", coats.black, join(rails, *slats, *cross, both_sides(join(*legs, *arms)))),
        Piece("light_rear", coats.black, lamp),
        Piece("light_rear", coats.rear_lamp, glass),
    ]


def pannier_pieces(at: Layout, w: Wheel, both: bool, coats: Coats) -> list[Piece]:
    """Bags beside the carrier: body, flap, straps with buckles."""
    z, y = carrier_height(at, w), at.rear_axle[1] + 0.085
    body = rounded_box((0.13, 0.31, 0.32), 0.035, 3)
    taper = Solid(body.vertices * (1, 1, 1) * (1 + np.minimum(body.vertices[:, 2:], 0) * (0.25, 0.35, 0.0)), body.triangles)
    x = 0.064 + 0.071
    bag = moved(taper, (x, y, z - 0.16))
    flap = moved(rounded_box((0.142, 0.322, 0.085), 0.03, 3), (x, y, z - 0.03))
    straps = [moved(rounded_box((0.004, 0.024, 0.2), 0.0015, 1), (x + 0.0705, y + d, z - 0.095)) for d in (-0.08, 0.08)]
    buckles = [moved(rounded_box((0.008, 0.032, 0.022), 0.002, 1), (x + 0.0712, y + d, z - 0.125)) for d in (-0.08, 0.08)]
    patch = moved(rounded_box((0.006, 0.07, 0.035), 0.002, 1), (x + 0.064, y, z - 0.2))
    solids = ((coats.canvas, bag), (coats.leather, join(flap, *straps)), (coats.alloy, join(*buckles)), (coats.amber, patch))
    pieces = [Piece("bag_left", material, solid) for material, solid in solids]
    return pieces + [Piece("bag_right", material, mirrored(solid)) for material, solid in solids if both]


def saddle_bag(at: Layout, coats: Coats) -> list[Piece]:
    """A wedge under the saddle's rear."""
    top = shifted(at.on_seat(at.g.saddle), 0, 0.095, -0.115)
    f = np.linspace(0, 1, 9)
    rings = np.empty((9, 20, 3))
    for k, t in enumerate(f):
        grow = 1 - 0.55 * abs(2 * t - 1) ** 6
        section = superellipse(0.036 * grow * (1 - 0.1 * t), (0.042 - 0.012 * t) * grow, 3.2, 20)
        rings[k] = np.column_stack([section[:, 0], np.full(20, 0.15 * (t - 0.5)), section[:, 1] + 0.014 * t])
    strap = [moved(rounded_box((0.079, 0.016, 0.09), 0.014, 2), (0, d, 0.008)) for d in (-0.04,)]
    tag = moved(rounded_box((0.03, 0.006, 0.012), 0.002, 1), (0, 0.076, 0.014))
    return [
        Piece("bag_saddle", coats.canvas, moved(loft(rings[:, ::-1]), top)),
        Piece("bag_saddle", coats.black, moved(join(*strap), top)),
        Piece("light_rear", coats.rear_lamp, moved(tag, top)),
    ]


def frame_bag(at: Layout, coats: Coats) -> list[Piece]:
    """A slim bag that fills the upper corner of the main triangle."""
    _, high = at.head
    k = at.g.tube
    tube_radius = 0.0143 + 0.011 * (k - 1)
    under_top = 0.93 * tube_radius
    seat_top = at.on_seat(at.g.seat_tube - 0.014 - tube_radius)
    from_top = high - (tube_radius + 0.008) * at.steering
    along = unit(from_top - seat_top)
    down = np.cross(along, (1.0, 0.0, 0.0))
    down = down if down[2] < 0 else -down
    long = float(np.linalg.norm(from_top - seat_top))
    a = seat_top + 0.034 * along + under_top * down
    b = seat_top + (long - 0.075) * along + under_top * down
    c, d = a + 0.11 * down + 0.012 * along, b + 0.055 * down
    ring: list[Float] = []
    corners = [a, c, d, b]
    for i, p in enumerate(corners):
        q, n = corners[i - 1], corners[(i + 1) % 4]
        ring += [between(p, q, 0.12), between(p, q, 0.03) * 0.5 + between(p, n, 0.03) * 0.5, between(p, n, 0.12)]
    outline = np.array(ring)
    middle = outline.mean(axis=0)
    levels = ((-0.024, 0.9), (-0.027, 0.97), (-0.02, 1.0), (0.02, 1.0), (0.027, 0.97), (0.024, 0.9))
    rings = np.array([middle + (outline - middle) * s + (x, 0, 0) for x, s in levels])
    solid = loft(rings) if _ccw(outline) else loft(rings[:, ::-1])
    zip_at = between(a, b, 0.5) + 0.022 * down
    zipper = [
        aimed(rounded_box((0.003, 0.006, 0.62 * long), 0.001, 1), shifted(zip_at, s * 0.0265, 0, 0), along) for s in (1, -1)
    ]
    straps = [
        aimed(rounded_box((0.042 * k + 0.004, 0.06, 0.022), 0.012, 2), between(a, b, s) - 0.012 * down, along)
        for s in (0.12, 0.88)
    ]
    return [
        Piece("bag_frame", coats.canvas, solid),
        Piece("bag_frame", coats.amber, join(*zipper)),
        Piece("bag_frame", coats.black, join(*straps)),
    ]


def _ccw(outline: Float) -> bool:
    """Return whether a ring in (y, z) runs counter-clockwise seen from +x."""
    y, z = outline[:, 1], outline[:, 2]
    return float(np.sum(y * np.roll(z, -1) - np.roll(y, -1) * z)) > 0


def basket_pieces(at: Layout, c: Cockpit, kind: Basket, w: Wheel, coats: Coats) -> list[Piece]:
    """A basket in front of the bar; the basket turns with the bar."""
    top = shifted(clamp(at, c), y=-0.062)
    low = at.front_axle[2] + w.radius + 0.05
    height = float(np.clip(top[2] - low, 0.17, 0.24))
    size = np.array((0.19, 0.13))
    middle = np.array((0.0, top[1] - size[1], top[2] - height + 0.01))
    solids = _wire_basket(size, height) if kind == "wire" else _wicker_basket(size, height)
    material = coats.black if kind == "wire" else coats.wicker
    stays = both_sides(rod((0.06, size[1] - 0.004, height - 0.03), (0.04, size[1] + 0.05, height - 0.012), 0.005, 8))
    low_stay = shifted(middle, 0, 0.5 * size[1], 0.004)
    legs = both_sides(rod((0.05, *low_stay[1:]), (0.053, *(shifted(at.front_axle, 0, 0, 0.012))[1:]), 0.0042, 8))
    pieces = [Piece("basket", material, moved(solids, middle)), Piece("basket", coats.black, join(moved(stays, middle), legs))]
    if kind == "wicker":
        belts = [moved(rounded_box((0.03, 0.006, 0.13), 0.002, 1), (x, -size[1] - 0.004, height - 0.06)) for x in (-0.08, 0.08)]
        pieces.append(Piece("basket", coats.leather, moved(join(*belts), middle)))
    return pieces


def _loop(size: Float, grow: float, z: float, count: int = 40) -> Float:
    """A rounded rectangle around the basket."""
    ring = superellipse(size[0] * grow, size[1] * grow, 5.0, count)
    return np.column_stack([ring, np.full(count, z)])


def _ring_tube(ring: Float, radius: float, sides: int) -> Solid:
    """A closed loop of wire."""
    middle = ring.mean(axis=0)
    out = (ring - middle) / np.linalg.norm(ring - middle, axis=1, keepdims=True)
    a = np.pi / sides + np.linspace(0, 2 * np.pi, sides, endpoint=False)
    rows = [ring + radius * (np.cos(t) * out + np.sin(t) * np.array((0.0, 0.0, 1.0))) for t in [*a, a[0]]]
    return flipped(grid(np.array(rows), wrap=True))


def _wire_basket(size: Float, height: float) -> Solid:
    """Hoops, uprights and a floor of wires."""
    levels = np.linspace(0, 1, 6)
    hoops = [_ring_tube(_loop(size, 0.84 + 0.16 * f, height * f), 0.0022 if 0 < f < 1 else 0.0036, 5) for f in levels]
    low, high = _loop(size, 0.84, 0.0), _loop(size, 1.0, height)
    uprights = [rod(low[i], high[i], 0.0017, 4) for i in range(40)]
    floor: list[Solid] = []
    for x in np.linspace(-0.78, 0.78, 11) * size[0]:
        y = 0.84 * size[1] * (1 - abs(x / (0.84 * size[0])) ** 5) ** 0.2
        floor.append(rod((x, -y, 0), (x, y, 0), 0.0017, 4))
    for y in np.linspace(-0.6, 0.6, 5) * size[1]:
        x = 0.84 * size[0] * (1 - abs(y / (0.84 * size[1])) ** 5) ** 0.2
        floor.append(rod((-x, y, 0.0016), (x, y, 0.0016), 0.0017, 4))
    return join(*hoops, *uprights, *floor)


def _wicker_basket(size: Float, height: float) -> Solid:
    """Woven rows: each row weaves in and out, opposite to the row below; a plaited rim and a floor."""
    count = int(height / 0.0125)
    rows: list[Solid] = []
    for k in range(count):
        f = k / (count - 1)
        ring = _loop(size, 0.84 + 0.16 * f, height * f, 36)
        wave = 1 + 0.01 * np.where((np.arange(36) // 2 + k) % 2, 1.0, -1.0)
        ring[:, :2] *= wave[:, None]
        rows.append(_ring_tube(ring, 0.0084, 4))
    rim = _ring_tube(_loop(size, 1.0, height, 40), 0.0105, 8)
    outline = _loop(size, 0.84, 0.0)
    floor = loft(np.array([shifted(outline, z=h) for h in (-0.004, 0.004)]))
    return join(*rows, rim, floor)


def _arc(axle: Float, radius: float, start: float, stop: float) -> Float:
    """Points of an arc around the axle, its angles in degrees: 0 points to the front, 90 up, 180 to the rear."""
    a = np.radians(np.linspace(start, stop, 31))
    return axle + radius * np.stack([0 * a, -np.cos(a), np.sin(a)], axis=1)


def mudguard(
    w: Wheel, axle: Float, start: float, stop: float, name: str, material: Material, coats: Coats, half: float
) -> list[Piece]:
    """A curved strip over the tyre from one angle to the other (degrees, as in _arc), with stays to the axle."""
    path = _arc(axle, w.radius + GAP, start, stop)
    wide, thick = w.tyre / 2 + 0.009, 0.0016
    a = np.radians(np.linspace(0, 180, 9))
    outer = np.stack([wide * np.cos(a), 0.013 * np.sin(a) - 0.012], axis=1)
    inner = outer * (1 - thick / wide, 1) - (0, thick)
    ring = np.concatenate([outer, inner[::-1]])
    sections = np.broadcast_to(ring, (len(path), len(ring), 2))
    strip = swept(path, sections)
    up = np.cross(np.gradient(path, axis=0), (1.0, 0.0, 0.0))
    if float(up[15] @ (path[15] - axle)) < 0:
        strip = swept(path[::-1], sections)
    stays: list[Solid] = []
    ends = (start, stop) if stop > 190 else (start, 0.5 * (start + stop))
    for angle in (ends[1] - 28, ends[1] - 12) if stop > 150 else (ends[0] + 12,):
        tip = _arc(axle, w.radius + GAP - 0.0105, angle, angle + 1)[0]
        stays.append(rod((wide, *tip[1:]), (half, *(shifted(axle, 0, 0.0, 0.004))[1:]), 0.0021, 6))
    return [Piece(name, material, strip), Piece(name, coats.steel, both_sides(join(*stays)))]


def front_light(place: Float, back: Float, size: float, coats: Coats) -> list[Piece]:
    """A lamp at this point facing the front, on an arm from `back`; its radius is 31 mm times size."""
    shell = [(0, -0.038), (0.012, -0.036), (0.022, -0.026), (0.029, -0.006), (0.031, 0.004), (0.03, 0.012), (0.026, 0.012)]
    glass = [(0.0275, 0.0085), (0.0265, 0.012), (0.018, 0.0155), (0.0, 0.017)]
    out = (0.0, -1.0, -0.04)
    return [
        Piece("light_front", coats.chrome, aimed(lathe(size * np.array(shell), 24), place, out)),
        Piece("light_front", coats.front_lamp, aimed(lathe(size * np.array(glass), 24), place, out)),
        Piece("light_front", coats.black, rod(back, shifted(place, 0, 0.02, 0), 0.0048, 8)),
    ]


def rear_light(post: Float, along: Float, coats: Coats) -> list[Piece]:
    """A small red lamp clamped to the seat post at this point, facing the rear."""
    place = shifted(post, y=0.024)
    band = rod(post - 0.008 * along, post + 0.008 * along, 0.0155, 16)
    body = moved(rounded_box((0.03, 0.022, 0.05), 0.008, 2), place)
    glass = moved(rounded_box((0.025, 0.012, 0.042), 0.005, 2), shifted(place, 0, 0.009, 0))
    return [Piece("light_rear", coats.black, join(body, band)), Piece("light_rear", coats.rear_lamp, glass)]


def kickstand(at: Layout, coats: Coats) -> list[Piece]:
    """A leg behind the bottom bracket that reaches the ground on the left."""
    root = between(at.bracket, at.rear_axle, 0.17)
    hip = (0.052, root[1] + 0.008, root[2] - 0.022)
    foot = (0.16, root[1] + 0.05, 0.005)
    knee = between(hip, foot, 0.93)
    block = moved(rounded_box((0.07, 0.034, 0.034), 0.006, 2), (0.024, root[1] + 0.004, root[2] - 0.014))
    leg = join(rod(hip, foot, (0.0085, 0.0075), 10), rod(between(hip, foot, -0.06), hip, 0.012, 10))
    return [Piece("kickstand", coats.alloy, join(block, leg)), Piece("kickstand", coats.rubber, rod(knee, foot, 0.0098, 10))]
