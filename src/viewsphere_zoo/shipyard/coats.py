"""The materials of one boat."""

from __future__ import annotations

from dataclasses import dataclass

from viewsphere.assets.mesh import Material
from viewsphere_zoo.shapes.paint import Color, lamp, linear, metal

WHITE: Color = (0.93, 0.93, 0.91)
TEAK: Color = (0.62, 0.42, 0.25)
MAHOGANY: Color = (0.42, 0.17, 0.08)


@dataclass(frozen=True)
class Coats:
    """Materials: topsides, bottom, stripes, deck, wood, and the materials that all boats share."""

    hull: Material
    bottom: Material
    boot: Material
    stripe: Material
    deck: Material
    inside: Material
    wood: Material
    planks: Material
    cushion: Material
    glass: Material
    steel: Material
    alloy: Material
    black: Material
    rubber: Material
    rope: Material
    white: Material
    accent: Material
    bronze: Material
    red_lamp: Material
    green_lamp: Material
    white_lamp: Material


def gelcoat(name: str, color: Color) -> Material:
    """Polished resin or yacht enamel."""
    return Material(name, linear(color), roughness=0.28, clearcoat=0.9, clearcoat_roughness=0.04)


def varnish(name: str, color: Color) -> Material:
    """Varnished wood."""
    return Material(name, linear(color), roughness=0.35, clearcoat=0.7, clearcoat_roughness=0.08)


def coats(
    hull: Color,
    bottom: Color,
    boot: Color,
    stripe: Color,
    deck: Color,
    wood: Color = TEAK,
    cushion: Color = WHITE,
    accent: Color = (0.1, 0.1, 0.11),
    varnished: bool = False,
    inside: Color | None = None,
) -> Coats:
    """Return the materials of a boat of these colours; varnished: the hull is of varnished wood."""
    planks: Color = (min(1, wood[0] * 0.82), wood[1] * 0.78, wood[2] * 0.75)
    return Coats(
        hull=varnish("hull", hull) if varnished else gelcoat("hull", hull),
        bottom=Material("antifouling", linear(bottom), roughness=0.75),
        boot=gelcoat("boot_stripe", boot),
        stripe=gelcoat("stripe", stripe),
        deck=Material("deck", linear(deck), roughness=0.6),
        inside=Material("inside", linear(inside or deck), roughness=0.55),
        wood=varnish("wood", wood),
        planks=Material("planks", linear(planks), roughness=0.65),
        cushion=Material("cushion", linear(cushion), roughness=0.7),
        glass=Material("glass", linear((0.16, 0.21, 0.25)), roughness=0.05, clearcoat=1.0),
        steel=metal("steel", (0.8, 0.81, 0.83), 0.2),
        alloy=metal("alloy", (0.72, 0.73, 0.75), 0.4),
        black=Material("black_trim", linear((0.07, 0.07, 0.075)), roughness=0.4),
        rubber=Material("rubber", linear((0.12, 0.12, 0.125)), roughness=0.85),
        rope=Material("rope", linear((0.85, 0.82, 0.72)), roughness=0.9),
        white=gelcoat("white", WHITE),
        accent=gelcoat("accent", accent),
        bronze=metal("bronze", (0.7, 0.5, 0.25), 0.35),
        red_lamp=lamp("red_lamp", (0.8, 0.04, 0.05), 0.3),
        green_lamp=lamp("green_lamp", (0.05, 0.6, 0.2), 0.3),
        white_lamp=lamp("white_lamp", (0.95, 0.95, 0.9), 0.3),
    )
