"""The materials of one car."""

from __future__ import annotations

from dataclasses import dataclass

from viewsphere.assets.mesh import Material
from viewsphere_zoo.shapes.paint import Color, lamp, linear, metal


@dataclass(frozen=True)
class Coats:
    """Materials: paint, the roof's paint, lower cladding, rims, and the materials that all cars share."""

    paint: Material
    roof: Material
    cladding: Material
    rims: Material
    glass: Material
    chrome: Material
    black: Material
    seam: Material
    rubber: Material
    steel: Material
    under: Material
    white_lamp: Material
    red_lamp: Material
    amber_lamp: Material
    plate: Material
    letters: Material


def car_paint(name: str, color: Color, flakes: float) -> Material:
    """Lacquered paint; flakes 0 (solid) to 1 (strong metallic)."""
    return Material(
        name,
        linear(color),
        metallic=0.45 * flakes,
        roughness=0.42 - 0.1 * flakes,
        clearcoat=1.0,
        clearcoat_roughness=0.03,
    )


def coats(color: Color, roof: Color, flakes: float, rims: Color, painted_cladding: bool, glass: Color) -> Coats:
    """Return the materials of a car of these colours."""
    paint = car_paint("paint", color, flakes)
    plastic = Material("plastic", linear((0.16, 0.16, 0.165)), roughness=0.75)
    return Coats(
        paint=paint,
        roof=paint if roof == color else car_paint("roof_paint", roof, flakes),
        cladding=paint if painted_cladding else plastic,
        rims=Material("alloy", linear(rims), metallic=0.6, roughness=0.3, clearcoat=0.5),
        glass=Material("glass", linear(glass), roughness=0.05, clearcoat=1.0),
        chrome=metal("chrome", (0.8, 0.81, 0.83), 0.12),
        black=Material("black_trim", linear((0.07, 0.07, 0.075)), roughness=0.4),
        seam=Material("seam", linear((0.04, 0.04, 0.04)), roughness=0.9),
        rubber=Material("rubber", linear((0.17, 0.17, 0.175)), roughness=0.9),
        steel=metal("steel", (0.5, 0.5, 0.52), 0.45),
        under=Material("underbody", linear((0.09, 0.09, 0.09)), roughness=0.95),
        white_lamp=lamp("headlight_lens", (0.93, 0.95, 0.97), 0.25),
        red_lamp=lamp("taillight_lens", (0.72, 0.03, 0.04), 0.25),
        amber_lamp=lamp("indicator_lens", (0.95, 0.5, 0.08), 0.15),
        plate=Material("plate", linear((0.93, 0.93, 0.9)), roughness=0.5),
        letters=Material("letters", linear((0.1, 0.1, 0.15)), roughness=0.6),
    )
