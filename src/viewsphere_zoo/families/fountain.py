"""Fountains for parks and squares: bowls in tiers, jets in a basin, and columns with spouts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.model.annotations.keypoints import At
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.paint import Color, coated, linear
from viewsphere_zoo.shapes.rods import copies, ring_of, turns
from viewsphere_zoo.shapes.solids import Float, Solid, join, lathe, loft, moved, tube

KEYPOINTS = {
    "top": At("finial|jet", (0, 0, 1)),
    "basin_front": At("basin", (0, -1, 1)),
    "basin_rear": At("basin", (0, 1, 1)),
    "basin_left": At("basin", (1, 0, 1)),
    "basin_right": At("basin", (-1, 0, 1)),
}
SKELETON = (("basin_front", "top"), ("basin_rear", "top"), ("basin_left", "top"), ("basin_right", "top"))

Style = Literal["tiers", "jets", "column"]


@dataclass(frozen=True)
class Fountain:
    """Parameters of a fountain; metres, colour sRGB 0..1.

    radius: of the basin; wall: its height; sides: of the basin, 0 round; height: of bowls or column; bowls: their number;
    jets: number in the ring, or of a column's spouts; spray: height of the jets; steps: around the basin; seed draws drops and
    ripples.
    """

    style: Style = "tiers"
    radius: float = 1.8
    wall: float = 0.5
    sides: int = 8
    height: float = 2.2
    bowls: int = 2
    jets: int = 8
    spray: float = 1.0
    steps: int = 1
    rim: float = 0.16
    color: Color = (0.74, 0.71, 0.65)
    metal: bool = False
    seed: int = 0


def fountain(parameters: Fountain | None = None) -> Mesh:
    """The fountain in metres about the z axis. Parts: basin, water, jet, and by style pedestal, bowl, finial, spout, step."""
    p = parameters or Fountain()
    rng = np.random.default_rng(p.seed)
    stone = Material("stone", linear(p.color), roughness=0.85)
    cast = coated("cast_iron", (0.12, 0.2, 0.17), "matte") if p.metal else stone
    pool = Material("water", linear((0.22, 0.45, 0.5)), roughness=0.06, clearcoat=1.0)
    r, g, b, _ = linear((0.86, 0.93, 0.96))
    spray = Material("spray", (r, g, b, 1.0), roughness=0.15, clearcoat=0.8, emissive=(0.12 * r, 0.12 * g, 0.12 * b))
    pieces = [*_basin(p, stone, pool, rng)]
    pieces += {"tiers": _tiers, "jets": _jets, "column": _column}[p.style](p, cast, pool, spray, rng)
    return assemble(pieces, crease_deg=38)


def _turned(profile: list[tuple[float, float]], sides: int) -> Solid:
    """A profile about the axis; with `sides` it has flats, one of them in front, and the profile's radii are measured to the
    flats.
    """
    if not sides:
        return lathe(profile, 36)
    a = np.pi / sides - np.pi / 2 + np.arange(sides) * 2 * np.pi / sides
    ring = np.stack([np.cos(a), np.sin(a)], axis=1) / np.cos(np.pi / sides)
    levels = [np.column_stack([ring * q, np.full(sides, z)]) for q, z in profile]
    return loft(np.array(levels), (False, False))


def _basin(p: Fountain, stone: Material, pool: Material, rng: np.random.Generator) -> list[Piece]:
    """The wall with its rim and plinth, the pool, and steps."""
    lift = 0.14 * p.steps
    r, w, t = p.radius, p.wall, p.rim
    wall = [
        (0.0, lift),
        (r + 0.05, lift),
        (r + 0.05, lift + 0.1),
        (r, lift + 0.13),
        (r - 0.02, lift + w - 0.16),
        (r + 0.04, lift + w - 0.1),
    ]
    wall += [(r + 0.05, lift + w - 0.02), (r + 0.03, lift + w), (r - 2 * t, lift + w), (r - 2 * t - 0.02, lift + w - 0.03)]
    wall += [(r - 2 * t - 0.02, lift + 0.05), (0.0, lift + 0.05)]
    pieces = [Piece("basin", stone, _turned(wall, p.sides))]
    for k in range(p.steps):
        reach = r + 0.4 * (p.steps - k) + 0.05
        step = [
            (0.0, 0.14 * k),
            (reach, 0.14 * k),
            (reach, 0.14 * (k + 1) - 0.02),
            (reach - 0.02, 0.14 * (k + 1)),
            (0.0, 0.14 * (k + 1)),
        ]
        pieces.append(Piece("step", stone, _turned(step, p.sides)))
    return [*pieces, Piece("water", pool, _pool(p, lift + w - 0.14, rng))]


def _pool(p: Fountain, z: float, rng: np.random.Generator) -> Solid:
    """The water's surface with ripples."""
    radius = p.radius - 2 * p.rim
    share = np.linspace(1.0, 0.0, 12)
    ripple = 0.012 * np.sin(28 * share + rng.uniform(0, 6)) * (share < 0.98)
    rows = list(zip((radius * share).tolist(), (z + ripple).tolist(), strict=True))
    return _turned([(radius, z - 0.08), *rows], p.sides)


def _bowl(radius: float, depth: float) -> list[tuple[float, float]]:
    """A shallow bowl's profile, with its rim at z = 0."""
    return [
        (0.1, -depth),
        (0.35 * radius, -0.9 * depth),
        (0.75 * radius, -0.5 * depth),
        (0.97 * radius, -0.12 * depth),
        (1.05 * radius, -0.04),
        (1.05 * radius, 0.0),
        (0.95 * radius, 0.0),
        (0.93 * radius, -0.05),
        (0.0, -0.05),
    ]


def _tiers(p: Fountain, cast: Material, pool: Material, spray: Material, rng: np.random.Generator) -> list[Piece]:
    """Bowls that grow smaller upwards on a turned shaft; water runs over their rims."""
    foot = 0.14 * p.steps + 0.05
    heights = (
        foot + p.wall + (p.height - p.wall) * np.linspace(0.42, 0.86, p.bowls)
        if p.bowls > 1
        else np.array([foot + 0.72 * p.height])
    )
    radii = p.radius * np.linspace(0.55, 0.28, p.bowls) if p.bowls > 1 else np.array([0.5 * p.radius])
    water = 0.14 * p.steps + p.wall - 0.14
    pieces: list[Piece] = []
    low = foot
    falls: list[Solid] = []
    for k, (z, r) in enumerate(zip(heights, radii, strict=True)):
        thick = 0.2 * r + 0.03
        span = z - 0.32 * r - low
        shaft = [
            (1.7, 0.0),
            (1.7, 0.06),
            (1.2, 0.12),
            (0.85, 0.3),
            (1.1, 0.5),
            (1.15, 0.56),
            (0.8, 0.64),
            (0.75, 0.9),
            (1.3, 1.02),
        ]
        rows = [(0.0, low), *((thick * a, low + span * b) for a, b in shaft), (0.0, low + 1.02 * span)]
        pieces.append(Piece("pedestal", cast, lathe(rows, 24)))
        pieces.append(Piece("bowl", cast, moved(lathe(_bowl(r, 0.34 * r), 28), (0, 0, z))))
        pieces.append(
            Piece(
                "water",
                pool,
                moved(lathe([(0.94 * r, -0.06), (0.93 * r, -0.02), (0.4 * r, -0.012), (0, -0.016)], 28), (0, 0, z)),
            )
        )
        falls.append(_curtain(1.06 * r, z, water if k == 0 else float(heights[k - 1]) - 0.02, 2 * min(p.jets, 8), rng))
        low = float(z) - 0.05
    top = [
        (0.0, low),
        (0.09, low),
        (0.06, low + 0.1),
        (0.1, low + 0.2),
        (0.12, low + 0.28),
        (0.07, low + 0.36),
        (0.03, low + 0.42),
        (0.0, low + 0.43),
    ]
    pieces.append(Piece("finial", cast, lathe(top, 16)))
    plume = _plume(low + 0.42, 0.35 * p.spray, 6, 0.11 * p.radius, rng)
    return [*pieces, Piece("jet", spray, join(*falls, plume))]


def _curtain(radius: float, top: float, bottom: float, count: int, rng: np.random.Generator) -> Solid:
    """Strands of water that fall from a rim."""
    t = np.linspace(0, 1, 5)
    strands: list[Solid] = []
    for k in range(count):
        a = 2 * np.pi * (k + float(rng.uniform(-0.2, 0.2))) / count
        out = radius + float(rng.uniform(0.05, 0.14)) * t
        z = top + 0.01 - (top - bottom) * t**2
        strands.append(tube(np.stack([out * np.cos(a), out * np.sin(a), z], axis=1), 0.008 + 0.016 * t, 4))
    return join(*strands)


def _plume(z: float, height: float, count: int, reach: float, rng: np.random.Generator) -> Solid:
    """A jet that rises and breaks up all around."""
    t = np.linspace(0, 1, 9)
    one = np.stack([reach * t, 0 * t, z + 4 * height * t * (1 - 0.62 * t) / 1.62], axis=1)
    arc = tube(one, 0.012 + 0.02 * t, 4)
    drops = _drops(np.array([reach, 0, z + 0.7 * height]), 0.35 * reach, 3, rng)
    core = tube([(0, 0, z - 0.02), (0, 0, z + 0.6 * height), (0, 0, z + height)], (0.025, 0.03, 0.012), 6)
    return join(core, ring_of(join(arc, drops), count, 2, float(rng.uniform(0, 1))))


def _drops(middle: Float, spread: float, count: int, rng: np.random.Generator) -> Solid:
    """Small drops about a place."""
    drop = lathe([(0, -0.02), (0.014, 0.0), (0, 0.02)], 4)
    places = middle + rng.normal(0, spread, (count, 3)) * (1, 1, 0.8)
    return copies(drop, turns(2, np.zeros(count)), places)


def _arc(start: tuple[float, float], stop: tuple[float, float], rise: float) -> Float:
    """A jet's path from (radius, z) to (radius, z), `rise` above the higher end, in y = 0."""
    t = np.linspace(0, 1, 13)
    r = start[0] + t * (stop[0] - start[0])
    top = max(start[1], stop[1]) + rise
    up, down = np.sqrt(top - start[1]), np.sqrt(top - stop[1])
    share = up / (up + down)
    return np.stack([r, 0 * t, top - ((t - share) * (up + down)) ** 2], axis=1)


def _jets(p: Fountain, cast: Material, pool: Material, spray: Material, rng: np.random.Generator) -> list[Piece]:
    """A tall jet in the middle and a ring of arcs that fall towards it."""
    z = 0.14 * p.steps + p.wall - 0.14
    ring = 0.78 * (p.radius - 2 * p.rim)
    nozzle = [(0.0, z - 0.1), (0.09, z - 0.1), (0.08, z + 0.06), (0.035, z + 0.14), (0.03, z + 0.16), (0.0, z + 0.16)]
    small = moved(lathe([(0.0, -0.08), (0.04, -0.08), (0.03, 0.08), (0.0, 0.08)], 10), (ring, 0, z))
    path = _arc((ring, z + 0.07), (0.25 * ring, z), 0.7 * p.spray)
    arc = tube(path, np.linspace(0.016, 0.04, 13), 5)
    drops = _drops(path[9], 0.07, 4, rng)
    middle = [_plume(z + 0.15, 1.7 * p.spray, 10, 0.2 * ring, rng), _plume(z + 0.15, 1.25 * p.spray, 7, 0.3 * ring, rng)]
    foam = [moved(lathe([(0.12, -0.02), (0.09, 0.03), (0.0, 0.04)], 8), (0.25 * ring, 0, z))]
    return [
        Piece("spout", cast, join(lathe(nozzle, 16), ring_of(small, p.jets))),
        Piece("jet", spray, join(*middle, ring_of(join(arc, drops, *foam), p.jets))),
    ]


def _column(p: Fountain, cast: Material, pool: Material, spray: Material, rng: np.random.Generator) -> list[Piece]:
    """A square pillar with a pyramid on top, and a spout on each side."""
    foot, water = 0.14 * p.steps + 0.05, 0.14 * p.steps + p.wall - 0.14
    h, half = p.height, 0.17 * p.radius
    rows = [
        (1.5, 0.0),
        (1.5, p.wall + 0.05),
        (1.1, p.wall + 0.15),
        (1.0, p.wall + 0.2),
        (0.9, 0.78 * h),
        (1.15, 0.8 * h),
        (1.25, 0.83 * h),
    ]
    rows += [(1.25, 0.86 * h), (0.95, 0.88 * h), (0.3, h - 0.12)]
    pillar = _turned([(0.0, foot), *((half * a, foot + z) for a, z in rows), (0.0, foot + h - 0.1)], 4)
    ball = [(0.02, -0.1), (0.09, -0.07), (0.12, 0.0), (0.085, 0.085), (0.0, 0.12)]
    z = foot + 0.62 * h
    spout = tube([(0.7 * half, 0, z), (1.25 * half, 0, z + 0.03), (1.6 * half, 0, z - 0.01)], (0.05, 0.045, 0.04), 8)
    rosette = tube([(0.85 * half, 0, z), (1.08 * half, 0, z)], 0.13, 12)
    reach = 1.6 * half + 0.32 * (p.radius - 1.6 * half)
    t = np.linspace(0, 1, 9)
    fall = np.stack([1.58 * half + (reach - 1.58 * half) * t, 0 * t, z - 0.01 - (z - water) * t**2], axis=1)
    stream = tube(fall, np.linspace(0.03, 0.055, 9), 7)
    foam = moved(lathe([(0.2, -0.02), (0.13, 0.04), (0.0, 0.05)], 12), (reach, 0, water))
    shell = lathe(_bowl(0.3 * p.radius, 0.1 * p.radius), 20)
    quarter = -np.pi / 2
    return [
        Piece("pedestal", cast, pillar),
        Piece("finial", cast, moved(lathe(ball, 14), (0, 0, foot + h - 0.05))),
        Piece("spout", cast, ring_of(join(spout, rosette), 4, 2, quarter)),
        Piece(
            "bowl",
            cast,
            ring_of(
                moved(Solid(shell.vertices * (0.8, 0.8, 0.8), shell.triangles), (1.5 * half + 0.1, 0, water + 0.14)),
                4,
                2,
                quarter,
            ),
        ),
        Piece("jet", spray, ring_of(join(stream, foam, _drops(fall[7], 0.05, 6, rng)), 4, 2, quarter)),
    ]


def fountain_random(rng: np.random.Generator) -> Mesh:
    """A fountain with all parameters drawn."""
    return fountain(draw(rng))


_STONES: tuple[Color, ...] = (
    (0.78, 0.75, 0.69),
    (0.66, 0.65, 0.62),
    (0.74, 0.62, 0.48),
    (0.5, 0.5, 0.5),
    (0.85, 0.84, 0.82),
    (0.66, 0.5, 0.44),
)


def draw(rng: np.random.Generator) -> Fountain:
    """The parameters of a random fountain."""
    style: Style = ("tiers", "jets", "column")[int(rng.choice(3, p=(0.5, 0.3, 0.2)))]
    r, g, b = (np.array(_STONES[int(rng.integers(len(_STONES)))]) * rng.uniform(0.9, 1.05)).clip(0.03, 0.95).tolist()
    radius = float(rng.uniform(1.3, 2.6))
    return Fountain(
        style=style,
        radius=radius,
        wall=float(rng.uniform(0.4, 0.62)),
        sides=int(rng.choice((0, 6, 8, 12), p=(0.45, 0.15, 0.3, 0.1))),
        height=float(rng.uniform(1.0, 1.35) * radius + 0.3),
        bowls=int(rng.choice((1, 2, 3), p=(0.2, 0.5, 0.3))),
        jets=int(rng.choice((6, 8, 10, 12))),
        spray=float(rng.uniform(0.6, 1.1) * (0.4 + 0.35 * radius)),
        steps=int(rng.choice((0, 1, 2), p=(0.4, 0.35, 0.25))),
        rim=float(rng.uniform(0.1, 0.2)),
        color=(r, g, b),
        metal=style != "column" and bool(rng.random() < 0.3),
        seed=int(rng.integers(1 << 31)),
    )


FAMILY = ZooFamily(
    random=fountain_random,
    home="garden",
    classes={"": "street furniture"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
)
