"""Cars on driveways and in parking bays, and people on pavements, of the neighbourhood and of the town."""

from __future__ import annotations

import itertools
from functools import lru_cache

import numpy as np
import pytest

import viewsphere_zoo as zoo
from viewsphere import plugins
from viewsphere.assets.exporting.rigged import RiggedModel
from viewsphere.model.place import Lane, Place, PlacePiece, Traffic
from viewsphere.plugins.place import PlaceSpec
from viewsphere_zoo.townscape import street_life
from zoo_mesh import seeds

SEEDS = seeds(8, few=2)
GROUND = ("street", "landscape", "driveway", "town_ground", "outskirts")
FULL = Traffic(parked=1.0, walkers=40)
USUAL = {"neighbourhood": 0.0, "town": 0.4}


def laid(name: str, seed: int, *traffic: Traffic) -> Place:
    return plugins.load(PlaceSpec, name).random(np.random.default_rng(seed), *traffic)


def of(place: Place, *families: str) -> list[PlacePiece]:
    return [piece for piece in place.pieces if piece.family in families]


@lru_cache(maxsize=512)
def vertices(family: str, seed: int) -> np.ndarray:
    model = zoo.build(family, np.random.default_rng(seed))
    return (model.mesh if isinstance(model, RiggedModel) else model).vertices


def placed(piece: PlacePiece) -> np.ndarray:
    m = np.array(piece.world_from_piece)
    return vertices(piece.family, piece.seed) @ m[:3, :3].T + m[:3, 3]


def box(piece: PlacePiece) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest point in the world."""
    return placed(piece).min(axis=0), placed(piece).max(axis=0)


def meet(a: tuple[np.ndarray, np.ndarray], b: tuple[np.ndarray, np.ndarray]) -> bool:
    return bool((a[0][:2] < b[1][:2]).all() and (b[0][:2] < a[1][:2]).all())


@pytest.mark.parametrize("name", USUAL)
def test_the_rest_of_a_place_is_the_same_whatever_its_traffic(name):
    kinds = [laid(name, 3, *traffic) for traffic in ((), (Traffic(parked=0.0),), (FULL,))]
    rest = [[piece for piece in place.pieces if piece.family not in ("car", "person")] for place in kinds]
    assert rest[0] == rest[1] == rest[2]
    assert laid(name, 3, FULL) == kinds[2] != laid(name, 4, FULL)
    counts = [[len(of(place, family)) for family in ("car", "person")] for place in kinds]
    assert counts[1] == [0, 0]
    assert counts[0][0] <= counts[2][0] <= len(kinds[2].bays)
    assert counts[0][1] == 0
    assert counts[2][1] == 40


@pytest.mark.parametrize("name", USUAL)
@pytest.mark.slow
def test_the_share_of_taken_bays_and_the_number_of_people(name):
    bays = cars = 0
    for seed in range(20):
        place = laid(name, seed, Traffic(parked=0.5, walkers=7))
        far = [b for b in place.bays if np.hypot(b.world_from_bay[0][3], b.world_from_bay[1][3]) > street_life.CLEAR]
        bays, cars = bays + len(far), cars + len(of(place, "car"))
        assert len(of(place, "person")) == 7
    assert bays > 100
    assert -0.1 < cars / bays - 0.5 < 2.6 * 0.5 / bays**0.5  # p = 0.005; some stay empty below the crowns of trees


@pytest.mark.parametrize("name", USUAL)
def test_people_walk_along_pavements_either_way(name):
    place = laid(name, 1, Traffic(walkers=60))
    ways = [part for lane in place.pavements for part in street_life.stretches(lane)]
    turned = set()
    for piece in of(place, "person"):
        m = np.array(piece.world_from_piece)
        gaps, along = zip(*(_beside(m, part) for part in ways), strict=True)
        nearest = int(np.argmin(gaps))
        assert gaps[nearest] <= ways[nearest][5] / 2 + 1e-6
        assert abs(along[nearest]) == pytest.approx(1, abs=1e-6)
        assert m[2, 3] == ways[nearest][2]
        turned.add(round(along[nearest]))
    assert turned == {-1, 1}


def _beside(m, part):
    """Metres from a person's middle to a straight part of a pavement, and how far its front points along it."""
    start, end = np.array(part[:2]), np.array(part[3:5])
    way = (end - start) / np.linalg.norm(end - start)
    t = np.clip((m[:2, 3] - start) @ way, 0, np.linalg.norm(end - start))
    return float(np.linalg.norm(m[:2, 3] - start - t * way)), float(-m[:2, 1] @ way)


def test_people_without_room_are_left_out():
    lane = Lane("path", ((0, 0, 0), (10, 0, 0)), 0.5)
    found = list(street_life.walkers(np.random.default_rng(0), [lane], 50, [(5, 0, 2.0)]))
    assert 2 <= len(found) <= 8
    spots = np.array(found)[:, :2, 3]
    assert (np.hypot(*(spots - (5, 0)).T) > 2.6).all()
    assert min(np.linalg.norm(a - b) for a, b in itertools.combinations(spots, 2)) > 1.2
    assert not list(street_life.walkers(np.random.default_rng(0), [], 50, []))


def reaches(points: np.ndarray, family: str, own: tuple[np.ndarray, np.ndarray]) -> bool:
    """True if the box of the parts as low as a car or person meets their box; of a tree, whether more than a leaf is in it."""
    if family == "tree":
        return bool(((points > own[0]) & (points < own[1])).all(axis=1).sum() > 4)
    low = points[points[:, 2] < own[1][2]]
    return len(low) > 0 and meet(own, (low.min(axis=0), low.max(axis=0)))


@pytest.mark.slow
@pytest.mark.parametrize("name", USUAL)
@pytest.mark.parametrize("seed", SEEDS)
def test_cars_and_people_keep_apart_and_stand_on_the_ground(name, seed):
    place = laid(name, seed, FULL)
    traffic = [(p, box(p)) for p in of(place, "car", "person")]
    assert len({p.family for p, _ in traffic}) == 2
    for (p, own), (q, other) in itertools.combinations(traffic, 2):
        assert not meet(own, other), (p.name, q.name)
    for q in (p for p in place.pieces if p.family not in (*GROUND, "car", "person")):
        points = placed(q)
        ends = points.min(axis=0) + points.max(axis=0)
        for p, own in traffic:
            if np.hypot(*(own[0] + own[1] - ends)[:2]) < 40:
                assert not reaches(points, q.family, own), (p.name, q.name)
    heights = {"car": 0.13 if name == "neighbourhood" else 0.0, "person": 0.1}
    for p, (low, _) in traffic:
        assert low[2] == pytest.approx(heights[p.family], abs=0.012), p.name
