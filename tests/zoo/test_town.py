"""zoo:town: the ground and its lanes, what keeps apart, what stays free, limits."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

import viewsphere_zoo as zoo
from viewsphere.model.place import Place, PlacePiece
from viewsphere_zoo.families.town_ground import TownGround, town_ground
from viewsphere_zoo.indoors.furnishing import overlap
from viewsphere_zoo.places.town import town_random
from viewsphere_zoo.townscape import blocks
from zoo_mesh import assert_sound, drawn, faces, part_vertices, seeds

SEEDS = seeds(6, few=3)


def at(piece: PlacePiece) -> np.ndarray:
    return np.array(piece.world_from_piece)


def of(place: Place, *families: str) -> list[PlacePiece]:
    return [p for p in place.pieces if p.family in families]


def plan(piece: PlacePiece) -> tuple[float, float, float, float]:
    """The floor that a building's walls cover, by its parameters."""
    p = zoo.family(piece.family).draw(np.random.default_rng(piece.seed))
    w, d = p.footprint if piece.family == "house" else (p.width, p.depth)
    m = np.abs(at(piece)[:2, :2])
    (x, y), (a, b) = at(piece)[:2, 3], m @ (w / 2, d / 2)
    return x - a, y - b, x + a, y + b


@pytest.fixture(scope="module", params=SEEDS)
def place(request: pytest.FixtureRequest) -> Place:
    return town_random(np.random.default_rng(request.param))


def test_a_seed_gives_one_layout() -> None:
    layouts = [town_random(np.random.default_rng(seed)) for seed in SEEDS]
    assert town_random(np.random.default_rng(2)) == layouts[2] and len(set(layouts)) == len(layouts)


def test_pieces_are_named_rigid_and_instances_of_few_members(place: Place) -> None:
    assert len({p.name for p in place.pieces}) == len(place.pieces) > 300
    assert {p.family for p in place.pieces} <= set(zoo.family_names())
    assert len({(p.family, p.seed) for p in place.pieces}) <= 60
    for p in place.pieces:
        np.testing.assert_allclose(at(p)[:3, :3] @ at(p)[:3, :3].T, np.eye(3), atol=1e-12)
    found = {p.family for p in place.pieces}
    assert {
        "shop",
        "house",
        "tree",
        "car",
        "lamp_post",
        "traffic_light",
        "bench",
        "fountain",
        "town_ground",
        "outskirts",
    } <= found


def test_buildings_stand_behind_pavements_and_not_in_one_another(place: Place) -> None:
    ground = of(place, "town_ground")[0]
    p: TownGround = zoo.family("town_ground").draw(np.random.default_rng(ground.seed))
    plans = [plan(piece) for piece in of(place, "shop", "house")]
    for a, b in itertools.combinations(plans, 2):
        assert not overlap(a, b, -0.01)
    inner = [
        (*(np.array(block.low) + blocks.PAVED - 1e-6), *(np.array(block.high) - blocks.PAVED + 1e-6)) for block, _ in p.blocks
    ]
    for own in plans:
        assert any(a <= own[0] and b <= own[1] and own[2] <= c and own[3] <= d for a, b, c, d in inner)


def test_lanes_around_blocks_meet_no_other_and_no_parked_car(place: Place) -> None:
    loops = [np.array(lane.points)[:, :2] for lane in place.lanes if lane.closed]
    assert len(loops) == 6
    for a, b in itertools.combinations(loops, 2):
        assert min(np.linalg.norm(a - q, axis=1).min() for q in b) > 3.0
    for car in of(place, "car"):
        position, forward = at(car)[:2, 3], -at(car)[:2, 1]
        gaps = [np.linalg.norm(_dense(loop) - position, axis=1).min() for loop in loops]
        assert min(gaps) > 2.3
        if min(gaps) > 4:  # on the outer side of the outer roads, along which no closed lane leads
            continue
        dense = _dense(loops[int(np.argmin(gaps))])
        near = int(np.linalg.norm(dense - position, axis=1).argmin())
        ahead = dense[(near + 1) % len(dense)] - dense[near]
        assert forward @ ahead / np.linalg.norm(ahead) > 0.99  # it stands as it would drive


def _dense(loop: np.ndarray) -> np.ndarray:
    ends = np.roll(loop, -1, axis=0)
    t = np.linspace(0, 1, 40, endpoint=False)[None, :, None]
    return (loop[:, None] * (1 - t) + ends[:, None] * t).reshape(-1, 2)


def test_nothing_stands_on_the_free_stretch_of_road(place: Place) -> None:
    x0, y0, x1, y1 = place.free
    assert (x0 + x1, y0 + y1) == (0, 0) and y1 > 15
    for piece in place.pieces:
        x, y = at(piece)[:2, 3]
        assert piece.family in ("town_ground", "outskirts") or not (x0 < x < x1 and y0 < y < y1)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_the_ground_is_sound_and_the_roads_are_level(seed: int) -> None:
    mesh = drawn("town_ground", seed)
    assert_sound(mesh, 40_000, least=5_000)
    assert np.abs(part_vertices(mesh, "road")[:, 2]).max() == 0
    assert part_vertices(mesh, "pavement")[:, 2] == pytest.approx(0.1)
    _, area = faces(mesh)
    flat = np.isin(mesh.triangle_part, [mesh.parts.index(n) for n in ("road", "pavement", "verge") if n in mesh.parts])
    assert (area[flat, 2] > 0).all()
    ground = zoo.family("town_ground").draw(np.random.default_rng(seed))
    width = ground.x[-1] - ground.x[0] + 2 * blocks.HALF
    road = part_vertices(mesh, "road")
    assert np.ptp(road[:, 0]) == pytest.approx(width, abs=1e-4)
    assert mesh.vertices.tobytes() == town_ground(ground).vertices.tobytes()


@pytest.mark.slow
def test_the_country_begins_where_the_town_ends() -> None:
    ground = zoo.family("town_ground").draw(np.random.default_rng(4))
    land = drawn("outskirts", 4)
    near = np.abs(part_vertices(land, "meadow")[:, :2])
    inside = (near[:, 0] < ground.half[0] - 1e-3) & (near[:, 1] < ground.half[1] - 1e-3)
    assert not inside.any()
    edge = np.hypot(*np.maximum(near - ground.half, 0).T)
    assert edge.min() < 1e-3 and math.isclose(
        drawn("town_ground", 4).bounds[1][0], ground.middle[0] + ground.half[0], abs_tol=1e-3
    )
