"""Boxes of cardboard: taped cartons and parcels, open cartons with their flaps, shoe boxes with a lid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.model.annotations.keypoints import At
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.household import cardboard, charts
from viewsphere_zoo.household.draws import chance, pick, seed, uniform
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.paint import Color, linear
from viewsphere_zoo.shapes.solids import Float, Solid, join, loft, moved, turned
from viewsphere_zoo.townscape.surfaces import cuboid

KEYPOINTS = {
    f"{level}_{end}_{side}": At(
        "walls", (1 if side == "left" else -1, -1 if end == "front" else 1, 1 if level == "top" else -1)
    )
    for level in ("base", "top")
    for end in ("front", "rear")
    for side in ("left", "right")
}
SKELETON = tuple(
    (f"{a}_{e}_{s}", f"{b}_{f}_{t}")
    for a, e, s, b, f, t in (
        *((k, "front", "left", k, "front", "right") for k in ("base", "top")),
        *((k, "rear", "left", k, "rear", "right") for k in ("base", "top")),
        *((k, "front", s, k, "rear", s) for k in ("base", "top") for s in ("left", "right")),
        *(("base", e, s, "top", e, s) for e in ("front", "rear") for s in ("left", "right")),
    )
)

Style = Literal["taped", "open", "lidded"]
SHEET = 0.004
"""Thickness of cardboard, metres."""


@dataclass(frozen=True)
class Box:
    """Parameters of a box; metres, degrees, colours sRGB 0..1.

    flaps: how far the front, rear, left and right flaps are open, 0 closed, 90 upright; label: position of the address label.
    """

    style: Style = "taped"
    width: float = 0.36
    depth: float = 0.26
    height: float = 0.24
    color: Color = (0.68, 0.5, 0.32)
    ink: Color = (0.13, 0.12, 0.12)
    tape: Color = (0.6, 0.42, 0.22)
    flaps: tuple[float, float, float, float] = (130, 120, 150, 110)
    label: Literal["top", "front", "none"] = "top"
    holes: bool = False
    seed: int = 0

    @property
    def extent(self) -> tuple[float, float, float]:
        """Greatest width, depth and height of the whole model, metres."""
        flaps = (0.9 * self.width, 1.1 * self.depth, 0.2) if self.style == "open" else (0.03, 0.03, 0.02)
        return self.width + flaps[0], self.depth + flaps[1], self.height + flaps[2]


def box(parameters: Box | None = None) -> Mesh:
    """The box in metres, on z = 0, hollow. Parts: walls, inside, and if present flap_*, tape, lid and label."""
    p = parameters or Box()
    rng = np.random.default_rng(p.seed)
    w, d, h = p.width, p.depth, p.height
    images = [
        cardboard.walls((w, d, h), p.color, p.ink, p.holes, cardboard.SHOES if p.style == "lidded" else cardboard.WORDS, rng),
        cardboard.kraft(rng, p.color),
    ]
    pictures = {"walls": _around(w, d, h), "kraft": _tiled}
    plain = charts.printed("kraft", 1, 0.9)
    top = h - (5e-4 if p.style == "open" else SHEET)
    outer, inner = _ring(w, d), _ring(w - 2 * SHEET, d - 2 * SHEET)
    pieces = [
        Piece("walls", charts.printed("walls", 0, 0.85), loft(_rings((outer, 0), (outer, top)), (False, False))),
        Piece("walls", plain, Solid(_rings((outer, 0))[0], np.array([[0, 2, 1], [0, 3, 2]]))),
        Piece("inside", plain, loft(_rings((outer, top), (inner, top), (inner, SHEET)), (False, True))),
    ]
    if p.style == "lidded":
        pieces += _lid(p)
    else:
        pieces += _flaps(p, plain)
    if p.style == "taped":
        pieces += _tape(p)
    if p.label != "none" and p.style != "open":
        pieces.append(_label(p))
        pictures["address"] = _stuck(p)
        images.append(cardboard.address(*_LABEL, rng))
    return charts.charted(assemble(pieces, crease_deg=30), pictures, images)


def _ring(width: float, depth: float) -> Float:
    return np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * (width / 2, depth / 2)


def _rings(*levels: tuple[Float, float]) -> Float:
    return np.array([np.column_stack([ring, np.full(len(ring), z)]) for ring, z in levels])


def _around(w: float, d: float, h: float) -> charts.Chart:
    """The four sides in one picture, from the front's left edge."""
    whole = 2 * (w + d)
    starts = {(1, -1): (-w / 2, 1), (0, 1): (-d / 2 - w, 1), (1, 1): (1.5 * w + d, -1), (0, -1): (1.5 * d + 2 * w, -1)}
    return charts.sides(
        {
            (axis, sign): charts.flat((low, 0), (low + way * whole, h), axes=(1 - axis, 2))
            for (axis, sign), (low, way) in starts.items()
        }
    )


def _tiled(corners: Float, normals: Float) -> Float:
    """Cardboard every 0.25 m, straight onto each side."""
    tiles = {(a, s): charts.flat((0, 0), (0.25, 0.25), ((a + 1) % 3, (a + 2) % 3)) for a in range(3) for s in (-1, 1)}
    return charts.sides(tiles)(corners, normals)


def _flaps(p: Box, plain: Material) -> list[Piece]:
    """Four flaps on their hinges; the flaps of the longer sides (front and rear) close over the others."""
    w, d, h = p.width, p.depth, p.height
    angles = p.flaps if p.style == "open" else (0.0, 0.0, 0.0, 0.0)
    pieces: list[Piece] = []
    for k, (name, angle) in enumerate(zip(("front", "rear", "left", "right"), angles, strict=True)):
        wide, deep = (w, d) if k < 2 else (d, w)
        if k > 1 and not angle:
            continue  # under the others, out of sight
        long = d / 2 - 6e-4 if k < 2 else min(d / 2, 0.5 * w)
        slab = cuboid((-wide / 2 + 0.001, 0, -SHEET), (wide / 2 - 0.001, long, 0))
        slab = moved(turned(slab, 0, np.radians(angle)), (0, -deep / 2, h))
        pieces.append(Piece(f"flap_{name}", plain, turned(slab, 2, (0, np.pi, np.pi / 2, -np.pi / 2)[k])))
    return pieces


def _tape(p: Box) -> list[Piece]:
    """A strip along the seam of the flaps that reaches down both sides."""
    film = Material("tape", linear(p.tape), roughness=0.3, clearcoat=0.6, clearcoat_roughness=0.1)
    half, down = 0.024, min(0.07, 0.4 * p.height)
    x, z = p.width / 2, p.height
    strip = cuboid((-x - 4e-4, -half, z), (x + 4e-4, half, z + 4e-4))
    ends = [cuboid((s * x - 4e-4 * (s < 0), -half, z - down), (s * x + 4e-4 * (s > 0), half, z)) for s in (-1, 1)]
    return [Piece("tape", film, join(strip, *ends))]


def _lid(p: Box) -> list[Piece]:
    """A lid that hangs over the walls."""
    paint = Material("lid", linear(p.tape), roughness=0.6)
    outer, inner = _ring(p.width + 2 * SHEET, p.depth + 2 * SHEET), _ring(p.width + 1e-3, p.depth + 1e-3)
    low, high = p.height - 0.042, p.height + SHEET
    shell = loft(_rings((inner, low), (outer, low), (outer, high)), (False, True))
    return [Piece("lid", paint, shell)]


_LABEL = (0.1, 0.075)
"""Width and height of an address label, metres."""


def _place(p: Box) -> tuple[float, float]:
    """The label's lower left corner: on the top (x, y), or on the front (x, z)."""
    x = -0.44 * p.width if p.label == "top" else 0.44 * p.width - _LABEL[0]
    return x, (0.06 if p.label == "top" else 0.1) * (p.depth if p.label == "top" else p.height) - 0.5 * (
        p.label == "top"
    ) * p.depth


def _label(p: Box) -> Piece:
    """The address, a sheet of paper."""
    x, y = _place(p)
    a, b = x + _LABEL[0], y + _LABEL[1]
    z = p.height + (SHEET if p.style == "lidded" else 0.0)
    sheet = (
        cuboid((x, y, z), (a, b, z + 6e-4)) if p.label == "top" else cuboid((x, -p.depth / 2 - 6e-4, y), (a, -p.depth / 2, b))
    )
    return Piece("label", charts.printed("address", 2, 0.7), sheet)


def _stuck(p: Box) -> charts.Chart:
    """Return the chart of the address on its sheet."""
    x, y = _place(p)
    return charts.flat((x, y), (x + _LABEL[0], y + _LABEL[1]), (0, 1) if p.label == "top" else (0, 2))


def box_random(rng: np.random.Generator) -> Mesh:
    """A box with all parameters drawn."""
    return box(draw(rng))


def draw(rng: np.random.Generator) -> Box:
    """The parameters of a random box."""
    style: Style = ("taped", "open", "lidded")[int(rng.choice(3, p=(0.52, 0.34, 0.14)))]
    if style == "lidded":
        color, lid = pick(rng, _SHOES)
        return Box(
            style=style,
            width=uniform(rng, 0.28, 0.35),
            depth=uniform(rng, 0.16, 0.22),
            height=uniform(rng, 0.1, 0.14),
            color=color,
            ink=lid if lid != color else (0.12, 0.12, 0.13),
            tape=lid,
            label=pick(rng, ("front", "none")),
            seed=seed(rng),
        )
    width = uniform(rng, 0.22, 0.55)
    front, rear, left, right = rng.uniform(95, 215, 4).tolist()
    return Box(
        style=style,
        width=width,
        depth=max(width * uniform(rng, 0.55, 0.95), 0.16),
        height=max(width * uniform(rng, 0.4, 1.0), 0.12),
        color=pick(rng, _CARD),
        ink=pick(rng, ((0.13, 0.12, 0.12), (0.13, 0.12, 0.12), (0.6, 0.12, 0.1), (0.12, 0.22, 0.45), (0.12, 0.3, 0.18))),
        tape=pick(rng, ((0.6, 0.42, 0.22), (0.74, 0.62, 0.42), (0.9, 0.89, 0.86), (0.7, 0.14, 0.1), (0.2, 0.35, 0.6))),
        flaps=(front, rear, left, right),
        label=pick(rng, ("top", "top", "front", "none")),
        holes=chance(rng, 0.35),
        seed=seed(rng),
    )


_CARD: tuple[Color, ...] = (
    (0.68, 0.5, 0.32),
    (0.72, 0.55, 0.37),
    (0.62, 0.45, 0.29),
    (0.74, 0.6, 0.44),
    (0.66, 0.52, 0.36),
    (0.9, 0.89, 0.86),
)
_SHOES: tuple[tuple[Color, Color], ...] = (
    ((0.72, 0.56, 0.38), (0.72, 0.56, 0.38)),
    ((0.9, 0.88, 0.84), (0.75, 0.14, 0.12)),
    ((0.13, 0.13, 0.14), (0.85, 0.55, 0.12)),
    ((0.2, 0.3, 0.5), (0.9, 0.89, 0.87)),
    ((0.9, 0.5, 0.2), (0.93, 0.92, 0.9)),
    ((0.35, 0.5, 0.42), (0.2, 0.3, 0.26)),
)


FAMILY = ZooFamily(
    random=box_random,
    home="floor",
    classes={"": "household item"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
)
