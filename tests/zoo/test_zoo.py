"""The zoo: registry, real size, parts, materials, sound triangles, determinism and variety of both families."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

import viewsphere_zoo as zoo
from quick import quick
from viewsphere.errors import UserError
from viewsphere_zoo.families.car import SIZES, Car, car, draw
from viewsphere_zoo.families.hair_drier import HairDrier, hair_drier
from zoo_mesh import assert_sound, drawn, outward_share, part_vertices

BODIES = ("sedan", "hatchback", "van", "pickup")
DRIERS = tuple(
    HairDrier(style=s, nozzle=n, folding=f)
    for s, n, f in (
        ("pistol", "concentrator", True),
        ("pistol", "diffuser", False),
        ("pistol", "plain", False),
        ("ring", "concentrator", False),
    )
)


def test_families_are_listed_without_importing_them() -> None:
    code = (
        "import sys; import viewsphere_zoo as zoo; assert {'car', 'hair_drier'} <= set(zoo.family_names()), zoo.family_names();"
        "assert not {'viewsphere_zoo.families.car', 'viewsphere_zoo.families.hair_drier'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_an_unknown_family_names_the_nearest() -> None:
    with pytest.raises(UserError, match=r"family: 'cars' is unknown; did you mean 'car'\? Valid: .*car, .*"):
        zoo.build("cars", np.random.default_rng(0))


@pytest.mark.parametrize("body", quick(BODIES, "pickup"))
def test_a_car_has_the_size_that_was_asked_for(body: str) -> None:
    for factor in (1.0, 1.06):
        length, width, height = (factor * x for x in SIZES[body])
        mesh = car(Car(body=body, length=length, width=width, height=height))
        shell = part_vertices(mesh, "body", "roof", "bumper", "sill", "cargo_bed")
        x, y, _ = np.ptp(shell, axis=0)
        assert abs(x / width - 1) < 0.02 and abs(y / length - 1) < 0.02
        assert abs(part_vertices(mesh, "roof")[:, 2].max() / height - 1) < 0.02
        size = zoo.real_size(mesh)
        assert abs(size[2] / length - 1) < 0.02 and width < size[0] < width + 0.55
        assert abs(float(mesh.vertices[:, 2].min())) < 1e-6
        np.testing.assert_allclose(mesh.bounds.sum(axis=0)[:2] / 2, 0, atol=0.02)


@pytest.mark.parametrize("body", quick(BODIES, "sedan", "van"))
def test_a_car_faces_minus_y_and_has_its_parts(body: str) -> None:
    mesh = car(Car(body=body))
    low, high = mesh.bounds
    assert part_vertices(mesh, "headlight")[:, 1].max() < low[1] + 0.22 * (high - low)[1]
    assert part_vertices(mesh, "taillight")[:, 1].min() > high[1] - 0.22 * (high - low)[1]
    assert part_vertices(mesh, "headlight_left")[:, 0].min() > 0 > part_vertices(mesh, "headlight_right")[:, 0].max()
    for end in ("front", "rear"):
        for side in ("left", "right"):
            tyre = part_vertices(mesh, f"wheel_{end}_{side}_tyre")
            rim = part_vertices(mesh, f"wheel_{end}_{side}_rim")
            assert tyre[:, 2].min() == pytest.approx(0, abs=1e-5)
            assert (tyre[:, 0].mean() > 0) == (side == "left") and (tyre[:, 1].mean() < 0) == (end == "front")
            assert tyre[:, 2].min() < rim[:, 2].min() and rim[:, 2].max() < tyre[:, 2].max()
    common = "body roof bumper_front bumper_rear windshield window_front_left window_front_right mirror_left mirror_right"
    common += " door_handle_front_left grille licence_plate badge seam wiper sill underbody"
    for name in common.split():
        part_vertices(mesh, name)
    assert ("cargo_bed" in mesh.parts) == (body == "pickup")
    glass = mesh.materials[int(mesh.triangle_material[mesh.triangle_part == mesh.parts.index("windshield")][0])]
    assert glass.name == "glass" and glass.alpha_mode == "OPAQUE"
    paint = next(m for m in mesh.materials if m.name == "paint")
    assert paint.clearcoat == 1.0


@pytest.mark.parametrize("body", quick(BODIES, "hatchback"))
def test_a_car_is_sound_and_symmetric(body: str) -> None:
    mesh = car(Car(body=body, roof_rack=True, rack_bars=True, rear_spoiler=True, exhausts=2))
    assert_sound(mesh, 44_500)
    assert outward_share(mesh) > 0.997
    walls = part_vertices(mesh, "body", "roof", "window", "bumper", "cargo_bed")
    right = {tuple(v) for v in np.round(walls * (-1, 1, 1) * 5000).astype(int)}
    left = {tuple(v) for v in np.round(walls * 5000).astype(int)}
    assert len(left & right) > 0.97 * len(left)


@pytest.mark.slow
def test_a_part_left_out_is_not_there() -> None:
    bare = car(Car(body="van", windows=1, rear_window=False, shark_fin=False, exhausts=0))
    absent = ("aerial", "exhaust", "roof_rack", "spoiler", "window_rear_left", "window_tailgate")
    assert not set(absent) & set(bare.parts)
    full = car(Car(body="van", windows=3, rear_window=True, roof_rack=True, rear_spoiler=True))
    assert {"window_rear_left", "window_quarter_right", "window_tailgate", "roof_rack", "spoiler"} <= set(full.parts)


@pytest.mark.parametrize("parameters", DRIERS, ids=lambda p: f"{p.style}-{p.nozzle}")
def test_a_drier_has_its_size_parts_and_sound_triangles(parameters: HairDrier) -> None:
    for factor in (1.0, 1.1):
        p = replace(parameters, length=parameters.length * factor, height=parameters.height * factor)
        mesh = hair_drier(p)
        barrel = part_vertices(mesh, "body", "nozzle", "outlet")
        assert np.ptp(barrel[:, 1]) == pytest.approx(p.length, rel=0.02)
        reach = part_vertices(mesh, "body")[:, 2].max() - part_vertices(mesh, "handle")[:, 2].min()
        assert reach == pytest.approx(p.height, rel=0.02)
        assert float(mesh.vertices[:, 2].min()) == pytest.approx(0, abs=1e-6)
    for name in ("body", "handle", "nozzle", "grille", "outlet", "switch", "cable", "strain_relief"):
        part_vertices(mesh, name)
    assert ("hinge" in mesh.parts) == p.folding
    assert part_vertices(mesh, "nozzle")[:, 1].min() == pytest.approx(part_vertices(mesh, "body", "nozzle")[:, 1].min())
    assert part_vertices(mesh, "handle")[:, 2].mean() < part_vertices(mesh, "body")[:, 2].min() + 0.02
    assert_sound(mesh, 17_000)
    assert outward_share(mesh) > 0.997


@pytest.mark.parametrize("family", [pytest.param("car", marks=pytest.mark.slow), "hair_drier"])
def test_one_seed_gives_one_mesh(family: str) -> None:
    a, b, other = drawn(family, 4), zoo.build(family, np.random.default_rng(4)), drawn(family, 3)
    for name in ("vertices", "triangles", "normals", "triangle_material", "triangle_part"):
        assert getattr(a, name).tobytes() == getattr(b, name).tobytes()
    assert a.materials == b.materials and a.parts == b.parts
    assert a.vertices.tobytes() != other.vertices.tobytes()


@pytest.mark.parametrize("count", [8, pytest.param(16, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("family", "ranges", "most"),
    [
        pytest.param("car", ((1.75, 2.6), (1.38, 2.4), (3.6, 5.75)), 44_500, marks=pytest.mark.slow),
        ("hair_drier", ((0.07, 0.16), (0.2, 0.4), (0.1, 0.32)), 17_000),
    ],
)
def test_draws_differ_in_shape_and_colour(family: str, ranges: tuple, most: int, count: int) -> None:
    meshes = [drawn(family, seed) for seed in range(count)]
    for mesh in meshes:
        assert_sound(mesh, most)
    sizes = np.array([zoo.real_size(m) for m in meshes])
    for k, (low, high) in enumerate(ranges):
        assert low < sizes[:, k].min() and sizes[:, k].max() < high
    assert (np.ptp(sizes, axis=0) > 0.1 * sizes.mean(axis=0)).all()
    name = {"car": "paint", "hair_drier": "shell"}[family]
    colors = np.array([next(m for m in mesh.materials if m.name == name).base_color[:3] for mesh in meshes])
    looks = np.concatenate([colors ** (1 / 2.2), sizes / sizes.std(axis=0) / 10], axis=1)
    distance = np.linalg.norm(looks[:, None] - looks[None], axis=2) + np.eye(count) * 9
    assert distance.min() > 0.02
    assert np.median(np.linalg.norm(colors[:, None] - colors[None], axis=2)) > 0.2


def test_a_hundred_cars_cover_what_is_on_the_roads() -> None:
    cars = [draw(np.random.default_rng(seed)) for seed in range(100)]
    shares = {body: sum(c.body == body for c in cars) for body in BODIES}
    assert all(10 <= n <= 50 for n in shares.values()), shares
    assert len({(c.wheel.spokes, c.wheel.paired, c.wheel.twist) for c in cars}) >= 7
    assert len({(c.lamps, c.grille) for c in cars}) >= 12
    assert 3 <= sum(c.roof_color is not None for c in cars) <= 40
    assert 5 <= sum(c.roof_rack for c in cars) <= 50
    assert len({c.color for c in cars}) > 95
