"""Models spread over the free floor, clear of a file's geometry, or heaped together as close as they go."""

import numpy as np
import pytest
import trimesh

from viewsphere.composing.placing import obstacles
from viewsphere.errors import RecipeError
from viewsphere.planning.plan import plan
from viewsphere.recipe.recipe import Recipe
from viewsphere.run.shots.stages import Stages

TABLE = {"size": [2, 2], "height": 0.001}


def spots_of(folder, layout="scatter", place=None, count=1, objects=25, surface=TABLE):
    weed = trimesh.creation.icosphere(1, 0.04)
    weed.export(folder / "weed.glb")
    recipe = Recipe(
        name="field",
        models=[{"source": str(folder / "weed.glb"), "category": "weed", "up": "+z", "forward": "-y"}],
        scenes={
            "count": count,
            "objects": objects,
            "repeat": True,
            "layout": layout,
            "gap": 0.01,
            "surface": surface,
        },
        viewpoints={"azimuth": 0, "elevation": 70, "distance": 2.2},
        camera={"size": [32, 32], "fov_deg": 60},
        scene={} if place is None else {"place": place},
        channels=["instances"],
        formats=[],
        splits={"by": "scene", "train": 1},
    )
    planned, stages = plan(recipe), Stages()
    shots = [planned.shot(row, stages.box) for row in planned.rows]
    return np.array([np.array(t.world_from_object)[:2, 3] for s in shots for t in s.things if t.is_target])


def test_scatter_is_uniform_over_a_surface(tmp_path):
    spots = spots_of(tmp_path, count=16)
    assert (np.abs(spots) <= 0.96 + 1e-9).all()
    counts, _, _ = np.histogram2d(*spots.T, bins=4, range=[[-0.96, 0.96]] * 2)
    expected = len(spots) / 16
    assert ((counts - expected) ** 2 / expected).sum() < 37.7  # chi-square of 15 degrees of freedom, p = 0.001


def test_heap_together_is_close_by(tmp_path):
    assert np.linalg.norm(spots_of(tmp_path, "heap_together"), axis=1).max() < 0.5


def test_scatter_keeps_clear_of_a_files_geometry(tmp_path):
    rows, crops = trimesh.Scene(), []
    for i in range(4):
        for j in range(6):
            crop = trimesh.creation.icosphere(2, 0.06)
            crop.apply_translation((i * 0.5 - 0.75, j * 0.3 - 0.75, 0.06))
            crops.append((i * 0.5 - 0.75, j * 0.3 - 0.75))
            rows.add_geometry(crop, node_name=f"crop_{i}_{j}", geom_name=f"crop_{i}_{j}")
    rows.export(tmp_path / "rows.glb")
    place = {"source": str(tmp_path / "rows.glb"), "up": "+z", "forward": "-y", "origin": [0, 0, 0]}
    spots = spots_of(tmp_path, place=place, count=2)
    gaps = np.linalg.norm(spots[:, None] - np.array(crops), axis=2).min(axis=1) - 0.06 - 0.04
    assert gaps.min() > 0
    free = spots_of(tmp_path, count=2)
    assert (np.linalg.norm(free[:, None] - np.array(crops), axis=2).min(axis=1) < 0.1).any()  # else nothing is in the way


@pytest.mark.parametrize("length", [10, 400])
def test_a_wall_through_the_middle_is_in_the_way_however_long_it_is(length):
    corners = np.array([(-length / 2, -0.5, 0), (length / 2, 0.5, 0), (length / 2, 0.5, 3), (-length / 2, -0.5, 3)])
    wall = obstacles(corners, np.array([(0, 1, 2), (0, 2, 3)], np.int32), 1.0)
    square = np.array([(0, 0), (0.3, 0), (0.3, 0.3), (0, 0.3)])
    assert wall.meets(square - 0.15, 0.0)
    assert all(wall.meets(np.array([(x, -0.05), (x + 0.02, -0.05), (x, 0.05)]), 0.0) for x in np.linspace(-0.3, 0.3, 25))
    assert not wall.meets(square + np.array((0, 1)), 0.1)
    assert not wall.meets(square - np.array((0, 1)), 0.1)


@pytest.mark.parametrize("reach", [20, 60, 300])
def test_a_fence_is_in_the_way_as_far_as_a_layout_reaches(reach):
    corners = [(reach - 5, y, z) for y, z in ((-4, 0), (4, 0), (4, 1), (-4, 1))]
    fence = obstacles(np.array(corners, np.float64), np.array([(0, 1, 2), (0, 2, 3)], np.int32), 1.0, reach)
    square = np.array([(0, 0), (1, 0), (1, 1), (0, 1)]) + np.array((reach - 5.5, 0))
    assert fence.meets(square, 0.0)
    assert not fence.meets(square - np.array((3, 0)), 0.5)
    assert not fence.meets(square + np.array((3, 0)), 0.5)


def test_a_scatter_over_60_m_keeps_clear_of_a_whole_street(tmp_path):
    street, walls = trimesh.Scene(), []
    street.add_geometry(trimesh.creation.box((130, 130, 0.01)), node_name="Floor", geom_name="Floor")
    for x in np.arange(-55, 56, 10.0):
        boards = [trimesh.creation.box((0.05, 100, 3)) for _ in range(51)]
        for i, board in enumerate(boards):
            board.apply_translation((x + 0.1 * i - 2.5, 0, 1.5))
        street.add_geometry(trimesh.util.concatenate(boards), node_name=f"wall_{x}", geom_name=f"wall_{x}")
        walls.append(x)
    street.export(tmp_path / "street.glb")
    place = {"source": str(tmp_path / "street.glb"), "up": "+z", "forward": "-y", "origin": [0, 0, 0]}
    spots = spots_of(tmp_path, {"kind": "scatter", "reach": 60}, place, count=2, objects=40, surface=None)
    assert (np.abs(spots).max(axis=0) > 40).all()
    beside = np.abs(spots[np.abs(spots[:, 1]) < 50][:, :1] - np.array(walls)).min(axis=1)
    assert beside.min() > 2.5


@pytest.mark.parametrize("layout", ["scatter", "heap_together", {"kind": "scatter", "between": "hulls"}])
def test_a_model_larger_than_the_floor_is_refused_with_both_sizes(layout, tmp_path, monkeypatch):
    monkeypatch.setenv("VIEWSPHERE_MAX_REDRAWS", "2")  # each fails as the first
    reason = r"scenes: weed covers 0\.08 x 0\.08 m, and the free floor has 0\.05 x 2 m\. Use a smaller model, set its `scale`"
    with pytest.raises(RecipeError, match=reason):
        spots_of(tmp_path, layout, objects=1, surface={"size": [0.05, 2], "height": 0.5})


@pytest.mark.parametrize("layout", ["scatter", "heap_together"])
def test_hulls_are_spread_as_well(layout, tmp_path):
    assert len(spots_of(tmp_path, {"kind": layout, "between": "hulls"}, objects=5)) == 5
