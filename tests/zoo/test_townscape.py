"""The families that streets are made of: sizes, parts, sound triangles, determinism, variety."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import viewsphere_zoo as zoo
from quick import quick
from viewsphere_zoo.families import driveway, fence, hedge
from viewsphere_zoo.families.house import draw as draw_house
from viewsphere_zoo.families.house import house
from viewsphere_zoo.families.lamp_post import LampPost, lamp_post
from viewsphere_zoo.families.landscape import Landscape, landscape
from viewsphere_zoo.families.road_sign import RoadSign, road_sign
from viewsphere_zoo.families.street import draw as draw_street
from viewsphere_zoo.families.street import plots, street
from viewsphere_zoo.families.tree import Tree, tree
from viewsphere_zoo.townscape import textures
from viewsphere_zoo.townscape.building import House
from zoo_mesh import assert_sound, drawn, faces, outward_share, part_vertices, seeds

SIZES = {
    "bench": ((1.3, 2.0), (0.4, 0.95), (0.5, 0.75)),
    "driveway": ((0.9, 3.2), (0.03, 0.05), (10.9, 11.1)),
    "fence": ((2.0, 2.2), (0.9, 1.7), (0.05, 0.2)),
    "hedge": ((2.0, 2.2), (0.8, 1.75), (0.5, 1.0)),
    "house": ((7.5, 15.5), (5.0, 13.0), (7.2, 13.5)),
    "lamp_post": ((0.2, 0.6), (3.7, 6.1), (0.2, 1.6)),
    "landscape": ((1000, 1500), (30, 90), (1000, 1500)),
    "post_box": ((0.35, 0.65), (1.2, 1.7), (0.35, 0.65)),
    "road_sign": ((0.5, 0.85), (2.3, 3.0), (0.1, 0.2)),
    "shrub": ((0.6, 2.1), (0.35, 1.2), (0.6, 2.1)),
    "street": ((60, 60), (0.45, 0.55), (200, 200)),
    "tree": ((1.5, 8.0), (4.5, 11.0), (1.5, 8.0)),
    "wheelie_bin": ((0.45, 0.65), (0.9, 1.25), (0.5, 0.85)),
}
"""Width, height and length that draws may have, metres."""

MOST = {"landscape": 40_000, "street": 20_000, "house": 8_000, "tree": 6_000}
CLOSED = ("bench", "fence", "house", "lamp_post", "post_box", "road_sign", "wheelie_bin")


@pytest.mark.parametrize("family", quick(SIZES, *(SIZES.keys() - {"landscape", "street"})))
def test_draws_are_sound_of_real_size_and_differ(family: str) -> None:
    meshes = [drawn(family, seed) for seed in seeds(2 if family in ("landscape", "street") else 6)]
    for mesh in meshes:
        assert_sound(mesh, MOST.get(family, 2_000), least=60)
        assert abs(float(mesh.vertices[:, 2].min())) < 0.05 or family in ("landscape", "street")
        for value, (low, high) in zip(zoo.real_size(mesh), SIZES[family], strict=True):
            assert low - 1e-3 <= value <= high + 1e-3
        if mesh.images:
            assert mesh.uv0 is not None and np.isfinite(mesh.uv0).all()
        for image in mesh.images:
            assert image.pixels.shape[0] == image.pixels.shape[1] <= 512 and (image.pixels[..., 3] == 255).all()
    looks = {m.vertices.tobytes() + b"".join(i.pixels.tobytes() for i in m.images) + repr(m.materials).encode() for m in meshes}
    assert len(looks) == len(meshes)


@pytest.mark.parametrize("family", quick(SIZES, *(SIZES.keys() - {"landscape"})))
def test_one_seed_gives_one_mesh(family: str) -> None:
    a, b = drawn(family, 1), zoo.build(family, np.random.default_rng(1))
    for name in ("vertices", "triangles", "normals", "uv0", "colors", "triangle_part", "triangle_material"):
        x, y = getattr(a, name), getattr(b, name)
        assert (x is None and y is None) or x.tobytes() == y.tobytes()
    assert a.materials == b.materials
    assert [i.pixels.tobytes() for i in a.images] == [i.pixels.tobytes() for i in b.images]


@pytest.mark.parametrize("family", CLOSED)
def test_what_is_closed_shows_its_outside(family: str) -> None:
    for seed in range(2):
        assert outward_share(drawn(family, seed)) > 0.995


def test_a_house_has_what_was_asked_for() -> None:
    plain = House(garage=0, dormers=0, porch="none", chimney=False, shutters=False)
    bare = house(plain)
    assert not {"garage_door", "porch", "chimney", "shutter"} & set(bare.parts)
    rich = house(replace(plain, garage=1, dormers=2, porch="posts", chimney=True, shutters=True))
    assert {"garage_door", "porch", "chimney", "chimney_pot", "shutter"} <= set(rich.parts)
    walls = part_vertices(bare, "wall")
    np.testing.assert_allclose(np.ptp(walls, axis=0)[:2], (plain.width, plain.depth), atol=1e-4)
    np.testing.assert_allclose(walls.min(axis=0)[:2], (-plain.width / 2, -plain.depth / 2), atol=1e-4)
    assert part_vertices(bare, "door").mean(axis=0)[1] < -plain.depth / 2 + 0.2


@pytest.mark.parametrize("seed", seeds(12, few=4))
def test_a_layout_knows_a_houses_footprint_door_and_garage(seed: int) -> None:
    p = draw_house(np.random.default_rng(seed))
    mesh = house(p)
    low, high = (f(part_vertices(mesh, "wall"), axis=0) for f in (np.min, np.max))
    np.testing.assert_allclose((high - low)[:2], p.footprint, atol=0.05)
    np.testing.assert_allclose((high + low)[:2] / 2, 0, atol=0.05)
    handle = part_vertices(mesh, "door_frame")
    door = handle[np.abs(handle[:, 0] - p.door_x) < 0.52]
    assert np.ptp(door[:, 0]) == pytest.approx(1.02, abs=0.02)
    if p.garage_x is not None:
        wide = part_vertices(mesh, "garage_door")
        assert wide[:, 0].mean() == pytest.approx(p.garage_x, abs=0.05)


def test_house_draws_cover_all_styles() -> None:
    draws = [draw_house(np.random.default_rng(seed)) for seed in range(120)]
    for name, kinds in (("roof", 4), ("wall", 3), ("porch", 3), ("bars", 5), ("garage", 3), ("dormers", 3)):
        counts = {v: sum(getattr(p, name) == v for p in draws) for v in {getattr(p, name) for p in draws}}
        assert len(counts) == kinds and min(counts.values()) >= 5, (name, counts)


@pytest.mark.slow
def test_a_street_is_level_at_its_middle_and_its_paint_lies_above() -> None:
    for seed in range(3):
        mesh = street(draw_street(np.random.default_rng(seed)))
        corners, _ = faces(mesh)
        flat = corners[..., :2]
        ahead = np.roll(flat, -1, axis=1)
        turns = flat[..., 0] * ahead[..., 1] - flat[..., 1] * ahead[..., 0]
        over = (turns >= 0).all(axis=1) & (turns.sum(axis=1) > 0)
        assert over.any() and corners[over][..., 2].max() == 0.0
        for part in ("centre_line", "zebra", "patch", "manhole", "drain"):
            if part in mesh.parts:
                assert 0.003 - 1e-6 <= part_vertices(mesh, part)[:, 2].max() <= 0.006 + 1e-6
        lanes = part_vertices(mesh, "patch")[:, 0] if "patch" in mesh.parts else np.array([1.0])
        assert np.abs(lanes).min() > 0.1 and np.abs(lanes).max() < 2.6


def test_kerbs_are_dropped_at_driveways_alone() -> None:
    p = draw_street(np.random.default_rng(2))
    kerb = part_vertices(street(p), "kerb")
    for sign, crossings in zip((1, -1), p.crossings, strict=True):
        side = kerb[np.sign(kerb[:, 0]) == sign]
        off = np.abs(side[:, 1:2] - np.array(crossings)).min(axis=1)
        top = np.abs(side[:, 0]) > 3.3
        assert side[top & (off > 2.2), 2].min() == pytest.approx(0.1)
        assert side[top & (off < 1.55), 2].max(initial=0.025) == pytest.approx(0.025)
        assert len(crossings) == len(plots((1 - sign) // 2)) >= 9


@pytest.mark.slow
def test_the_landscape_closes_the_horizon_around_the_street() -> None:
    pytest.importorskip("embreex")
    from trimesh import Trimesh
    from trimesh.ray.ray_pyembree import RayMeshIntersector

    mesh = landscape(Landscape(seed=3))
    used = part_vertices(mesh, "road", "meadow", "hill")
    caster = RayMeshIntersector(Trimesh(mesh.vertices, mesh.triangles, process=False))
    azimuth = np.radians(np.arange(0, 360, 2.0))
    out = np.stack([np.cos(azimuth), np.sin(azimuth), np.full_like(azimuth, 0.0)], axis=1)
    for height in (0.2, 2.0, 7.5):
        assert caster.intersects_any(np.tile((0.0, 0.0, height), (len(out), 1)), out).all()
    inside = (np.abs(used[:, 0]) < 30 - 1e-6) & (np.abs(used[:, 1]) < 100 - 1e-6)
    assert not inside.any()


@pytest.mark.parametrize("style", ["arm", "swan_neck", "lantern", "globe"])
def test_a_lamp_post_stands_on_its_column_and_reaches_over_the_road(style: str) -> None:
    mesh = lamp_post(LampPost(style=style, height=5.0))
    column, lens = part_vertices(mesh, "column"), part_vertices(mesh, "lens")
    np.testing.assert_allclose(column[:, :2].mean(axis=0), 0, atol=0.01)
    assert mesh.bounds[1][2] == pytest.approx(5.0, abs=0.12)
    assert lens[:, 2].min() > 0.75 * 5.0
    assert (lens[:, 1].mean() < -0.3) == (style in ("arm", "swan_neck"))


@pytest.mark.parametrize("habit", ["round", "column", "conifer", "birch"])
def test_a_tree_has_its_height_crown_and_a_trunk_below(habit: str) -> None:
    p = Tree(habit=habit, height=8.0, crown=4.4, clear=2.0)
    mesh = tree(p)
    leaves, trunk = part_vertices(mesh, "leaves"), part_vertices(mesh, "trunk")
    assert mesh.bounds[1][2] == pytest.approx(8.0, rel=0.12)
    assert np.ptp(leaves[:, :2], axis=0).max() == pytest.approx(4.4, rel=0.35)
    assert leaves[:, 2].min() > 1.0 and trunk[:, 2].min() < 0.05
    assert np.hypot(*trunk[:, :2].T).max() < 0.6


def test_pieces_that_join_end_to_end_have_their_length() -> None:
    for module in (hedge, fence):
        mesh = getattr(module, module.__name__.rsplit(".", 1)[1])()
        assert np.ptp(mesh.bounds[:, 0]) == pytest.approx(module.LENGTH, abs=0.2)
    mesh = driveway.driveway()
    assert np.ptp(mesh.bounds[:, 1]) == pytest.approx(driveway.LENGTH)


def test_signs_face_front_and_show_their_number() -> None:
    for kind in ("limit", "stop", "give_way", "crossing", "parking"):
        mesh = road_sign(RoadSign(kind=kind))
        plate = part_vertices(mesh, "plate")
        assert plate[:, 1].max() < -0.03
        assert mesh.bounds[1][2] == pytest.approx(2.7, abs=0.1)
    a, b = (road_sign(RoadSign(limit=n)) for n in (20, 50))
    assert part_vertices(a, "symbol").shape == part_vertices(b, "symbol").shape
    assert not np.array_equal(part_vertices(a, "symbol"), part_vertices(b, "symbol"))


def test_textures_tile_without_a_seam() -> None:
    rng = np.random.default_rng(1)
    tiles = (
        textures.asphalt(rng, (0.4, 0.4, 0.4), 256),
        textures.grass(rng, (0.35, 0.45, 0.2), 256),
        textures.plaster(rng, "plaster", (0.9, 0.9, 0.85)),
        textures.leafage(rng, (0.3, 0.4, 0.2), 400),
    )
    for tile in tiles:
        p = tile.pixels[..., :3].astype(float)
        for axis in (0, 1):
            steps = np.abs(np.diff(p, axis=axis)).mean()
            seam = np.abs(np.take(p, 0, axis) - np.take(p, -1, axis)).mean()
            assert seam < 1.5 * steps + 1


def test_all_families_of_the_townscape_are_registered() -> None:
    assert set(SIZES) <= set(zoo.family_names())
