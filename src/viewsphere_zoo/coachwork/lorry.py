"""A lorry's cab and chassis; the load areas are in cargo.py."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from viewsphere_zoo.coachwork import heavy, lights, structure
from viewsphere_zoo.coachwork.coats import Coats
from viewsphere_zoo.coachwork.hull import Arch, Hull
from viewsphere_zoo.coachwork.outline import Outline
from viewsphere_zoo.coachwork.wheels import Wheel
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import Color
from viewsphere_zoo.shapes.panels import in_quad, panel, raised, ribbon, straight
from viewsphere_zoo.shapes.rods import rod, shifted
from viewsphere_zoo.shapes.solids import Float, Solid, both_sides, join, loft, moved, rounded_box, tube
from viewsphere_zoo.townscape.surfaces import cuboid

RAIL = 0.42
"""x of the chassis' side members, metres."""


Load = Literal["box", "cold_box", "curtain", "dropside", "tipper"]


Goods = Literal["none", "crates", "pipes", "gravel"]


@dataclass(frozen=True)
class Truck:
    """Parameters of a lorry; lengths in metres, colours sRGB 0..1.

    length, width, height: of the whole lorry without mirrors (height is the box's); cab_*: of the cab; roundness: 0 boxy to 1
    soft; rake: how far the windscreen leans back; axles: 2 or 3; slats: bars of the grille; name: capitals on the box, empty
    for none; goods: on an open bed or in a tub.
    """

    load: Load = "box"
    length: float = 8.2
    width: float = 2.5
    height: float = 3.6
    cab_length: float = 1.95
    cab_width: float = 2.35
    cab_height: float = 2.75
    roundness: float = 0.4
    rake: float = 0.12
    axles: int = 2
    wheel_radius: float = 0.47
    slats: int = 4
    chrome: bool = False
    round_lamps: bool = False
    high_roof: bool = False
    visor: bool = True
    deflector: bool = False
    livery: Literal["plain", "stripe", "both", "wedge"] = "stripe"
    name: str = "EXPRESS"
    goods: Goods = "crates"
    color: Color = (0.1, 0.26, 0.55)
    load_color: Color = (0.93, 0.93, 0.92)
    mark_color: Color = (0.1, 0.26, 0.55)
    rim_color: Color = (0.75, 0.76, 0.78)
    painted_bumper: bool = False
    glass_color: Color = (0.13, 0.155, 0.17)

    @property
    def wheel(self) -> Wheel:
        """The measures of the lorry's tyres."""
        return Wheel(radius=self.wheel_radius, width=0.58 * self.wheel_radius, rim=0.57)


@dataclass(frozen=True)
class Frame:
    """The positions of the parts along a lorry, and its cab's surface."""

    p: Truck

    @property
    def front(self) -> float:
        """y of the foremost point."""
        return -self.p.length / 2

    @property
    def cab_end(self) -> float:
        """y of the cab's rear wall."""
        return self.front + self.p.cab_length

    @property
    def bed(self) -> tuple[float, float]:
        """First and last y of the load area."""
        return self.cab_end + 0.22, self.p.length / 2

    @property
    def floor(self) -> float:
        """z of the load's floor."""
        return 2 * self.p.wheel_radius + 0.16

    @property
    def axles(self) -> tuple[float, ...]:
        """y of the axles, front to rear."""
        steer = self.front + 0.3 + 1.08 * self.p.wheel_radius * 2
        drive = self.p.length / 2 - 0.24 * (self.p.length - self.p.cab_length)
        both = (drive - 1.14 * self.p.wheel_radius, drive + 1.14 * self.p.wheel_radius)
        return (steer, *(both if self.p.axles > 2 else (drive,)))

    @cached_property
    def cab(self) -> Hull:
        """The cab with its roof."""
        p, end = self.p, self.cab_end
        half, soft, top = (end - self.front) / 2, p.roundness, p.cab_height
        r = 0.08 + 0.14 * soft
        outline = Outline(
            self.front, end, p.cab_width / 2, (6 - 2 * soft, 14.0), (0.69 * half / (1.2 * r), 30.0), (0.03 + 0.1 * soft, 0.0)
        )
        low, radius = 0.36 if p.cab_height > 2.4 else 0.3, p.wheel_radius
        fall = 0.06 + 0.2 * soft
        roof = ((self.front, top - fall), (self.front + 0.35 * p.cab_length, top - 0.02), (end, top - 0.02))
        nose = ((low, 0.05), (0.5, 0.0), (self.sill - 0.15, 0.015), (self.sill + 0.3, 0.06), (top, 0.1 + p.rake))
        side = ((low, 0.02), (0.6, 0.0), (self.sill, 0.01), (top, 0.13))
        return Hull(
            outline,
            roof,
            0.05,
            ((self.front, low), (end, low)),
            side,
            nose,
            ((low, 0.0), (top, 0.02)),
            (Arch(self.axles[0], radius, radius + 0.1),),
            edge=0.06 + 0.06 * soft,
            bumper_line=low + 0.42,
            crease=self.sill - 0.08,
        )

    @property
    def sill(self) -> float:
        """z of the windscreen's lower edge."""
        return 0.56 * self.p.cab_height

    @property
    def head(self) -> float:
        """z of the windscreen's upper edge."""
        return self.p.cab_height - (0.3 if not self.p.high_roof else 0.75)


def cab_pieces(s: Frame, c: Coats) -> list[Piece]:
    """Shell, windows, doors, lamps, mirrors and steps."""
    hull, p = s.cab, s.p
    return [
        *structure.hull_pieces(hull, p.cab_width / 2 - 0.5, c, ("bumper_front", "underbody")),
        Piece("roof", c.paint, heavy.roof(hull)),
        *structure.arch_trims(hull, c, 0.012),
        *_glass(s, c),
        *_doors(s, c),
        *_face(s, c),
    ]


def _glass(s: Frame, c: Coats) -> list[Piece]:
    """Windscreen with its wipers, a small pane in the rear wall."""
    surface, wrap = s.cab.surface, 1.0 + 0.03 * s.p.roundness
    low, high = s.sill, s.head
    blades = []
    for start, stop in ((-0.7, -0.08), (0.08, 0.7)):
        line = np.stack([np.linspace(start, stop, 6), low + np.linspace(0.02, 0.14, 6)], axis=1)
        blades.append(tube(raised(surface, line, 0.028), 0.012, 6))
    return [
        Piece("windshield", c.black, heavy.bent(surface, (-wrap - 0.015, wrap + 0.015), (low - 0.05, high + 0.04), 0.01)),
        Piece("windshield", c.glass, heavy.bent(surface, (-wrap, wrap), (low, high), 0.017)),
        Piece("wiper", c.black, join(*blades)),
    ]


def _doors(s: Frame, c: Coats) -> list[Piece]:
    """Side windows that slope down towards the front, seams, handles, steps."""
    hull, p = s.cab, s.p
    o, surface = hull.outline, hull.surface
    start = float(o.point(np.array(o.u_at_x(0.985 * o.half_width)))[1]) + 0.06
    stop = min(start + 1.05, s.cab_end - 0.12)
    low, high = s.sill - 0.02, s.head - 0.02

    def u(y: float) -> float:
        return float(o.u_at_y(y))

    quad = np.array([(u(start + 0.04), low - 0.1), (u(stop - 0.05), low), (u(stop - 0.05), high), (u(start + 0.1), high)])
    window = panel(surface, quad, 0.008, 0.1, 3, 0.016, 2, 2)
    frame = panel(
        surface,
        in_quad(quad, np.array([(-0.04, -0.06), (1.04, -0.06), (1.04, 1.05), (-0.04, 1.05)])),
        0.004,
        0.1,
        3,
        0.016,
        2,
        2,
    )
    arch = hull.arches[0]
    foot = hull.bumper_line - 0.02

    def clear(y: float) -> float:
        return max(foot, float(arch.height(np.array([y]))[0]) + 0.08)

    lines = [ribbon(surface, straight((u(y), clear(y)), (u(y), high + 0.06), 10)[::-1], 0.014) for y in (start, stop)]
    lines.append(ribbon(surface, straight((u(start), high + 0.06), (u(stop), high + 0.06), 6), 0.014))
    at = raised(surface, np.array([[u(stop - 0.16), low - 0.14]]), 0.018)[0]
    grip = moved(rounded_box((0.025, 0.2, 0.045), 0.01, 1), at)
    bar = tube(raised(surface, np.array([(u(stop + 0.05), z) for z in (foot + 0.5, low + 0.35)]), 0.04), 0.015, 6)
    step_y = (start + min(arch.y - arch.radius, stop)) / 2
    steps = [moved(rounded_box((0.12, 0.34, 0.05), 0.015, 1), (p.cab_width / 2 - 0.03, step_y, z)) for z in (0.42, 0.66)]
    return [
        *heavy.sides("window", c.black, frame),
        *heavy.sides("window", c.glass, window),
        Piece("seam", c.seam, both_sides(join(*lines))),
        *heavy.sides("door_handle", c.black, join(grip, *([bar] if stop < s.cab_end - 0.15 else []))),
        Piece("step", c.black, both_sides(join(*steps))),
    ]


def _face(s: Frame, c: Coats) -> list[Piece]:
    """Grille, badge, lamps, plate, mirrors, visor, deflector."""
    p, hull = s.p, s.cab
    surface, line = hull.surface, hull.bumper_line
    low, high = line + 0.06, s.sill - 0.2
    found = [Piece("grille", c.black, heavy.bent(surface, (-0.72, 0.72), (low, high), 0.006))]
    rows = np.linspace(low + 0.05, high - 0.05, p.slats)
    bars = [ribbon(surface, straight((-0.68, z), (0.68, z), 13), 0.05 if p.slats < 5 else 0.026, 0.02) for z in rows]
    found.append(Piece("grille", c.chrome if p.chrome else c.paint, join(*bars)))
    found.append(Piece("badge", c.chrome, heavy.bent(surface, (-0.1, 0.1), (high + 0.03, high + 0.13), 0.014, 0.4)))
    a, b = (0.62, 0.93)
    tall = (line - 0.28, line - 0.06)
    found += heavy.sides(
        "headlight", c.black, heavy.bent(surface, (a - 0.04, b + 0.04), (tall[0] - 0.03, tall[1] + 0.03), 0.006)
    )
    eyes = [(a, (a + b) / 2 - 0.01), ((a + b) / 2 + 0.01, b)]
    found += heavy.sides(
        "headlight", c.white_lamp, join(*(heavy.bent(surface, e, tall, 0.014, 0.5 if p.round_lamps else 0.15) for e in eyes))
    )
    found += heavy.sides("indicator", c.amber_lamp, heavy.bent(surface, (b + 0.06, b + 0.14), tall, 0.012, 0.2))
    found += lights.plate(surface, 0.0, line - 0.2, 1.0, c)
    root = surface(1.02, s.head - 0.12)
    found += heavy.arm_mirror(root, 0.2, (0.2, 0.24 * p.cab_height * 0.8), 0.3, c, c.black)
    if p.visor:
        u = np.linspace(-0.98, 0.98, 21)
        inner = shifted(surface(u, np.full(21, s.head + 0.1)), y=0.03)
        outer = raised(surface, np.stack([u, np.full(21, s.head + 0.02)], axis=1), 0.13)
        found.append(Piece("visor", c.black, _strip(outer, inner)))
    if p.deflector:
        found.append(Piece("deflector", c.paint, _deflector(s)))
    return found


def _strip(outer: Float, inner: Float) -> Solid:
    """A thin closed strip between two lines (N, 3)."""
    rise = np.array((0, 0, 0.025))
    return loft(np.stack([outer, inner, inner + rise, outer + rise], axis=1))


def _deflector(s: Frame) -> Solid:
    """A curved shield on the roof that leads the wind over the load."""
    p = s.p
    start, stop = s.front + 0.42 * p.cab_length, s.cab_end - 0.02
    y = np.linspace(start, stop, 8)
    share = (y - start) / (stop - start)
    rise = (min(s.p.height, s.p.cab_height + 0.95) - p.cab_height - 0.05) * share**0.6
    z = p.cab_height - 0.06 + np.maximum(rise, 0.02) + 0.04
    half = p.cab_width / 2 - 0.22 + 0.1 * share
    x = np.array([-1, -0.93, -0.8, 0, 0.8, 0.93, 1])
    drop = np.array([1, 0.25, 0.02, 0, 0.02, 0.25, 1])
    base = p.cab_height - 0.12
    points = np.empty((len(y), len(x), 3))
    points[..., 0] = x * half[:, None]
    points[..., 1] = y[:, None]
    points[..., 2] = z[:, None] - drop * (z[:, None] - base)
    foot = points[:, ::-1] * (1, 1, 0) + (0, 0, base)
    return loft(np.concatenate([points, foot[:, 1:-1]], axis=1))


def chassis_pieces(s: Frame, c: Coats) -> list[Piece]:
    """Side members, axles, guards over the rear wheels, tank, rails beside the wheels, bumper and lamps behind."""
    p, half = s.p, s.p.length / 2
    top = s.floor - 0.1
    beams = [cuboid((x - 0.05, s.cab_end - 0.6, top - 0.24), (x + 0.05, half - 0.08, top)) for x in (-RAIL, RAIL)]
    cross = [cuboid((-RAIL, y - 0.05, top - 0.2), (RAIL, y + 0.05, top - 0.05)) for y in np.linspace(s.cab_end, half - 0.3, 5)]
    found = [Piece("chassis", c.under, join(*beams, *cross))]
    out = p.width / 2 - 0.03
    found += heavy.axle("front", s.axles[0], min(out, p.cab_width / 2 - 0.02), p.wheel, False, c)
    for k, y in enumerate(s.axles[1:]):
        found += heavy.axle("rear" if k == 0 else "third", y, out, p.wheel, True, c)
        found.append(Piece("mudguard", c.rubber, both_sides(_guard(p.wheel_radius, y, out, 0.62))))
    a, b = s.cab_end + 0.2, s.axles[1] - p.wheel_radius - 0.25
    if b - a > 0.8:
        found += _flank(s, a, b, c)
    return found + _tail(s, c)


def _guard(radius: float, y: float, outside: float, width: float) -> Solid:
    """A bent sheet over a wheel."""
    angle = np.linspace(0.28, np.pi - 0.28, 10)
    r = radius + 0.07
    line = np.stack([y - r * np.cos(angle), radius + r * np.sin(angle)], axis=1)
    outer = np.array([(x, *q) for q in line for x in (outside - width, outside)]).reshape(10, 2, 3)
    inner = outer - np.stack([0 * angle, -np.cos(angle), np.sin(angle)], axis=1)[:, None] * 0.02
    ring = np.stack([outer[:, 0], outer[:, 1], inner[:, 1], inner[:, 0]], axis=1)
    return loft(ring)


def _flank(s: Frame, a: float, b: float, c: Coats) -> list[Piece]:
    """Tank and battery box below the load, and the side guards that keep people away from the wheels."""
    p, z = s.p, s.floor - 0.45
    length = min(1.3, 0.5 * (b - a))
    tank = rod((-p.width / 2 + 0.42, a + 0.1, z), (-p.width / 2 + 0.42, a + 0.1 + length, z), 0.29, 18)
    box = moved(rounded_box((0.5, min(0.9, 0.5 * (b - a)), 0.5), 0.03, 1), (p.width / 2 - 0.4, a + 0.6, z))
    x = p.width / 2 - 0.06
    rails = [cuboid((x - 0.03, a, h), (x, b, h + 0.1)) for h in (z - 0.25, z + 0.06)]
    posts = [cuboid((x - 0.05, y, z - 0.25), (x - 0.03, y + 0.05, s.floor - 0.1)) for y in np.linspace(a + 0.1, b - 0.15, 3)]
    return [
        Piece("tank", c.steel, tank),
        Piece("battery_box", c.black, box),
        Piece("side_guard", c.steel, both_sides(join(*rails, *posts))),
    ]


def _tail(s: Frame, c: Coats) -> list[Piece]:
    """Underrun bar, lamps, flaps, plate."""
    p, half = s.p, s.p.length / 2
    z = 0.5 if p.wheel_radius > 0.42 else 0.42
    wide = p.width / 2 - 0.04
    bar = moved(rounded_box((2 * wide, 0.1, 0.14), 0.02, 1), (0, half - 0.08, z))
    legs = [cuboid((x - 0.04, half - 0.14, z), (x + 0.04, half - 0.06, s.floor - 0.1)) for x in (-RAIL, RAIL)]
    found = [Piece("bumper_rear", c.black, join(bar, *legs))]
    for part, material, x, w in (
        ("taillight", c.red_lamp, wide - 0.13, 0.2),
        ("indicator_rear", c.amber_lamp, wide - 0.31, 0.12),
        ("reversing_light", c.white_lamp, wide - 0.43, 0.1),
    ):
        found += heavy.sides(part, material, moved(rounded_box((w, 0.05, 0.12), 0.02, 1), (x, half - 0.02, z + 0.14)))
    back = s.axles[-1] + p.wheel_radius + 0.16
    flap = cuboid((wide - 0.6, back, 0.16), (wide - 0.02, back + 0.015, s.floor - 0.12))
    found.append(Piece("mud_flap", c.rubber, both_sides(flap)))
    board = moved(rounded_box((0.5, 0.02, 0.115), 0.004, 1), (0, half - 0.02, z))
    marks = [moved(rounded_box((0.036, 0.004, 0.07), 0.001, 1), (x, half - 0.009, z)) for x in (-0.17, -0.1, -0.02, 0.06, 0.14)]
    return [*found, Piece("licence_plate", c.plate, board), Piece("licence_plate", c.letters, join(*marks))]
