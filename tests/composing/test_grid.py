"""The placer `grid`: things in equal cells, none nearer than the gap, the first where it always is."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_placing import box, distance, place, polygon

from viewsphere.composing.placing import footprint
from viewsphere.errors import RecipeError
from viewsphere.planning.plan import plan
from viewsphere.recipe.recipe import Recipe

sizes = st.floats(0.05, 6)
things = st.lists(st.tuples(sizes, sizes, st.floats(-1, 1), st.floats(-1, 1)), min_size=2, max_size=12)


@given(things, st.floats(0, 1))
def test_cells_are_a_grid_and_keep_the_gap(parts, gap):
    boxes = [box(width, length, x=x, y=y) for width, length, x, y in parts]
    poses = place("grid", boxes, [f"m{i}" for i in range(len(boxes))], gap=gap)
    ground = [polygon(b, np.array(pose)) for b, pose in zip(boxes, poses, strict=True)]
    for i, own in enumerate(ground):
        assert all(distance(own, other) >= gap - 1e-9 for other in ground[:i])
    assert poses[0] == place("grid", boxes[:1], ["m0"])[0]
    middles = np.array([footprint(b, pose).center for b, pose in zip(boxes, poses, strict=True)])
    cell = np.array([max(p[k] for p in parts) + gap for k in (0, 1)])
    numbers = (middles - middles[0]) / cell
    np.testing.assert_allclose(numbers, numbers.round(), atol=1e-9)
    assert len({tuple(n) for n in numbers.round().astype(int).tolist()}) == len(parts)
    assert (np.abs(numbers) <= np.sqrt(len(parts)) + 1e-9).all()


def test_nearest_cells_come_first():
    poses = place("grid", [box(1, 2)] * 9, "abcdefghi", gap=0.5)
    cells = [(pose[0][3] / 1.5, pose[1][3] / 2.5) for pose in poses]
    assert cells[:5] == [(0, 0), (0, -1), (-1, 0), (1, 0), (0, 1)]
    assert sorted(cells) == [(x, y) for x in (-1, 0, 1) for y in (-1, 0, 1)]


def test_a_grid_larger_than_the_free_floor_is_refused():
    free = footprint(box(3, 3), np.eye(4).tolist())
    with pytest.raises(RecipeError, match=r"scene\.company\.layout: expected all models in the free part of the place"):
        place("grid", [box(1, 1)] * 9, "abcdefghi", gap=0.2, free=free)


def test_recipes_ask_for_it_by_name():
    recipe = Recipe.model_validate(
        {
            "models": [{"source": "zoo:chair", "count": 6}],
            "viewpoints": {"azimuth": [0], "elevation": [20], "distance": [9]},
            "scene": {"company": {"count": 5, "layout": "grid", "gap": 0.4}},
            "splits": {"train": 1},
        }
    )
    shot = next(plan(recipe).shots(lambda spec, step=None: box(0.5, 0.5)))
    assert sorted(thing.world_from_object[0][3] for thing in shot.things) == pytest.approx([-0.9, -0.9, 0, 0, 0, 0.9])
