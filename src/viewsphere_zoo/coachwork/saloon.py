"""A complete bus: one long hull, bands of windows, doors, and the fittings of front, rear and roof."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material
from viewsphere_zoo.coachwork import heavy, lights, structure
from viewsphere_zoo.coachwork.coats import Coats
from viewsphere_zoo.coachwork.hull import Arch, Hull
from viewsphere_zoo.coachwork.outline import Outline
from viewsphere_zoo.coachwork.wheels import Wheel
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import Color, lamp
from viewsphere_zoo.shapes.panels import raised, ribbon, straight
from viewsphere_zoo.shapes.solids import both_sides, join, mirrored, moved, rounded_box, tube
from viewsphere_zoo.townscape.lettering import lettering

Style = Literal["city", "coach", "double_decker"]


Livery = Literal["plain", "stripe", "double", "sweep"]


RoofUnit = Literal["none", "rear", "front", "long"]


@dataclass(frozen=True)
class Bus:
    """Parameters of a bus; lengths in metres, colours sRGB 0..1.

    roundness: 0 boxy to 1 soft; pitch: distance from window to window; flush: whether panes lie over one dark band; doors: 1
    to 3, on door_side; split: a windscreen of two panes; route: text on its display, capitals and digits; skirt_color: the
    wall below the bumpers' line, stripe_color: of its livery.
    """

    style: Style = "city"
    length: float = 11.9
    width: float = 2.52
    height: float = 3.05
    roundness: float = 0.4
    wheel_radius: float = 0.48
    pitch: float = 1.45
    flush: bool = True
    doors: int = 2
    door_side: Literal["left", "right"] = "right"
    split: bool = False
    lamps: Literal["slim", "block", "round"] = "block"
    livery: Livery = "plain"
    roof_unit: RoofUnit = "rear"
    rear_window: bool = True
    route: str = "42 STATION"
    color: Color = (0.72, 0.08, 0.09)
    skirt_color: Color = (0.72, 0.08, 0.09)
    roof_color: Color = (0.92, 0.92, 0.9)
    stripe_color: Color = (0.93, 0.93, 0.9)
    rim_color: Color = (0.72, 0.73, 0.75)
    glass_color: Color = (0.12, 0.145, 0.16)

    @property
    def wheel(self) -> Wheel:
        """The measures of the bus' tyres."""
        return Wheel(radius=self.wheel_radius, width=0.28, rim=0.58)


Band = tuple[float, float]


@dataclass(frozen=True)
class Layout:
    """The positions of parts on a style of bus, metres.
    `bands` and `screens`: window bands (low, high) from below, and the windscreen's. `front` and `rear`: the overhangs before
    the front and behind the rear axle. `door` and `skirt`: their tops.
    """

    bands: tuple[Band, ...]
    screens: tuple[Band, ...]
    front: float
    rear: float
    door: float
    skirt: float
    rake: float


LAYOUTS: dict[Style, Layout] = {
    "city": Layout(((1.12, 2.42),), ((0.95, 2.45),), 2.7, 3.2, 2.45, 0.72, 0.1),
    "coach": Layout(((1.72, 3.02),), ((1.05, 3.1),), 2.7, 3.2, 2.75, 1.0, 0.34),
    "double_decker": Layout(((1.12, 2.05), (2.78, 3.72)), ((0.95, 2.1), (2.72, 3.8)), 2.5, 2.6, 2.2, 0.72, 0.12),
}


@dataclass(frozen=True)
class Saloon:
    """The surfaces of one bus."""

    p: Bus

    @property
    def plan(self) -> Layout:
        """The layout of its style."""
        return LAYOUTS[self.p.style]

    @cached_property
    def amber(self) -> Material:
        """The material of the lit letters on its displays."""
        return lamp("destination", (1.0, 0.66, 0.1), 0.9)

    @cached_property
    def axles(self) -> tuple[float, float]:
        """y of the front and the rear axle."""
        share = min(1.0, self.p.length / 11.0)
        return -self.p.length / 2 + share * self.plan.front, self.p.length / 2 - share * self.plan.rear

    @cached_property
    def hull(self) -> Hull:
        """The whole body, roof included."""
        p, half = self.p, self.p.length / 2
        r = 0.12 + 0.2 * p.roundness
        front, rear = (0.69 * half / (1.4 * r), 0.69 * half / r)
        outline = Outline(
            -half, half, p.width / 2, (5.5 - 1.5 * p.roundness, 8.0), (front, rear), (0.05 + 0.13 * p.roundness, 0.03)
        )
        low, top = 0.27, p.height
        drop = 0.05 + 0.14 * p.roundness
        roof = ((-half, top - drop), (-half + 0.9, top - 0.01), (half - 0.6, top - 0.01), (half, top - 0.06))
        rake = self.plan.rake
        nose = ((low, 0.05), (0.45, 0.0), (self.plan.screens[0][0], 0.012), (0.55 * top, 0.25 * rake), (top, rake))
        tail = ((low, 0.08), (0.5, 0.0), (0.5 * top, 0.01), (top, 0.1))
        side = ((low, 0.03), (0.55, 0.0), (0.55 * top, 0.01), (top, 0.09))
        radius = p.wheel_radius
        arches = tuple(Arch(y, radius, radius + 0.09) for y in self.axles)
        return Hull(
            outline,
            roof,
            0.07,
            ((-half, low), (half, low)),
            side,
            nose,
            tail,
            arches,
            edge=0.07 + 0.08 * p.roundness,
            bumper_line=self.plan.skirt,
            crease=0.45 * top,
        )

    @cached_property
    def doors(self) -> tuple[tuple[float, float], ...]:
        """(first y, last y) of the doors: ahead of the front axle, between the axles, behind the rear axle."""
        front, rear = self.axles
        lead = self.flank[0]
        first = (lead, min(lead + 1.25, front - self.p.wheel_radius - 0.2))
        middle = (front + rear) / 2 - 0.2
        return (first, (middle - 0.65, middle + 0.65), (rear + 0.85, rear + 2.05))[: self.p.doors]

    def doors_at(self, low: float) -> list[tuple[float, float]]:
        """The doors that reach into a band of windows from this z; a coach's second one ends below them."""
        if low != self.plan.bands[0][0]:
            return []
        return [*self.doors[:1]] if self.p.style == "coach" else [*self.doors]

    @property
    def flank(self) -> tuple[float, float]:
        """The start and the end of the flat part of the flanks."""
        o = self.hull.outline
        ends = [o.u_at_x(0.993 * o.half_width, rear) for rear in (False, True)]
        front, rear = o.point(np.array(ends))[:, 1].tolist()
        return front, rear

    def u(self, y: float) -> float:
        """The outline's parameter on the left flank."""
        return float(self.hull.outline.u_at_y(y))


def pieces(p: Bus, c: Coats) -> list[Piece]:
    """The whole bus."""
    s = Saloon(p)
    hull = s.hull
    out = p.width / 2 - 0.035
    return [
        *structure.hull_pieces(hull, p.width / 2 - 0.72, c, ("bumper_front", "bumper_rear")),
        Piece("roof", c.roof, heavy.roof(hull)),
        *structure.arch_trims(hull, c, 0.008),
        *heavy.axle("front", s.axles[0], out, p.wheel, False, c),
        *heavy.axle("rear", s.axles[1], out, p.wheel, True, c),
        *_windows(s, c),
        *_doors(s, c),
        *_livery(s, c),
        *_front(s, c),
        *_rear(s, c),
        *_roof(s, c),
    ]


def _windows(s: Saloon, c: Coats) -> list[Piece]:
    """Panes in rows on both flanks, over a dark band if they are flush; the side with doors leaves room for them."""
    p = s.p
    found: list[Piece] = []
    for low, high in s.plan.bands:
        for side, place in (("left", None), ("right", mirrored)):
            doors = s.doors_at(low) if side == p.door_side else []
            panes = []
            for a, b in _free(*s.flank, doors):
                if p.flush:
                    band = heavy.rectangle(s.hull.surface, (s.u(a), s.u(b)), (low - 0.05, high + 0.05), 0.008, 0.02)
                    found.append(Piece("window_band", c.black, place(band) if place else band))
                count = max(1, round((b - a) / p.pitch))
                edge = np.linspace(a, b, count + 1)
                gap = 0.02 if p.flush else 0.05
                for k in range(count):
                    u = (s.u(edge[k] + gap), s.u(edge[k + 1] - gap))
                    panes.append(heavy.rectangle(s.hull.surface, u, (low, high), 0.015, 0.05))
            if panes:
                glass = join(*panes)
                found.append(Piece(f"window_{side}", c.glass, place(glass) if place else glass))
    return found


def _free(start: float, stop: float, doors: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """The spans between doors that are long enough for a window."""
    spans, at = [], start
    for a, b in sorted(doors):
        spans.append((at, a - 0.12))
        at = b + 0.12
    return [(a, b) for a, b in (*spans, (at, stop)) if b - a > 0.45]


def _doors(s: Saloon, c: Coats) -> list[Piece]:
    """Two glazed leaves in a dark frame each."""
    p, surface = s.p, s.hull.surface
    found: list[Piece] = []
    for number, (a, b) in enumerate(s.doors, 1):
        low, high = 0.33, s.plan.door
        if p.style == "coach" and number > 1:
            high = s.plan.bands[0][0] - 0.06
        frame = heavy.rectangle(surface, (s.u(a), s.u(b)), (low, high), 0.011, 0.03)
        middle = (a + b) / 2
        leaves = [
            heavy.rectangle(surface, (s.u(x + 0.05), s.u(y - 0.05)), (low + 0.12, high - 0.1), 0.017, 0.05)
            for x, y in ((a, middle + 0.02), (middle - 0.02, b))
        ]
        rails = [
            tube([raised(surface, np.array([[s.u(middle + d), z]]), 0.03)[0] for z in (0.9, 1.6)], 0.016, 8)
            for d in (-0.09, 0.09)
        ]
        for part, material, solid in (
            (f"door_{number}", c.black, frame),
            (f"door_{number}", c.glass, join(*leaves)),
            (f"door_{number}", c.amber_lamp, join(*rails)),
        ):
            found.append(Piece(part, material, mirrored(solid) if p.door_side == "right" else solid))
    return found


def _livery(s: Saloon, c: Coats) -> list[Piece]:
    """Stripes along the flanks, seams of the flaps below them."""
    p, hull = s.p, s.hull
    y = np.linspace(*s.flank, 40)
    u = hull.outline.u_at_y(y)
    found: list[Piece] = []
    low = s.plan.bands[0][0]
    if p.livery == "stripe":
        z = np.full(40, (s.plan.skirt + low) / 2)
        found.append(Piece("stripe", c.letters, both_sides(ribbon(hull.surface, np.stack([u, z], axis=1), 0.16))))
    elif p.livery == "double":
        z = np.full(40, s.plan.skirt + 0.1)
        lines = [ribbon(hull.surface, np.stack([u, z + d], axis=1), 0.07) for d in (0.0, 0.13)]
        found.append(Piece("stripe", c.letters, both_sides(join(*lines))))
    elif p.livery == "sweep":
        rise = np.clip((y - 0.025 * p.length) / (0.375 * p.length), 0, 1)
        lines = [np.stack([u, s.plan.skirt - 0.12 + d + (low - 0.22 - s.plan.skirt) * rise**1.6], axis=1) for d in (0.0, 0.17)]
        found.append(Piece("stripe", c.letters, both_sides(join(*(ribbon(hull.surface, line, 0.12) for line in lines)))))
    front, rear = s.axles
    places = np.arange(front + 0.95, rear - 0.7, 1.25)
    seams = [ribbon(hull.surface, straight((s.u(v), 0.31), (s.u(v), s.plan.skirt - 0.03), 5)[::-1], 0.012) for v in places]
    found.append(Piece("seam", c.seam, both_sides(join(*seams))))
    return found


def _front(s: Saloon, c: Coats) -> list[Piece]:
    """Windscreens, destination display, lamps, plate, mirrors, wipers."""
    p, hull = s.p, s.hull
    surface, wrap = hull.surface, 1.0 + 0.06 * p.roundness
    found: list[Piece] = []
    for k, (low, high) in enumerate(s.plan.screens):
        found.append(
            Piece("windshield", c.black, heavy.bent(surface, (-wrap - 0.02, wrap + 0.02), (low - 0.06, high + 0.05), 0.01))
        )
        found.append(
            Piece("windshield" if k == 0 else "window_front", c.glass, heavy.bent(surface, (-wrap, wrap), (low, high), 0.017))
        )
    for low, high in s.plan.bands if p.style != "coach" else ():
        u = (wrap + 0.06, s.u(s.flank[0]) - 0.012)
        pane = heavy.bent(surface, u, (low, high), 0.015)
        side = {"right": "left", "left": "right"}[p.door_side]
        found.append(Piece("window_driver", c.glass, mirrored(pane) if side == "right" else pane))
    if p.split:
        low, high = s.plan.screens[0]
        found.append(Piece("seam", c.black, ribbon(surface, straight((0.0, low), (0.0, high), 9)[::-1], 0.05, 0.021)))
    top = s.plan.screens[0][1]
    sign = (top + 0.05, top + 0.4) if p.style != "coach" else (top - 0.32, top - 0.08)
    u = 0.78
    found.append(Piece("destination", c.black, heavy.bent(surface, (-u, u), sign, 0.024, 0.1)))
    text = lettering(p.route, 0.72 * (sign[1] - sign[0]), 0.006, 0.55 * u * p.width)
    found.append(Piece("destination", s.amber, heavy.written(text, hull, sum(sign) / 2, 0.027)))
    z = s.plan.screens[0][0]
    lights_low = (0.5, 0.7) if p.lamps == "slim" else (0.5, 0.78)
    a, b = (0.52, 0.98) if p.lamps == "slim" else (0.62, 0.92)
    found += heavy.sides(
        "headlight", c.black, heavy.bent(surface, (a - 0.03, b + 0.03), (lights_low[0] - 0.03, lights_low[1] + 0.03), 0.005)
    )
    eyes = [(a, (a + b) / 2 - 0.01), ((a + b) / 2 + 0.01, b)]
    lens = join(*(heavy.bent(surface, e, lights_low, 0.012, 0.5 if p.lamps == "round" else 0.2) for e in eyes))
    found += heavy.sides("headlight", c.white_lamp, lens)
    found += heavy.sides("indicator", c.amber_lamp, heavy.bent(surface, (b + 0.04, b + 0.12), lights_low, 0.01, 0.2))
    found += lights.plate(surface, 0.0, 0.42, 1.0, c)
    found.append(
        Piece(
            "grille",
            c.black,
            heavy.bent(surface, (-0.42, 0.42), (z - 0.33, z - 0.16) if p.style == "coach" else (0.58, 0.7), 0.006),
        )
    )
    found.append(Piece("badge", c.chrome, heavy.rectangle(surface, (-0.05, 0.05), (z - 0.16, z - 0.08), 0.01, 0.4)))
    root = surface(1.0, s.plan.screens[-1 if p.style == "coach" else 0][1] - 0.05)
    if p.style == "coach":
        root = surface(0.98, s.plan.screens[0][1] + 0.12)
    found += heavy.arm_mirror(root, 0.24, (0.22, 0.42), 0.38, c, c.black)
    for start, stop in ((-0.75, -0.05), (0.05, 0.75)):
        line = np.stack([np.linspace(start, stop, 7), z + np.linspace(0.03, 0.2, 7)], axis=1)
        found.append(Piece("wiper", c.black, tube(raised(surface, line, 0.03), 0.014, 6)))
    return found


def _rear(s: Saloon, c: Coats) -> list[Piece]:
    """Rear windows, engine grille, lamps, plate."""
    p, hull = s.p, s.hull
    surface = hull.surface
    found: list[Piece] = []
    edge = 4 - float(hull.outline.u_at_x(0.86 * p.width / 2, rear=True))
    for low, high in s.plan.bands if p.rear_window else s.plan.bands[1:]:
        found.append(Piece("window_rear", c.glass, heavy.bent(surface, (4 - edge, 4 + edge), (low + 0.12, high), 0.008, 0.12)))
    inner = 0.55 * edge
    found.append(Piece("engine_grille", c.black, heavy.bent(surface, (4 - inner, 4 + inner), (0.62, 0.98), 0.006)))
    slats = [
        ribbon(surface, straight((4 - 0.95 * inner, z), (4 + 0.95 * inner, z), 9), 0.025, 0.014)
        for z in np.linspace(0.66, 0.94, 6)
    ]
    found.append(Piece("engine_grille", c.steel, join(*slats)))
    for part, material, (low, high) in (
        ("taillight", c.red_lamp, (0.86, 1.06)),
        ("indicator_rear", c.amber_lamp, (0.72, 0.83)),
        ("reversing_light", c.white_lamp, (0.6, 0.69)),
    ):
        found += heavy.sides(part, material, heavy.bent(surface, (4 - 1.04 * edge, 4 - 0.86 * edge), (low, high), 0.012, 0.25))
    high = p.height - 0.34
    brake = heavy.bent(surface, (4 - 0.15 * edge, 4 + 0.15 * edge), (high, high + 0.06), 0.012, 0.2)
    found.append(Piece("brake_light", c.red_lamp, brake))
    number = lettering(p.route.split(" ")[0], 0.2, 0.01)
    z = s.plan.bands[0][1] - 0.28 if p.rear_window else s.plan.bands[0][0] + 0.6
    found.append(
        Piece("destination", c.black, heavy.bent(surface, (4 - 0.4 * edge, 4 + 0.4 * edge), (z - 0.15, z + 0.15), 0.014))
    )
    found.append(Piece("destination", s.amber, heavy.written(number, hull, z, 0.016, True)))
    return found + lights.plate(surface, 4.0, 0.45, -1.0, c)


def _roof(s: Saloon, c: Coats) -> list[Piece]:
    """Air conditioning and hatches."""
    p, half = s.p, s.p.length / 2
    boxes = {
        "none": [],
        "rear": [(0.34 * half, 2.3, 0.3)],
        "front": [(-0.45 * half, 1.9, 0.26)],
        "long": [(0.05 * half, 0.75 * p.length, 0.22)],
    }[p.roof_unit]
    found: list[Piece] = []
    for y, length, tall in boxes:
        wide = p.width * (0.72 if p.roof_unit != "long" else 0.5)
        unit = moved(rounded_box((wide, length, tall + 0.1), 0.09, 3), (0, y, p.height + tall / 2 - 0.06))
        found.append(Piece("roof_unit", c.roof, unit))
        fans = [
            moved(rounded_box((0.5, 0.5, 0.05), 0.02, 1), (x * 0.22 * wide * 2, y, p.height + tall - 0.005))
            for x in (-0.5, 0.5)
        ]
        found.append(Piece("roof_unit", c.black, join(*fans)))
    free = [y for y in (-0.7 * half, 0.0, 0.72 * half) if all(abs(y - b[0]) > b[1] / 2 + 0.45 for b in boxes)]
    if free:
        hatches = [moved(rounded_box((0.75, 0.75, 0.07), 0.03, 2), (0, y, p.height + 0.005)) for y in free]
        found.append(Piece("hatch", c.roof, join(*hatches)))
    return found
