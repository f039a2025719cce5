"""Meadows, hills, woods and distant houses around a street."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere.assets.mesh import Image, Material
from viewsphere.codecs import srgb
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import linear
from viewsphere_zoo.shapes.solids import Float, Solid, grid, join, moved, turned
from viewsphere_zoo.townscape import HALF_LENGTH, HALF_WIDTH, KERB, ROAD, STEP, textures
from viewsphere_zoo.townscape.foliage import blob
from viewsphere_zoo.townscape.paving import meadow, turf
from viewsphere_zoo.townscape.surfaces import Tint, cuboid, prism, waves
from viewsphere_zoo.townscape.textures import textured

FAR = 150.0
"""Distance beyond which grass has no grain, only a colour that fades into the haze, metres."""

NEAR = 60.0
"""Distance from the gardens below which woods show leaves, metres."""

GRASS = textured("grass", 0, 2.6, 0.95)
ASPHALT = textured("asphalt", 1, 2.2, 0.92)
THICKET = textured("thicket", 2, 2.8, 0.95)
HILL = Material("hill", roughness=1.0)
WOOD = Material("wood", roughness=1.0)

AIR = srgb.linear((0.66, 0.74, 0.82))
"""The colour into which distant things fade, linear."""


@dataclass(frozen=True)
class Relief:
    """The terrain: flat at the street or town in its middle, rising to a ridge of this height at this distance.

    phases: six random ones; half: half the width and length of the area in its middle; road: whether a road continues to both
    ends of Y.
    """

    hills: float
    reach: float
    phases: tuple[float, ...]
    half: tuple[float, float] = (HALF_WIDTH, HALF_LENGTH)
    road: bool = True

    def away(self, points: Float) -> Float:
        """Distance (N,) of points from the area in the middle, metres."""
        return np.hypot(np.maximum(np.abs(points[:, 0]) - self.half[0], 0), np.maximum(np.abs(points[:, 1]) - self.half[1], 0))

    def height(self, x: Float, y: Float) -> Float:
        """Height z over plan points; level across the road."""
        across = np.sign(x) * np.maximum(np.abs(x) - 9.0, 0)
        away = np.hypot(np.maximum(np.abs(x) - self.half[0], 0), np.maximum(np.abs(y) - self.half[1], 0))
        share = np.clip((away - 15) / (self.reach - 15), 0, 1)
        a, b, c, d, e, f = self.phases
        roll = np.sin(across / 71 + a) * np.sin(y / 83 + b) + 0.6 * np.sin(across / 37 + c + 0.8 * np.sin(y / 55 + d))
        ridge = 1 + 0.22 * np.sin(across / 130 + e) + 0.22 * np.sin(y / 150 + f) - 0.45 * np.exp(-((across / 70) ** 2))
        bank = STEP - 0.3 * np.clip(away / 4, 0, 1)
        return bank + self.hills * ridge * share**1.7 + 2.2 * roll * np.clip(share * 5, 0, 1) * (1 + share)


def _lines(inner: list[float], reach: float) -> Float:
    """Grid lines with spacing that grows with distance, mirrored."""
    out = inner[-1] + (reach - inner[-1] + 120) * np.linspace(0, 1, 19)[1:] ** 1.8
    half = np.concatenate([inner, out])
    return np.concatenate([-half[::-1], half[half > 0]])


def ground(relief: Relief) -> list[Piece]:
    """The land with the street's rectangle left out; its grid shares the rectangle's corners and the road's edges."""
    wide, long = relief.half
    near = [ROAD, 4.5, 9.0, 19.0] if relief.road else [0.35 * wide, 0.7 * wide]
    x = _lines([*near, wide], relief.reach)
    y = _lines([0.0, 0.35 * long, 0.7 * long, long], relief.reach)
    gx, gy = np.meshgrid(x, y, indexing="ij")
    z = relief.height(gx, gy)
    lane = (np.abs(gx) <= KERB) & relief.road
    away = np.clip((np.abs(gy) - long) / 8, 0, 1)
    z = np.where(lane, np.where(np.abs(gy) <= long + 1e-9, 0.0, z + 0.12 * away), z)
    surface = grid(np.stack([gx, gy, z], axis=-1))
    cells = surface.vertices[surface.triangles].mean(axis=1).reshape(2, -1, 3).mean(axis=0)
    middle = np.tile(cells, (2, 1))
    road = (np.abs(middle[:, 0]) < ROAD) & relief.road
    inside = (np.abs(middle[:, 0]) < wide) & (np.abs(middle[:, 1]) < long)
    far = relief.away(middle) > FAR
    choice = (("road", ASPHALT, road & ~inside), ("meadow", GRASS, ~(road | inside | far)), ("hill", HILL, far & ~road))
    pieces = [Piece(part, material, Solid(surface.vertices, surface.triangles[own])) for part, material, own in choice]
    return [piece for piece in pieces if len(piece.solid.triangles)]


def _scattered(relief: Relief, rng: np.random.Generator, near: float, far: float) -> Float:
    """A point (3,) on the land between two distances from the street's rectangle, clear of the road."""
    while True:
        x, y = rng.uniform(-1, 1, 2) * (relief.half[0] + far, relief.half[1] + far)
        away = float(relief.away(np.array([[x, y]]))[0])
        if near < away < far and abs(x) > 14:
            return np.array([x, y, float(relief.height(np.array(x), np.array(y)))])


def woods(relief: Relief, count: int, rng: np.random.Generator) -> list[Piece]:
    """A thicket behind the gardens, hedgerows farther off, woods on the hills."""
    near: list[Solid] = []
    far: list[Solid] = []
    for side in (-1, 1):
        for y in np.arange(2.0 - relief.half[1], relief.half[1], 5.5):
            x = side * (relief.half[0] + float(rng.uniform(7, 11)))
            near.append(_crown(relief, x, float(y + rng.normal(0, 1.2)), float(rng.uniform(2.2, 3.6)), rng))
    for k in range(count):
        share = (k + 0.5) / count
        start = 14 + 0.75 * relief.reach * share**1.5
        x, y, _ = _scattered(relief, rng, start, start + 40)
        direction = rng.uniform(0, np.pi)
        for step in range(int(rng.integers(3, 7))):
            at = np.array([x + 6.5 * step * np.cos(direction), y + 6.5 * step * np.sin(direction)]) + rng.normal(0, 2, 2)
            away = float(relief.away(at[None])[0])
            if abs(at[0]) > 13 and away > 7:
                crown = _crown(relief, float(at[0]), float(at[1]), float(rng.uniform(2.6, 5.0)) * (1 + share), rng)
                (near if away < NEAR else far).append(crown)
    return [Piece("thicket", THICKET, join(*near)), Piece("wood", WOOD, join(*far))]


def _crown(relief: Relief, x: float, y: float, size: float, rng: np.random.Generator) -> Solid:
    """One tree of a wood: a blob on the ground."""
    half = size * np.array([1, 1, float(rng.uniform(0.9, 1.5))])
    return moved(blob(rng, half, 1, 0.22), (x, y, float(relief.height(np.array(x), np.array(y))) + 0.4 * half[2]))


def around(points: Float) -> Float:
    """uv (N, 2) of points: metres along the horizon seen from the origin, and down. Used for leaves on woods, which are never
    seen from behind.
    """
    reach = np.hypot(points[:, 0], points[:, 1])
    return np.stack([reach * np.arctan2(points[:, 1], points[:, 0]), -points[:, 2]], axis=1)


def houses(relief: Relief, count: int, rng: np.random.Generator) -> list[Piece]:
    """Plain, distant houses."""
    walls = [Material(f"far_wall_{i}", linear(c), roughness=0.95) for i, c in enumerate(_WALLS)]
    roofs = [Material(f"far_roof_{i}", linear(c), roughness=0.95) for i, c in enumerate(_ROOFS)]
    glass = Material("far_window", linear((0.2, 0.23, 0.26)), roughness=0.2)
    pieces: list[Piece] = []
    for k in range(count):
        near = 18 + 150 * (k / count) ** 1.4
        at = _scattered(relief, rng, near, near + 30) - (0, 0, 0.5)
        turn = float(rng.choice((0.0, np.pi / 2))) + float(rng.normal(0, 0.2))
        w, d, h = (float(rng.uniform(*r)) for r in ((8, 13), (7, 9), (3.2, 6.0)))
        gable = prism([(-d / 2 - 0.4, h), (d / 2 + 0.4, h), (0, h + 0.45 * d)], -w / 2 - 0.3, w / 2 + 0.3, axis=0)
        panes = [
            cuboid((x - 0.6, -d / 2 - 0.05, z), (x + 0.6, d / 2 + 0.05, z + 1.2))
            for x in np.arange(-w / 2 + 1.6, w / 2 - 1, 2.6)
            for z in np.arange(1.2, h - 1.2, 2.6)
        ]
        body = cuboid((-w / 2, -d / 2, -1.0), (w / 2, d / 2, h + 0.05))
        parts = (
            (walls[int(rng.integers(len(walls)))], body),
            (roofs[int(rng.integers(len(roofs)))], gable),
            (glass, join(*panes)),
        )
        pieces += [Piece("house", material, moved(turned(solid, 2, turn), at)) for material, solid in parts]
    return pieces


_WALLS = ((0.86, 0.84, 0.78), (0.62, 0.36, 0.28), (0.8, 0.72, 0.58), (0.9, 0.89, 0.87))
_ROOFS = ((0.5, 0.26, 0.2), (0.33, 0.33, 0.35), (0.42, 0.3, 0.24))


def images(rng: np.random.Generator) -> list[Image]:
    """Textures of grass, asphalt and leaves."""
    return [turf(), textures.asphalt(rng, (0.4, 0.39, 0.38), 256), textures.leafage(rng, (0.3, 0.39, 0.17))]


def tints(relief: Relief, rng: np.random.Generator) -> dict[str, Tint]:
    """Fields on the hills, woods in several greens; both fade into the haze with distance."""
    near, fields, leaves = rng.spawn(3)
    mean = 0.88 * srgb.linear(turf().pixels[..., :3] / 255.0).mean(axis=(0, 1))

    def hazy(color: Float, p: Float) -> Float:
        share = 1 - np.exp(-np.maximum(relief.away(p) - FAR, 0) / 900)
        return color + (AIR - color) * share[:, None]

    def hill(p: Float) -> Float:
        dry = np.clip(0.5 + 0.9 * waves(fields, p[:, :2], 90.0), 0, 1)[:, None]
        color = mean * (1 - 0.45 * dry) + np.array([0.2, 0.17, 0.06]) * 0.45 * dry
        edge = np.clip((relief.away(p) - FAR) / 60, 0, 1)[:, None]
        return hazy(mean * (1 - edge) + color * edge, p)

    def wood(p: Float) -> Float:
        tone = waves(leaves, p, 14.0)[:, None]
        fine = 1 + 0.25 * waves(leaves, p, 2.5)[:, None]
        return hazy((np.array([0.045, 0.075, 0.02]) + np.array([0.02, 0.015, 0.004]) * tone) * fine, p)

    def thicket(p: Float) -> Float:
        tone = waves(leaves, p, 14.0)
        light = 0.75 + 0.05 * np.clip(p[:, 2], 0, 4) * (1 + 0.2 * tone)
        return np.stack([light * (1 + 0.15 * tone), light, light * (0.9 - 0.1 * tone)], axis=1)

    return {"grass": lambda p: meadow(near, p), "hill": hill, "wood": wood, "thicket": thicket}
