"""Mugs, bottles, bowls, cans and plates: sizes, parts, hollows, sound triangles, symmetry, determinism, variety."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import viewsphere_zoo as zoo
from viewsphere.assets.metadata.surface import Surface
from viewsphere.assets.metadata.symmetries import find
from viewsphere.model.annotations.symmetries import Symmetries
from viewsphere_zoo.families.bottle import FORMS, Bottle, bottle
from viewsphere_zoo.families.bottle import draw as draw_bottle
from viewsphere_zoo.families.bowl import SHAPES as BOWLS
from viewsphere_zoo.families.bowl import Bowl, bowl
from viewsphere_zoo.families.can import Can, can
from viewsphere_zoo.families.mug import SHAPES, Mug, mug
from viewsphere_zoo.families.plate import Plate, plate
from viewsphere_zoo.household.canvas import blank
from viewsphere_zoo.household.patterns import PATTERNS
from viewsphere_zoo.household.prints import GROUNDS, PICTURES, wrapper
from zoo_mesh import assert_family, assert_sound, part_vertices

SIZES = {
    "mug": ((0.09, 0.15), (0.075, 0.17), (0.07, 0.16)),
    "bottle": ((0.055, 0.095), (0.16, 0.345), (0.055, 0.095)),
    "bowl": ((0.11, 0.27), (0.04, 0.17), (0.11, 0.27)),
    "can": ((0.05, 0.105), (0.03, 0.17), (0.05, 0.105)),
    "plate": ((0.175, 0.305), (0.012, 0.06), (0.175, 0.305)),
}
"""Width, height and length that draws may have, metres."""


@pytest.mark.parametrize("family", SIZES)
def test_draws_are_sound_of_real_size_and_differ(family: str) -> None:
    assert_family(family, SIZES[family], 6_000)


def rising(mesh, part: str, above: float) -> bool:
    """Return whether some face of the part looks up and lies at least so high above the ground."""
    own = mesh.triangles[mesh.triangle_part == mesh.parts.index(part)]
    corners = mesh.vertices[own].astype(np.float64)
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return bool((area[:, 2] > 0.5 * np.linalg.norm(area, axis=1))[corners[..., 2].mean(axis=1) > above].any())


@pytest.mark.parametrize(
    ("mesh", "height", "floor"),
    [(mug(Mug()), 0.095, 0.006), (bowl(Bowl()), 0.07, 0.006), (bottle(Bottle(closure="none")), 0.3, 0.004)],
    ids=["mug", "bowl", "bottle"],
)
def test_vessels_are_hollow(mesh, height: float, floor: float) -> None:
    inside, body = part_vertices(mesh, "inside"), part_vertices(mesh, "body")
    assert inside[:, 2].min() == pytest.approx(floor, abs=1e-3)
    assert inside[:, 2].max() == pytest.approx(height, abs=2e-3)
    assert np.hypot(*inside[:, :2].T).max() < np.hypot(*body[:, :2].T).max()
    assert np.hypot(*body[:, :2].T).min() < 1e-6 and body[:, 2].min() == 0.0
    assert rising(mesh, "inside", 0.5 * floor) and not rising(mesh, "inside", height)


@pytest.mark.parametrize("shape", SHAPES)
def test_a_mugs_handle_stands_out_and_ends_within_its_wall(shape: str) -> None:
    for handle in ("bow", "ear", "square", "ring"):
        p = Mug(shape=shape, handle=handle, reach=0.034)
        mesh = mug(p)
        grip, inside = part_vertices(mesh, "handle"), part_vertices(mesh, "inside")
        assert grip[:, 0].max() == pytest.approx(p.radius + p.reach, abs=0.008)
        assert np.abs(grip[:, 1]).max() < 0.012
        wall = inside[np.hypot(inside[:, 0], inside[:, 1]) > 0.5 * p.radius]
        height = np.argsort(wall[:, 2])
        ends = grip[np.argsort(grip[:, 0])[:14]]
        within = np.interp(ends[:, 2], wall[height, 2], np.hypot(wall[height, 0], wall[height, 1]))
        assert (ends[:, 0] > within - 2e-4).all() and (ends[:, 0] < within + p.wall).any()


@pytest.mark.slow
def test_what_is_asked_for_is_there() -> None:
    assert {"content", "tag", "spoon"} <= set(mug(Mug(content="tea", tag=True, spoon=True)).parts)
    assert not {"content", "tag", "spoon"} & set(mug(Mug()).parts)
    assert "content" in bowl(Bowl(content="fruit")).parts and "content" not in bowl(Bowl()).parts
    assert "content" in plate(Plate(content="cookies")).parts and "content" not in plate(Plate()).parts
    assert "tab" in can(Can(kind="food")).parts and "tab" not in can(Can(kind="food", ring=False)).parts
    assert not {"cap", "label"} & set(bottle(Bottle(closure="none", label=None)).parts)
    for name in ("foil", "cork", "crown", "screw", "flip", "lid"):
        assert part_vertices(bottle(Bottle(closure=name)), "cap")[:, 2].max() > 0.3


@pytest.mark.parametrize("shape", BOWLS)
def test_what_is_in_a_bowl_does_not_come_through_its_wall(shape: str) -> None:
    for content in ("soup", "rings", "fruit", "salad"):
        p = Bowl(shape=shape, radius=0.09, height=0.075, content=content)
        mesh = bowl(p)
        food, wall = part_vertices(mesh, "content"), part_vertices(mesh, "body")
        below = food[food[:, 2] < p.height]
        outline = wall[np.argsort(wall[:, 2])]
        outside = np.interp(below[:, 2], outline[:, 2], np.hypot(*outline[:, :2].T))
        assert (np.hypot(*below[:, :2].T) < outside).all() and below[:, 2].min() > 0.003
        assert_sound(mesh, 6_000, 200)


@pytest.mark.parametrize("form", FORMS)
def test_a_bottle_has_its_size_and_its_label_outside(form: str) -> None:
    p = Bottle(form=form, closure="none")
    mesh = bottle(p)
    assert mesh.bounds[1][2] == pytest.approx(p.height, abs=0.002)
    label, body = part_vertices(mesh, "label"), part_vertices(mesh, "body")
    assert np.hypot(*body[:, :2].T).max() == pytest.approx(p.radius, abs=1e-4)
    low, high = (share * p.height for share in FORMS[form].label)
    np.testing.assert_allclose((label[:, 2].min(), label[:, 2].max()), (low, high), atol=1e-5)


def test_labels_are_read_from_left_to_right() -> None:
    mesh = can(Can())
    index = [m.name for m in mesh.materials].index("label")
    own = mesh.triangles[mesh.triangle_material == index]
    front = own[(mesh.vertices[own][..., 1] < -0.02).all(axis=1)]
    x, u = mesh.vertices[front][..., 0].ravel(), mesh.uv0[front][..., 0].ravel()
    z, v = mesh.vertices[front][..., 2].ravel(), mesh.uv0[front][..., 1].ravel()
    assert np.corrcoef(x, u)[0, 1] > 0.99 and np.corrcoef(z, v)[0, 1] < -0.99
    assert np.ptp(mesh.uv0[own][..., 0], axis=1).max() < 0.1


@pytest.mark.parametrize(
    ("mesh", "is_round"),
    [(bowl(Bowl()), True), (plate(Plate()), True), (bottle(Bottle()), True), (mug(Mug()), False)],
    ids=["bowl", "plate", "bottle", "mug"],
)
def test_what_is_turned_is_found_round(mesh, is_round: bool) -> None:
    found = find(Surface.from_mesh(mesh))
    if is_round:
        assert [c.axis for c in found.continuous] == [(0.0, 0.0, 1.0)] and not found.discrete
    else:
        assert found == Symmetries()


def test_bottles_are_of_all_kinds_and_colours() -> None:
    draws = [draw_bottle(np.random.default_rng(seed)) for seed in range(120)]
    assert {p.form for p in draws} == set(FORMS) and len({p.closure for p in draws}) == 6
    assert len({(p.label.title, p.label.colors) for p in draws if p.label}) > 30


@pytest.mark.slow
def test_all_prints_can_be_drawn_and_differ() -> None:
    looks = set()
    for paint in PATTERNS.values():
        c = blank(0.25, 0.09, (0.9, 0.9, 0.88), 128)
        paint(c, ((0.1, 0.3, 0.5), (0.8, 0.3, 0.2)), np.random.default_rng(1))
        looks.add(c.image("print").pixels.tobytes())
    label = Can().label
    labels = [replace(label, picture=name) for name in PICTURES] + [replace(label, ground=name) for name in GROUNDS]
    for one in labels:
        c = blank(0.2, 0.1, (0.9, 0.9, 0.88), 128)
        wrapper(c, one, np.random.default_rng(1))
        looks.add(c.image("label").pixels.tobytes())
    assert len(looks) == len(PATTERNS) + len(labels)


def test_prints_close_around_a_vessel() -> None:
    for name in set(PATTERNS) - {"word", "hearts"}:
        c = blank(0.25, 0.09, (0.9, 0.9, 0.88), 256)
        PATTERNS[name](c, ((0.1, 0.3, 0.5), (0.8, 0.3, 0.2)), np.random.default_rng(2))
        steps = np.abs(np.diff(c.rgb, axis=1)).mean(axis=(0, 2))
        assert np.abs(c.rgb[:, 0] - c.rgb[:, -1]).mean() <= max(float(steps.max()) * 1.05, 0.02), name


def test_all_families_of_the_table_are_registered() -> None:
    assert set(SIZES) <= set(zoo.family_names())
