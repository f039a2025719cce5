"""Bollards: of steel, cast iron and concrete, and guard posts in warning colours."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.model.annotations.keypoints import At
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.paint import Color, coated, linear, metal
from viewsphere_zoo.shapes.rods import ring_of
from viewsphere_zoo.shapes.solids import Float, lathe, moved, rounded_box

KEYPOINTS = {"top": At("cap|post", (0, 0, 1)), "foot": At("foot|post", (0, 0, -1))}
SKELETON = (("top", "foot"),)

Style = Literal["steel", "iron", "concrete", "guard"]


@dataclass(frozen=True)
class Bollard:
    """Parameters of a bollard; metres, colours sRGB 0..1. bands: heights of reflecting bands as shares of the height; top:
    shape of the post's top; plate: whether it is bolted down on a flange; sides: number of the post's sides, 0 for round.
    """

    style: Style = "iron"
    height: float = 1.0
    radius: float = 0.09
    top: Literal["flat", "dome", "ball", "crown"] = "dome"
    bands: tuple[float, ...] = (0.78,)
    plate: bool = False
    sides: int = 0
    color: Color = (0.07, 0.08, 0.08)
    band_color: Color = (0.93, 0.93, 0.91)


def bollard(parameters: Bollard | None = None) -> Mesh:
    """The bollard in metres, its axis the z axis. Parts: foot, post, cap, band."""
    p = parameters or Bollard()
    paint = {
        "steel": metal("steel", p.color, 0.3),
        "concrete": Material("concrete", linear(p.color), roughness=0.92),
    }.get(p.style, coated("paint", p.color, "gloss" if p.style == "guard" else "matte"))
    band = Material("band", linear(p.band_color), roughness=0.3, clearcoat=0.3)
    n = p.sides or 28
    pieces = [
        Piece("foot", paint, lathe(_foot(p), n)),
        Piece("post", paint, lathe(_post(p), n)),
        Piece("cap", paint, lathe(_cap(p), n)),
    ]
    for share in p.bands:
        half = 0.05 if p.style == "guard" else 0.035
        z = p.height * np.array([share - half, share - half, share + half, share + half])
        r = _radius(p, share * p.height) * np.array([0.98, 1.035, 1.035, 0.98])
        pieces.append(Piece("band", band, lathe(np.stack([r, z], axis=1), n)))
    if p.plate:
        bolt = lathe([(0.014, 0.0), (0.014, 0.02), (0.0, 0.022)], 6)
        place = moved(bolt, (1.7 * p.radius, 0, 0.018))
        pieces.append(Piece("foot", metal("bolt", (0.6, 0.61, 0.62), 0.4), ring_of(place, 4, 2, np.pi / 4)))
        pieces.append(Piece("foot", paint, moved(rounded_box((4 * p.radius, 4 * p.radius, 0.02), 0.006, 1), (0, 0, 0.01))))
    return assemble(pieces, crease_deg=35)


def _radius(p: Bollard, z: float) -> float:
    """Radius of the post at this height."""
    share = z / p.height
    return p.radius * {"iron": 1.06 - 0.2 * share, "concrete": 1.12 - 0.26 * share}.get(p.style, 1.0)


def _foot(p: Bollard) -> Float:
    """Return the profile of the foot on the ground."""
    r = _radius(p, 0.0)
    if p.style != "iron":
        return np.array([(0, 0), (1.15 * r, 0), (1.15 * r, 0.03), (1.02 * r, 0.045), (0.9 * r, 0.045)])
    steps = [
        (0, 0),
        (1.7, 0),
        (1.7, 0.05),
        (1.55, 0.07),
        (1.55, 0.16),
        (1.62, 0.18),
        (1.5, 0.21),
        (1.2, 0.24),
        (1.12, 0.3),
        (1.0, 0.3),
    ]
    return np.array([(q * r, z * p.height) for q, z in steps])


def _neck(p: Bollard) -> float:
    """Height at which the cap begins."""
    return p.height - {"flat": 0.02, "dome": 0.75 * p.radius, "ball": 2.4 * p.radius, "crown": 1.9 * p.radius}[p.top]


def _post(p: Bollard) -> Float:
    """The shaft; one of cast iron has rings around it."""
    top = _neck(p)
    low = 0.28 * p.height if p.style == "iron" else 0.02
    rows = [(_radius(p, z), z) for z in np.linspace(low, top, 5)]
    if p.style == "iron":
        for z in (0.5 * (low + top), top - 0.05):
            r = _radius(p, z)
            rows += [(r, z - 0.02), (1.14 * r, z - 0.012), (1.18 * r, z), (1.14 * r, z + 0.012), (r, z + 0.02)]
    return np.array(sorted(rows, key=lambda q: q[1]))


def _cap(p: Bollard) -> Float:
    """The cap, from the neck to the top."""
    z, r, h = _neck(p), _radius(p, _neck(p)), p.height
    a = np.linspace(0, np.pi / 2, 7)
    if p.top == "flat":
        return np.array([(r, z - 0.002), (r, h - 0.012), (0.9 * r, h), (0, h)])
    if p.top == "dome":
        return np.stack([r * np.cos(a), z + (h - z) * np.sin(a)], axis=1)
    if p.top == "ball":
        b = np.linspace(-1.1, np.pi / 2, 11)
        ball = np.stack([1.05 * p.radius * np.cos(b), h - 1.05 * p.radius + 1.05 * p.radius * np.sin(b)], axis=1)
        collar = [(r, z - 0.002), (1.25 * r, z), (1.3 * r, z + 0.02), (1.1 * r, z + 0.04), (0.6 * r, z + 0.05)]
        return np.concatenate([collar, ball])
    crown = [
        (1.0, 0.0),
        (1.35, 0.06),
        (1.4, 0.2),
        (1.15, 0.28),
        (1.2, 0.4),
        (1.0, 0.62),
        (0.55, 0.78),
        (0.5, 0.84),
        (0.38, 0.95),
        (0, 1.0),
    ]
    return np.array([(q * r, z + (h - z) * s) for q, s in crown])


def bollard_random(rng: np.random.Generator) -> Mesh:
    """A bollard with all parameters drawn."""
    return bollard(draw(rng))


_COLORS: dict[Style, tuple[Color, ...]] = {
    "steel": ((0.74, 0.75, 0.77), (0.55, 0.56, 0.58), (0.3, 0.31, 0.33)),
    "iron": ((0.06, 0.065, 0.065), (0.07, 0.17, 0.12), (0.09, 0.12, 0.22), (0.3, 0.05, 0.07)),
    "concrete": ((0.68, 0.67, 0.64), (0.6, 0.57, 0.52), (0.76, 0.74, 0.7)),
    "guard": ((0.95, 0.75, 0.06), (0.95, 0.75, 0.06), (0.93, 0.93, 0.91), (0.85, 0.1, 0.08)),
}
_BANDS: dict[Style, tuple[Color, ...]] = {
    "steel": ((0.93, 0.93, 0.91), (0.8, 0.1, 0.08), (0.95, 0.75, 0.06)),
    "iron": ((0.93, 0.93, 0.91), (0.75, 0.6, 0.2), (0.8, 0.1, 0.08)),
    "concrete": ((0.93, 0.93, 0.91), (0.8, 0.1, 0.08)),
    "guard": ((0.06, 0.06, 0.06), (0.06, 0.06, 0.06), (0.8, 0.08, 0.07), (0.95, 0.95, 0.94)),
}


def draw(rng: np.random.Generator) -> Bollard:
    """The parameters of a random bollard."""
    style: Style = ("steel", "iron", "concrete", "guard")[int(rng.choice(4, p=(0.26, 0.36, 0.14, 0.24)))]
    kind = int(rng.integers(len(_COLORS[style])))
    r, g, b = (np.array(_COLORS[style][kind]) * rng.uniform(0.88, 1.08)).clip(0.03, 0.96).tolist()
    tops: dict[Style, tuple[Literal["flat", "dome", "ball", "crown"], ...]] = {
        "steel": ("flat", "dome", "ball"),
        "iron": ("crown", "ball", "dome", "crown"),
        "concrete": ("dome", "flat"),
        "guard": ("dome", "flat"),
    }
    sets: dict[Style, tuple[tuple[float, ...], ...]] = {
        "steel": ((0.8,), (0.72, 0.84), ()),
        "iron": ((0.74,), (), (0.42, 0.74)),
        "concrete": ((0.78,), (), (0.6, 0.78)),
        "guard": ((0.3, 0.55, 0.8), (0.35, 0.7), (0.62, 0.82)),
    }
    bands = sets[style][int(rng.integers(3))]
    return Bollard(
        style=style,
        height=float(rng.uniform(0.85, 1.15)),
        radius=float({"steel": 0.065, "iron": 0.085, "concrete": 0.14, "guard": 0.075}[style] * rng.uniform(0.85, 1.25)),
        top=tops[style][int(rng.integers(len(tops[style])))],
        bands=bands,
        plate=style in ("steel", "guard") and bool(rng.random() < 0.5),
        sides=int(rng.choice((0, 8), p=(0.6, 0.4))) if style in ("iron", "concrete") else 0,
        color=(r, g, b),
        band_color=_BANDS[style][kind % len(_BANDS[style])]
        if style == "guard"
        else _BANDS[style][int(rng.integers(len(_BANDS[style])))],
    )


FAMILY = ZooFamily(
    random=bollard_random,
    home="street",
    classes={"": "street furniture"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
)
