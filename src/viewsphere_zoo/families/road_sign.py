"""Road signs on a pole: speed limit, stop, give way, crossing (shapes and sizes of the Vienna Convention, 1968)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.model.annotations.keypoints import At
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.paint import Color, linear, metal
from viewsphere_zoo.shapes.solids import Float, Solid, join, lathe, moved
from viewsphere_zoo.townscape.surfaces import cuboid, prism

KEYPOINTS = {
    "plate": At("plate", (0, -1, 0)),
    "foot": At("pole", (0, 0, -1)),
}
SKELETON = (("plate", "foot"),)

Kind = Literal["limit", "stop", "give_way", "crossing", "parking"]


@dataclass(frozen=True)
class RoadSign:
    """Parameters of a sign; metres. height: of the sign's top; size: the plate's height; limit: the number on a speed limit."""

    kind: Kind = "limit"
    height: float = 2.7
    size: float = 0.6
    limit: int = 30


def road_sign(parameters: RoadSign | None = None) -> Mesh:
    """The sign in metres, read from -Y, its pole behind it on z = 0. Parts: pole, plate, symbol, back."""
    p = parameters or RoadSign()
    zinc = metal("zinc", (0.6, 0.61, 0.62), 0.45)
    pole = lathe(
        [(0, p.height - 0.03), (0.028, p.height - 0.04), (0.03, p.height - 0.05), (0.03, 0.02), (0.07, 0.0), (0, 0.0)][::-1], 14
    )
    middle = p.height - p.size / 2 - 0.02
    clamps = [cuboid((-0.09, -0.036, middle + z), (0.09, 0.034, middle + z + 0.03)) for z in (-0.16, 0.13)]
    layers = [(part, color, moved(solid, (0, -0.04, middle))) for part, color, solid in _plates(p)]
    pieces = [
        Piece(part, Material(f"{part}_{i}", linear(color), roughness=0.45), s) for i, (part, color, s) in enumerate(layers)
    ]
    return assemble([Piece("pole", zinc, pole), Piece("back", zinc, join(*clamps)), *pieces], crease_deg=35)


_WHITE: Color = (0.95, 0.95, 0.94)
_RED: Color = (0.74, 0.05, 0.07)
_BLUE: Color = (0.06, 0.22, 0.6)
_BLACK: Color = (0.05, 0.05, 0.06)
_GREY: Color = (0.5, 0.51, 0.52)


def _plates(p: RoadSign) -> list[tuple[str, Color, Solid]]:
    """Layers from the back to the front, 2 mm each, about the origin in the plane y = 0."""
    r = p.size / 2
    if p.kind == "limit":
        ring = _regular(36, r)
        return [*_stack(ring, (_GREY, _RED, _WHITE), (1, 1, 0.78)), ("symbol", _BLACK, _digits(str(p.limit), 0.62 * r))]
    if p.kind == "stop":
        ring = _regular(8, r / np.cos(np.pi / 8), np.pi / 8)
        return [*_stack(ring, (_GREY, _WHITE, _RED), (1, 1, 0.92)), ("symbol", _WHITE, _bar(1.3 * r, 0.2 * r, 0.0))]
    if p.kind == "give_way":
        ring = np.add(_regular(3, 1.25 * r, -np.pi / 2), (0, 0.2 * r))
        return _stack(ring, (_GREY, _RED, _WHITE), (1, 1, 0.62), (0, 0.2 * r))
    square = np.array([(-r, -r), (r, -r), (r, r), (-r, r)])
    layers = _stack(square, (_GREY, _WHITE, _BLUE), (1, 1, 0.93))
    if p.kind == "parking":
        return [*layers, ("symbol", _WHITE, _letter_p(r))]
    sign = _regular(3, 0.85 * r, np.pi / 2) - (0, 0.12 * r)
    walker = [_bar(0.1 * r, 0.34 * r, -0.02 * r), _bar(0.44 * r, 0.07 * r, 0.06 * r), _dot(0.08 * r, 0.27 * r)]
    legs = [moved(_bar(0.09 * r, 0.3 * r, -0.3 * r), (x * r, 0, 0)) for x in (-0.1, 0.1)]
    return [
        *layers,
        ("plate", _WHITE, _sheet(sign, 4)),
        ("symbol", _BLACK, moved(join(*walker, *legs), (0, -0.002, -0.12 * r))),
    ]


def _regular(count: int, radius: float, phase: float = 0.0) -> Float:
    a = phase + 2 * np.pi * np.arange(count) / count
    return radius * np.stack([np.cos(a), np.sin(a)], axis=1)


def _sheet(outline: Float, layer: int) -> Solid:
    """A thin plate over an outline in (x, z); higher layers lie further in front."""
    front = -0.004 - 0.002 * layer
    return prism(outline[:, ::-1][::-1], front, front + (0.006 if layer == 0 else 0.002), axis=1)


def _stack(
    ring: Float, colors: tuple[Color, ...], shares: tuple[float, ...], about: tuple[float, float] = (0, 0)
) -> list[tuple[str, Color, Solid]]:
    """Plates that grow smaller towards the front; the first is the metal behind."""
    names = ("back", *["plate"] * (len(colors) - 1))
    outlines = [np.array(about) + (ring - about) * s for s in shares]
    return [(n, c, _sheet(o, k)) for k, (n, c, o) in enumerate(zip(names, colors, outlines, strict=True))]


def _bar(width: float, height: float, z: float) -> Solid:
    return cuboid((-width / 2, -0.012, z - height / 2), (width / 2, -0.008, z + height / 2))


def _dot(radius: float, z: float) -> Solid:
    return moved(prism(_regular(14, radius)[:, ::-1][::-1], -0.012, -0.008, axis=1), (0, 0, z))


_SEGMENTS = {
    "0": "abcdef",
    "1": "bc",
    "2": "abged",
    "3": "abgcd",
    "4": "fgbc",
    "5": "afgcd",
    "6": "afgedc",
    "7": "abc",
    "8": "abcdefg",
    "9": "abcdfg",
}


def _digits(text: str, height: float) -> Solid:
    """Numerals of straight strokes."""
    h, w, t = height, 0.55 * height, 0.15 * height
    at = {
        "a": (0, h / 2),
        "g": (0, 0),
        "d": (0, -h / 2),
        "f": (-w / 2, h / 4),
        "b": (w / 2, h / 4),
        "e": (-w / 2, -h / 4),
        "c": (w / 2, -h / 4),
    }
    strokes: list[Solid] = []
    for k, digit in enumerate(text):
        x0 = (k - (len(text) - 1) / 2) * 1.6 * w
        for name in _SEGMENTS[digit]:
            x, z = at[name]
            size = (w + t, t) if name in "agd" else (t, h / 2 + t)
            strokes.append(moved(_bar(*size, z), (x0 + x, 0, 0)))
    return join(*strokes)


def _letter_p(r: float) -> Solid:
    t = 0.2 * r
    stem = moved(_bar(t, 1.25 * r, 0), (-0.28 * r, 0, 0))
    bows = [moved(_bar(0.6 * r, t, z * r), (0.02 * r, 0, 0)) for z in (0.525, -0.02)]
    return join(stem, *bows, moved(_bar(t, 0.745 * r, 0.2525 * r), (0.32 * r, 0, 0)))


def road_sign_random(rng: np.random.Generator) -> Mesh:
    """A sign with all parameters drawn."""
    return road_sign(draw(rng))


def draw(rng: np.random.Generator) -> RoadSign:
    """The parameters of a random sign."""
    return RoadSign(
        kind=("limit", "stop", "give_way", "crossing", "parking")[int(rng.choice(5, p=(0.3, 0.15, 0.15, 0.25, 0.15)))],
        height=float(rng.uniform(2.4, 2.9)),
        size=float(rng.uniform(0.55, 0.7)),
        limit=int(rng.choice((20, 30, 40, 50))),
    )


FAMILY = ZooFamily(
    random=road_sign_random,
    home="street",
    classes={"": "traffic sign", "pole": "pole"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
)
