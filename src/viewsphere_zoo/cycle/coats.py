"""The materials of one bicycle."""

from __future__ import annotations

from dataclasses import dataclass

from viewsphere.assets.mesh import Material
from viewsphere_zoo.shapes.paint import Color, Finish, coated, lamp, linear, metal


@dataclass(frozen=True)
class Colors:
    """Colours sRGB 0..1; parts: cranks, stem, seat post and hubs; sidewall: of the tyres; grip: of the grips."""

    frame: Color = (0.7, 0.08, 0.1)
    accent: Color = (0.95, 0.95, 0.93)
    fork: Color = (0.7, 0.08, 0.1)
    rim: Color = (0.78, 0.79, 0.8)
    parts: Color = (0.76, 0.77, 0.78)
    tyre: Color = (0.1, 0.1, 0.105)
    sidewall: Color = (0.1, 0.1, 0.105)
    saddle: Color = (0.09, 0.09, 0.09)
    grip: Color = (0.09, 0.09, 0.09)
    extra: Color = (0.85, 0.87, 0.88)
    finish: Finish = "gloss"


@dataclass(frozen=True)
class Coats:
    """The materials of these colours, and the materials that all bicycles share."""

    frame: Material
    accent: Material
    fork: Material
    rim: Material
    parts: Material
    tyre: Material
    sidewall: Material
    saddle: Material
    grip: Material
    extra: Material
    steel: Material
    alloy: Material
    chrome: Material
    black: Material
    rubber: Material
    chain: Material
    stanchion: Material
    wicker: Material
    canvas: Material
    leather: Material
    front_lamp: Material
    rear_lamp: Material
    amber: Material


def coats(c: Colors, canvas: Color) -> Coats:
    """Return the materials of a bicycle of these colours; canvas is the colour of its bags."""
    frame = coated("frame_paint", c.frame, c.finish)
    return Coats(
        frame=frame,
        accent=coated("accent_paint", c.accent, c.finish),
        fork=frame if c.fork == c.frame else coated("fork_paint", c.fork, c.finish),
        rim=Material("rim", linear(c.rim), metallic=0.55, roughness=0.32, clearcoat=0.3),
        parts=Material("parts", linear(c.parts), metallic=0.6, roughness=0.3, clearcoat=0.3),
        tyre=Material("tyre", linear(c.tyre), roughness=0.9),
        sidewall=Material("sidewall", linear(c.sidewall), roughness=0.85),
        saddle=Material("saddle", linear(c.saddle), roughness=0.5, clearcoat=0.15, clearcoat_roughness=0.4),
        grip=Material("grip", linear(c.grip), roughness=0.75),
        extra=coated("extra", c.extra, "gloss"),
        steel=metal("steel", (0.62, 0.63, 0.65), 0.35),
        alloy=metal("alloy", (0.72, 0.73, 0.75), 0.3),
        chrome=metal("chrome", (0.84, 0.85, 0.87), 0.12),
        black=Material("black", linear((0.06, 0.06, 0.065)), roughness=0.42),
        rubber=Material("rubber", linear((0.08, 0.08, 0.085)), roughness=0.85),
        chain=metal("chain", (0.4, 0.39, 0.38), 0.4),
        stanchion=metal("stanchion", (0.8, 0.81, 0.83), 0.08),
        wicker=Material("wicker", linear((0.55, 0.37, 0.2)), roughness=0.8),
        canvas=Material("canvas", linear(canvas), roughness=0.85),
        leather=Material("leather", linear((0.42, 0.23, 0.12)), roughness=0.5),
        front_lamp=lamp("front_lens", (0.93, 0.95, 0.97), 0.25),
        rear_lamp=lamp("rear_lens", (0.75, 0.03, 0.04), 0.25),
        amber=lamp("reflector", (0.95, 0.5, 0.06), 0.1),
    )
