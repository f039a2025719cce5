"""Materials that families share; colours are given as sRGB, as in colour pickers, and stored as linear values."""

from __future__ import annotations

from typing import Literal

from viewsphere.assets.mesh import Material
from viewsphere.codecs import srgb

Color = tuple[float, float, float]
Finish = Literal["gloss", "matte", "metal"]


def linear(color: Color, alpha: float = 1.0) -> tuple[float, float, float, float]:
    """Linear RGBA of an sRGB colour in 0..1 (IEC 61966-2-1)."""
    r, g, b = srgb.linear(color).round(5).tolist()
    return r, g, b, alpha


def coated(name: str, color: Color, finish: Finish = "gloss") -> Material:
    """Moulded plastic or lacquer: glossy, matte, or with metal flakes under clear lacquer."""
    if finish == "metal":
        return Material(name, linear(color), metallic=0.35, roughness=0.35, clearcoat=0.6, clearcoat_roughness=0.05)
    if finish == "matte":
        return Material(name, linear(color), roughness=0.7)
    return Material(name, linear(color), roughness=0.25, clearcoat=0.8, clearcoat_roughness=0.03)


def metal(name: str, color: Color, roughness: float = 0.2) -> Material:
    """Bare or plated metal."""
    return Material(name, linear(color), metallic=0.9, roughness=roughness)


def lamp(name: str, color: Color, glow: float = 0.15) -> Material:
    """A lens that shines a little."""
    r, g, b, _ = linear(color)
    return Material(name, linear(color), roughness=0.1, clearcoat=1.0, emissive=(glow * r, glow * g, glow * b))
