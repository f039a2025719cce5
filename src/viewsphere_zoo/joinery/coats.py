"""Materials of chairs and the colours they come in; colours are sRGB 0..1."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material
from viewsphere_zoo.shapes.paint import Color, linear, metal

Cloth = Literal["fabric", "leather", "velvet"]


@dataclass(frozen=True)
class Cover:
    """The material that covers a seat."""

    color: Color = (0.3, 0.36, 0.42)
    cloth: Cloth = "fabric"

    @property
    def material(self) -> Material:
        """The cloth itself."""
        rough, coat = {"fabric": (0.95, 0.0), "velvet": (0.8, 0.0), "leather": (0.42, 0.25)}[self.cloth]
        return Material(self.cloth, linear(self.color), roughness=rough, clearcoat=coat, clearcoat_roughness=0.4)

    @property
    def piping(self) -> Material:
        """A darker edge of the same cloth."""
        return Material(f"{self.cloth}_piping", linear(shaded(self.color, 0.72)), roughness=0.8)


WOODS: dict[str, Color] = {
    "beech": (0.76, 0.59, 0.41),
    "oak": (0.66, 0.48, 0.3),
    "ash": (0.82, 0.69, 0.51),
    "teak": (0.53, 0.37, 0.22),
    "cherry": (0.5, 0.3, 0.18),
    "walnut": (0.33, 0.23, 0.155),
    "mahogany": (0.3, 0.16, 0.11),
    "ebonised": (0.1, 0.085, 0.075),
    "white": (0.9, 0.89, 0.86),
    "sage": (0.52, 0.6, 0.5),
    "blue": (0.2, 0.33, 0.47),
    "red": (0.62, 0.11, 0.09),
    "yellow": (0.86, 0.65, 0.16),
}
"""Woods, and paints on wood."""

_PAINTS = ("white", "sage", "blue", "red", "yellow", "ebonised")
_CLOTHS: tuple[Color, ...] = (
    (0.3, 0.33, 0.37),
    (0.66, 0.6, 0.5),
    (0.16, 0.24, 0.38),
    (0.13, 0.38, 0.34),
    (0.72, 0.5, 0.14),
    (0.6, 0.2, 0.13),
    (0.56, 0.64, 0.58),
    (0.74, 0.45, 0.4),
    (0.42, 0.14, 0.2),
    (0.82, 0.79, 0.72),
    (0.12, 0.12, 0.13),
    (0.35, 0.5, 0.66),
    (0.36, 0.42, 0.22),
    (0.36, 0.29, 0.37),
    (0.5, 0.49, 0.46),
)
_LEATHERS: tuple[Color, ...] = (
    (0.08, 0.075, 0.07),
    (0.3, 0.16, 0.09),
    (0.55, 0.31, 0.15),
    (0.85, 0.8, 0.71),
    (0.4, 0.08, 0.07),
    (0.12, 0.2, 0.17),
    (0.28, 0.27, 0.26),
)
PLASTICS: tuple[Color, ...] = (
    (0.9, 0.9, 0.88),
    (0.1, 0.1, 0.105),
    (0.78, 0.13, 0.1),
    (0.93, 0.66, 0.1),
    (0.12, 0.42, 0.52),
    (0.42, 0.62, 0.34),
    (0.9, 0.45, 0.12),
    (0.55, 0.66, 0.74),
    (0.82, 0.55, 0.55),
)


def shaded(color: Color, factor: float) -> Color:
    """The colour made darker or lighter."""
    r, g, b = (min(1.0, c * factor) for c in color)
    return r, g, b


def timber(color: Color) -> tuple[Material, Material, Material]:
    """One wood in three boards that differ a little, as sawn wood does; lacquered silk-matt."""

    def board(name: str, shade: float) -> Material:
        return Material(name, linear(shaded(color, shade)), roughness=0.5, clearcoat=0.25, clearcoat_roughness=0.3)

    return board("wood", 1.0), board("wood_light", 1.06), board("wood_dark", 0.92)


def plastic(name: str, color: Color, roughness: float = 0.45) -> Material:
    """Moulded plastic."""
    return Material(name, linear(color), roughness=roughness, clearcoat=0.15, clearcoat_roughness=0.3)


def lacquered(color: Color) -> Material:
    """Powder-coated steel tube."""
    return Material("coated_steel", linear(color), roughness=0.4, clearcoat=0.3, clearcoat_roughness=0.15)


CHROME = metal("chrome", (0.77, 0.78, 0.8), 0.16)
BRASS = metal("brass", (0.72, 0.55, 0.28), 0.25)
STEEL = metal("steel", (0.56, 0.57, 0.59), 0.4)
RUBBER = Material("rubber", linear((0.09, 0.09, 0.095)), roughness=0.9)


def drawn_color(colors: tuple[Color, ...], rng: np.random.Generator, hue: float = 0.012) -> Color:
    """One of these colours, a little off: lighter or darker, and by about `hue` in each channel."""
    base = np.array(colors[int(rng.integers(len(colors)))])
    r, g, b = np.clip(base * rng.uniform(0.88, 1.1) + rng.normal(0, hue, 3), 0.03, 0.95)
    return float(r), float(g), float(b)


def drawn_wood(rng: np.random.Generator, painted: float = 0.25) -> Color:
    """A wood's colour, or with this probability a paint's."""
    paint = rng.random() < painted
    return drawn_color(tuple(c for name, c in WOODS.items() if (name in _PAINTS) == paint), rng, 0.006)


def drawn_cover(rng: np.random.Generator, leather: float = 0.3) -> Cover:
    """A cover of leather (with this probability), fabric or velvet."""
    if rng.random() < leather:
        return Cover(drawn_color(_LEATHERS, rng), "leather")
    return Cover(drawn_color(_CLOTHS, rng), "velvet" if rng.random() < 0.3 else "fabric")
