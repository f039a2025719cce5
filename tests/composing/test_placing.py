"""Placers: where things stand, without standing in one another; shapes; a placer of somebody else."""

import itertools
import math
import re
import sys
from contextlib import ExitStack
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from installed import installed as packaged
from small import ROOT
from viewsphere import plugins
from viewsphere.assets.cache import load_normalised
from viewsphere.composing import placing
from viewsphere.composing.placing import Footprint, Room, Shape, checked, footprint, standing
from viewsphere.composing.placing.scatter import _roomy
from viewsphere.composing.placing.shared.crowd import Crowd, TakenMap, inner_class
from viewsphere.composing.placing.shared.footprint import Outline, first_crowded, outline
from viewsphere.composing.placing.shared.spot import Others
from viewsphere.composing.seeds import generator
from viewsphere.errors import MissingExtraError, RecipeError
from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.rotation import transform
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import IDENTITY
from viewsphere.planning.plan import plan
from viewsphere.plugins.placer import PlacerSpec
from viewsphere.recipe.recipe import Recipe


def spec(key):
    return ModelSpec(key=key, source="x.obj", category="thing", category_id=1)


def place(name, boxes, keys, seed=0, names=(), **room):
    """Where things of these boxes and keys stand: the first at the origin, the others as the placer of this name says."""
    own, *shapes = [Shape(b, lambda b=b: b) for b in boxes]
    first = standing(own.box)
    return first, *alone(name, shapes, keys[1:], seed, names, taken=((own, first),), **room)


def alone(name, shapes, keys, seed=0, names=(), **room):
    rng = partial(generator, seed, "layout", *names)
    module = plugins.load(PlacerSpec, name)
    options = [module.options()] if module.options else []
    return tuple(module.place([spec(key) for key in keys], Room(**room), shapes, (), rng, *options))


def box(width, length, height=1.0, x=0.0, y=0.0, z=0.0):
    half = np.array([width, length, height]) / 2
    return Box3d.between(np.array([x, y, z]) - half, np.array([x, y, z]) + half).corners


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


@pytest.mark.slow
@given(boxes_strategy, st.integers(0, 2**32), st.sampled_from(["scatter", "row"]), st.floats(0, 1))
def test_no_two_stand_in_one_another(measures, seed, how, gap):
    boxes = [box(w, n, x=x * w, y=y * n, z=0.3 * i) for i, (w, n, x, y) in enumerate(measures)]
    keys = [f"m{i}" for i in range(len(boxes))]
    moves = place(how, boxes, keys, seed, ("m0",), gap=gap)
    floors = [polygon(b, m) for b, m in zip(boxes, moves, strict=True)]
    for a, b in itertools.combinations(floors, 2):
        assert distance(a, b) >= gap - 1e-9
        assert distance(a, b) > 0 or gap <= 1e-6
    for b, m in zip(boxes, moves, strict=True):
        assert abs(transform(m, b)[:, 2].min()) < 1e-12
    assert moves[0] == standing(boxes[0])
    assert moves == place(how, boxes, keys, seed, ("m0",), gap=gap)


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


def all_pairs(prints, gap, start):
    """The first two that are not apart by separating sides, computed with matrices, and how near the question was."""
    for i in range(start, len(prints)):
        for j in range(i):
            one, two = prints[i], prints[j]
            separations = [
                abs(float((two.center - one.center) @ axis)) - sum(float(np.abs(p.axes @ axis) @ p.half) for p in (one, two))
                for axis in (*one.axes, *two.axes)
            ]
            assert one.apart(two, gap) == two.apart(one, gap) == (max(separations) >= gap - 1e-9)
            if not one.apart(two, gap):
                return i, j
    return None


floor_prints = st.lists(
    st.tuples(st.floats(0.01, 9), st.floats(0.01, 9), *[st.floats(-30, 30)] * 2, st.floats(0, 360)), min_size=0, max_size=14
)


@given(floor_prints, st.floats(0, 3), st.integers(0, 3))
def test_a_sweep_finds_the_pair_that_a_look_at_all_pairs_finds(measures, gap, start):
    prints = [footprint(box(w, n), standing(box(w, n), x, y, turn)) for w, n, x, y, turn in measures]
    assert first_crowded(prints, gap, start) == all_pairs(prints, gap, start)


@pytest.mark.parametrize("step", [1.25, 1.25 - 1e-8, 1.25 - 1e-10])
def test_a_sweep_of_a_thousand_cells_compares_neighbours_alone(step, monkeypatch):
    compared = []
    apart = Footprint.apart
    monkeypatch.setattr(Footprint, "apart", lambda one, two, gap: compared.append(two) or apart(one, two, gap))
    cells = itertools.product(range(40), range(25))
    prints = [footprint(box(1, 1), standing(box(1, 1), step * x, step * y)) for x, y in cells]
    assert first_crowded(prints, 0.25) == (None if step > 1.25 - 1e-9 else (1, 0))
    assert len(compared) < 10_000  # of 499,500


@settings(deadline=None)
@given(floor_prints, st.floats(0, 2), st.booleans())
def test_a_crowd_compares_neighbours_and_decides_as_all_pairs_do(measures, gap, of_hulls):
    """Also for triangles and for lines, whose sides separate them only from afar, or never."""
    crowd, covers = Crowd(), []
    for k, (w, n, x, y, turn) in enumerate(measures):
        b, pose = box(w, n), standing(box(w, n), x, y, turn)
        covers.append(outline(b[: 2 + k % 3], pose) if of_hulls else footprint(b, pose))
        assert crowd.is_clear(covers[-1], gap) == all(covers[-1].apart(other, gap) for other in covers[:-1])
        crowd.add(covers[-1])


@settings(deadline=None)
@given(floor_prints, st.tuples(sizes, sizes, st.floats(-2, 2)), st.floats(0, 2), st.booleans(), st.integers(0, 99))
def test_a_map_leaves_out_crowded_spots_alone(measures, own, gap, of_hulls, seed):
    width, length, x = own
    shape = box(width, length, x=x)
    cover = partial(outline if of_hulls else footprint, shape)
    others = Others((TakenMap.empty(gap, inner_class(cover(IDENTITY).circle.inner), 20.0),))
    for w, n, *at in measures:
        others.add((outline if of_hulls else footprint)(box(w, n), standing(box(w, n), *at)))
    draws = np.random.default_rng(seed).random((60, 3))
    spots, turns = 50 * draws[:, :2] - 25, 360 * draws[:, 2]
    left = set(others.untaken(cover, spots, np.radians(turns)).tolist())
    for i in set(range(60)) - left:
        assert not others.crowd.is_clear(cover(standing(shape, *spots[i].tolist(), turns[i])), gap)


@pytest.mark.parametrize("floor", [None, Footprint(np.array([1.0, 2.0]), np.eye(2), np.array([17.3, 17.3]))])
@pytest.mark.parametrize("between", ["boxes", "hulls"])
@pytest.mark.slow
def test_many_things_are_compared_with_few(floor, between, monkeypatch):
    compared = []
    for kind in (Footprint, Outline):
        apart = kind.apart
        monkeypatch.setattr(kind, "apart", lambda one, two, gap, apart=apart: compared.append(two) or apart(one, two, gap))
    shapes = [Shape(box(0.5, 0.6), lambda: box(0.5, 0.6))] * 150
    module = plugins.load(PlacerSpec, "scatter")
    rng, cast = partial(generator, 3, "layout"), [spec(f"m{i}") for i in range(150)]
    poses = module.place(cast, Room(free=floor, gap=0.1), shapes, (), rng, module.options(between=between))
    assert first_crowded([footprint(shapes[0].box, pose) for pose in poses], 0.1) is None
    assert len(compared) < 30 * len(shapes)  # looking at all before each spot, there are 200,000


def test_a_floor_whose_size_is_rounded_is_taken_as_a_whole():
    """Clipping 1.0 +- 17.30000001 rounds; the search for a floor large enough ended never."""
    free = Footprint(np.array([1.1, 2.3]), np.eye(2), np.array([17.30000001, 17.1]))
    shapes = [Shape(box(3, 3), lambda: box(3, 3))] * 40
    floor = _roomy(free, shapes)
    np.testing.assert_allclose(floor.half, free.half, rtol=1e-12)


def test_the_first_mistake_is_told_of_crowds_and_of_floors():
    free = Footprint(np.zeros(2), np.eye(2), np.array([3.0, 3.0]))
    boxes, cast = [Shape(box(1, 1), lambda: box(1, 1))] * 4, [spec(f"m{i}") for i in range(4)]
    inside, near, beyond = (standing(box(1, 1), x) for x in (0.0, 0.5, 9.0))
    for poses, said in (
        ([inside, beyond, near, inside], "found m1 beyond"),
        ([inside, near, beyond], "found m1 and m0 nearer"),
    ):
        with pytest.raises(RecipeError, match=said):
            checked(cast[: len(poses)], Room(free=free), boxes[: len(poses)], poses)
    poses = [inside, standing(box(1, 1), 1.0)]
    assert checked(cast[:2], Room(free=free), boxes[:2], poses) is poses


def test_a_row_is_side_by_side_at_the_gap_right_and_left_in_turn():
    boxes = [box(2, 4), box(1, 1, x=0.5), box(3, 1), box(1, 1)]
    moves = place("row", boxes, "abcd", gap=0.5)
    spans = [transform(m, b)[:, 0] for m, b in zip(moves, boxes, strict=True)]
    edges = [(float(s.min()), float(s.max())) for s in spans]
    assert edges == [(-1, 1), (1.5, 2.5), (-4.5, -1.5), (3, 4)]
    assert all(m[0][:2] == (1, 0) for m in moves)


@pytest.mark.parametrize("how", ["scatter", "row"])
def test_with_nobody_there_before_the_first_stands_at_the_origin(how):
    boxes = [box(2, 4), box(1, 1), box(3, 1), box(1, 1)]
    shapes = [Shape(b, lambda b=b: b) for b in boxes]
    turns = set()
    for seed in range(20):
        moves = alone(how, shapes, "abcd", seed, gap=0.5)
        assert moves[0][0][3] == moves[0][1][3] == 0
        floors = [polygon(b, m) for b, m in zip(boxes, moves, strict=True)]
        assert min(distance(a, b) for a, b in itertools.combinations(floors, 2)) >= 0.5 - 1e-9
        turns.add(moves[0][0][:2])
    assert len(turns) == (1 if how == "row" else 20)
    if how == "row":
        assert moves == place("row", boxes, "abcd", gap=0.5)


def test_all_listed_spots_are_taken_where_nobody_is_there_before():
    shapes = [Shape(box(1, 1), lambda: box(1, 1))] * 2
    moves = alone("listed", shapes, "ab", spots=((1.0, 0.0, 0.0), (-1.0, 0.0, 90.0)))
    assert [move[0][3] for move in moves] == [1, -1]
    with pytest.raises(RecipeError, match=r"scenes\.layout: expected 0.3 m between all models; found b and a nearer"):
        alone("listed", shapes, "ab", spots=((1.0, 0.0, 0.0), (1.5, 0.0, 0.0)), gap=0.3, field="scenes")


def test_a_listed_layout_is_taken_as_it_is_and_refused_where_two_meet():
    listed = partial(place, "listed", [box(2, 4), box(2, 4)], ("own", "other"))
    moves = listed(spots=((4.0, 1.0, 90.0),), gap=0.3)
    assert moves[1] == ((0, -1, 0, 4), (1, 0, 0, 1), (0, 0, 1, 0.5), (0, 0, 0, 1))
    np.testing.assert_allclose(np.array(moves[1])[:3, :3] @ [0, -1, 0], [1, 0, 0])  # faces a camera of azimuth 90
    with pytest.raises(
        RecipeError, match=r"layout: expected 0.3 m between all models; found other and the model that it joins nearer"
    ):
        listed(spots=((2.2, 0.0, 0.0),), gap=0.3)
    listed(spots=((2.2, 0.0, 0.0),), gap=0.2)
    with pytest.raises(RecipeError, match="nearer or in one another"):
        listed(spots=((0.0, 0.0, 0.0),))
    with pytest.raises(RecipeError, match=r"layout: expected a list of 1 spots \[x, y, azimuth\]; found 0"):
        listed()


@pytest.mark.slow
def test_all_stay_on_the_free_floor_or_it_is_said():
    free = footprint(Box3d.between((-3.0, -50.0, 0.0), (3.0, 50.0, 0.0)).corners, standing(np.zeros((8, 3))))
    square = footprint(Box3d.between((-2.5, -2.5, 0.0), (2.5, 2.5, 0.0)).corners, standing(np.zeros((8, 3))))
    boxes, keys = [box(1.8, 4.4)] * 5, [f"m{i}" for i in range(5)]
    for seed in range(20):
        moves = place("scatter", boxes, keys, seed, gap=0.3, free=free)
        for move in moves:
            corners = polygon(boxes[0], move)
            assert (np.abs(corners) <= [3 + 1e-9, 50 + 1e-9]).all()
    with pytest.raises(RecipeError, match="expected room for 5 models; found none for m"):
        place("scatter", boxes, keys, gap=0.3, free=square)
    with pytest.raises(RecipeError, match="free part of the place; found m1 beyond"):
        place("row", boxes, keys, gap=0.3, free=square)


def test_who_else_is_there_does_not_change_what_is_drawn_for_a_slot():
    """The last of three has the spot that it has where the second is another model, as long as both leave it free."""
    boxes = [box(0.1, 0.1)] * 3
    seeds = range(40)
    one, other = ([place("scatter", boxes, ("own", key, "last"), seed)[2] for seed in seeds] for key in ("a", "b"))
    assert sum(a == b for a, b in zip(one, other, strict=True)) > len(seeds) / 2
    assert len({*one}) == len(seeds)


def test_the_hull_has_the_corners_and_nothing_from_inside():
    rng = np.random.default_rng(0)
    corners = box(2, 4, 1)
    inside = rng.uniform(-1, 1, (500, 3)) * [0.9, 1.9, 0.4]
    points = rng.permutation(np.concatenate([inside, corners, corners, inside[:9]]))
    asked = []
    shape = Shape(corners, lambda: asked.append(1) or points)
    assert not asked
    np.testing.assert_array_equal(shape.hull, np.unique(corners, axis=0))
    assert shape.hull is shape.hull and len(asked) == 1


def test_a_flat_models_hull_is_all_its_points_each_once():
    flat = np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 1], [1, 0, 1], [0.5, 0, 0.5], [1, 0, 1]])
    np.testing.assert_array_equal(Shape(flat, lambda: flat).hull, np.unique(flat, axis=0))


def test_a_hull_without_scipy_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "scipy.spatial", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'viewsphere\[hulls\]'"):
        _ = Shape(box(1, 1), lambda: box(1, 1)).hull


@pytest.fixture(params=["entry point", "file beside the others"])
def installed(request, tmp_path, monkeypatch):
    """Installs the text of a placer under a name, as a package of somebody's or beside ours."""

    def install(name, text):
        if request.param == "entry point":
            stack.enter_context(packaged(tmp_path, "placers", name, text))
        else:
            (tmp_path / f"{name}.py").write_text(text)
            monkeypatch.setattr(placing, "__path__", [*placing.__path__, str(tmp_path)])
            made.append(f"{placing.__name__}.{name}")

    made = []
    with ExitStack() as stack:
        yield install
    for module in made:
        sys.modules.pop(module, None)
        placing.__dict__.pop(module.rpartition(".")[2], None)


def recipe(layout, **fields):
    return Recipe(
        models=[{"source": "zoo:post_box", "count": 4}],
        viewpoints={"azimuth": [0, 90], "distance": 12},
        scene={"company": {"count": 3, "layout": layout, **fields}},
        splits={"by": "frame"},
        formats=[],
    )


def test_the_placer_in_the_docs_is_one_file(installed):
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "extending.md").read_text("utf-8"), re.DOTALL)
    (code,) = (block for block in blocks if "def place(" in block)
    installed("circle", code)
    assert plugins.names("placers").count("circle") == 1
    things = plan(recipe("circle", gap=0.5)).shot(0, lambda spec, step=None: box(0.4, 0.6)).things
    poses = [np.array(thing.world_from_object) for thing in things]
    middle, ring = poses[0][:2, 3], np.array([pose[:2, 3] for pose in poses[1:]])
    radius = np.linalg.norm(ring - middle, axis=1)
    sides = np.linalg.norm(ring - np.roll(ring, 1, axis=0), axis=1)
    assert len(poses) == 4 and np.ptp(radius) < 1e-12 and np.ptp(sides) < 1e-12 and radius[0] > 0.5
    for pose, spot in zip(poses[1:], ring, strict=True):
        np.testing.assert_allclose((pose[:3, :3] @ [0, -1, 0])[:2], -spot / radius[0], atol=1e-12)  # faces the first
    with pytest.raises(RecipeError, match=r"scene.company.layout: 'cirle' is unknown; did you mean 'circle'"):
        plan(recipe("cirle"))


def test_a_placer_gets_the_hulls_of_the_models_themselves(installed):
    installed(
        "leaning",
        """
from viewsphere.plugins.placer import PlacerSpec
from viewsphere.composing.placing import standing

def place(cast, room, shapes, views, rng):
    reaches = [float(shape.hull[:, 0].max()) for shape in shapes]
    assert len(shapes) == 3 and all(len(shape.hull) > 8 for shape in shapes) and list(views) == []
    return [standing(shape.box, x) for shape, x in zip(shapes, reaches)]

PLACER = PlacerSpec(place=place)
""",
    )
    boxes = {}

    def box_of(spec, step=None):
        if spec.key not in boxes:
            boxes[spec.key] = Box3d.between(*load_normalised(spec).bounds).corners
        return boxes[spec.key]

    things = plan(recipe("leaning")).shot(0, box_of).things
    assert len({thing.model.key for thing in things}) == 4
    for thing in things[1:]:
        reach = boxes[thing.model.key][4, 0]
        assert reach > 0.05 and thing.world_from_object[0][3] == pytest.approx(reach, abs=1e-9)


def test_random_is_scatter():
    assert recipe("random").scene.company == recipe("scatter").scene.company
    assert recipe("random").digest == recipe("scatter").digest
