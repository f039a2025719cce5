"""Standing lamps: on the floor (column, tripod, arc, reading lamp) or on a table (body and shade, jointed arm, globe)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.model.annotations.keypoints import At
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.furnishing.casework import block, footed
from viewsphere_zoo.furnishing.coats import BLACK_STEEL, WHITE_STEEL, Timber, Wood, drawn_wood, furnished, grain
from viewsphere_zoo.joinery.coats import BRASS, CHROME, drawn_color
from viewsphere_zoo.joinery.members import spindle
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import Color, linear
from viewsphere_zoo.shapes.rods import aimed, ring_of, rod, shifted
from viewsphere_zoo.shapes.solids import Float, Solid, curve, flipped, grid, join, lathe, moved, superellipse, tube

KEYPOINTS = {
    "foot": At("base|leg", (0, 0, -1)),
    "bulb": At("bulb"),
    "shade": At("shade"),
    "shade_top": At("shade", (0, 0, 1)),
}
SKELETON = (
    ("foot", "bulb"),
    ("bulb", "shade_top"),
)

Style = Literal["column", "tripod", "arc", "reading", "table", "desk", "globe"]
Shade = Literal["drum", "cone", "bell", "square"]
Body = Literal["gourd", "urn", "bottle", "ball", "candlestick", "block"]
Metal = Literal["black", "white", "brass", "chrome"]
METALS = {"black": BLACK_STEEL, "white": WHITE_STEEL, "brass": BRASS, "chrome": CHROME}

_BODIES: dict[Body, tuple[tuple[float, float], ...]] = {
    "gourd": ((0.55, 0), (0.6, 0.03), (1.0, 0.28), (0.55, 0.58), (0.62, 0.74), (0.3, 0.94), (0.12, 1)),
    "urn": ((0.6, 0), (0.62, 0.05), (0.35, 0.1), (0.85, 0.45), (1.0, 0.7), (0.7, 0.88), (0.25, 0.93), (0.3, 1)),
    "bottle": ((0.8, 0), (0.95, 0.04), (1.0, 0.3), (0.85, 0.55), (0.3, 0.72), (0.22, 0.95), (0.26, 1)),
    "ball": ((0.3, 0), (0.62, 0.09), (0.93, 0.3), (1.0, 0.5), (0.93, 0.7), (0.62, 0.9), (0.18, 1)),
    "candlestick": ((1.0, 0), (1.0, 0.03), (0.4, 0.08), (0.25, 0.2), (0.4, 0.3), (0.22, 0.4), (0.3, 0.7), (0.2, 0.8), (0.4, 1)),
    "block": ((0.8, 0), (0.8, 1.0)),
}
"""Profiles of table lamps' bodies: half widths as shares of the largest, heights as shares of the body's height."""


@dataclass(frozen=True)
class Lamp:
    """Parameters of a lamp; lengths in metres.

    height: to the top; shade: its form; shade_radius, shade_height, narrow: the shade's size, and its upper radius as a share
    of the lower; reach: how far an arc or an arm reaches out (-Y); body, body_color: of a table lamp; wooden: body, column or
    legs of wood; glow: how brightly the shade shines; seed: of the grain.
    """

    style: Style = "column"
    height: float = 1.55
    shade: Shade = "drum"
    shade_radius: float = 0.2
    shade_height: float = 0.26
    narrow: float = 0.8
    shade_color: Color = (0.93, 0.88, 0.78)
    reach: float = 0.9
    body: Body = "gourd"
    body_color: Color = (0.2, 0.42, 0.5)
    wooden: bool = False
    metal: Metal = "black"
    glow: float = 0.6
    wood: Wood = field(default_factory=Wood)
    seed: int = 0

    @property
    def extent(self) -> tuple[float, float, float]:
        """Greatest width, depth and height of the whole model, metres."""
        wide = 2 * self.shade_radius + (0.32 if self.style == "tripod" else 0.04)
        return wide, wide, self.height


@dataclass(frozen=True)
class _Coats:
    metal: Material
    timber: Timber
    body: Material
    shade: Material
    inner: Material
    bulb: Material


def lamp(parameters: Lamp | None = None) -> Mesh:
    """The lamp in metres, standing on z = 0; arcs and arms reach towards -Y. Parts: base or leg, stem, shade, bulb; body."""
    p = parameters or Lamp()
    images = [grain(np.random.default_rng(p.seed), p.wood)]
    r, g, b, _ = linear(p.shade_color)
    warm = (p.glow * r, 0.82 * p.glow * g, 0.58 * p.glow * b)
    bright = (2.6 * p.glow + 0.2, 2.2 * p.glow + 0.17, 1.5 * p.glow + 0.12)
    timber = p.wood.timber(0)
    coats = _Coats(
        METALS[p.metal],
        timber,
        timber.upright if p.wooden else Material("glaze", linear(p.body_color), roughness=0.25, clearcoat=0.8),
        Material("shade", linear(p.shade_color), roughness=0.9, emissive=warm),
        Material("shade_metal", linear(p.shade_color), roughness=0.4, clearcoat=0.5),
        Material("bulb", linear((0.98, 0.95, 0.88)), roughness=0.3, emissive=bright),
    )
    return furnished(_STYLES[p.style](p, coats), images, 38)


def bulb(parameters: Lamp) -> tuple[float, float, float]:
    """The middle of the bulb, in the model's axes, metres: where a point light belongs."""
    p = parameters
    if p.style == "arc":
        _, y, z = _arc_path(p)[-1].tolist()
        return 0.0, y, z - 0.75 * p.shade_radius - 0.03
    if p.style in ("desk", "reading"):
        x, y, z = (_head(p) + 0.055 * _aim(p)).tolist()
        return x, y, z
    if p.style == "globe":
        return 0.0, 0.0, p.height - p.shade_radius
    return 0.0, 0.0, p.height - 0.52 * p.shade_height


def _hollow(p: Lamp, low: float) -> Solid:
    """The shade about the z axis, its lower rim at z = low, open above and below."""
    t, r, h = 0.004, p.shade_radius, p.shade_height
    if p.shade == "square":
        outline = superellipse(1.12, 1.12, 9.0, 32)
        turned = [(r, low), (p.narrow * r, low + h), (p.narrow * r - t, low + h), (r - t, low), (r, low)]
        rings = np.array([np.column_stack([outline * s, np.full(32, z)]) for s, z in turned])
        return _skin(rings)
    s = np.linspace(0, 1, 7) if p.shade == "bell" else np.array([0.0, 1.0])
    wide = (p.narrow + (1 - p.narrow) * ((1 - s) ** (2.2 if p.shade == "bell" else 1))) * r
    outer = np.stack([wide, low + h * s], axis=1)
    return lathe(np.concatenate([outer, outer[::-1] - (t, 0), outer[:1]]), 36)


def _skin(rings: Float) -> Solid:
    """A closed skin over rings that come back to the first."""
    return flipped(grid(rings, wrap=True))


def _lit(p: Lamp, coats: _Coats) -> list[Piece]:
    """Shade, its rings and spokes, and the bulb, on the z axis."""
    low = p.height - p.shade_height
    x, y, z = bulb(p)
    spokes = ring_of(rod((0.012, 0, p.height - 0.02), (p.narrow * p.shade_radius - 0.002, 0, p.height - 0.02), 0.002, 5), 3)
    socket = lathe([(0, z - 0.09), (0.018, z - 0.09), (0.018, z - 0.03), (0, z - 0.03)], 12)
    stem = rod((0, 0, z), (0, 0, p.height - 0.012), 0.004, 6)
    return [
        Piece("shade", coats.shade, _hollow(p, low)),
        Piece("stem", coats.metal, join(spokes, socket, stem)),
        Piece("bulb", coats.bulb, moved(_ball(0.032), (x, y, z))),
    ]


def _ball(radius: float, segments: int = 14) -> Solid:
    a = np.linspace(-np.pi / 2, np.pi / 2, 9)
    return lathe(radius * np.stack([np.cos(a), np.sin(a)], axis=1), segments)


def _disc(radius: float, high: float) -> Solid:
    """A round foot on the floor."""
    edge = [(0, 0), (radius, 0), (radius, 0.5 * high), (0.94 * radius, high), (0.12 * radius, 1.15 * high), (0, 1.15 * high)]
    return lathe(edge, 36)


def _column(p: Lamp, coats: _Coats) -> list[Piece]:
    """A floor lamp: a slim column on a round foot."""
    stem = rod((0, 0, 0.01), (0, 0, bulb(p)[2] - 0.06), 0.012 if not p.wooden else 0.019, 12)
    coat = coats.timber.upright if p.wooden else coats.metal
    return [Piece("base", coat, _disc(0.15, 0.022)), Piece("stem", coat, stem), *_lit(p, coats)]


def _tripod(p: Lamp, coats: _Coats) -> list[Piece]:
    """Three slanting wooden legs that meet under the shade."""
    top = p.height - p.shade_height - 0.03
    leg = footed(spindle((0.26 + 0.1 * p.height, 0, 0), (0.025, 0, top), [(0, 0.011), (0.6, 0.017), (1, 0.014)], 12))
    hub = lathe(
        [
            (0, top - 0.06),
            (0.05, top - 0.06),
            (0.05, top),
            (0.014, top + 0.02),
            (0.012, bulb(p)[2] - 0.05),
            (0, bulb(p)[2] - 0.05),
        ],
        20,
    )
    coat = coats.timber.upright if p.wooden else coats.metal
    return [Piece("leg", coat, ring_of(leg, 3, 2, np.pi / 2)), Piece("stem", coats.metal, hub), *_lit(p, coats)]


def _arc_path(p: Lamp) -> Float:
    """The middle of an arc's tube, from its foot at the rear to where its shade hangs."""
    rear, half = 0.3, (p.reach + 0.3) / 2
    a = np.linspace(0, 0.79 * np.pi, 24)
    bow = np.stack([0 * a, rear - half + half * np.cos(a), 0.5 * p.height * (1 + np.sin(a))], axis=1)
    return np.concatenate([[(0, rear, 0.05)], bow, bow[-1:] - (0, 0.02, 0.04)])


def _arc(p: Lamp, coats: _Coats) -> list[Piece]:
    """A bow from a heavy foot far over to the front, with a dome at its end."""
    path, r, (x, y, z) = _arc_path(p), p.shade_radius, bulb(p)
    b = np.linspace(0.04, np.pi / 2, 9)
    outer = np.stack([r * np.sin(b), 0.75 * r * np.cos(b)], axis=1)
    dome = lathe(np.concatenate([outer[::-1], outer * 0.97, outer[-1:]]), 32)
    foot = block((-0.16, path[0, 1] - 0.12, 0), (0.16, path[0, 1] + 0.12, 0.09), 0.012)
    marble = Material("stone", linear((0.9, 0.89, 0.87)), roughness=0.2, clearcoat=0.6)
    collar = lathe([(0, 0.72 * r), (0.02, 0.72 * r), (0.02, 0.75 * r + 0.04), (0, 0.75 * r + 0.04)], 12)
    return [
        Piece("base", marble, foot),
        Piece("stem", coats.metal, join(tube(path, 0.012, 8), moved(collar, (0, y, z)))),
        Piece("shade", coats.metal, moved(dome, (0, y, z))),
        Piece("bulb", coats.bulb, moved(_ball(0.045), (x, y, z))),
    ]


def _aim(p: Lamp) -> Float:
    """The unit direction in which a head shines: down and to the front."""
    tilt = np.radians(62 if p.style == "desk" else 50)
    return np.array((0.0, -np.cos(tilt), -np.sin(tilt)))


def _head(p: Lamp) -> Float:
    """The middle of a jointed lamp's head."""
    return np.array((0.0, -p.reach, p.height - 0.06))


def _spot(p: Lamp, coats: _Coats, coat: Material) -> list[Piece]:
    """A bell that shines along its aim, and its bulb."""
    r, long = 0.34 * p.shade_radius + 0.03, 0.085 + 0.1 * p.shade_radius
    s = np.array([(0.32, -0.55), (0.4, -0.4), (0.5, -0.1), (0.8, 0.4), (1.0, 0.75), (1.03, 0.8)])
    outer = s * (r, long)
    inner = outer[::-1] * (0.94, 1) - (0.0, 0.002)
    bell = lathe(np.concatenate([[(0, outer[0, 1])], outer, inner, [(0, inner[-1, 1] + 0.02)]]), 28)
    at, aim = _head(p), _aim(p)
    neck = rod(at - 0.55 * long * aim, at - (0.55 * long + 0.035) * aim, 0.014, 10)
    return [
        Piece("shade", coat, aimed(bell, at, aim)),
        Piece("stem", coats.metal, neck),
        Piece("bulb", coats.bulb, moved(_ball(0.5 * r), at + 0.055 * aim)),
    ]


def _reading(p: Lamp, coats: _Coats) -> list[Piece]:
    """A column beside the chair, an arm at its top with a small bell."""
    at = _head(p) - (0.55 * (0.085 + 0.1 * p.shade_radius) + 0.03) * _aim(p)
    top = at[2] - 0.02
    stems = [rod((0, 0, 0.01), (0, 0, top + 0.03), 0.011, 12), rod((0, 0.06, top), at, 0.007, 8)]
    joint = aimed(lathe([(0, -0.02), (0.018, -0.02), (0.018, 0.02), (0, 0.02)], 14), (0, 0, top), (1, 0, 0), (0, 1, 0))
    return [
        Piece("base", coats.metal, _disc(0.14, 0.02)),
        Piece("stem", coats.metal, join(*stems, joint)),
        *_spot(p, coats, coats.inner),
    ]


def _desk(p: Lamp, coats: _Coats) -> list[Piece]:
    """Two arms with joints between foot and head."""
    foot, head = np.array((0.0, 0.06, 0.03)), _head(p) - (0.55 * (0.085 + 0.1 * p.shade_radius) + 0.03) * _aim(p)
    elbow = np.array((0.0, 0.06 + 0.24 * p.height, 0.64 * p.height))
    arms = [
        rod(shifted(a, s * 0.012), shifted(b, s * 0.012), 0.0055, 7) for a, b in ((foot, elbow), (elbow, head)) for s in (-1, 1)
    ]
    knob = lathe([(0, -0.025), (0.02, -0.025), (0.02, 0.025), (0, 0.025)], 14)
    joints = [aimed(knob, at, (1, 0, 0), (0, 1, 0)) for at in (foot, elbow, head)]
    return [
        Piece("base", coats.inner, moved(_disc(0.1, 0.024), (0, 0.06, 0))),
        Piece("stem", coats.metal, join(*arms, *joints)),
        *_spot(p, coats, coats.inner),
    ]


def _table(p: Lamp, coats: _Coats) -> list[Piece]:
    """A body of clay, wood or metal under a shade."""
    tall, wide = p.height - p.shade_height - 0.03, 0.56 * p.shade_radius
    if p.body == "block":
        body = block((-0.7 * wide, -0.7 * wide, 0.012), (0.7 * wide, 0.7 * wide, tall), 0.01)
    else:
        shape = np.array(_BODIES[p.body]) * (wide, tall - 0.012) + (0, 0.012)
        z = np.linspace(0.012, tall, 26)
        radius = curve(z, np.column_stack([shape[:, 1], shape[:, 0]]))
        body = lathe([(0, 0.012), *zip(radius, z, strict=True), (0, tall)], 32)
    foot = wide * (1.05 if p.body == "block" else 0.85)
    neck = rod((0, 0, tall - 0.005), (0, 0, bulb(p)[2] - 0.06), 0.009, 10)
    return [
        Piece("base", coats.metal, lathe([(0, 0), (foot, 0), (foot, 0.014), (0, 0.014)], 32)),
        Piece("body", coats.body, body),
        Piece("stem", coats.metal, neck),
        *_lit(p, coats),
    ]


def _globe(p: Lamp, coats: _Coats) -> list[Piece]:
    """A ball of milk glass on a stem, as a table lamp or a floor lamp."""
    r, (x, y, z) = p.shade_radius, bulb(p)
    stem = rod((0, 0, 0.01), (0, 0, z - 0.96 * r), 0.012, 12)
    cup = lathe([(0, z - 1.05 * r), (0.4 * r, z - 0.98 * r), (0.45 * r, z - 0.87 * r), (0, z - 0.87 * r)], 24)
    return [
        Piece("base", coats.timber.along if p.wooden else coats.metal, _disc(max(0.75 * r, 0.09 * p.height), 0.024)),
        Piece("stem", coats.metal, join(stem, cup)),
        Piece("shade", coats.shade, moved(_ball(r, 28), (x, y, z))),
        Piece("bulb", coats.bulb, moved(_ball(0.03), (x, y, z))),
    ]


_STYLES = {
    "column": _column,
    "tripod": _tripod,
    "arc": _arc,
    "reading": _reading,
    "table": _table,
    "desk": _desk,
    "globe": _globe,
}


def lamp_random(rng: np.random.Generator) -> Mesh:
    """A lamp with parameters drawn to resemble lamps in real homes."""
    return lamp(draw(rng))


def draw(rng: np.random.Generator) -> Lamp:
    """The parameters of a random lamp."""
    styles: tuple[Style, ...] = ("column", "tripod", "arc", "reading", "table", "desk", "globe")
    style = styles[int(rng.choice(7, p=(0.17, 0.15, 0.06, 0.1, 0.29, 0.15, 0.08)))]
    floor = style in ("column", "tripod", "arc", "reading") or (style == "globe" and rng.random() < 0.3)
    shade: Shade = ("drum", "cone", "bell", "square")[int(rng.choice(4, p=(0.3, 0.35, 0.2, 0.15)))]
    radius = float(
        {"globe": rng.uniform(0.11, 0.16), "arc": rng.uniform(0.16, 0.22)}.get(
            style, rng.uniform(0.16, 0.26) if floor else rng.uniform(0.13, 0.2)
        )
    )
    height = float(rng.uniform(1.75, 2.1) if style == "arc" else rng.uniform(1.35, 1.7) if floor else rng.uniform(0.45, 0.65))
    spot = style in ("desk", "reading")
    return Lamp(
        style=style,
        height=height,
        shade=shade,
        shade_radius=radius,
        shade_height=radius * float(rng.uniform(0.95, 1.4)),
        narrow=float(rng.uniform(0.92, 1.0) if shade == "drum" else rng.uniform(0.45, 0.75)),
        shade_color=drawn_color(_ENAMELS if spot else _SHADES, rng),
        reach=float(rng.uniform(0.9, 1.2) if style == "arc" else rng.uniform(0.18, 0.3)),
        body=("gourd", "urn", "bottle", "ball", "candlestick", "block")[int(rng.integers(6))],
        body_color=drawn_color(_GLAZES, rng, 0.02),
        wooden=bool(rng.random() < (0.75 if style == "tripod" else 0.3)),
        metal=("black", "white", "brass", "chrome")[int(rng.integers(4))],
        glow=float(rng.uniform(0.25, 0.9)),
        wood=drawn_wood(rng, 0.1),
        seed=int(rng.integers(1 << 31)),
    )


_SHADES: tuple[Color, ...] = (
    (0.93, 0.9, 0.83),
    (0.9, 0.85, 0.74),
    (0.82, 0.72, 0.56),
    (0.9, 0.72, 0.55),
    (0.75, 0.8, 0.78),
    (0.8, 0.5, 0.4),
    (0.4, 0.5, 0.58),
    (0.3, 0.3, 0.32),
)
_ENAMELS: tuple[Color, ...] = (
    (0.08, 0.08, 0.09),
    (0.9, 0.9, 0.88),
    (0.75, 0.15, 0.1),
    (0.2, 0.42, 0.4),
    (0.88, 0.65, 0.2),
    (0.3, 0.42, 0.56),
)
_GLAZES: tuple[Color, ...] = (
    (0.14, 0.36, 0.46),
    (0.9, 0.89, 0.85),
    (0.2, 0.22, 0.25),
    (0.68, 0.36, 0.2),
    (0.35, 0.48, 0.36),
    (0.75, 0.68, 0.55),
    (0.5, 0.2, 0.22),
    (0.86, 0.72, 0.3),
)


FAMILY = ZooFamily(
    random=lamp_random,
    home="floor",
    classes={"": "furniture"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
)
