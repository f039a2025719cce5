"""What fills streets and towns: sizes, parts, sound triangles, determinism, variety of the families for traffic."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import viewsphere_zoo as zoo
from quick import quick
from viewsphere_zoo.coachwork.lorry import Truck
from viewsphere_zoo.coachwork.saloon import Bus
from viewsphere_zoo.families.backpack import backpack
from viewsphere_zoo.families.bollard import Bollard, bollard
from viewsphere_zoo.families.bus import bus
from viewsphere_zoo.families.fountain import Fountain, fountain
from viewsphere_zoo.families.motorcycle import Motorcycle, motorcycle
from viewsphere_zoo.families.shop import shop
from viewsphere_zoo.families.traffic_cone import TrafficCone, traffic_cone
from viewsphere_zoo.families.traffic_light import TrafficLight, traffic_light
from viewsphere_zoo.families.truck import truck
from viewsphere_zoo.sewing.design import Backpack
from viewsphere_zoo.townscape.lettering import lettering
from viewsphere_zoo.townscape.shopfront import Shop
from zoo_mesh import assert_sound, drawn, outward_share, part_vertices, seeds

SIZES = {
    "backpack": ((0.25, 0.5), (0.38, 0.9), (0.25, 0.65)),
    "bollard": ((0.1, 0.6), (0.84, 1.16), (0.1, 0.6)),
    "bus": ((2.4, 3.1), (2.9, 4.8), (9.1, 13.0)),
    "fountain": ((2.5, 7.2), (1.2, 4.6), (2.5, 7.2)),
    "motorcycle": ((0.65, 1.0), (1.0, 1.6), (1.75, 2.6)),
    "shop": ((5.39, 8.42), (9.0, 22.0), (8.5, 14.0)),
    "traffic_cone": ((0.2, 0.65), (0.4, 1.55), (0.2, 0.65)),
    "traffic_light": ((0.2, 5.4), (2.8, 6.9), (0.4, 1.5)),
    "truck": ((2.1, 2.8), (1.9, 4.1), (5.5, 10.3)),
}
"""Width, height and length that draws may have, metres."""

MOST = {"bus": 40_000, "motorcycle": 40_000, "truck": 40_000}
CENTRED = ("bus", "fountain", "motorcycle", "traffic_cone", "truck")
STYLES = {
    "backpack": {"style": 4, "pockets": 2, "side_pockets": 2, "bottle": 2, "mat": 2},
    "bollard": {"style": 4, "top": 4, "plate": 2, "sides": 2},
    "bus": {"style": 3, "livery": 4, "roof_unit": 4, "door_side": 2, "flush": 2, "split": 2},
    "fountain": {"style": 3, "sides": 4, "bowls": 3, "jets": 4, "steps": 3, "metal": 2},
    "motorcycle": {"style": 5, "engine": 3, "spokes": 6, "mufflers": 2, "top_box": 2, "panniers": 2},
    "shop": {"roof": 3, "wall": 3, "storeys": 3, "side_door": 3, "door": 3, "hanging_sign": 3, "bars": 5, "name": 12},
    "traffic_cone": {"foot": 3, "stack": 3, "bands": 6, "light": 2, "dark_foot": 2},
    "traffic_light": {"style": 3, "lit": 3, "sides": 4, "heads": 2, "button": 2, "striped": 2},
    "truck": {"load": 5, "axles": 2, "livery": 4, "visor": 2, "high_roof": 2},
}
"""Choices of a family, and how many values each has among draws."""


@pytest.mark.parametrize("family", quick(SIZES, *(SIZES.keys() - {"bus", "truck", "shop"})))
def test_draws_are_sound_of_real_size_and_differ(family: str) -> None:
    meshes = [drawn(family, seed) for seed in seeds(4)]
    for mesh in meshes:
        assert_sound(mesh, MOST.get(family, 8_000), least=150)
        assert mesh.uv0 is None or (np.isfinite(mesh.uv0).all() and all(i.pixels.shape[0] <= 512 for i in mesh.images))
        low, high = mesh.bounds
        assert low[2] == pytest.approx(0, abs=1e-5)
        assert family not in CENTRED or abs((low + high)[:2]).max() / 2 < 0.05 * (high - low)[:2].max()
        for value, (least, most) in zip(zoo.real_size(mesh), SIZES[family], strict=True):
            assert least - 1e-3 <= value <= most + 1e-3
    assert len({m.vertices.tobytes() for m in meshes}) == len({repr(m.materials) for m in meshes}) == len(meshes)


@pytest.mark.parametrize("family", quick(SIZES, *(SIZES.keys() - {"bus"})))
def test_one_seed_gives_one_mesh(family: str) -> None:
    a, b = drawn(family, 1), zoo.build(family, np.random.default_rng(1))
    for name in ("vertices", "triangles", "normals", "uv0", "colors", "triangle_part", "triangle_material"):
        x, y = getattr(a, name), getattr(b, name)
        assert (x is None and y is None) or x.tobytes() == y.tobytes()
    assert a.materials == b.materials
    assert [i.pixels.tobytes() for i in a.images] == [i.pixels.tobytes() for i in b.images]


@pytest.mark.parametrize("family", quick(SIZES, *(SIZES.keys() - {"bus"})))
def test_a_camera_sees_outsides(family: str) -> None:
    assert outward_share(drawn(family, 2)) > 0.995


@pytest.mark.parametrize("family", SIZES)
def test_draws_cover_all_styles(family: str) -> None:
    draw = zoo.family(family).draw
    draws = [draw(np.random.default_rng(seed)) for seed in range(80)]
    for name, kinds in STYLES[family].items():
        counts = {v: sum(getattr(p, name) == v for p in draws) for v in {getattr(p, name) for p in draws}}
        assert len(counts) == kinds and min(counts.values()) >= 3, (name, counts)
    paints = {p.wall_color if family == "shop" else p.color for p in draws}
    assert len(paints) > 60


@pytest.mark.parametrize("family", ["bus", "truck"])
def test_heavy_vehicles_have_the_size_that_was_asked_for_and_face_minus_y(family: str) -> None:
    build, p = {"bus": (bus, Bus(length=10.5, height=3.1)), "truck": (truck, Truck(length=7.5, height=3.7))}[family]
    mesh = build(p)
    low, high = mesh.bounds
    assert (high - low)[1] == pytest.approx(p.length, rel=0.02)
    tops = part_vertices(mesh, "roof" if family == "bus" else "cargo_box")
    assert tops[:, 2].max() == pytest.approx(p.height, abs=0.4 if family == "bus" else 0.03)
    assert part_vertices(mesh, "headlight")[:, 1].max() < low[1] + 0.6
    assert part_vertices(mesh, "taillight")[:, 1].min() > high[1] - 0.4
    for side, sign in (("left", 1), ("right", -1)):
        for end in ("front", "rear"):
            tyre, rim = (part_vertices(mesh, f"wheel_{end}_{side}_{part}") for part in ("tyre", "rim"))
            assert tyre[:, 2].min() == pytest.approx(0, abs=1e-5)
            assert sign * tyre[:, 0].min() > 0 and sign * tyre[:, 0].max() > 0
            assert (tyre[:, 1].mean() < 0) == (end == "front")
            assert np.abs(rim).max(axis=0)[0] <= np.abs(tyre).max(axis=0)[0] + 0.05
    assert {"windshield", "grille", "licence_plate", "wiper", "mirror_left", "mirror_right"} <= set(mesh.parts)


@pytest.mark.slow
def test_a_bus_has_its_doors_on_one_side_and_a_row_of_windows_on_each() -> None:
    p = Bus(doors=3, door_side="right")
    right, left = bus(p), bus(replace(p, door_side="left"))
    for mesh, sign in ((right, -1), (left, 1)):
        assert {"door_1", "door_2", "door_3"} <= set(mesh.parts)
        assert (np.sign(part_vertices(mesh, "door_")[:, 0]) == sign).all()
        along = [part_vertices(mesh, f"door_{k}")[:, 1].mean() for k in (1, 2, 3)]
        assert along == sorted(along)
    assert np.ptp(part_vertices(right, "window_left")[:, 1]) > 0.8 * p.length
    upper = part_vertices(bus(replace(p, style="double_decker", height=4.3)), "window_left")[:, 2]
    assert upper.max() > 3.5 and upper.min() < 1.3
    with_other_number = bus(replace(p, route="7 PARK"))
    assert part_vertices(with_other_number, "destination").shape != part_vertices(right, "destination").shape


@pytest.mark.parametrize("load", quick(["box", "cold_box", "curtain", "dropside", "tipper"], "tipper"))
def test_a_lorry_carries_what_was_asked_for_behind_its_cab(load: str) -> None:
    mesh = truck(Truck(load=load, axles=3, goods="gravel" if load == "tipper" else "crates"))
    own = {"box": "cargo_door", "cold_box": "cooling_unit", "curtain": "curtain", "dropside": "headboard", "tipper": "load"}
    assert own[load] in mesh.parts and "wheel_third_left_tyre" in mesh.parts
    cab = part_vertices(mesh, "body", "roof")[:, 1].max()
    hold = part_vertices(mesh, "cargo_bed" if load in ("dropside", "tipper") else "cargo_box")
    assert hold[:, 1].min() > cab and hold[:, 2].min() > 0.7
    bare = truck(Truck(load=load, goods="none", name="", livery="plain", visor=False))
    assert not {"load", "livery", "visor", "deflector", "wheel_third_left_tyre"} & set(bare.parts)


@pytest.mark.parametrize("style", quick(["naked", "sport", "cruiser", "tourer", "scooter"], "sport", "scooter"))
def test_a_motorcycle_stands_on_both_wheels_and_steers_to_the_left(style: str) -> None:
    p = Motorcycle(style=style, screen=0.4)
    straight, steered = motorcycle(p), motorcycle(replace(p, steering=20.0))
    for end, sign in (("front", -1), ("rear", 1)):
        tyre = part_vertices(straight, f"wheel_{end}_tyre")
        assert tyre[:, 2].min() == pytest.approx(0, abs=0.02) and sign * tyre[:, 1].mean() > 0
    own = {"sport": "fairing", "scooter": "leg_shield"}.get(style, "tank")
    assert {"seat", "headlight", "taillight", "engine", "muffler", own} <= set(straight.parts)
    assert ("windscreen" in straight.parts) == (style != "scooter")
    assert ("leg_shield" in straight.parts) == (style == "scooter")
    lamp = part_vertices(straight, "headlight")
    assert lamp[:, 1].mean() < part_vertices(straight, "seat")[:, 1].mean() < part_vertices(straight, "taillight")[:, 1].mean()
    ahead = [part_vertices(mesh, "mirror_left")[:, 1].mean() for mesh in (straight, steered)]
    assert (
        ahead[1] - part_vertices(steered, "seat")[:, 1].mean() > ahead[0] - part_vertices(straight, "seat")[:, 1].mean() + 0.05
    )
    fitted = {"top_box", "pannier"}
    assert not fitted & set(straight.parts) and "top_box" in motorcycle(replace(p, top_box=True)).parts


@pytest.mark.parametrize("style", ["post", "cantilever", "pedestrian"])
def test_one_lamp_of_a_traffic_light_shines(style: str) -> None:
    looks = set()
    for lit in ("red", "amber", "green"):
        mesh = traffic_light(TrafficLight(style=style, lit=lit, height=6.0 if style == "cantilever" else 3.4))
        z = {}
        for name in ("red", "amber", "green"):
            part = mesh.triangle_part == mesh.parts.index(f"lamp_{name}")
            glows = [max(mesh.materials[i].emissive) > 0.5 for i in set(mesh.triangle_material[part])]
            assert glows == [name == lit]
            z[name] = part_vertices(mesh, f"lamp_{name}").mean(axis=0)
        assert z["red"][2] > z["amber"][2] > z["green"][2] and z["red"][1] < -0.05
        walker = [n for n in mesh.parts if n.startswith("pedestrian")]
        assert bool(walker) == (style == "pedestrian")
        if walker:
            go = mesh.triangle_part == mesh.parts.index("pedestrian_go")
            assert any(max(mesh.materials[i].emissive) > 0.5 for i in set(mesh.triangle_material[go])) == (lit == "red")
        looks.add(repr(mesh.materials))
    assert len(looks) == 3


def test_a_traffic_lights_heads_are_where_they_were_asked_for() -> None:
    arm = traffic_light(TrafficLight(style="cantilever", height=6.0, arm=4.0, heads=2, sides=1))
    reach = [part_vertices(arm, f"lamp_red{n}")[:, 0].mean() for n in ("_3", "_2")]
    assert max(part_vertices(arm, "housing")[:, 0]) == pytest.approx(3.84, abs=0.3)
    assert {"lamp_red", "lamp_red_2", "lamp_red_3"} <= set(arm.parts) and abs(reach[0]) < 0.1 and reach[1] > 2
    around = traffic_light(TrafficLight(sides=4))
    places = [part_vertices(around, f"lamp_green{n}")[:, :2].mean(axis=0) for n in ("_4", "_3", "_2")]
    np.testing.assert_allclose(sorted(p[0] for p in places), np.array((-1, 0, 1)) * np.abs(places).max(), atol=1e-3)


def test_a_cone_narrows_and_its_bands_lie_on_it() -> None:
    p = TrafficCone(height=0.75, stack=1)
    mesh = traffic_cone(p)
    cone, band = part_vertices(mesh, "cone"), part_vertices(mesh, "band")
    assert cone[:, 2].max() == pytest.approx(p.height)
    low, high = cone[cone[:, 2] < 0.15], cone[cone[:, 2] > 0.7]
    assert np.hypot(*low[:, :2].T).max() > 2.5 * np.hypot(*high[:, :2].T).max()
    assert band[:, 2].min() == pytest.approx(0.35 * p.height) and band[:, 2].max() == pytest.approx(0.8 * p.height)
    assert np.ptp(part_vertices(mesh, "foot"), axis=0)[0] == pytest.approx(p.base, abs=0.01)
    assert "band" not in traffic_cone(replace(p, bands=())).parts and "light" in traffic_cone(replace(p, light=True)).parts
    assert traffic_cone(replace(p, stack=3)).bounds[1][2] > p.height + 0.2


@pytest.mark.parametrize("style", ["steel", "iron", "concrete", "guard"])
@pytest.mark.parametrize("top", ["flat", "dome", "ball", "crown"])
def test_a_bollard_has_its_height_and_stands_upright(style: str, top: str) -> None:
    mesh = bollard(Bollard(style=style, top=top, height=0.95, radius=0.08))
    assert mesh.bounds[1][2] == pytest.approx(0.95)
    np.testing.assert_allclose((mesh.bounds.sum(axis=0) / 2)[:2], 0, atol=1e-6)
    assert part_vertices(mesh, "band")[:, 2].mean() == pytest.approx(0.78 * 0.95)
    assert outward_share(mesh) > 0.995


@pytest.mark.parametrize("style", ["school", "hiking", "roll_top", "flap"])
def test_a_backpack_has_pockets_in_front_and_straps_behind(style: str) -> None:
    p = Backpack(style=style, bottle=True)
    mesh = backpack(p)
    body = part_vertices(mesh, "body")
    assert np.ptp(body[:, 2]) == pytest.approx(p.height, abs=0.01) and np.ptp(body[:, 0]) == pytest.approx(p.width, rel=0.06)
    assert part_vertices(mesh, "pocket")[:, 1].max() < 0 < part_vertices(mesh, "strap_left")[:, 1].min()
    assert part_vertices(mesh, "strap_left")[:, 0].min() > 0 > part_vertices(mesh, "strap_right")[:, 0].max()
    assert part_vertices(mesh, "handle")[:, 2].max() > 0.95 * p.height
    own = {"hiking": {"belt", "lid"}, "roll_top": {"lid", "buckle"}, "flap": {"lid", "buckle"}}.get(style, {"zip"})
    assert own | {"bottle", "side_pocket"} <= set(mesh.parts)
    assert not {"bottle", "side_pocket"} & set(backpack(replace(p, side_pockets=False)).parts)
    assert ("mat" in backpack(replace(p, mat=True)).parts) == (style == "hiking")


@pytest.mark.parametrize("roof", ["flat", "pitched", "mansard"])
def test_a_shop_fits_between_its_neighbours(roof: str) -> None:
    p = Shop(roof=roof, width=6.5, depth=9.5, storeys=4, dormers=True, chimneys=(1, -1), hanging_sign="round", balconies=0.5)
    mesh = shop(p)
    np.testing.assert_allclose(mesh.bounds[:, 0], (-p.width / 2, p.width / 2), atol=0.005)
    wall = part_vertices(mesh, "wall")
    np.testing.assert_allclose(wall.max(axis=0), (p.width / 2, p.depth / 2, p.height), atol=1e-4)
    np.testing.assert_allclose(wall.min(axis=0), (-p.width / 2, -p.depth / 2, 0), atol=1e-4)
    sides = part_vertices(mesh, "party_wall")
    np.testing.assert_allclose(np.ptp(sides, axis=0)[0], p.width, atol=1e-4)
    front = -p.depth / 2 + 0.2
    for part in ("sign", "shop_window", "shop_door", "pilaster", "awning"):
        corners = (
            part_vertices(mesh, part) if part != "sign" else part_vertices(mesh, "sign")[part_vertices(mesh, "sign")[:, 1] < 0]
        )
        assert corners[:, 1].max() < front and corners[:, 2].max() < p.ground + 0.1, part
    assert part_vertices(mesh, "balcony")[:, 2].min() > p.ground - 0.2
    assert {"chimney", "hanging_sign", "cornice", "goods", "door"} <= set(mesh.parts)
    assert ("dormer" in mesh.parts) == (roof != "flat")


@pytest.mark.slow
def test_a_shop_has_what_was_asked_for_and_bears_its_name() -> None:
    plain = Shop(awning=0.0, balconies=0.0, side_door=0, chimneys=(), painted=False, surrounds=False, courses=False)
    bare = shop(plain)
    assert not {"awning", "balcony", "chimney", "painted_sign", "surround", "course", "hanging_sign"} & set(bare.parts)
    assert part_vertices(bare, "door_frame")[:, 1].min() > 0  # the yard's alone
    a, b = (part_vertices(shop(replace(plain, name=name)), "sign") for name in ("CAFE", "PHARMACY"))
    assert len(a) < len(b)
    tall = shop(replace(plain, storeys=5))
    assert len(part_vertices(tall, "window_frame")) > 1.5 * len(part_vertices(bare, "window_frame"))


@pytest.mark.parametrize("style", ["tiers", "jets", "column"])
@pytest.mark.parametrize("sides", [0, 6])
def test_a_fountains_water_stays_in_its_basin(style: str, sides: int) -> None:
    p = Fountain(style=style, sides=sides, steps=2)
    mesh = fountain(p)
    basin, jet = part_vertices(mesh, "basin"), part_vertices(mesh, "jet")
    assert np.abs(basin[:, 1]).max() == pytest.approx(p.radius + 0.05, abs=0.01)
    assert basin[:, 2].max() == pytest.approx(0.28 + p.wall)
    assert np.hypot(*jet[:, :2].T).max() < p.radius - p.rim and jet[:, 2].max() > basin[:, 2].max() + 0.3
    assert jet[:, 2].min() > 0.28 + p.wall - 0.3
    assert ("bowl" in mesh.parts) == (style != "jets") and ("spout" in mesh.parts) == (style != "tiers")
    assert "step" not in fountain(replace(p, steps=0)).parts


def test_lettering_covers_each_cell_of_its_letters_once() -> None:
    solid = lettering("R8", 0.7, 0.02)
    low, high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    np.testing.assert_allclose((high - low)[[0, 2]], (1.1, 0.7), atol=1e-9)
    np.testing.assert_allclose((high + low)[[0, 2]] / 2, 0, atol=1e-9)
    corners = solid.vertices[solid.triangles]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 1]
    assert -area[area < 0].sum() / 2 == pytest.approx((18 + 17) * 0.01)
    assert lettering("LONG NAME", 0.7, 0.02, 2.0).vertices[:, 0].max() == pytest.approx(1.0)


def test_all_families_of_traffic_are_registered() -> None:
    assert set(SIZES) <= set(zoo.family_names())
