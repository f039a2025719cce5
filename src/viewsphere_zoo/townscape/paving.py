"""A street's surfaces from gutter to garden, and their textures."""

from __future__ import annotations

import numpy as np

from viewsphere.assets.mesh import Image, Material
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import Color
from viewsphere_zoo.shapes.solids import Float, Solid, flipped, grid
from viewsphere_zoo.townscape import DROPPED, HALF_LENGTH, HALF_WIDTH, KERB, PAVEMENT, ROAD, STEP, textures
from viewsphere_zoo.townscape.surfaces import Tint, cuboid, waves
from viewsphere_zoo.townscape.textures import textured

ASPHALT = textured("asphalt", 0, 2.2, 0.92)
GRASS = textured("grass", 1, 2.6, 0.95)
PAVING = textured("paving", 2, 2.4, 0.9)
STONE = textured("kerb_stone", 3, 0.9, 0.9)
PAINT = textured("road_paint", 4, 1.0, 0.7)
SETTS = textured("setts", 5, 1.2, 0.9)
PATCH = Material("patched_asphalt", (0.62, 0.62, 0.62, 1.0), base_color_texture=ASPHALT.base_color_texture, roughness=0.95)

GUTTER = 2.95
"""x of the inner edge of the gutter, metres."""

CROSSING = 1.6
"""Half the width of a dropped kerb, metres."""

TURF: Color = (0.375, 0.455, 0.195)
"""Colour of grass, sRGB: the same in all streets and in the country."""


def turf() -> Image:
    """The picture of grass that streets and country share."""
    return textures.grass(np.random.default_rng(0), TURF)


def images(rng: np.random.Generator, asphalt: Color, paving: str, color: Color, wear: float) -> list[Image]:
    """The textures in the order that the materials expect."""
    if paving == "asphalt":
        path = textures.asphalt(rng, color, 256)
    elif paving == "bricks":
        path = textures.bricks(rng, "paving", color, (0.42, 0.4, 0.37), (12, 24), (0.03, 0.06), 0.09)
    else:
        path = textures.bricks(rng, "paving", color, (0.4, 0.39, 0.36), (4, 4), (0.012, 0.012), 0.028)
    stone, gap = (0.6, 0.59, 0.57), (0.36, 0.35, 0.33)
    return [
        textures.asphalt(rng, asphalt),
        turf(),
        path,
        textures.bricks(rng, "kerb_stone", stone, gap, (1, 1), (0.008, 0.008), 0.0, 0.0, 256),
        textures.plaster(rng, "road_paint", (0.93, 0.93, 0.91), 0.05 + 0.12 * wear),
        textures.bricks(rng, "setts", (0.45, 0.44, 0.43), (0.3, 0.29, 0.27), (12, 12), (0.06, 0.06), 0.1, 0.5, 256),
    ]


def tints(rng: np.random.Generator, wear: float) -> dict[str, Tint]:
    """Wheel tracks on the road, lighter and yellower places on the grass, stains on the pavement."""
    road, grass, path = rng.spawn(3)

    def worn(p: Float) -> Float:
        tracks = np.exp(-(((np.abs(np.abs(p[:, 0]) - 1.55) - 0.75) / 0.35) ** 2))
        return 0.9 + 0.07 * wear * waves(road, p[:, :2] * (1, 0.3), 2.5) - 0.07 * tracks

    return {"asphalt": worn, "grass": lambda p: meadow(grass, p), "paving": lambda p: 0.93 + 0.07 * waves(path, p, 3.0)}


def meadow(rng: np.random.Generator, points: Float) -> Float:
    """Factors (N, 3) of the grass' colour, for grass that is not equally green everywhere."""
    light, dry = waves(rng, points[:, :2], 9.0), waves(rng, points[:, :2], 16.0)
    shade = 0.9 + 0.09 * light
    return np.stack([shade, shade - 0.02, shade - 0.06 - 0.05 * dry], axis=1)


def _drop(y: Float, crossings: tuple[float, ...]) -> Float:
    """Return the drop of the kerb at these y, 0 to 1."""
    off = np.abs(y[:, None] - np.asarray(crossings)).min(axis=1, initial=np.inf)
    return np.clip((CROSSING + 0.5 - off) / 0.5, 0, 1)


def _lines(crossings: tuple[float, ...]) -> Float:
    """The y at which all strips of one side have their vertices."""
    edges = [y + s * d for y in crossings for s in (-1, 1) for d in (CROSSING, CROSSING + 0.5)]
    even = np.linspace(-HALF_LENGTH, HALF_LENGTH, 81)
    even = even[np.abs(even[:, None] - np.array([*edges, np.inf])).min(axis=1) > 0.3]
    return np.sort(np.concatenate([even, edges]))


def _strip(side: int, x: Float, y: Float, z: Float) -> Solid:
    """A surface over columns x (M, or (M, N)) and lines y (N,), seen from above; side -1 mirrors it."""
    shape = len(x), len(y)
    across = np.broadcast_to(x[:, None] if x.ndim == 1 else x, shape)
    points = np.stack([side * across, np.broadcast_to(y, shape), np.broadcast_to(z, shape)], axis=-1)
    solid = grid(points)
    return solid if side > 0 else flipped(solid)


def sections(crossings: tuple[tuple[float, ...], tuple[float, ...]]) -> list[Piece]:
    """Road, gutters, kerbs, verges with the driveways' crossings, pavements and lawns; and the faces that close them below."""
    y = np.linspace(-HALF_LENGTH, HALF_LENGTH, 101)
    pieces = [Piece("road", ASPHALT, _strip(1, np.linspace(-GUTTER, GUTTER, 13), y, np.zeros(1)))]
    for side, at in zip((1, -1), crossings, strict=True):
        pieces += _side(side, at)
    below = cuboid((-HALF_WIDTH, -HALF_LENGTH, -0.4), (HALF_WIDTH, HALF_LENGTH, -0.05))
    return [*pieces, Piece("base", Material("earth", (0.03, 0.022, 0.015, 1.0), roughness=1.0), below)]


def _side(side: int, crossings: tuple[float, ...]) -> list[Piece]:
    """Return the strips of one side, from the gutter outwards."""
    y = _lines(crossings)
    drop = _drop(y, crossings)
    top = STEP + (DROPPED - STEP) * drop
    x = np.array([ROAD, ROAD, ROAD + 0.008, ROAD + 0.025, KERB])
    z = np.stack([0 * y, top - np.minimum(0.025, 0.8 * top), top - 0.008, top, top])
    inner = np.array([KERB, 3.8, 4.2, PAVEMENT[0] - 0.06])
    slope = STEP + (DROPPED - STEP) * drop * (1 - (inner[:, None] - KERB) / (inner[-1] - KERB))
    edge = np.array([PAVEMENT[0] - 0.06, PAVEMENT[0]])
    rim = np.array([PAVEMENT[1], PAVEMENT[1] + 0.06])
    garden = np.array([rim[1], 7.5, 9.0, 11.5, 14.5, 18.0, 22.0, 26.0, HALF_WIDTH])
    level = np.full(1, STEP)
    pieces = [
        Piece("gutter", SETTS, _strip(side, np.array([GUTTER, ROAD]), y, np.zeros(1))),
        Piece("kerb", STONE, _strip(side, x, y, z)),
        Piece("edging", STONE, _strip(side, edge, y, level)),
        Piece("pavement", PAVING, _strip(side, np.linspace(*PAVEMENT, 3), y, level)),
        Piece("edging", STONE, _strip(side, rim, y, level)),
        Piece("lawn", GRASS, _strip(side, garden, y, level)),
    ]
    paved = (drop == 1)[:-1] & (drop == 1)[1:]
    for part, material, chosen in (("verge", GRASS, ~paved), ("crossing", PAVING, paved)):
        surface = _strip(side, inner, y, slope)
        cell = np.tile(np.tile(chosen, len(inner) - 1), 2)
        pieces.append(Piece(part, material, Solid(surface.vertices, surface.triangles[cell])))
    return [p for p in pieces if len(p.solid.triangles)]
