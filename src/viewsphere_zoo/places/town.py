"""A small town: shops with flats above, houses with gardens, a park, junctions, parked cars, and the country beyond."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from viewsphere.model.place import USUAL, Bay, Lane, Place, PlacePiece, Traffic, standing
from viewsphere.model.scene import Matrix4
from viewsphere.plugins.place import PlaceSpec
from viewsphere_zoo import drawing_of
from viewsphere_zoo.families.town_ground import TownGround
from viewsphere_zoo.townscape import STEP, blocks, street_life
from viewsphere_zoo.townscape.blocks import CORNER, HALF, LANE, PAVED, Block

DESIGNS = {"car": 9, "person": 8, "tree": 6, "shop": 12, "house": 6, "bench": 2, "wheelie_bin": 2, "shrub": 3}
"""Number of designs in a town, for families with many copies; other families have one."""

KINDS: dict[str, Callable[[Any], bool]] = {
    "": lambda p: True,
    "plain": lambda house: house.garage == 0 and house.footprint[1] < 12,
    "low": lambda hedge: hedge.height < 1.3,
    "small": lambda tree: tree.crown < 4.2 and tree.height < 7,
    "backed": lambda bench: bench.backrest,
    "walking": lambda person: person.walks,
}
"""Tests for members of a kind."""


PARKED = 0.4
"""Usual share of parking spaces that are occupied."""

WIDE = {"bench": 1.1, "tree": 2.2}
"""Radius of a family's pieces, metres, where it differs from `SLIM`; small trees use their crowns."""

SLIM = 0.4


@dataclass(frozen=True)
class Frontage:
    """A side of a block: its left end as seen from the road, the direction to the right, and its length."""

    start: tuple[float, float]
    right: tuple[float, float]
    length: float

    @property
    def turn_deg(self) -> float:
        """The turn that makes a piece's front (-Y) face the road."""
        return math.degrees(math.atan2(self.right[1], self.right[0]))

    def at(self, along: float, inset: float) -> tuple[float, float]:
        """The point this far from the left end, and this far from the kerb into the block."""
        (x, y), (a, b) = self.start, self.right
        return x + a * along - b * inset, y + b * along + a * inset


def frontages(block: Block) -> tuple[Frontage, ...]:
    """Return the frontages of the front (-y), right (+x), rear and left."""
    (x0, y0), (x1, y1) = block.low, block.high
    wide, long = block.size
    return (
        Frontage((x0, y0), (1.0, 0.0), wide),
        Frontage((x1, y0), (0.0, 1.0), long),
        Frontage((x1, y1), (-1.0, 0.0), wide),
        Frontage((x0, y1), (0.0, -1.0), long),
    )


@dataclass(eq=False)
class _Town:
    """The pieces of a town under construction."""

    rng: np.random.Generator
    pieces: list[PlacePiece] = field(default_factory=list[PlacePiece])
    designs: dict[tuple[str, str], list[tuple[int, Any]]] = field(default_factory=dict[tuple[str, str], list[tuple[int, Any]]])
    count: Counter[str] = field(default_factory=Counter[str])

    def drawn(self, family: str, kind: str = "") -> tuple[int, Any]:
        """One of the town's members of a family, or of a kind of it: its seed and parameters."""
        if (family, kind) not in self.designs:
            draw, found, fits = drawing_of(family), list[tuple[int, Any]](), KINDS[kind]
            while len(found) < DESIGNS.get(family, 1):
                seed = int(self.rng.integers(1 << 31))
                if fits(parameters := draw(np.random.default_rng(seed))):
                    found.append((seed, parameters))
            self.designs[family, kind] = found
        known = self.designs[family, kind]
        return known[int(self.rng.integers(len(known)))]

    def put(self, family: str, seed: int, x: float, y: float, turn: float = 0.0, z: float = STEP) -> None:
        """Add a piece at a position."""
        self.put_at(family, seed, standing(x, y, turn % 360, z))

    def put_at(self, family: str, seed: int, world_from_piece: Matrix4) -> None:
        """Add a piece in its frame."""
        self.count[family] += 1
        name = f"{family}_{self.count[family]}"
        self.pieces.append(PlacePiece(name, family, seed, family.replace("_", " "), world_from_piece))

    def stand(self, family: str, side: Frontage, along: float, inset: float, turn: float = 0.0, kind: str = "") -> None:
        """Add a member of a family on a side of a block, its front to the road unless turned."""
        seed, _ = self.drawn(family, kind)
        self.put(family, seed, *side.at(along, inset), side.turn_deg + turn)


def town(seed: int = 0, traffic: Traffic = USUAL) -> Place:
    """The town of this seed; the roads are z = 0, the origin is on the middle of a road between two junctions."""
    rng = np.random.default_rng(seed)
    own = int(rng.integers(1 << 31))
    ground: TownGround = drawing_of("town_ground")(np.random.default_rng(own))
    made = _Town(rng)
    made.put("town_ground", own, 0.0, 0.0, z=0.0)
    made.put("outskirts", own, *ground.middle, z=0.0)
    for block, use in ground.blocks:
        {"shops": _shops, "houses": _houses, "park": _park}[use](made, block)
        for side in frontages(block):
            _pavement(made, side)
    _corners(made, ground)
    bays, pavements = tuple(blocks.bays(ground.x, ground.y)), blocks.pavements(ground.x, ground.y)
    _traffic(made, traffic, bays, pavements)
    y = min(y for y in ground.y if y > 0) - HALF - CORNER - blocks.ZEBRA[1]
    free = (-LANE, -y, LANE, y)
    lanes = blocks.lanes(ground.x, ground.y)
    return Place(tuple(made.pieces), free=free, lanes=lanes, bays=bays, pavements=pavements)


def town_random(rng: np.random.Generator, traffic: Traffic = USUAL) -> Place:
    """A town with all parameters drawn."""
    return town(int(rng.integers(1 << 31)), traffic)


def _shops(t: _Town, block: Block) -> None:
    """Terraces on all four sides: the long ones from corner to corner, the others between them; trees in the yard."""
    deep = 0.0
    for side in frontages(block)[1::2]:
        deep = max(deep, _terrace(t, side, PAVED, side.length - PAVED))
    for side in frontages(block)[::2]:
        _terrace(t, side, PAVED + deep + 0.5, side.length - PAVED - deep - 0.5)
    for _ in range(6):
        x, y = (float(m + t.rng.uniform(-1, 1) * (s / 2 - PAVED - 15)) for m, s in zip(block.middle, block.size, strict=True))
        t.put("tree", t.drawn("tree")[0], x, y, float(t.rng.uniform(0, 360)))


def _terrace(t: _Town, side: Frontage, start: float, stop: float) -> float:
    """Houses with shops, wall to wall between two positions along a side; returns the depth of the deepest house."""
    row, used = list[tuple[int, Any]](), 0.0
    while True:
        seed, p = t.drawn("shop")
        if used + p.width > stop - start:
            break
        row.append((seed, p))
        used += p.width
    at = (start + stop - used) / 2
    for seed, p in row:
        t.put("shop", seed, *side.at(at + p.width / 2, PAVED + p.depth / 2), side.turn_deg, STEP - 0.02)
        at += p.width
    return max((p.depth for _, p in row), default=0.0)


def _houses(t: _Town, block: Block) -> None:
    """Houses in gardens on the two long sides, hedges along the pavement with gaps in front of the doors."""
    for side in frontages(block)[1::2]:
        for along in _spread(side.length, 17.5, 10.5):
            seed, p = t.drawn("house", "plain")
            t.put("house", seed, *side.at(along, PAVED + 6.0 + p.footprint[1] / 2), side.turn_deg, STEP - 0.02)
            door = along + p.door_x
            t.stand("tree", side, along + float(t.rng.choice((-7.0, 7.0))), PAVED + 3.0, float(t.rng.uniform(0, 360)))
            t.stand("shrub", side, along + 0.35 * p.width * np.sign(along - door + 0.1), PAVED + 5.0)
            for step in np.arange(along - 8.0, along + 8.0, 2.0):
                if abs(step + 1.0 - door) > 1.8:
                    t.stand("hedge", side, float(step + 1.0), PAVED + 0.4, kind="low")


def _park(t: _Town, block: Block) -> None:
    """Trees, shrubs and benches around a fountain."""
    for side in frontages(block):
        for along in _spread(side.length, 7.0, 6.0):
            inset = PAVED + float(t.rng.uniform(3.0, 7.0))
            t.stand("tree", side, along + float(t.rng.uniform(-1.5, 1.5)), inset, float(t.rng.uniform(0, 360)))
            if t.rng.random() < 0.4:
                t.stand("shrub", side, along + 3.0, PAVED + 1.2, float(t.rng.uniform(0, 360)))
        for along in _spread(side.length, 16.0, 14.0):
            t.stand("bench", side, along, PAVED + 9.5, 180.0, "backed")
    x, y = block.middle
    t.put("fountain", t.drawn("fountain")[0], x, y)


def _pavement(t: _Town, side: Frontage) -> None:
    """Lamp posts and trees along the kerb, a bench, a post box and bins."""
    lamps = list(_spread(side.length, 24.0, 8.0))
    for along in lamps:
        t.stand("lamp_post", side, along, 0.55)
    for along in _spread(side.length, 9.5, 12.0):
        if min(abs(along - lamp) for lamp in lamps) > 2.5 and t.rng.random() < 0.6:
            t.stand("tree", side, along, 0.75, float(t.rng.uniform(0, 360)), "small")
    for family, inset, chance in (
        ("bench", 2.3, 0.6),
        ("post_box", 0.5, 0.3),
        ("wheelie_bin", 2.2, 0.5),
        ("bollard", 0.4, 0.5),
    ):
        if t.rng.random() < chance:
            along = float(t.rng.uniform(14, side.length - 14))
            if min(abs(along - lamp) for lamp in lamps) > 1.5:
                t.stand(family, side, along, inset)


def _corners(t: _Town, ground: TownGround) -> None:
    """Traffic lights at every crossing of the town's inner junctions."""
    for block, _ in ground.blocks:
        for side in frontages(block):
            x, y = side.at(side.length - CORNER - 0.4, 0.0)
            inner = ground.x[0] + HALF + 1 < x < ground.x[-1] - HALF - 1 or ground.y[0] + HALF + 1 < y < ground.y[-1] - HALF - 1
            if inner:
                t.stand("traffic_light", side, side.length - CORNER - 0.6, 0.6, 90.0)


def _traffic(t: _Town, traffic: Traffic, bays: Sequence[Bay], pavements: Sequence[Lane]) -> None:
    """Cars in some of the bays, and people on the pavements."""
    share = PARKED if traffic.parked is None else traffic.parked
    for seed, at in street_life.parked(t.rng, bays, share, lambda: t.drawn("car"), _crowns(t)):
        t.put_at("car", seed, at)
    others = [(*_spot(piece), WIDE.get(piece.family, SLIM)) for piece in t.pieces]
    for at in street_life.walkers(t.rng, pavements, traffic.walkers, others):
        t.put_at("person", t.drawn("person", "walking")[0], at)


def _crowns(t: _Town) -> list[street_life.Crown]:
    """The crowns of all trees."""
    draw = drawing_of("tree")
    known = {piece.seed: draw(np.random.default_rng(piece.seed)) for piece in t.pieces if piece.family == "tree"}
    trees = [(_spot(piece), known[piece.seed]) for piece in t.pieces if piece.family == "tree"]
    return [(x, y, p.crown / 2, p.clear + STEP) for (x, y), p in trees]


def _spot(piece: PlacePiece) -> tuple[float, float]:
    """x and y of a piece."""
    return piece.world_from_piece[0][3], piece.world_from_piece[1][3]


def _spread(length: float, pitch: float, margin: float) -> Iterator[float]:
    """Positions about this far apart along a side, clear of its ends."""
    count = max(1, int((length - 2 * margin) // pitch) + 1)
    yield from (np.linspace(margin, length - margin, count) if count > 1 else np.array([length / 2])).tolist()


PLACE = PlaceSpec(random=town_random, roads=True)
