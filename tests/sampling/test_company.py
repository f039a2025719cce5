"""Several targets: who, and where, without standing in one another."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewsphere.errors import RecipeError
from viewsphere.geometry.box import box_vertices
from viewsphere.geometry.rotation import transform
from viewsphere.model.model_spec import ModelSpec
from viewsphere.recipe.scenery import CompanyEntry
from viewsphere.sampling.company import companions, footprint, layout, standing


def spec(key):
    return ModelSpec(key=key, source="x.obj", category="thing", category_id=1)


def box(width, length, height=1.0, x=0.0, y=0.0, z=0.0):
    half = np.array([width, length, height]) / 2
    return box_vertices(np.array([x, y, z]) - half, np.array([x, y, z]) + half)


def polygon(vertices, move):
    """The box's bottom in the world, from its eight vertices alone."""
    return transform(move, vertices)[[0, 1, 2, 3], :2]


def cross(a, b):
    return a[0] * b[1] - a[1] * b[0]


def distance(a, b):
    """Least distance of two convex polygons, 0 where they meet: corners to edges, both ways, and crossing edges."""

    def inside(p, poly):
        sides = [cross(poly[(i + 1) % 4] - poly[i], p - poly[i]) for i in range(4)]
        return all(s >= 0 for s in sides) or all(s <= 0 for s in sides)

    if any(inside(p, b) for p in a) or any(inside(p, a) for p in b):
        return 0.0
    least = math.inf
    for own, other in ((a, b), (b, a)):
        for p, i in itertools.product(own, range(4)):
            q, e = other[i], other[(i + 1) % 4] - other[i]
            s = np.clip(np.dot(p - q, e) / np.dot(e, e), 0, 1)
            least = min(least, float(np.linalg.norm(p - q - s * e)))
    for i, j in itertools.product(range(4), range(4)):
        d, e, w = a[(i + 1) % 4] - a[i], b[(j + 1) % 4] - b[j], b[j] - a[i]
        det = cross(d, e)
        if abs(det) > 1e-15 and 0 <= cross(w, e) / det <= 1 and 0 <= cross(w, d) / det <= 1:
            return 0.0
    return least


sizes = st.floats(0.05, 6)
boxes_strategy = st.lists(st.tuples(sizes, sizes, st.floats(-1, 1), st.floats(-1, 1)), min_size=2, max_size=6)


@given(boxes_strategy, st.integers(0, 2**32), st.sampled_from(["random", "row"]), st.floats(0, 1))
def test_no_two_stand_in_one_another(measures, seed, how, gap):
    boxes = [box(w, n, x=x * w, y=y * n, z=0.3 * i) for i, (w, n, x, y) in enumerate(measures)]
    specs = [spec(f"m{i}") for i in range(len(boxes))]
    entry = CompanyEntry(count=len(boxes) - 1, layout=how, gap=gap)
    moves = layout(entry, seed, specs, boxes, ("m0",))
    floors = [polygon(b, m) for b, m in zip(boxes, moves, strict=True)]
    for a, b in itertools.combinations(floors, 2):
        assert distance(a, b) >= gap - 1e-9
        assert distance(a, b) > 0 or gap <= 1e-6
    for b, m in zip(boxes, moves, strict=True):
        assert abs(transform(m, b)[:, 2].min()) < 1e-12
    assert moves == layout(entry, seed, specs, boxes, ("m0",))


@settings(max_examples=2 * settings.default.max_examples)
@given(*[st.tuples(sizes, sizes, st.floats(-5, 5), st.floats(-5, 5), st.floats(0, 360))] * 2)
def test_apart_never_says_more_than_there_is(one, other):
    """An axis that separates is a proof; where there is none, the two are nearer than the largest gap it was asked for."""
    (a, move_a), (b, move_b) = ((box(w, n), standing(box(w, n), x, y, turn)) for w, n, x, y, turn in (one, other))
    there = distance(polygon(a, move_a), polygon(b, move_b))
    prints = footprint(a, move_a), footprint(b, move_b)
    if prints[0].apart(prints[1], 0.4):
        assert there >= 0.4 - 1e-6
    if there == 0:
        assert not prints[0].apart(prints[1], 1e-6)
    elif there > 1e-6:
        assert prints[0].apart(prints[1], 0.0) and prints[1].apart(prints[0], 0.0)


def test_a_row_is_side_by_side_at_the_gap_right_and_left_in_turn():
    boxes = [box(2, 4), box(1, 1, x=0.5), box(3, 1), box(1, 1)]
    moves = layout(CompanyEntry(count=3, layout="row", gap=0.5), 0, [spec(f"m{i}") for i in range(4)], boxes, ())
    spans = [transform(m, b)[:, 0] for m, b in zip(moves, boxes, strict=True)]
    edges = [(float(s.min()), float(s.max())) for s in spans]
    assert edges == [(-1, 1), (1.5, 2.5), (-4.5, -1.5), (3, 4)]
    assert all(m[0][:2] == (1, 0) for m in moves)


def test_a_listed_layout_is_taken_as_it_is_and_refused_where_two_meet():
    boxes, specs = [box(2, 4), box(2, 4)], [spec("own"), spec("other")]
    moves = layout(CompanyEntry(layout=[[4.0, 1.0, 90.0]]), 0, specs, boxes, ())
    assert moves[1] == ((0, -1, 0, 4), (1, 0, 0, 1), (0, 0, 1, 0.5), (0, 0, 0, 1))
    np.testing.assert_allclose(np.array(moves[1])[:3, :3] @ [0, -1, 0], [1, 0, 0])  # faces a camera of azimuth 90
    with pytest.raises(RecipeError, match=r"layout: expected 0.3 m between all models; found own and other nearer"):
        layout(CompanyEntry(layout=[[2.2, 0, 0]]), 0, specs, boxes, ())
    layout(CompanyEntry(layout=[[2.2, 0, 0]], gap=0.2), 0, specs, boxes, ())
    with pytest.raises(RecipeError, match="nearer or in one another"):
        layout(CompanyEntry(layout=[[0, 0, 0]], gap=0), 0, specs, boxes, ())


def test_all_stay_on_the_free_floor_or_it_is_said():
    free = footprint(box_vertices((-3.0, -50.0, 0.0), (3.0, 50.0, 0.0)), standing(np.zeros((8, 3))))
    square = footprint(box_vertices((-2.5, -2.5, 0.0), (2.5, 2.5, 0.0)), standing(np.zeros((8, 3))))
    boxes, specs = [box(1.8, 4.4)] * 5, [spec(f"m{i}") for i in range(5)]
    for seed in range(20):
        moves = layout(CompanyEntry(count=4), seed, specs, boxes, (), free)
        for move in moves:
            corners = polygon(boxes[0], move)
            assert (np.abs(corners) <= [3 + 1e-9, 50 + 1e-9]).all()
    with pytest.raises(RecipeError, match="expected room for 5 models; found none for m"):
        layout(CompanyEntry(count=4), 0, specs, boxes, (), square)
    with pytest.raises(RecipeError, match="free part of the place; found m1 beyond"):
        layout(CompanyEntry(count=4, layout="row"), 0, specs, boxes, (), square)


def test_a_model_more_takes_only_the_places_it_wins():
    specs = [spec(f"m{i:03d}") for i in range(30)]
    before = {s.key: companions(5, s, specs[:29], 1, (s.key,)) for s in specs[:29]}
    after = {s.key: companions(5, s, specs, 1, (s.key,)) for s in specs[:29]}
    changed = [k for k in before if before[k] != after[k]]
    assert 0 < len(changed) < 8
    assert all(after[k][0] is specs[29] for k in changed)


def test_companions_are_others_each_once_and_all_get_their_turn():
    specs = [spec(f"m{i}") for i in range(6)]
    chosen = {s.key: companions(0, s, specs, 4, (s.key,)) for s in specs}
    for key, others in chosen.items():
        assert len({o.key for o in others}) == 4 and key not in {o.key for o in others}
    assert {o.key for others in chosen.values() for o in others} == {s.key for s in specs}
    fixed = [companions(0, s, specs, 1, ())[0].key for s in specs]
    assert len(set(fixed)) == 2  # one for all but itself
    assert chosen == {s.key: companions(0, s, specs[::-1], 4, (s.key,)) for s in specs}
