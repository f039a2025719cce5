"""Boats: size, parts, sound triangles, rigging, determinism and variety of the three kinds."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import viewsphere_zoo as zoo
from quick import quick
from viewsphere_zoo.families.boat import Boat, MotorBoat, RowingBoat, SailingBoat, boat, draw
from viewsphere_zoo.shapes.cut import cut
from viewsphere_zoo.shapes.sheets import bar, moulding, sheet
from viewsphere_zoo.shapes.solids import Solid, rounded_box
from zoo_mesh import assert_sound, drawn, faces, outward_share, part_vertices, seeds

BOATS: tuple[Boat, ...] = (
    RowingBoat(),
    RowingBoat(stern="pointed", planks=0, thwarts=3, oars=2, sweep=None, length=4.6),
    MotorBoat(bow_seats=True),
    MotorBoat(cuddy=True, top=True, drive="stern_drive"),
    MotorBoat(style="console", top=True, engines=2, length=7.0, fenders=True),
    MotorBoat(style="cruiser", length=7.8, beam=2.7, freeboard=0.92, flag=((0.7, 0.1, 0.1), (0.9, 0.9, 0.9), (0.1, 0.1, 0.5))),
    SailingBoat(),
    SailingBoat(rig="fractional", keel="bulb", cabin=0.0, length=5.6, beam=2.0, mast=6.0, draft=0.8, rails=False),
    SailingBoat(rig="gaff", keel="long", tuck=0.5, wooden=True, lee=-1.0, length=7.0, mast=7.2, draft=1.05, beam=2.3),
)
NAMES = ("dinghy", "skiff", "bowrider", "cuddy", "console", "cruiser", "sloop", "day_sailer", "gaff")
ENLARGED = tuple(replace(p, length=p.length * 1.05, beam=p.beam * 1.05) for p in BOATS)
built = cache(boat)
EACH = pytest.mark.parametrize("parameters", quick(ENLARGED, *(ENLARGED[i] for i in (1, 3, 5))), ids=NAMES)


@EACH
def test_a_boat_has_its_size_and_stands_on_the_ground(parameters: Boat) -> None:
    p, mesh = parameters, built(parameters)
    shell = part_vertices(mesh, "hull", "antifouling", "boot_stripe", "sheer_stripe", "gunwale", "toe_rail", "rubbing")
    assert np.ptp(shell[:, 1]) == pytest.approx(p.length, rel=0.035)
    assert np.ptp(shell[:, 0]) == pytest.approx(p.beam, rel=0.06)
    assert float(mesh.vertices[:, 2].min()) == pytest.approx(0, abs=1e-6)
    np.testing.assert_allclose(mesh.bounds.sum(axis=0)[:2] / 2, 0, atol=1e-4)


@EACH
def test_a_boat_is_sound(parameters: Boat) -> None:
    mesh = built(parameters)
    assert_sound(mesh, 60_000)
    assert outward_share(mesh) > 0.995


@EACH
def test_the_bow_is_at_minus_y_and_colours_change_at_the_waterline(parameters: Boat) -> None:
    mesh = built(parameters)
    hull = part_vertices(mesh, "hull")
    low, high = hull[:, 1].min(), hull[:, 1].max()
    fore, aft = hull[hull[:, 1] < low + 0.1 * (high - low)], hull[hull[:, 1] > high - 0.1 * (high - low)]
    assert np.ptp(fore[:, 0]) < 0.75 * np.ptp(hull[:, 0])
    if not (isinstance(parameters, RowingBoat) and parameters.stern == "pointed"):
        assert np.ptp(aft[:, 0]) > 1.15 * np.ptp(fore[:, 0])
    assert fore[:, 2].max() > hull[np.abs(hull[:, 1] - hull[:, 1].mean()) < 0.3][:, 2].max()
    boot, bottom = part_vertices(mesh, "boot_stripe"), part_vertices(mesh, "antifouling")
    assert bottom[:, 2].max() == pytest.approx(boot[:, 2].min(), abs=2e-4)
    assert hull[:, 2].min() == pytest.approx(boot[:, 2].max(), abs=2e-4)


def test_left_and_right_are_the_boats_own() -> None:
    mesh = built(MotorBoat())
    assert part_vertices(mesh, "cleat_left")[:, 0].min() > 0 > part_vertices(mesh, "cleat_right")[:, 0].max()
    assert part_vertices(mesh, "side_light_left")[:, 0].mean() > 0 > part_vertices(mesh, "side_light_right")[:, 0].mean()
    red = mesh.materials[int(mesh.triangle_material[mesh.triangle_part == mesh.parts.index("side_light_left")][0])]
    assert red.name == "red_lamp"


def test_a_rowing_boat_is_open_and_has_thickness() -> None:
    mesh = built(RowingBoat())
    outside, inside = part_vertices(mesh, "hull", "antifouling", "boot_stripe"), part_vertices(mesh, "inside")
    middle = np.abs(outside[:, 1]) < 0.15, np.abs(inside[:, 1]) < 0.15
    gap = np.abs(outside[middle[0]][:, 0]).max() - np.abs(inside[middle[1]][:, 0]).max()
    assert 0.01 < gap < 0.05
    assert inside[:, 2].min() > outside[:, 2].min() + 0.008
    fitted = "ribs floorboards thwart gunwale transom riser breasthook rowlock_left oar_blade_right"
    for name in fitted.split():
        part_vertices(mesh, name)
    assert "transom" not in built(RowingBoat(stern="pointed")).parts
    spread, laid = (part_vertices(built(RowingBoat(sweep=s)), "oar_") for s in (38.0, None))
    assert np.abs(spread[:, 0]).max() > 1.5
    assert np.abs(laid[:, 0]).max() < 0.6


@pytest.mark.slow
def test_clinker_planks_throw_steps() -> None:
    smooth, lapped = (part_vertices(built(RowingBoat(planks=n)), "hull") for n in (0, 8))
    near = [np.abs(v[:, 1]) < 0.2 for v in (smooth, lapped)]
    assert np.abs(lapped[near[1]][:, 0]).max() > np.abs(smooth[near[0]][:, 0]).max() + 0.001
    mesh = built(RowingBoat(planks=8))
    _, area = faces(mesh)
    skin = np.isin(mesh.triangle_part, [mesh.parts.index("hull")])
    down = area[skin][:, 2] / np.linalg.norm(area[skin], axis=1)
    assert (down < -0.85).sum() > 300


@pytest.mark.slow
def test_fittings_follow_the_style() -> None:
    parts = {style: set(built(MotorBoat(style=style)).parts) for style in ("runabout", "console", "cruiser")}
    common = set(
        ["hull", "deck", "sole", "cockpit", "coaming", "outboard_cowl", "propeller", "spray_rail", "rubbing_strake", "bow_rail"]
    )
    assert all(common <= found for found in parts.values())
    assert {"windscreen", "dashboard", "wheel", "seat", "bench"} <= parts["runabout"]
    assert {"console", "wheel", "bench"} <= parts["console"] and "canopy" not in parts["console"]
    assert {"wheelhouse", "windshield_left", "side_window_1_right", "cabin_window_left"} <= parts["cruiser"]
    drive = set(built(MotorBoat(drive="stern_drive", rail=False)).parts)
    assert {"stern_drive", "bathing_platform", "ladder"} <= drive and not {"outboard_cowl", "bow_rail"} & drive


@pytest.mark.slow
def test_rigging_is_thin_and_real() -> None:
    p = SailingBoat()
    mesh = built(p)
    top, keel = part_vertices(mesh, "mast")[:, 2].max(), part_vertices(mesh, "keel")[:, 2].min()
    assert keel == pytest.approx(0, abs=1e-6)
    assert top - keel == pytest.approx(p.mast + p.draft, rel=0.02)
    stay = part_vertices(mesh, "forestay")
    along = stay[stay[:, 2] < stay[:, 2].min() + 0.02]
    assert 0.004 < np.ptp(along[:, 0]) < 0.03
    assert part_vertices(mesh, "backstay")[:, 1].max() > part_vertices(mesh, "boom")[:, 1].max()
    shrouds, spreaders = part_vertices(mesh, "shrouds"), part_vertices(mesh, "spreaders")
    assert np.ptp(shrouds[:, 0]) > 0.85 * p.beam and np.ptp(spreaders[:, 0]) > 0.4 * p.beam
    assert {"gaff", "bowsprit", "bobstay"} <= set(built(BOATS[-1]).parts) and "spreaders" not in built(BOATS[-1]).parts


@pytest.mark.parametrize("lee", quick([1.0, -1.0], 1.0))
def test_sails_fill_to_leeward_and_are_closed(lee: float) -> None:
    mesh = built(SailingBoat(lee=lee))
    main, jib = part_vertices(mesh, "mainsail"), part_vertices(mesh, "jib")
    assert np.median(main[:, 0]) * lee > 0.1 and np.median(jib[:, 0]) * lee > 0.1
    assert jib[:, 1].max() < part_vertices(mesh, "mast")[:, 1].max()
    number = mesh.triangle_part == mesh.parts.index("sail_number")
    _, area = faces(mesh)
    sides = np.sign(area[number][:, 0])
    assert 0.3 < (sides > 0).mean() < 0.7


@pytest.mark.slow
def test_the_tiller_stands_on_something() -> None:
    tillers = 0
    for seed in range(14):
        mesh = drawn("boat", seed)
        if "rudder_stock" in mesh.parts:
            stock, *bases = (
                mesh.vertices[np.unique(mesh.triangles[mesh.triangle_part == mesh.parts.index(name)])]
                for name in ("rudder_stock", "cockpit", "deck")
            )
            aft, floor = bases[0][:, 1].max(), bases[0][:, 2].min()
            assert stock[:, 2].min() < (floor if stock[:, 1].mean() < aft else bases[1][:, 2].max())
            tillers += 1
    assert tillers >= 3


@pytest.mark.slow
def test_one_seed_gives_one_boat() -> None:
    a, b, other = drawn("boat", 4), zoo.build("boat", np.random.default_rng(4)), drawn("boat", 3)
    for name in ("vertices", "triangles", "normals", "triangle_material", "triangle_part"):
        assert getattr(a, name).tobytes() == getattr(b, name).tobytes()
    assert a.materials == b.materials and a.parts == b.parts
    assert a.vertices.tobytes() != other.vertices.tobytes()


def test_draws_are_sound_and_differ() -> None:
    meshes = [drawn("boat", seed) for seed in seeds(6)]
    for mesh in meshes:
        assert_sound(mesh, 60_000)
    sizes = np.array([zoo.real_size(m) for m in meshes])
    assert sizes[:, 2].min() >= 3.0 and sizes[:, 2].max() < 12 and sizes[:, 1].max() < 13
    gaps = np.linalg.norm(sizes[:, None] - sizes[None], axis=2) + np.eye(len(sizes)) * 9
    assert gaps.min() > 0.02


def test_a_hundred_draws_fill_a_harbour() -> None:
    boats = [draw(np.random.default_rng(seed)) for seed in range(100)]
    kinds = {kind: [b for b in boats if isinstance(b, kind)] for kind in (RowingBoat, MotorBoat, SailingBoat)}
    assert all(len(found) >= 20 for found in kinds.values())
    rowing, motor, sailing = kinds.values()
    for found, low, high in ((rowing, 3, 5), (motor, 4, 9), (sailing, 5, 10)):
        assert all(low <= b.length <= high for b in found)
    assert len({b.style for b in motor if isinstance(b, MotorBoat)}) == 3
    assert {b.rig for b in sailing if isinstance(b, SailingBoat)} == {"masthead", "fractional", "gaff"}
    assert len({b.sails.pattern for b in sailing if isinstance(b, SailingBoat)}) >= 4
    assert {b.stern for b in rowing if isinstance(b, RowingBoat)} == {"transom", "pointed"}
    assert len({b.color for b in boats}) > 75
    assert max((b.mast + b.draft) / b.length for b in sailing if isinstance(b, SailingBoat)) < 1.23


def test_a_cut_keeps_the_surface_and_parts_it_at_the_level() -> None:
    box = rounded_box((1.0, 2.0, 3.0), 0.2)
    low, high = cut(box, box.vertices[:, 2] - 0.4)
    assert low.vertices[:, 2].max() == pytest.approx(0.4) == high.vertices[:, 2].min()
    assert _area(low) + _area(high) == pytest.approx(_area(box), rel=1e-9)
    everything, nothing = cut(box, box.vertices[:, 2] - 9)
    assert _area(everything) == pytest.approx(_area(box)) and len(nothing.triangles) == 0


def test_sheets_and_mouldings_are_closed_and_outward() -> None:
    x, y = np.linspace(0, 2, 5), np.linspace(0, 3, 7)
    flat = sheet(np.stack([*np.meshgrid(x, y, indexing="ij"), np.zeros((5, 7))], axis=-1), 0.1)
    assert _volume(flat) == pytest.approx(0.6)
    stick = moulding([(0, 0, 0), (0, 1, 0), (0, 2, 0)], bar(0.2, 0.1, chamfer=0.0), (1.0, 0, 0))
    assert _volume(stick) == pytest.approx(0.04)


def _area(solid: Solid) -> float:
    a, b, c = solid.vertices[solid.triangles].transpose(1, 0, 2)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def _volume(solid: Solid) -> float:
    a, b, c = solid.vertices[solid.triangles].transpose(1, 0, 2)
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)
