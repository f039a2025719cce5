"""zoo:neighbourhood: the layout's determinism, what keeps apart, the free stretch of road, limits."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
import pytest

import viewsphere_zoo as zoo
from viewsphere import plugins
from viewsphere.assets.mesh import Mesh
from viewsphere.errors import UserError
from viewsphere.model.place import Place, PlacePiece, standing
from viewsphere.plugins.place import PlaceSpec
from viewsphere_zoo.places.neighbourhood import Neighbourhood, neighbourhood, neighbourhood_random
from zoo_mesh import seeds

SEEDS = seeds(12, few=4)
APART = ("house", "lamp_post", "road_sign", "bench", "post_box", "wheelie_bin", "shrub")


def drawn(seed: int) -> Place:
    return neighbourhood_random(np.random.default_rng(seed))


def of(place: Place, *families: str) -> list[PlacePiece]:
    return [p for p in place.pieces if p.family in families]


def at(piece: PlacePiece) -> np.ndarray:
    return np.array(piece.world_from_piece)[:3, 3]


@pytest.fixture(scope="module")
def built() -> tuple[Place, dict[tuple[str, int], Mesh]]:
    place = drawn(1)
    keys = {(p.family, p.seed) for p in place.pieces}
    return place, {key: zoo.build(key[0], np.random.default_rng(key[1])) for key in sorted(keys)}


def in_world(built: tuple[Place, dict[tuple[str, int], Mesh]], *families: str) -> Iterator[tuple[PlacePiece, np.ndarray, Mesh]]:
    """Pieces with their vertices in the world, (V, 3)."""
    place, meshes = built
    for piece in of(place, *families) if families else place.pieces:
        mesh, m = meshes[piece.family, piece.seed], np.array(piece.world_from_piece)
        yield piece, mesh.vertices @ m[:3, :3].T + m[:3, 3], mesh


def test_places_are_found_by_name() -> None:
    assert "neighbourhood" in plugins.names("places")
    assert plugins.load(PlaceSpec, "neighbourhood").random is neighbourhood_random
    with pytest.raises(UserError, match=r"place: 'neighborhood' is unknown; did you mean 'neighbourhood'"):
        plugins.load(PlaceSpec, "neighborhood")


def test_a_seed_gives_one_layout_and_others_give_others() -> None:
    assert drawn(3) == drawn(3)
    assert neighbourhood() == neighbourhood(Neighbourhood(seed=0))
    layouts = [drawn(seed) for seed in SEEDS]
    assert len(set(layouts)) == len(layouts)
    houses = [tuple(at(p)[1] for p in of(place, "house")) for place in layouts]
    assert len(set(houses)) == len(layouts)


def test_a_layout_builds_no_mesh(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(self: Mesh) -> None:
        raise AssertionError("a mesh was built")

    monkeypatch.setattr(Mesh, "__post_init__", refuse)
    assert len(drawn(5).pieces) > 100
    with pytest.raises(AssertionError, match="a mesh was built"):
        zoo.build("fence", np.random.default_rng(0))


@pytest.mark.parametrize("seed", SEEDS)
def test_every_piece_is_named_placed_rigidly_and_of_a_known_family(seed: int) -> None:
    place = drawn(seed)
    assert len({p.name for p in place.pieces}) == len(place.pieces)
    assert {p.family for p in place.pieces} <= set(zoo.family_names())
    for p in place.pieces:
        m = np.array(p.world_from_piece)
        np.testing.assert_allclose(m[:3, :3] @ m[:3, :3].T, np.eye(3), atol=1e-12)
        assert np.linalg.det(m[:3, :3]) == pytest.approx(1) and (m[3] == (0, 0, 0, 1)).all() and m[2, 2] == 1
    assert len({(p.family, p.seed) for p in place.pieces}) <= 30


def test_quarter_turns_are_exact_and_face_the_road() -> None:
    assert standing(4.0, 2.0, 90.0, 0.1) == ((0, -1, 0, 4), (1, 0, 0, 2), (0, 0, 1, 0.1), (0, 0, 0, 1))
    for p in of(drawn(0), "house", "lamp_post"):
        front = np.array(p.world_from_piece)[:3, :3] @ (0, -1, 0)
        assert front[0] == -np.sign(at(p)[0])


@pytest.mark.parametrize("seed", SEEDS)
def test_the_orbit_has_room_and_lamp_posts_stand_close(seed: int) -> None:
    place = drawn(seed)
    assert min(abs(at(p)[0]) for p in of(place, "house")) > 15
    for sign in (1, -1):
        near = [np.hypot(*at(p)[:2]) for p in of(place, "lamp_post") if np.sign(at(p)[0]) == sign]
        assert 4.2 < min(near) < 5.6
        assert len(near) >= 6
    tall = of(place, "tree")
    assert 10 <= len(tall) <= 26 and min(np.hypot(*at(p)[:2]) for p in tall) > 15.5
    assert len(of(place, "house")) == 18
    neighbours = [p.seed for p in of(place, "house")]
    assert all(a != b for a, b in itertools.pairwise(neighbours[:9]))


@pytest.mark.slow
def test_nothing_stands_on_the_free_stretch_of_road(built: tuple[Place, dict[tuple[str, int], Mesh]]) -> None:
    for piece, vertices, mesh in in_world(built):
        corners = vertices[mesh.triangles]
        low, high = corners.min(axis=1), corners.max(axis=1)
        over = (low[:, 0] < 3.2) & (high[:, 0] > -3.2) & (low[:, 1] < 9) & (high[:, 1] > -9)
        top = high[over, 2].max(initial=0.0)
        assert top <= 0.01 if piece.family == "street" else not over.any(), piece.name


@pytest.mark.slow
def test_things_keep_apart(built: tuple[Place, dict[tuple[str, int], Mesh]]) -> None:
    boxes = [(p, v.min(axis=0), v.max(axis=0)) for p, v, _ in in_world(built, *APART)]
    for (p, a, b), (q, c, d) in itertools.combinations(boxes, 2):
        planted = {p.family, q.family} in ({"shrub"}, {"shrub", "house"})
        assert planted or (a[:2] > d[:2]).any() or (c[:2] > b[:2]).any(), (p.name, q.name)
    trees = [(p, at(p)[:2], np.hypot(*(v - at(p))[:, :2].T).max()) for p, v, _ in in_world(built, "tree")]
    for (p, a, r), (q, b, s) in itertools.combinations(trees, 2):
        assert np.hypot(*(a - b)) > 0.85 * (r + s), (p.name, q.name)
    for (p, spot, r), (q, low, high) in itertools.product(trees, boxes):
        reach = r if q.family == "house" else 0.5
        gap = np.maximum(np.maximum(low[:2] - spot, spot - high[:2]), 0)
        assert np.hypot(*gap) > 0.95 * reach, (p.name, q.name)


@pytest.mark.slow
def test_driveways_lead_to_garages_and_paths_to_doors(built: tuple[Place, dict[tuple[str, int], Mesh]]) -> None:
    place, meshes = built
    paved = of(place, "driveway")
    for piece, vertices, mesh in in_world(built, "house"):
        ends = {}
        for part in ("garage_door", "door"):
            if part in mesh.parts:
                own = mesh.triangles[mesh.triangle_part == mesh.parts.index(part)]
                ends[part] = vertices[np.unique(own)].mean(axis=0)
        same = [p for p in paved if np.sign(at(p)[0]) == np.sign(at(piece)[0])]
        for part, spot in ends.items():
            nearest = min(same, key=lambda p: abs(at(p)[1] - spot[1]))
            assert abs(at(nearest)[1] - spot[1]) < 0.1
            wide = np.ptp(meshes[nearest.family, nearest.seed].bounds[:, 0]) > 2
            assert wide == (part == "garage_door")
            assert abs(at(nearest)[0]) + 5.5 > abs(spot[0]) - 0.6
    spans = sorted((s, at(p)[1], np.ptp(meshes[p.family, p.seed].bounds[:, 0]) / 2) for p in paved for s in [np.sign(at(p)[0])])
    for (s, y, r), (t, z, q) in itertools.pairwise(spans):
        assert s != t or z - y > r + q


@pytest.mark.slow
def test_a_place_is_moderate_in_size(built: tuple[Place, dict[tuple[str, int], Mesh]]) -> None:
    place, meshes = built
    assert len(meshes) <= 30
    assert 100_000 < sum(len(meshes[p.family, p.seed].triangles) for p in place.pieces) < 300_000
