"""Furniture: sizes, parts, sound triangles, what stands on it, determinism, variety."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import viewsphere_zoo as zoo
from quick import quick
from viewsphere_zoo.families.bed import Bed, bed
from viewsphere_zoo.families.cabinet import Cabinet, cabinet
from viewsphere_zoo.families.cabinet import surfaces as surfaces_of_cabinet
from viewsphere_zoo.families.lamp import Lamp, bulb, lamp
from viewsphere_zoo.families.refrigerator import Refrigerator, refrigerator
from viewsphere_zoo.families.rug import Rug, rug
from viewsphere_zoo.families.shelf import Shelf, shelf
from viewsphere_zoo.families.shelf import surfaces as surfaces_of_shelf
from viewsphere_zoo.families.sofa import Sofa, sofa
from viewsphere_zoo.families.sofa import surfaces as surfaces_of_sofa
from viewsphere_zoo.families.table import Table, table
from viewsphere_zoo.families.television import Television, television
from viewsphere_zoo.families.television import surfaces as surfaces_of_television
from zoo_mesh import assert_sound, drawn, outward_share, part_vertices, seeds

SIZES = {
    "bed": ((0.95, 2.7), (0.85, 2.1), (1.9, 2.6)),
    "cabinet": ((0.39, 3.2), (0.48, 2.3), (0.33, 1.3)),
    "lamp": ((0.15, 0.95), (0.4, 2.15), (0.2, 1.75)),
    "refrigerator": ((0.5, 1.6), (1.38, 2.02), (0.57, 1.6)),
    "rug": ((0.85, 3.7), (0.01, 0.07), (0.85, 2.0)),
    "shelf": ((0.54, 2.2), (0.7, 2.15), (0.27, 0.47)),
    "sofa": ((1.3, 3.2), (0.7, 0.98), (0.8, 1.76)),
    "table": ((0.4, 2.2), (0.37, 1.07), (0.33, 1.3)),
    "television": ((0.5, 1.85), (0.42, 1.85), (0.24, 0.66)),
}
"""Width, height and length that draws may have, metres."""

PARTS = {
    "bed": {"leg", "rail", "headboard", "mattress", "duvet", "pillow"},
    "cabinet": {"side", "carcass", "back", "handle"},
    "lamp": {"stem", "shade", "bulb"},
    "refrigerator": {"body", "door", "handle", "gasket", "foot", "condenser", "compressor"},
    "rug": {"pile"},
    "shelf": {"upright", "board"},
    "sofa": {"base", "seat_cushion", "back", "armrest", "leg"},
    "table": {"top"},
    "television": {"screen", "casing", "vent"},
}
"""Parts of every member."""

SOFT = ("bed", "sofa")
STANDS = tuple(name for name in SIZES if zoo.family(name).surfaces)
SEEDS = seeds(5)


def parameters(family: str, seed: int):
    return zoo.family(family).draw(np.random.default_rng(seed))


@pytest.mark.parametrize("family", SIZES)
@pytest.mark.slow
def test_draws_are_sound_of_real_size_and_differ(family: str) -> None:
    meshes = [drawn(family, seed) for seed in SEEDS]
    for mesh in meshes:
        assert_sound(mesh, 10_000, least=200)
        np.testing.assert_allclose(mesh.bounds.sum(axis=0)[:2] / 2, 0, atol=0.45)
        assert float(mesh.bounds[0, 2]) == pytest.approx(0, abs=2e-3)
        assert set(mesh.parts) >= PARTS[family]
        for value, (low, high) in zip(zoo.real_size(mesh), SIZES[family], strict=True):
            assert low - 1e-3 <= value <= high + 1e-3
        assert all(m.base_color_texture is None or m.base_color_texture.image < len(mesh.images) for m in mesh.materials)
        assert not mesh.images or (mesh.uv0 is not None and np.isfinite(mesh.uv0).all())
    shapes = {tuple(np.round(zoo.real_size(m), 2)) for m in meshes}
    looks = {tuple(round(i.pixels.mean() / 4) for i in m.images) + m.materials for m in meshes}
    assert len(shapes) == len(looks) == len(meshes)


@pytest.mark.parametrize("family", SIZES)
def test_one_seed_gives_one_mesh(family: str) -> None:
    a, b = drawn(family, 1), zoo.build(family, np.random.default_rng(1))
    for name in ("vertices", "triangles", "normals", "uv0", "colors", "triangle_part", "triangle_material"):
        x, y = getattr(a, name), getattr(b, name)
        assert (x is None and y is None) or x.tobytes() == y.tobytes()
    assert a.materials == b.materials
    assert [i.pixels.tobytes() for i in a.images] == [i.pixels.tobytes() for i in b.images]


@pytest.mark.parametrize("family", SIZES)
def test_furniture_shows_its_outside(family: str) -> None:
    for seed in seeds(3):
        assert outward_share(drawn(family, seed)) > 0.995


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("family", STANDS)
def test_what_falls_from_above_lands_on_a_surface(family: str, seed: int) -> None:
    """Rays straight down, from below whatever is above a surface, meet the mesh at its height, all over its rectangle."""
    pytest.importorskip("embreex")
    from trimesh import Trimesh
    from trimesh.ray.ray_pyembree import RayMeshIntersector

    mesh = drawn(family, seed)
    caster = RayMeshIntersector(Trimesh(mesh.vertices, mesh.triangles, process=False))
    found = zoo.family(family).surfaces(parameters(family, seed))
    assert (found or family in ("shelf", "television")) and len({s.name for s in found}) == len(found)
    for surface in found:
        x0, y0, x1, y1 = surface.rectangle
        assert x1 - x0 > 0.05 and y1 - y0 > 0.05 and surface.clearance > 0.05
        x, y = np.meshgrid(np.linspace(x0, x1, 9), np.linspace(y0, y1, 9))
        lift = min(surface.clearance, 3.0) - 0.004
        origins = np.stack([x.ravel(), y.ravel(), np.full(x.size, surface.height + lift)], axis=1)
        first = caster.intersects_first(origins, np.tile((0.0, 0.0, -1.0), (x.size, 1)))
        assert (first >= 0).all(), surface
        corners = mesh.vertices[mesh.triangles[first]].astype(np.float64)
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        z = corners[:, 0, 2] - ((origins - corners[:, 0])[:, :2] * normal[:, :2]).sum(axis=1) / normal[:, 2]
        np.testing.assert_allclose(z, surface.height, atol=0.03 if family in SOFT else 1e-3, err_msg=str(surface))


def test_a_table_has_what_was_asked_for() -> None:
    plain = table(Table(width=1.4, depth=0.8, height=0.74))
    np.testing.assert_allclose(zoo.real_size(plain), (1.4, 0.74, 0.8), atol=1e-5)
    assert {"leg", "apron"} <= set(plain.parts) and "drawer" not in plain.parts
    desk = Table(style="desk", drawers=2, riser=0.2, depth=0.7)
    assert {"drawer", "handle", "case", "riser", "panel"} <= set(table(desk).parts)
    assert part_vertices(table(desk), "drawer")[:, 1].max() < 0
    round_ = table(replace(Table(), top="round", frame="pedestal", width=1.1, depth=1.1))
    assert {"column", "foot"} <= set(round_.parts)


@pytest.mark.slow
def test_a_sofa_has_what_was_asked_for() -> None:
    plain = sofa(Sofa(scattered=0))
    assert not {"pillow", "throw", "chaise", "button"} & set(plain.parts)
    assert part_vertices(plain, "back")[:, 1].min() > 0.05 > part_vertices(plain, "seat_cushion")[:, 1].mean()
    assert np.ptp(part_vertices(plain, "seat_cushion")[:, 0]) == pytest.approx(3 * 0.64, abs=0.02)
    rich = Sofa(scattered=3, throw=True, chaise="left", back="tufted")
    assert {"pillow", "throw", "chaise", "button"} <= set(sofa(rich).parts)
    assert [s.name for s in surfaces_of_sofa(rich)] == ["seat_1", "seat_2", "seat_3", "chaise"]
    assert (
        part_vertices(sofa(rich), "chaise")[:, 0].min()
        > 0
        > part_vertices(sofa(replace(rich, chaise="right")), "chaise")[:, 0].max()
    )


@pytest.mark.parametrize("head", quick(["panel", "slats", "arched", "upholstered", "channels", "bars"], "arched", "channels"))
def test_a_bed_has_what_was_asked_for(head: str) -> None:
    mesh = bed(Bed(head=head, head_height=1.1, width=1.4, length=2.0, throw=True, cushions=2, foot="matching"))
    assert {"throw", "cushion", "footboard", "duvet_fold"} <= set(mesh.parts)
    np.testing.assert_allclose(np.ptp(part_vertices(mesh, "mattress"), axis=0)[:2], (1.4, 1.98), atol=1e-4)
    headboard, footboard = part_vertices(mesh, "headboard"), part_vertices(mesh, "footboard")
    assert headboard[:, 2].max() == pytest.approx(1.1, abs=0.03) and headboard[:, 1].min() > 0.95
    assert footboard[:, 2].max() < headboard[:, 2].max() and footboard[:, 1].max() < -0.95
    bare = bed(Bed(head=head, foot="none", folded=0, pillows=1))
    assert not {"throw", "cushion", "footboard", "duvet_fold", "post"} & set(bare.parts)


@pytest.mark.parametrize("style", quick(["bookcase", "cubes", "ladder", "rack"], "bookcase", "ladder"))
def test_a_shelf_has_its_boards_and_tells_which_are_free(style: str) -> None:
    columns = 1 if style in ("ladder", "rack") else 2
    empty = Shelf(style=style, filled=0.0, depth=0.44, boards=5, columns=columns)
    assert not {"book", "box", "vase"} & set(shelf(empty).parts)
    heights = sorted({round(s.height, 6) for s in surfaces_of_shelf(empty)})
    np.testing.assert_allclose(heights, empty.tops, atol=1e-6)
    full = replace(empty, filled=1.0)
    assert {s.name for s in surfaces_of_shelf(full)} <= {"top"}
    assert {"book", "box", "vase"} & set(shelf(full).parts)
    assert zoo.real_size(shelf(empty))[:2] == pytest.approx((0.9, 1.9), abs=0.01)


@pytest.mark.parametrize("style", ["column", "tripod", "arc", "reading", "table", "desk", "globe"])
def test_a_lamp_tells_where_its_bulb_is_and_shines(style: str) -> None:
    p = (
        Lamp(style=style, height=0.55, reach=0.2, shade_radius=0.15)
        if style in ("table", "desk", "globe")
        else Lamp(style=style)
    )
    mesh = lamp(p)
    found = part_vertices(mesh, "bulb")
    np.testing.assert_allclose((found.min(axis=0) + found.max(axis=0)) / 2, bulb(p), atol=1e-5)
    shade = part_vertices(mesh, "shade")
    assert (shade.min(axis=0) - 0.02 < bulb(p)).all() and (shade.max(axis=0) + 0.02 > bulb(p)).all()
    assert {"bulb"} <= {m.name for m in mesh.materials if max(m.emissive) > 0}
    assert part_vertices(mesh, "base", "leg")[:, 2].min() == pytest.approx(0, abs=1e-3)


def test_a_cabinet_has_what_was_asked_for() -> None:
    p = Cabinet(columns=((("pair", 1.0)[::-1],), ((0.5, "open"), (0.5, "drawer"))), width=1.2, height=0.8)
    shut = cabinet(p)
    assert {"door", "drawer", "handle", "top", "leg"} <= set(shut.parts)
    assert part_vertices(shut, "door")[:, 0].max() < 0 < part_vertices(shut, "drawer")[:, 0].min()
    assert {s.name for s in surfaces_of_cabinet(p)} == {"top", "bay_1"}
    width, height, _ = zoo.real_size(shut)
    assert (width, height) == pytest.approx((1.2, 0.8), abs=1e-3)
    ajar, pulled = cabinet(replace(p, ajar=90)), cabinet(replace(p, pulled=0.15))
    front = part_vertices(shut, "door")[:, 1].min()
    assert part_vertices(ajar, "door")[:, 1].min() == pytest.approx(front - 0.28, abs=0.03)
    assert part_vertices(pulled, "drawer")[:, 1].min() == pytest.approx(front - 0.15, abs=1e-3)


@pytest.mark.parametrize("gas", [False, True])
def test_a_kitchen_has_a_hole_for_its_basin_and_leaves_sink_and_hob_free(gas: bool) -> None:
    unit = ((1.0, "pair"),)
    p = Cabinet("kitchen", 1.84, 0.6, 0.9, (unit,) * 3, top=0.038, base="plinth", basin=0, cooker=2, gas=gas, stone="marble")
    mesh = cabinet(p)
    assert {"worktop", "sink", "tap", "hob", "burner", "knob"} <= set(mesh.parts)
    basin, hob = part_vertices(mesh, "sink"), part_vertices(mesh, "hob")
    assert basin[:, 2].min() < 0.9 - 0.15 and part_vertices(mesh, "tap")[:, 2].max() > 1.15
    (free,) = surfaces_of_cabinet(p)
    assert basin[:, 0].max() < free.rectangle[0] < free.rectangle[2] < hob[:, 0].min()


@pytest.mark.parametrize("style", ["bottom_freezer", "top_freezer", "side_by_side", "french", "retro"])
def test_a_refrigerator_has_its_doors_and_opens(style: str) -> None:
    wide = style in ("side_by_side", "french")
    p = Refrigerator(style=style, width=0.9 if wide else 0.6, dispenser=wide, notes=2)
    shut = refrigerator(p)
    assert zoo.real_size(shut)[:2] == pytest.approx((p.width, 1.85), abs=0.01)
    doors = part_vertices(shut, "door")
    assert doors[:, 1].min() == pytest.approx(-0.31, abs=1e-3) and np.ptp(doors[:, 0]) == pytest.approx(p.width, abs=1e-3)
    assert ("dispenser" in shut.parts) == wide and {"note", "magnet"} <= set(shut.parts) and "food" not in shut.parts
    ajar = refrigerator(replace(p, ajar=90))
    assert {"glass_shelf", "crisper", "door_bin"} <= set(ajar.parts)
    assert part_vertices(ajar, "door")[:, 1].min() < -0.31 - 0.35


@pytest.mark.parametrize("style", quick(["feet", "foot", "easel", "console", "tube"], "easel", "tube"))
def test_a_television_shows_its_picture_within_its_screen(style: str) -> None:
    p = Television(style=style, width=0.6 if style == "tube" else 1.1, bezel=0.04 if style == "tube" else 0.01, lift=0.1)
    mesh = television(p)
    (lit,) = {k for k, m in enumerate(mesh.materials) if m.emissive_texture}
    own = mesh.triangles[mesh.triangle_material == lit]
    texture = mesh.materials[lit].emissive_texture
    front = np.unique(own[mesh.normals[own][..., 1].max(axis=1) < -0.95])
    u, v = (np.column_stack([mesh.uv0[front], np.ones(len(front))]) @ texture.matrix.T).T
    assert u.min() == pytest.approx(0, abs=0.02) and u.max() == pytest.approx(1, abs=0.02)
    assert v.min() == pytest.approx(0, abs=0.02) and v.max() == pytest.approx(1, abs=0.02)
    order = np.corrcoef(u, mesh.vertices[front, 0])[0, 1], np.corrcoef(v, mesh.vertices[front, 2])[0, 1]
    assert order == pytest.approx((1, -1), abs=1e-3)
    dark = television(replace(p, show=None))
    assert not any(m.emissive_texture or max(m.emissive) for m in dark.materials)
    assert len(surfaces_of_television(p)) == (2 if style == "console" else 0)


@pytest.mark.parametrize("outline", ["rectangle", "round", "oval"])
def test_a_rug_lies_flat_and_shows_its_whole_picture(outline: str) -> None:
    mesh = rug(Rug(outline=outline, width=2.0, depth=1.4, waves=0.01, fringe=0.08))
    assert ("fringe" in mesh.parts) == (outline == "rectangle")
    pile = part_vertices(mesh, "pile")
    np.testing.assert_allclose(np.ptp(pile, axis=0)[:2], (2.0, 1.4), atol=1e-3)
    assert pile[:, 2].min() == 0 and 0.012 <= pile[:, 2].max() < 0.024
    texture = next(m for m in mesh.materials if m.name == "wool").base_color_texture
    used = np.unique(mesh.triangles[mesh.triangle_part == mesh.parts.index("pile")])
    uv = np.column_stack([mesh.uv0[used], np.ones(len(used))]) @ texture.matrix.T
    np.testing.assert_allclose([uv.min(axis=0), uv.max(axis=0)], [(0, 0), (1, 1)], atol=1e-3)
    flat = rug(Rug(outline=outline, waves=0.0))
    assert part_vertices(flat, "pile")[:, 2].max() == pytest.approx(0.012, abs=1e-6)
