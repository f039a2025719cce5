"""Books, boxes, laptops, monitors and plants: sizes, parts, poses, sound triangles, determinism, variety."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

import viewsphere_zoo as zoo
from quick import quick
from viewsphere_zoo.families.book import Book, book
from viewsphere_zoo.families.book import draw as draw_book
from viewsphere_zoo.families.box import Box, box
from viewsphere_zoo.families.box import draw as draw_box
from viewsphere_zoo.families.laptop import Laptop, laptop
from viewsphere_zoo.families.monitor import Monitor, monitor
from viewsphere_zoo.families.plant import POTS, Plant, plant
from viewsphere_zoo.families.plant import draw as draw_plant
from viewsphere_zoo.household.canvas import blank
from viewsphere_zoo.household.covers import ARTS
from viewsphere_zoo.household.greenery import HABITS
from viewsphere_zoo.household.lettering import length, write
from viewsphere_zoo.household.screens import SHOWS, picture
from zoo_mesh import assert_family, outward_share, part_vertices

SIZES = {
    "book": ((0.012, 0.5), (0.012, 0.31), (0.1, 0.34)),
    "box": ((0.2, 1.1), (0.1, 0.85), (0.15, 1.1)),
    "laptop": ((0.28, 0.4), (0.14, 0.3), (0.18, 0.45)),
    "monitor": ((0.35, 0.96), (0.33, 0.58), (0.18, 0.36)),
    "plant": ((0.08, 0.8), (0.07, 0.95), (0.08, 0.85)),
}
"""Width, height and length that draws may have, metres."""

MOST = {"laptop": 12_000}
LEAST = {"book": 90, "box": 40}


@pytest.mark.parametrize("family", quick(SIZES, "book", "box", "plant"))
def test_draws_are_sound_of_real_size_and_differ(family: str) -> None:
    assert_family(family, SIZES[family], MOST.get(family, 6_000), least=LEAST.get(family, 200))


CLOSED = {
    "book": (book, Book()),
    "book_open": (book, Book(pose="open")),
    "box": (box, Box()),
    "box_open": (box, Box(style="open")),
    "box_lidded": (box, Box(style="lidded")),
    "laptop": (laptop, Laptop()),
    "monitor": (monitor, Monitor()),
    "monitor_curved": (monitor, Monitor(curve=1.2, foot="fork")),
    "plant": (plant, Plant(habit="aloe")),
    "cactus": (plant, Plant(habit="cactus")),
}


@pytest.mark.parametrize("name", CLOSED)
def test_what_is_closed_shows_its_outside(name: str) -> None:
    build, parameters = CLOSED[name]
    assert outward_share(build(parameters)) > 0.99


@pytest.mark.parametrize("binding", ["boards", "paper"])
def test_a_book_lies_or_stands_and_has_its_size(binding: str) -> None:
    p = Book(binding=binding)
    lying, standing = book(p), book(replace(p, pose="standing"))
    np.testing.assert_allclose(np.ptp(lying.bounds, axis=0), (p.width, p.height, p.thickness), atol=1.1e-3)
    np.testing.assert_allclose(np.ptp(standing.bounds, axis=0), (p.thickness, p.width, p.height), atol=1.1e-3)
    assert abs(standing.bounds[0][2]) < 1e-6 and abs(lying.bounds[0][2]) < 1e-6
    assert part_vertices(lying, "spine")[:, 0].mean() < -0.4 * p.width
    assert part_vertices(standing, "spine")[:, 1].mean() < -0.4 * p.width
    for axis in range(3):
        inner, outer = (f(part_vertices(lying, "pages")[:, axis]) for f in (np.min, np.max))
        assert lying.bounds[0][axis] < inner + 1e-6 and outer < lying.bounds[1][axis] + 1e-6


def test_the_front_cover_and_the_spine_show_their_own_part_of_the_jacket() -> None:
    p = Book()
    mesh = book(p)
    index = [m.name for m in mesh.materials].index("jacket")
    own = mesh.triangles[mesh.triangle_material == index]
    xyz, uv = mesh.vertices[own].astype(np.float64), mesh.uv0[own]
    whole = 2 * p.width + p.thickness
    front = (xyz[..., 2] > p.thickness - 1e-4).all(axis=1)
    u = uv[front][..., 0] * whole
    np.testing.assert_allclose(u - (p.width + p.thickness), xyz[front][..., 0] + p.width / 2, atol=1e-4)
    np.testing.assert_allclose(1 - uv[front][..., 1], xyz[front][..., 1] / p.height + 0.5, atol=1e-5)
    back = (xyz[..., 2] < 1e-4).all(axis=1)
    np.testing.assert_allclose(uv[back][..., 0] * whole, p.width / 2 - xyz[back][..., 0], atol=1e-4)


def test_an_open_book_shows_two_pages() -> None:
    mesh = book(Book(pose="open"))
    pages, cover = part_vertices(mesh, "pages"), part_vertices(mesh, "cover")
    assert pages[:, 0].min() < -0.13 and pages[:, 0].max() > 0.13
    assert (np.abs(cover) + 1e-6 >= np.abs(pages).max(axis=0)).any(axis=0)[:2].all()
    gutter = pages[np.abs(pages[:, 0]) < 1e-6, 2].max()
    assert gutter < 0.8 * pages[:, 2].max()


def test_a_box_is_hollow_and_closes_or_opens() -> None:
    p = Box(style="taped", label="top")
    closed, opened = box(p), box(replace(p, style="open"))
    np.testing.assert_allclose(np.ptp(closed.bounds, axis=0), (p.width, p.depth, p.height), atol=2e-3)
    inside = part_vertices(opened, "inside")
    assert inside[:, 2].min() == pytest.approx(0.004) and np.ptp(inside[:, 0]) == pytest.approx(p.width, abs=0.009)
    assert {"tape", "label", "flap_front", "flap_rear"} <= set(closed.parts) and "flap_left" not in closed.parts
    assert {"flap_front", "flap_rear", "flap_left", "flap_right"} <= set(opened.parts) and "tape" not in opened.parts
    assert part_vertices(opened, "flap_front")[:, 1].min() < -p.depth / 2 - 0.02
    assert part_vertices(opened, "flap_left")[:, 0].max() > p.width / 2 + 0.02
    assert part_vertices(box(Box(style="lidded")), "lid")[:, 2].max() == pytest.approx(Box().height + 0.004)


@pytest.mark.parametrize("angle", [92.0, 110.0, 130.0])
def test_a_laptops_lid_stands_at_its_angle(angle: float) -> None:
    mesh = laptop(Laptop(angle=angle))
    screen = part_vertices(mesh, "screen")
    low, high = screen[np.argmin(screen[:, 2])], screen[np.argmax(screen[:, 2])]
    lean = np.degrees(np.arctan2(high[1] - low[1], high[2] - low[2]))
    assert 90 + lean == pytest.approx(angle, abs=0.1)
    assert part_vertices(mesh, "keys")[:, 1].mean() < low[1] and part_vertices(mesh, "touchpad")[:, 1].max() < 0
    assert part_vertices(mesh, "emblem")[:, 1].mean() > screen[:, 1].mean()
    index = mesh.parts.index("screen")
    own = mesh.triangles[mesh.triangle_part == index]
    assert mesh.normals[own].reshape(-1, 3)[:, 1].max() < 0
    u, v = mesh.uv0[own].reshape(-1, 2).T
    assert {0.0, 1.0} == set(np.round(u, 4).tolist()) == set(np.round(v, 4).tolist())


def test_keys_do_not_touch_and_stay_on_the_deck() -> None:
    for numbers in (False, True):
        p = Laptop(width=0.37, depth=0.25, numbers=numbers, wedge=0.0)
        caps = part_vertices(laptop(p), "keys")
        feet = caps[caps[:, 2] < p.thickness + 1e-6]
        assert len(feet) >= 4 * (73 if not numbers else 90)
        assert np.abs(caps[:, 0]).max() < p.width / 2 - 0.01 and np.abs(caps[:, 1]).max() < p.depth / 2 - 0.02
        assert caps[:, 2].max() == pytest.approx(p.thickness + 0.0022, abs=1e-5)


@pytest.mark.parametrize(("foot", "curve"), [*itertools.product(("disc", "plate", "fork", "hoop"), (0.0, 1.3))])
def test_a_monitor_stands_on_its_foot_and_faces_front(foot: str, curve: float) -> None:
    p = Monitor(foot=foot, curve=curve, tilt=6.0)
    mesh = monitor(p)
    stand, screen = part_vertices(mesh, "foot"), part_vertices(mesh, "screen")
    assert stand[:, 2].min() == 0.0 and part_vertices(mesh, "housing")[:, 2].min() > 0.5 * p.lift
    center = (mesh.bounds[0] + mesh.bounds[1])[:2] / 2
    assert stand[:, 1].min() < center[1] < stand[:, 1].max() + 0.05
    assert np.ptp(screen[:, 0]) == pytest.approx(p.width - 2 * p.bezel, abs=1e-3)
    own = mesh.triangles[mesh.triangle_part == mesh.parts.index("screen")]
    assert mesh.normals[own].reshape(-1, 3)[:, 1].max() < -0.9
    assert screen[:, 1].max() < part_vertices(mesh, "neck")[:, 1].min()
    glow = next(m for m in mesh.materials if m.name == "screen")
    assert glow.emissive_texture is not None and max(glow.emissive) > 0.3


@pytest.mark.parametrize("habit", HABITS)
def test_a_plant_grows_out_of_its_pot(habit: str) -> None:
    p = Plant(habit=habit, reach=0.3 if habit != "rosette" else 0.06)
    mesh = plant(p)
    pot, soil = part_vertices(mesh, "pot"), part_vertices(mesh, "soil")
    green = part_vertices(mesh, "stems" if habit == "cactus" else "leaves")
    assert pot[:, 2].max() == pytest.approx(p.height + 0.006, abs=0.004)
    assert soil[:, 2].max() < pot[:, 2].max() and np.hypot(*soil[:, :2].T).max() < np.hypot(*pot[:, :2].T).max()
    assert green[:, 2].max() > pot[:, 2].max() + (0.004 if habit == "rosette" else 0.05)
    assert green[:, 2].min() > 0 and green[:, 2].max() < pot[:, 2].max() + 1.2 * p.reach
    assert mesh.colors is not None and np.ptp(mesh.colors[:, 1]) > 0.1


@pytest.mark.parametrize("pot", POTS)
def test_pots_have_their_size(pot: str) -> None:
    p = Plant(habit="cactus", reach=0.15, pot=pot, saucer=False)
    made = part_vertices(plant(p), "pot")
    assert np.hypot(*made[:, :2].T).max() == pytest.approx(p.radius, rel=0.01)


def test_draws_cover_all_kinds() -> None:
    books, boxes, plants = ([draw(np.random.default_rng(k)) for k in range(90)] for draw in (draw_book, draw_box, draw_plant))
    assert {p.pose for p in books} == {"lying", "standing", "open"} and {p.art for p in books} == set(ARTS)
    assert {p.style for p in boxes} == {"taped", "open", "lidded"}
    assert {p.habit for p in plants} == set(HABITS) and {p.pot for p in plants} == set(POTS)


@pytest.mark.slow
def test_screens_show_different_things() -> None:
    looks = [picture(show, 0.3, 0.18, np.random.default_rng(3)).pixels for show in SHOWS]
    for a, b in itertools.combinations(looks, 2):
        assert np.abs(a.astype(int) - b.astype(int)).mean() > 8


def test_letters_are_where_they_are_written() -> None:
    c = blank(1.0, 0.2, (1, 1, 1), 400)
    write(c, "HILL", 0.5, 0.1, 0.1, (0, 0, 0))
    dark = c.rgb.mean(axis=2) < 0.5
    x, y = c.x[dark], c.y[dark]
    assert length("HILL", 0.1) == pytest.approx(0.326)
    assert abs(np.ptp(x) - length("HILL", 0.1)) < 0.08 and (x.min() + x.max()) / 2 == pytest.approx(0.5, abs=0.03)
    assert np.ptp(y) == pytest.approx(0.1 * 1.17, abs=0.008) and (y.min() + y.max()) / 2 == pytest.approx(0.1, abs=0.005)


def test_all_families_of_the_desk_are_registered() -> None:
    assert set(SIZES) <= set(zoo.family_names())
