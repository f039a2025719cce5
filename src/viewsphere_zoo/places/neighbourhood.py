"""A residential street: two rows of houses with gardens, lamp posts and trees, and the country beyond."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from viewsphere.model.place import USUAL, Bay, Lane, Place, PlacePiece, Traffic, standing
from viewsphere.model.scene import Matrix4
from viewsphere.plugins.place import PlaceSpec
from viewsphere_zoo import drawing_of
from viewsphere_zoo.families import car, driveway, fence, hedge, house, street, tree
from viewsphere_zoo.townscape import HALF_LENGTH, PLOT, ROAD, STEP, street_life

if TYPE_CHECKING:
    from viewsphere_zoo.townscape.building import House

_SETBACK = 15.2
"""x of the houses' nearest wall, metres."""

VERGE, PAVEMENT, GARDEN = 4.2, 5.95, 6.36
"""x of the middle of the verge, where lamp posts stand; of benches on the pavement; of the gardens' edge; metres."""


PARKED = 0.0
"""Usual share of the driveways with a car."""

BAY = (2.3, 5.8)
"""Width and length of a parking space on a driveway, metres."""

APART = 1.7
"""Distance between a house's front, including its eaves, and that space, metres."""

WIDE = {"bench": 1.1, "driveway": 0.0}
"""Radius of a family's pieces, metres, where it differs from `SLIM`; trees use their crowns."""

SLIM = 0.5

FAR = 65.0
"""Distance along the street, metres, beyond which plots have no shrubs, bins and trees behind the house."""


@dataclass(frozen=True)
class Neighbourhood:
    """Parameters of a neighbourhood; metres. `seed` draws everything that the other parameters leave open.

    houses: designs with the garage on the right, without one, with it on the left; trees: designs; lamp_spacing: between lamp
    posts of one side; lamp: y of the lamp post on the right that is nearest to the origin, mirrored on the left; greenery:
    share of plots with a tree in front of the house; bounded: share with a hedge or fence in front; clear: distance from the
    origin that trees keep; traffic: cars on driveways and people on the pavements.
    """

    seed: int = 0
    houses: tuple[int, int, int] = (2, 3, 2)
    trees: int = 4
    lamp_spacing: float = 26.0
    lamp: float = 2.1
    greenery: float = 0.65
    bounded: float = 0.6
    clear: float = 15.5
    traffic: Traffic = USUAL


@dataclass(frozen=True)
class _Stand:
    """A family's member at a spot; x and y in the world."""

    family: str
    seed: int
    x: float
    y: float
    turn: float = 0.0
    z: float = STEP

    @property
    def world_from_piece(self) -> Matrix4:
        """The pose of the piece in the world."""
        return standing(self.x, self.y, self.turn, self.z)


def neighbourhood(parameters: Neighbourhood | None = None) -> Place:
    """The street along Y with everything beside it; the origin is on the middle of the road, free for 9 m each way."""
    p = parameters or Neighbourhood()
    design, lots, lamps, bounds, green, props, life = np.random.default_rng(p.seed).spawn(7)
    road, land = _designs(design, "street", 1)[0], _designs(design, "landscape", 1)[0]
    plan = street.draw(np.random.default_rng(road))
    plots = _plots(p, plan, design, lots)
    stands = [_Stand("street", road, 0.0, 0.0, z=0.0), _Stand("landscape", land, 0.0, 0.0, z=0.0)]
    stands += [_Stand("house", q.seed, q.side * q.house[0], q.house[1], q.turn, STEP - 0.02) for q in plots]
    stands += _paved(plots, design)
    stands += _lamp_posts(p, plan, lamps)
    stands += _boundaries(p, plots, bounds)
    stands += _trees(p, plots, green)
    stands += _shrubs(plots, green)
    stands += _furniture(plan, plots, props)
    bays, pavements = _bays(plots, stands), street.pavements()
    pieces = _named(
        [(s.family, s.seed, s.world_from_piece) for s in stands] + _traffic(p.traffic, bays, pavements, stands, life)
    )
    free = (-ROAD, -HALF_LENGTH, ROAD, HALF_LENGTH)
    return Place(pieces, free=free, lanes=street.lanes(), bays=bays, pavements=pavements)


def neighbourhood_random(rng: np.random.Generator, traffic: Traffic = USUAL) -> Place:
    """A neighbourhood with all parameters drawn."""
    return neighbourhood(
        Neighbourhood(
            seed=int(rng.integers(1 << 31)),
            lamp_spacing=float(rng.uniform(24, 29)),
            lamp=float(rng.uniform(1.7, 2.4)),
            greenery=float(rng.uniform(0.5, 0.75)),
            bounded=float(rng.uniform(0.4, 0.75)),
            traffic=traffic,
        )
    )


def _named(stands: Iterable[tuple[str, int, Matrix4]]) -> tuple[PlacePiece, ...]:
    """Pieces named by family and number."""
    count: Counter[str] = Counter()
    pieces: list[PlacePiece] = []
    for family, seed, world_from_piece in stands:
        count[family] += 1
        pieces.append(PlacePiece(f"{family}_{count[family]}", family, seed, family, world_from_piece))
    return tuple(pieces)


def _bays(plots: Sequence[_Plot], stands: Sequence[_Stand]) -> tuple[Bay, ...]:
    """A parking space on each driveway without a tree over it, in front of the garage and facing it."""
    trees = [(s.x, s.y, _around(s)) for s in stands if s.family == "tree"]
    width, length = BAY
    found: list[Bay] = []
    for q in plots:
        x, y = q.side * (q.front - APART - length / 2), q.driveway
        if all(np.hypot(max(abs(x - a) - length / 2, 0), max(abs(y - b) - width / 2, 0)) > r for a, b, r in trees):
            found.append(Bay(standing(x, y, (q.turn + 180.0) % 360.0, STEP + driveway.TOP), BAY))
    return tuple(found)


def _around(stand: _Stand) -> float:
    """Radius of a piece around its middle, metres."""
    if stand.family == "tree":
        return tree.draw(np.random.default_rng(stand.seed)).crown / 2
    return WIDE.get(stand.family, SLIM)


def _traffic(
    traffic: Traffic, bays: Sequence[Bay], pavements: Sequence[Lane], stands: Sequence[_Stand], rng: np.random.Generator
) -> list[tuple[str, int, Matrix4]]:
    """Cars on driveways, and people on the pavements."""
    share = PARKED if traffic.parked is None else traffic.parked
    if not share and not traffic.walkers:
        return []
    cars, people, spots, walks = rng.spawn(4)
    pool = {s: car.draw(np.random.default_rng(s)) for s in _designs(cars, "car", 7)}
    walking = _designs(people, "person", 6, lambda p: p.walks)

    def design() -> tuple[int, car.Car]:
        seed = int(rng.choice([*pool]))
        return seed, pool[seed]

    others = [(s.x, s.y, _around(s)) for s in stands[2:]]
    taken = [("car", seed, at) for seed, at in street_life.parked(spots, bays, share, design)]
    return taken + [
        ("person", int(rng.choice(walking)), at) for at in street_life.walkers(walks, pavements, traffic.walkers, others)
    ]


def _designs(rng: np.random.Generator, family: str, count: int, wanted: Callable[[Any], bool] = lambda p: True) -> list[int]:
    """Seeds of `count` members of a family whose parameters `wanted` accepts."""
    draw = drawing_of(family)
    seeds: list[int] = []
    while len(seeds) < count:
        seed = int(rng.integers(1 << 31))
        if wanted(draw(np.random.default_rng(seed))):
            seeds.append(seed)
    return seeds


def _plots(p: Neighbourhood, plan: street.Street, design: np.random.Generator, rng: np.random.Generator) -> list[_Plot]:
    """Both sides' plots, right first."""
    seeds = [
        s for g, n in zip((-1, 0, 1), p.houses, strict=True) for s in _designs(design, "house", n, lambda h, g=g: h.garage == g)
    ]
    pool = {s: house.draw(np.random.default_rng(s)) for s in seeds}
    sides = ((1, 0), (-1, 1))
    return [q for side, k in sides for q in _allotted(side, street.plots(k), plan.crossings[k], pool, rng)]


def _paved(plots: Sequence[_Plot], design: np.random.Generator) -> list[_Stand]:
    """A driveway and a path to the front door on each plot."""
    drives = _designs(design, "driveway", 2, lambda d: d.width > 2)
    paths = _designs(design, "driveway", 1, lambda d: d.width < 2 and d.surface != "asphalt")
    x = GARDEN + driveway.LENGTH / 2
    stands: list[_Stand] = []
    for k, q in enumerate(plots):
        stands.append(_Stand("driveway", drives[k * 7 // 3 % 2], q.side * x, q.driveway, q.turn))
        stands.append(_Stand("driveway", paths[0], q.side * x, q.door, q.turn))
    return stands


def _beside(y: float, crossings: Iterable[float], gap: float = 2.5) -> float:
    """The y nearest to `y` that is not in front of a driveway."""
    tries = y + np.array([s * 0.25 * k for k in range(40) for s in (1, -1)])
    free = (np.abs(tries[:, None] - np.array([*crossings])) > gap).all(axis=1)
    return float(tries[free][0])


def _lamp_posts(p: Neighbourhood, plan: street.Street, rng: np.random.Generator) -> list[_Stand]:
    """One kind of lamp post on both verges, facing the road."""
    seed = _designs(rng, "lamp_post", 1)[0]
    steps = np.arange(-3, 4) * p.lamp_spacing
    return [
        _Stand("lamp_post", seed, side * VERGE, _beside(float(y), crossings, 2.3), 270.0 if side > 0 else 90.0)
        for side, crossings in zip((1, -1), plan.crossings, strict=True)
        for y in side * p.lamp + steps
        if abs(y) < HALF_LENGTH - 5
    ]


def _boundaries(p: Neighbourhood, plots: Sequence[_Plot], rng: np.random.Generator) -> list[_Stand]:
    """Hedges and fences between the front gardens, and along the pavement, except in front of the houses at the origin."""
    low = _designs(rng, "hedge", 2, lambda h: h.height < 1.3)
    kinds = [("hedge", s) for s in low] + [("fence", s) for s in _designs(rng, "fence", 2, lambda f: f.style != "boards")]
    stands: list[_Stand] = []
    for q in plots:
        kind = kinds[int(rng.integers(4))]
        if rng.random() < 0.85:
            x = GARDEN + 1.25 + fence.LENGTH * np.arange(4)
            stands += [_Stand(*kind, q.side * float(v), q.ends[0]) for v in x]
        if min(abs(e) for e in q.ends) > 9 and rng.random() < p.bounded and q.ends[0] * q.ends[1] > 0:
            kind = kind if rng.random() < 0.6 else kinds[int(rng.integers(4))]
            y = q.y - 8 + hedge.LENGTH * np.arange(9)
            free = np.pad((np.abs(y - q.driveway) > 2.75) & (np.abs(y - q.door) > 1.75), 1)
            joined = free[1:-1] & (free[:-2] | free[2:])
            stands += [_Stand(*kind, q.side * (GARDEN + 0.45), float(v), q.turn) for v in y[joined]]
    return stands


def _trees(p: Neighbourhood, plots: Sequence[_Plot], rng: np.random.Generator) -> list[_Stand]:
    """Trees on front lawns, and taller trees behind the houses, in the gaps between them."""
    radius = {s: tree.draw(np.random.default_rng(s)).crown / 2 for s in _designs(rng, "tree", p.trees, lambda t: t.height < 9)}
    seeds = [*radius]
    stands: list[_Stand] = []
    for k, q in enumerate(plots):
        if rng.random() < p.greenery:
            seed = seeds[int(rng.integers(len(seeds)))]
            for _ in range(12):
                x, y = float(rng.uniform(9.2, 11.8)), float(rng.uniform(q.ends[0] + 1.8, q.ends[1] - 1.8))
                if _grows(p, q, stands, x, y, radius[seed], radius):
                    stands.append(_Stand("tree", seed, q.side * x, y, float(rng.uniform(0, 360))))
                    break
        if k % 2 and abs(q.y) < FAR:
            seed = seeds[int(rng.integers(len(seeds)))]
            y = q.ends[0] + float(rng.normal(0, 1))
            stands.append(_Stand("tree", seed, q.side * float(rng.uniform(31.8, 34)), y, float(rng.uniform(0, 360)), -0.3))
    return stands


def _grows(
    p: Neighbourhood, q: _Plot, others: Sequence[_Stand], x: float, y: float, r: float, radius: dict[int, float]
) -> bool:
    """Return whether a tree of this radius has room: off the paving, clear of the house, of other trees and of the origin."""
    apart = all(np.hypot(q.side * x - o.x, y - o.y) > r + radius[o.seed] + 0.6 for o in others)
    off = abs(y - q.driveway) > 2.2 and abs(y - q.door) > 1.3
    return bool(apart and off and x + r < q.front - 1.2 and x - r > GARDEN - 0.6 and np.hypot(x, y) - r > p.clear)


def _shrubs(plots: Sequence[_Plot], rng: np.random.Generator) -> list[_Stand]:
    """Beds in front of the houses' walls, beside the path to the door."""
    seeds = _designs(rng, "shrub", 2)
    stands: list[_Stand] = []
    for q in (q for q in plots if abs(q.y) < FAR):
        away = -np.sign(q.driveway - q.y)
        near = abs(q.y) < 12
        for step in range(3 if near else 1):
            y = q.door + away * (2.2 + 1.25 * step + float(rng.uniform(0, 0.3)))
            if abs(y - q.y) < 8.5:
                spot = (q.side * (q.front - 0.85 + float(rng.uniform(-0.1, 0.1))), float(y))
                stands.append(_Stand("shrub", seeds[int(rng.integers(2))], *spot, float(rng.uniform(0, 360))))
    return stands


def _furniture(plan: street.Street, plots: Sequence[_Plot], rng: np.random.Generator) -> list[_Stand]:
    """Signs, a bench, a post box, and bins beside the driveways."""
    crossing = _designs(rng, "road_sign", 1, lambda s: s.kind == "crossing")[0]
    limit = _designs(rng, "road_sign", 1, lambda s: s.kind == "limit")[0]
    right, left = plan.crossings
    stands = [
        _Stand("road_sign", crossing, VERGE, _beside(plan.zebra - 2.4, right)),
        _Stand("road_sign", crossing, -VERGE, _beside(plan.zebra + 2.4, left), 180.0),
        _Stand("road_sign", limit, VERGE, _beside(-40.0, right)),
        _Stand("road_sign", limit, -VERGE, _beside(44.0, left), 180.0),
        _Stand("bench", _designs(rng, "bench", 1, lambda b: b.backrest)[0], PAVEMENT, _beside(-12.0, right, 3.0), 270.0),
        _Stand("post_box", _designs(rng, "post_box", 1)[0], -PAVEMENT, _beside(12.0, left), 90.0),
    ]
    bins = _designs(rng, "wheelie_bin", 2)
    for q in (q for q in plots if abs(q.y) < FAR):
        for k in range(int(rng.choice((0, 1, 2), p=(0.45, 0.35, 0.2)))):
            y = q.driveway - np.sign(q.driveway - q.y) * (2.0 + 0.75 * k)
            spot = (q.side * float(rng.uniform(7.7, 8.0)), float(y))
            stands.append(_Stand("wheelie_bin", bins[k], *spot, q.turn + float(rng.uniform(-12, 12))))
    return stands


@dataclass(frozen=True)
class _Plot:
    """One house's plot: its middle along the street, where house, driveway and door are, metres; seed draws the house.

    x is measured from the middle of the road towards the plot; side is 1 on the right (+X) and -1 on the left.
    """

    side: int
    y: float
    driveway: float
    door: float
    seed: int
    house: tuple[float, float]
    front: float
    reach: tuple[float, float]

    @property
    def turn(self) -> float:
        """Turn about z that faces a piece's front (-Y) to the road, degrees."""
        return 270.0 if self.side > 0 else 90.0

    @property
    def ends(self) -> tuple[float, float]:
        """y of the plot's borders with its neighbours."""
        return self.y - PLOT / 2, self.y + PLOT / 2


def _allotted(
    side: int,
    middles: Sequence[float],
    driveways: Sequence[float],
    pool: dict[int, House],
    rng: np.random.Generator,
) -> list[_Plot]:
    """A plot for each middle: a house (a seed of `pool`) different from the one next door; a garage, if any, is at the
    driveway.
    """
    plots: list[_Plot] = []
    for y, ramp in zip(middles, driveways, strict=True):
        near = -side if ramp > y else side
        taken = [p.seed for p in plots[-2:]]
        fitting = [s for s, h in pool.items() if h.garage in (0, near)]
        fresh = [s for s in fitting if s not in taken]
        seed = int(rng.choice(fresh or fitting))
        plots.append(_plot(side, y, ramp, seed, pool[seed], float(rng.uniform(0, 0.7))))
    return plots


def _plot(side: int, y: float, driveway: float, seed: int, house: House, back: float) -> _Plot:
    width, depth = house.footprint
    beside = y - np.sign(driveway - y) * 1.6
    middle = float(beside) if house.garage_x is None else driveway + side * house.garage_x
    front = _SETBACK + back
    return _Plot(
        side=side,
        y=y,
        driveway=driveway,
        door=middle - side * house.door_x,
        seed=seed,
        house=(front + depth / 2, middle),
        front=front,
        reach=(middle - width / 2, middle + width / 2),
    )


PLACE = PlaceSpec(random=neighbourhood_random, roads=True)
