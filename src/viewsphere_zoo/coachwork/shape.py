"""The hull, cabin and bed of a car from its parameters, and the proportions of each body style."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from viewsphere_zoo.coachwork.greenhouse import Cell, Greenhouse
from viewsphere_zoo.coachwork.hull import Arch, Hull, Knots, follow
from viewsphere_zoo.coachwork.outline import Outline
from viewsphere_zoo.coachwork.wheels import Wheel
from viewsphere_zoo.shapes.solids import Float

Body = Literal["sedan", "hatchback", "van", "pickup"]


@dataclass(frozen=True)
class Proportions:
    """A side view. Places along the car are fractions of its length from the front, heights fractions of its height.

    cowl and rear_glass: the cabin's ends at the belt; roof_front, roof_rear: at the roof; doors: front edge of the front
    door, middle pillar, rear edge of the rear door; nose, bonnet, belt, boot, tail: the deck's height from front to rear.
    """

    front_axle: float
    rear_axle: float
    cowl: float
    roof_front: float
    roof_rear: float
    rear_glass: float
    doors: tuple[float, float, float]
    nose: float
    bonnet: float
    belt: float
    boot: float
    tail: float
    clearance: float
    tumblehome: float
    cab_end: float = 1.0


PROPORTIONS: dict[Body, Proportions] = {
    "sedan": Proportions(0.185, 0.775, 0.275, 0.42, 0.71, 0.855, (0.3, 0.495, 0.7), 0.5, 0.635, 0.63, 0.665, 0.65, 0.125, 0.15),
    "hatchback": Proportions(
        0.195, 0.815, 0.25, 0.4, 0.885, 0.965, (0.29, 0.53, 0.76), 0.51, 0.635, 0.625, 0.66, 0.65, 0.125, 0.14
    ),
    "van": Proportions(0.175, 0.79, 0.135, 0.285, 0.965, 0.985, (0.2, 0.41, 0.66), 0.46, 0.6, 0.585, 0.59, 0.585, 0.11, 0.1),
    "pickup": Proportions(
        0.17, 0.775, 0.245, 0.345, 0.525, 0.565, (0.265, 0.425, 0.575), 0.61, 0.69, 0.65, 0.655, 0.65, 0.17, 0.13, 0.595
    ),
}


@dataclass(frozen=True)
class Shape:
    """A car's surfaces, metres; made from the outer measures, the proportions and a few styling numbers."""

    body: Body
    length: float
    width: float
    height: float
    proportions: Proportions
    wheel: Wheel
    roundness: float
    dome: float

    def y(self, fraction: float) -> float:
        """Position along the car of a fraction of its length."""
        return (fraction - 0.5) * self.length

    def z(self, fraction: float) -> float:
        """Height of a fraction of the car's height."""
        return fraction * self.height

    @property
    def track(self) -> float:
        """x of the inner walls of the wheel houses."""
        return self.width / 2 - self.wheel.width - 0.09

    @cached_property
    def arches(self) -> tuple[Arch, Arch]:
        """Front and rear wheel opening."""
        r = self.wheel.radius
        p = self.proportions
        front, rear = (Arch(self.y(a), r, r * 1.13 + 0.012) for a in (p.front_axle, p.rear_axle))
        return front, rear

    @cached_property
    def crown(self) -> float:
        """The drop of the deck's sides below its middle."""
        return 0.05 + 0.03 * self.roundness

    @cached_property
    def hull(self) -> Hull:
        """The lower body; of a pickup, the part below bonnet and cab."""
        p, half = self.proportions, self.length / 2
        soft = self.roundness
        end = self.y(p.cab_end)
        pickup = self.body == "pickup"
        square = pickup or self.body == "van"
        outline = Outline(
            -half,
            end,
            self.width / 2,
            (4.4 - 1.6 * soft, 12.0 if pickup else (5.5 if square else 4.6 - 1.4 * soft)),
            (9 - 2.5 * soft, 40.0 if pickup else (18.0 if square else 11 - 3 * soft)),
            (0.1 + 0.1 * soft, 0.0 if pickup else 0.05 + 0.06 * soft),
        )
        arches = self.arches[:1] if pickup else self.arches
        return Hull(
            outline,
            self._center_line,
            self.crown,
            self._sill,
            self._side,
            self._nose,
            self._tail,
            arches,
            edge=0.03 + 0.02 * soft,
            bumper_line=self.z(0.34),
            crease=self._crease,
            dome=self.dome,
            dome_end=self.y(p.cowl) + 0.1,
        )

    @cached_property
    def _center_line(self) -> Knots:
        p, c = self.proportions, self.crown
        drop = 0.055 + 0.03 * self.roundness
        line = [
            (self.y(0.0), self.z(p.nose)),
            (self.y(0.05), self.z(p.nose) + drop),
            (self.y(p.cowl), self.z(p.bonnet) + c * 0.6),
            (self.y(p.cowl + 0.1), self.z(p.belt) + c),
        ]
        if self.body == "pickup":
            return (*line, (self.y(1.0), self.z(p.belt) + c))
        return (*line, (self.y(p.rear_glass - 0.03), self.z(p.boot) + c), (self.y(1.0), self.z(p.tail) + 0.4 * c))

    @cached_property
    def _sill(self) -> Knots:
        low = self.z(self.proportions.clearance)
        return (
            (self.y(0.0), low * 1.25),
            (self.y(0.1), low),
            (self.y(0.86), low),
            (self.y(1.0), low * 1.55),
        )

    @cached_property
    def _side(self) -> Knots:
        z, p = self.z, self.proportions
        low, belt = z(p.clearance), z(p.belt)
        crease = self._crease
        return (
            (low, 0.07),
            (low + 0.08, 0.03),
            (low + 0.17, 0.016),
            (low + 0.45 * (belt - low), 0.002),
            (crease, 0.0),
            (crease + 0.022, 0.014),
            (belt, 0.04 + 0.015 * self.roundness),
            (belt + 0.3, 0.12),
        )

    @property
    def _crease(self) -> float:
        p = self.proportions
        return self.z(p.clearance + 0.72 * (p.belt - p.clearance))

    @cached_property
    def _nose(self) -> Knots:
        z, p = self.z, self.proportions
        low, line, top = z(p.clearance), z(0.34), z(p.nose)
        lean = 0.05 + 0.05 * self.roundness
        return (
            (low, 0.11),
            (low + 0.12, 0.025),
            (line - 0.03, 0.0),
            (line, 0.004),
            (line + 0.02, 0.02),
            (top, lean),
            (top + 0.25, lean + 0.12),
        )

    @cached_property
    def _tail(self) -> Knots:
        z, p = self.z, self.proportions
        low, line, top = z(p.clearance), z(0.34), z(p.tail)
        return (
            (low, 0.13),
            (low + 0.15, 0.03),
            (line - 0.03, 0.0),
            (line, 0.004),
            (line + 0.02, 0.028),
            (0.5 * (line + top), 0.034),
            (top, 0.06 + 0.03 * self.roundness),
            (top + 0.3, 0.14),
        )

    @cached_property
    def cabin(self) -> Greenhouse:
        """The upper body."""
        p = self.proportions
        half = self.width / 2 - self._side[-2][1] - self.hull.edge - 0.012
        lean = p.tumblehome * (0.9 + 0.3 * self.roundness)
        square = self.body in ("van", "pickup")
        rear = (9.0, 14.0) if square else (6.0, 10.0)
        base = Outline(
            self.y(p.cowl), self.y(p.rear_glass), half, (6.0, rear[0]), (12.0, rear[1] * 1.5), (0.2, 0.03 if square else 0.1)
        )
        top = Outline(
            self.y(p.roof_front),
            self.y(p.roof_rear),
            half - lean,
            (6.0, rear[0]),
            (11.0, rear[1]),
            (0.11, 0.02 if square else 0.05),
        )
        return Greenhouse(self.hull, base, top, self._roof, drop=0.045 + 0.03 * self.roundness)

    @cached_property
    def _roof(self) -> Knots:
        p, h = self.proportions, self.height
        front, rear = self.y(p.roof_front), self.y(p.roof_rear)
        fall = {"sedan": 0.05, "hatchback": 0.055, "van": 0.01, "pickup": 0.03}[self.body]
        return ((front, h - 0.045), (front + 0.38 * (rear - front), h), (rear, h - fall))

    def side_cells(self, windows: int, slant: float) -> tuple[Cell, ...]:
        """The left side of the cabin from A to rear pillar: 1, 2 or 3 windows, then panels."""
        base, p = self.cabin.base, self.proportions
        first, last = 1.1, 2.88
        pillar, end = (float(base.u_at_y(self.y(f))) for f in (p.doors[1], p.doors[2]))
        end = min(end, last - 0.12)
        margins = (0.045, 0.035, 0.03, 0.035)
        front = Cell(first, pillar, "window_front", (0.07, 0.035, 0.03, 0.035))
        rest = [
            Cell(pillar, end, "window_rear", margins, slant),
            Cell(end, last, "window_quarter", (0.04, 0.08, 0.045, 0.05), slant),
        ]
        plain = [Cell(c.start, c.stop) for c in rest]
        return (Cell(0.94, first), front, *rest[: windows - 1], *plain[windows - 1 :], Cell(last, 3.12))

    def deck_inner(self) -> Float:
        """Return the line between deck and cabin, (stations, 2), one point for each of the hull's stations."""
        return follow(self.hull, self.cabin.base, 1.15, overlap=0.035)

    @cached_property
    def bed(self) -> Hull:
        """A pickup's load bed from outside."""
        p, hull = self.proportions, self.hull
        outline = Outline(self.y(p.cab_end) + 0.025, self.length / 2, self.width / 2, (12.0, 9.0), (40.0, 26.0), (0.0, 0.02))
        line = ((self.y(0.0), self.z(p.belt) + 0.015), (self.y(1.0), self.z(p.tail) + 0.015))
        flat = ((0.0, 0.02), (3.0, 0.02))
        return Hull(
            outline,
            line,
            0.015,
            self._sill,
            self._side,
            flat,
            self._tail,
            self.arches[1:],
            edge=0.025,
            bumper_line=hull.bumper_line,
            crease=self._crease,
        )

    @cached_property
    def bed_inner(self) -> Outline:
        """The bed's opening."""
        o = self.bed.outline
        return Outline(o.front + 0.07, o.rear - 0.175, o.half_width - 0.13, (12.0, 12.0), (40.0, 40.0), (0.0, 0.0))

    def nose_top(self, u: Float) -> Float:
        """Height where the wall's rounded top edge begins."""
        return self.hull.top(np.asarray(u, np.float64))[1] - self.hull.edge
