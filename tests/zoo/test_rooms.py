"""zoo:room, zoo:flat and zoo:table_top: determinism, what keeps apart, what stays free, what stands on what."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import viewsphere_zoo as zoo
from quick import quick
from viewsphere import plugins
from viewsphere.model.place import Place
from viewsphere.plugins.place import PlaceSpec
from viewsphere_zoo.indoors.furnishing import Furnishing, Stand, extent, overlap
from viewsphere_zoo.indoors.habits import furnished
from viewsphere_zoo.indoors.plan import SIDES
from zoo_mesh import drawn, seeds

FAMILIES = (
    "bed",
    "bottle",
    "bowl",
    "cabinet",
    "can",
    "chair",
    "lamp",
    "mug",
    "plate",
    "refrigerator",
    "shelf",
    "sofa",
    "table",
)
SEEDS = seeds(10, few=4)


def place(name: str, seed: int) -> Place:
    return plugins.load(PlaceSpec, name).random(np.random.default_rng(seed))


def at(piece) -> np.ndarray:
    return np.array(piece.world_from_piece)


@pytest.mark.parametrize("name", quick(["room", "flat", "table_top"], "table_top"))
def test_a_seed_gives_one_layout_and_others_give_others(name: str) -> None:
    layouts = [place(name, seed) for seed in range(5)]
    assert place(name, 3) == layouts[3]
    assert len(set(layouts)) == len(layouts)
    for one in layouts:
        assert len({p.name for p in one.pieces}) == len(one.pieces) > 4
        assert {p.family for p in one.pieces} <= set(zoo.family_names())
        for p in one.pieces:
            m = at(p)
            np.testing.assert_allclose(m[:3, :3] @ m[:3, :3].T, np.eye(3), atol=1e-12)
        assert one.free is not None
        x0, y0, x1, y1 = one.free
        assert (x0 + x1, y0 + y1) == pytest.approx((0, 0), abs=1e-9)


def test_a_layout_builds_no_mesh(monkeypatch: pytest.MonkeyPatch) -> None:
    from viewsphere.assets.mesh import Mesh

    def refuse(self: Mesh) -> None:
        raise AssertionError("a mesh was built")

    monkeypatch.setattr(Mesh, "__post_init__", refuse)
    assert len(place("flat", 5).pieces) > 30


def rooms(seed: int) -> list[Furnishing]:
    rng = np.random.default_rng(seed)
    interior = zoo.family("interior").draw(np.random.default_rng(seed))
    return [furnished(room, rng) for room in interior.rooms]


@pytest.mark.parametrize("seed", SEEDS)
def test_furniture_keeps_apart_and_off_the_doors(seed: int) -> None:
    for made in rooms(seed):
        floor = [s for s in made.stands if s.z == 0 and s.size[2] > 0.06]
        for a, b in itertools.combinations(floor, 2):
            tucked = "table" in (a.family, b.family) and "chair" in (a.family, b.family)
            assert tucked or not overlap(a.rectangle, b.rectangle), (a.family, b.family)
        low, high = made.room.low, made.room.high
        for s in floor:
            x0, y0, x1, y1 = s.rectangle
            assert x0 > low[0] and y0 > low[1] and x1 < high[0] and y1 < high[1]
        for o in made.room.openings:
            if o.opens != "window":
                x, y = made.room.middle(o.side)
                wall = Stand("", 0, None, x, y, -90.0 * SIDES.index(o.side))
                a, b = wall.at(o.x, 0.05), wall.at(o.x, 0.9)
                way = (min(a[0], b[0]) - 0.05, min(a[1], b[1]) - 0.05, max(a[0], b[0]) + 0.05, max(a[1], b[1]) + 0.05)
                assert not any(overlap(way, s.rectangle) for s in floor)


@pytest.mark.parametrize("seed", SEEDS)
def test_small_things_stand_on_what_carries_them(seed: int) -> None:
    for made in rooms(seed):
        small = [s for s in made.stands if s.z > 0]
        for s in small:
            under = [o for o in made.stands if o.z == 0 and overlap(o.rectangle, s.rectangle)]
            assert any(abs(f.height - s.z) < 1e-9 for o in under for f in o.surfaces())
        for a, b in itertools.combinations(small, 2):
            assert abs(a.z - b.z) > 0.2 or not overlap(a.rectangle, b.rectangle)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["room", "flat", "table_top"])
def test_surfaces_are_level_faces_of_furniture(name: str) -> None:
    pytest.importorskip("embreex")
    from trimesh import Trimesh
    from trimesh.ray.ray_pyembree import RayMeshIntersector

    made = place(name, 1)
    found = {surface.name: surface for surface in made.surfaces}
    assert len(found) == len(made.surfaces) > 0 and {"table", "shelf", "cabinet"} & found.keys()
    big = [p for p in made.pieces[1:] if zoo.family(p.family).surfaces]
    casters = [
        (at(p), RayMeshIntersector(Trimesh(m.vertices, m.triangles, process=False)))
        for p in big
        for m in [drawn(p.family, p.seed)]
    ]
    for surface in made.surfaces:
        world = np.array(surface.world_from_surface)
        (w, d), above = surface.size, 0.05 if surface.clearance is None else min(0.05, surface.clearance / 2)
        u, v = np.meshgrid(np.linspace(-0.45, 0.45, 5) * w, np.linspace(-0.45, 0.45, 5) * d)
        points = np.stack([u.ravel(), v.ravel(), np.full(25, above)], axis=1) @ world[:3, :3].T + world[:3, 3]
        heights = np.full(25, -np.inf)
        for pose, caster in casters:
            own = (points - pose[:3, 3]) @ pose[:3, :3]
            hits, rays, _ = caster.intersects_location(own, np.tile((0.0, 0.0, -1.0), (25, 1)), multiple_hits=False)
            heights[rays] = np.maximum(heights[rays], hits[:, 2] + pose[2, 3])
        assert np.abs(heights - world[2, 3]).max() < 0.035, surface.name


@pytest.mark.slow
def test_every_kind_of_room_has_what_makes_it_one() -> None:
    found: dict[str, list[set[str]]] = {}
    for seed in range(24):
        for made in rooms(seed):
            found.setdefault(made.room.kind, []).append({s.family for s in made.stands})
    for kind, family in (("bedroom", "bed"), ("living_room", "sofa"), ("kitchen", "table"), ("office", "table")):
        assert np.mean([family in there for there in found[kind]]) > 0.8, kind


@pytest.mark.slow
@pytest.mark.parametrize(("name", "seeds"), [("room", 2), ("flat", 1)])
def test_the_free_floor_is_free_and_cameras_have_room_around_it(name: str, seeds: int) -> None:
    for seed in range(seeds):
        made = place(name, seed)
        x0, y0, x1, y1 = made.free
        assert min(x1 - x0, y1 - y0) >= 1.1
        for piece in made.pieces[1:]:
            mesh = drawn(piece.family, piece.seed)
            world = mesh.vertices @ at(piece)[:3, :3].T + at(piece)[:3, 3]
            if piece.family != "rug" and world[:, 2].min() < 0.3:
                inside = (
                    (world[:, 0] > x0 + 0.05)
                    & (world[:, 0] < x1 - 0.05)
                    & (world[:, 1] > y0 + 0.05)
                    & (world[:, 1] < y1 - 0.05)
                )
                assert not inside.any(), piece.name


@pytest.mark.slow
def test_the_table_top_is_the_floor_and_empty() -> None:
    for seed in range(4):
        made = place("table_top", seed)
        x0, y0, x1, y1 = made.free
        tables = [p for p in made.pieces if p.family == "table"]
        tops = []
        for piece in tables:
            mesh = drawn(piece.family, piece.seed)
            world = mesh.vertices @ at(piece)[:3, :3].T + at(piece)[:3, 3]
            tops.append(world[:, 2].max() if np.hypot(*at(piece)[:2, 3]) < 1e-9 else np.inf)
        assert min(tops) == pytest.approx(0, abs=1e-6)
        for piece in made.pieces[1:]:
            x, y, z = at(piece)[:3, 3]
            assert not (abs(z) < 1e-9 and x0 < x < x1 and y0 < y < y1), piece.name


@pytest.mark.parametrize("family", quick(FAMILIES, *FAMILIES[2::4]))
def test_measures_by_parameters_are_those_of_meshes(family: str) -> None:
    for seed in range(4):
        p = zoo.family(family).draw(np.random.default_rng(seed))
        if (
            (family == "chair" and type(p).__name__ not in ("Dining", "Windsor", "Shell", "Office", "Armchair"))
            or (family == "lamp" and p.style not in ("column", "tripod", "table"))
            or (family == "refrigerator" and p.ajar)
        ):
            continue
        low, high = drawn(family, seed).bounds
        wide, deep, _ = extent(p)
        front = 0.6 if family == "cabinet" else 0.75 if family == "sofa" else 0.06  # doors ajar, a chaise
        assert high[0] - low[0] < wide + 0.12 and high[1] < deep / 2 + 0.06 and -low[1] < deep / 2 + front
