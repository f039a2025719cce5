"""What fills streets and towns: sizes, parts, sound triangles, determinism, variety of the families for traffic."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from viewsphere import plugins, zoo
from viewsphere.zoo.bus import Bus, bus
from viewsphere.zoo.townscape.lettering import lettering
from viewsphere.zoo.truck import Truck, truck
from zoo_mesh import assert_sound, drawn, outward_share, part_vertices

SIZES = {
    "bus": ((2.4, 3.1), (2.9, 4.8), (9.1, 13.0)),
    "truck": ((2.1, 2.8), (1.9, 4.1), (5.5, 10.3)),
}
"""Width, height and length that draws may have, metres."""

MOST = {"bus": 40_000, "truck": 40_000}
STYLES = {
    "bus": {"style": 3, "livery": 4, "roof_unit": 4, "door_side": 2, "flush": 2, "split": 2},
    "truck": {"load": 5, "axles": 2, "livery": 4, "visor": 2, "high_roof": 2},
}
"""Choices of a family, and how many values each has among draws."""


@pytest.mark.parametrize("family", SIZES)
def test_draws_are_sound_of_real_size_and_differ(family: str) -> None:
    meshes = [drawn(family, seed) for seed in range(4)]
    for mesh in meshes:
        assert_sound(mesh, MOST.get(family, 8_000), least=150)
        low, high = mesh.bounds
        assert low[2] == pytest.approx(0, abs=1e-5)
        assert abs((low + high)[:2]).max() / 2 < 0.05 * (high - low)[:2].max()
        for value, (least, most) in zip(zoo.real_size(mesh), SIZES[family], strict=True):
            assert least - 1e-3 <= value <= most + 1e-3
    assert len({m.vertices.tobytes() for m in meshes}) == len({repr(m.materials) for m in meshes}) == len(meshes)


@pytest.mark.parametrize("family", SIZES)
def test_one_seed_gives_one_mesh(family: str) -> None:
    a, b = drawn(family, 1), zoo.build(family, np.random.default_rng(1))
    for name in ("vertices", "triangles", "normals", "uv0", "colors", "triangle_part", "triangle_material"):
        x, y = getattr(a, name), getattr(b, name)
        assert (x is None and y is None) or x.tobytes() == y.tobytes()
    assert a.materials == b.materials
    assert [i.pixels.tobytes() for i in a.images] == [i.pixels.tobytes() for i in b.images]


@pytest.mark.parametrize("family", SIZES)
def test_a_camera_sees_outsides(family: str) -> None:
    assert outward_share(drawn(family, 2)) > 0.995


@pytest.mark.parametrize("family", SIZES)
def test_draws_cover_all_styles(family: str) -> None:
    draw = plugins.family(family).draw
    draws = [draw(np.random.default_rng(seed)) for seed in range(80)]
    for name, kinds in STYLES[family].items():
        counts = {v: sum(getattr(p, name) == v for p in draws) for v in {getattr(p, name) for p in draws}}
        assert len(counts) == kinds and min(counts.values()) >= 3, (name, counts)
    paints = {p.color for p in draws}
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


@pytest.mark.parametrize("load", ["box", "cold_box", "curtain", "dropside", "tipper"])
def test_a_lorry_carries_what_was_asked_for_behind_its_cab(load: str) -> None:
    mesh = truck(Truck(load=load, axles=3, goods="gravel" if load == "tipper" else "crates"))
    own = {"box": "cargo_door", "cold_box": "cooling_unit", "curtain": "curtain", "dropside": "headboard", "tipper": "load"}
    assert own[load] in mesh.parts and "wheel_third_left_tyre" in mesh.parts
    cab = part_vertices(mesh, "body", "roof")[:, 1].max()
    hold = part_vertices(mesh, "cargo_bed" if load in ("dropside", "tipper") else "cargo_box")
    assert hold[:, 1].min() > cab and hold[:, 2].min() > 0.7
    bare = truck(Truck(load=load, goods="none", name="", livery="plain", visor=False))
    assert not {"load", "livery", "visor", "deflector", "wheel_third_left_tyre"} & set(bare.parts)


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
    assert set(SIZES) <= set(plugins.families())
