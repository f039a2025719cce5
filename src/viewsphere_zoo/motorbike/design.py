"""A motorcycle's parameters, the places that follow from them, and its materials."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material
from viewsphere_zoo.shapes.paint import Color, coated, lamp, linear, metal
from viewsphere_zoo.shapes.solids import Float, Solid, curve, loft

Style = Literal["naked", "sport", "cruiser", "tourer", "scooter"]
Engine = Literal["single", "four", "v_twin"]


@dataclass(frozen=True)
class Motorcycle:
    """Parameters of a motorcycle; lengths in metres, angles in degrees, colours sRGB 0..1.

    wheelbase: between the axles; rake: of the fork from the vertical; fork: its length; radius, tyre (front, rear): of the
    wheels and their tyres' widths; spokes: of a cast wheel, 0 for wire; seat: its height; bar (width, rise): of the handlebar,
    pull: how far back its grips are; screen: height of a windscreen, 0 for none; steering: the bar's turn to the left.
    """

    style: Style = "naked"
    wheelbase: float = 1.42
    rake: float = 25.0
    fork: float = 0.7
    radius: tuple[float, float] = (0.305, 0.312)
    tyre: tuple[float, float] = (0.12, 0.17)
    spokes: int = 5
    seat: float = 0.81
    bar: tuple[float, float] = (0.74, 0.12)
    pull: float = 0.12
    engine: Engine = "four"
    screen: float = 0.0
    top_box: bool = False
    panniers: bool = False
    mufflers: int = 1
    steering: float = 0.0
    color: Color = (0.7, 0.06, 0.07)
    second: Color = (0.08, 0.08, 0.085)
    stripe: Color = (0.93, 0.93, 0.9)
    seat_color: Color = (0.07, 0.07, 0.07)
    rim_color: Color = (0.15, 0.15, 0.16)
    bright: bool = True

    @property
    def front_axle(self) -> Float:
        """(3,), metres."""
        return np.array((0.0, -self.wheelbase / 2, self.radius[0]))

    @property
    def rear_axle(self) -> Float:
        """(3,), metres."""
        return np.array((0.0, self.wheelbase / 2, self.radius[1]))

    @property
    def up(self) -> Float:
        """The fork's direction from the axle upwards, (3,)."""
        a = np.radians(self.rake)
        return np.array((0.0, np.sin(a), np.cos(a)))

    @property
    def head(self) -> Float:
        """The fork's upper end, (3,)."""
        return self.front_axle + self.fork * self.up


@dataclass(frozen=True)
class Coats:
    """Materials."""

    paint: Material
    second: Material
    stripe: Material
    seat: Material
    rim: Material
    engine: Material
    pipe: Material
    chrome: Material
    steel: Material
    black: Material
    rubber: Material
    glass: Material
    white_lamp: Material
    red_lamp: Material
    amber: Material
    plate: Material


def coats(p: Motorcycle) -> Coats:
    """Return the materials of a motorcycle."""
    chrome = metal("chrome", (0.82, 0.83, 0.85), 0.12)
    return Coats(
        paint=coated("paint", p.color, "gloss"),
        second=coated("second_paint", p.second, "gloss"),
        stripe=coated("stripe", p.stripe, "gloss"),
        seat=Material("seat", linear(p.seat_color), roughness=0.6),
        rim=Material("rim", linear(p.rim_color), metallic=0.5, roughness=0.35, clearcoat=0.4),
        engine=metal("engine", (0.6, 0.61, 0.62) if p.bright else (0.16, 0.16, 0.17), 0.45),
        pipe=chrome if p.bright else metal("pipe", (0.28, 0.28, 0.3), 0.35),
        chrome=chrome,
        steel=metal("steel", (0.55, 0.56, 0.58), 0.35),
        black=Material("black", linear((0.06, 0.06, 0.065)), roughness=0.45),
        rubber=Material("rubber", linear((0.09, 0.09, 0.095)), roughness=0.9),
        glass=Material("screen", linear((0.22, 0.25, 0.28)), roughness=0.05, clearcoat=1.0),
        white_lamp=lamp("headlight_lens", (0.94, 0.95, 0.97), 0.3),
        red_lamp=lamp("taillight_lens", (0.75, 0.03, 0.04), 0.3),
        amber=lamp("indicator_lens", (0.95, 0.5, 0.06), 0.15),
        plate=Material("plate", linear((0.93, 0.93, 0.9)), roughness=0.5),
    )


Knot = tuple[float, float, float, float]


def body(knots: list[Knot], exponent: float = 2.6, rings: int = 16, sides: int = 22) -> Solid:
    """A smooth solid along +y through (y, z of its middle, half its width, half its height)."""
    k = np.array(knots)
    y = k[0, 0] + (k[-1, 0] - k[0, 0]) * (1 - np.cos(np.linspace(0, np.pi, rings))) / 2
    z, w, h = (curve(y, k[:, (0, i)]) for i in (1, 2, 3))
    a = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    c, s = np.cos(a), np.sin(a)
    reach = (np.abs(c) ** exponent + np.abs(s) ** exponent) ** (-1 / exponent)
    ring = np.stack(
        [-w[:, None] * c * reach, np.broadcast_to(y[:, None], (rings, sides)), z[:, None] + h[:, None] * s * reach], -1
    )
    return loft(ring)
