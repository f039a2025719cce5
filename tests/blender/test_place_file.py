"""A place made in Blender says where its floor, lanes and surfaces are, as a .blend file and as the GLB exported from it."""

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

from viewsphere.composing.scene.scenery import free_floor, is_indoors, place_lanes, place_surfaces
from viewsphere.recipe.recipe import Recipe

pytestmark = [pytest.mark.slow]


@pytest.fixture(scope="module")
def made(blender, tmp_path_factory):
    """The folder of the files that `make_place` makes, and the points of its way."""
    folder = tmp_path_factory.mktemp("place")
    run = subprocess.run([blender, Path(__file__).with_name("make_place.py"), folder], capture_output=True, text=True)
    return folder, np.array(json.loads(run.stdout.splitlines()[-1]), float)


@pytest.mark.parametrize("name", ["yard.blend", "yard.glb"])
def test_what_a_place_made_in_blender_says(made, name):
    folder, way = made
    scene = {"place": {"source": str(folder / name)}}
    recipe = Recipe(models=[{"source": "zoo:car"}], viewpoints={"distance": 9}, scene=scene, splits={"by": "frame"}, formats=[])
    place = recipe.scene.place
    assert free_floor(recipe, place, ()).half == pytest.approx([3, 2], abs=1e-5) and is_indoors(recipe, place)
    loop, north, along = place_lanes(recipe, place, ())
    assert [(lane.name, lane.width, lane.closed) for lane in (loop, north, along)] == [
        ("loop", 3.0, True),
        ("north", 4.0, False),
        ("way", 3.0, False),
    ]
    np.testing.assert_allclose(loop.points, [(-4, -9, 0), (14, -9, 0), (14, 9, 0)], atol=1e-5)
    np.testing.assert_allclose(north.points, way, atol=1e-5)
    np.testing.assert_allclose(along.points, way + np.array([20, 0, 0]), atol=1e-5)
    (table,) = place_surfaces(recipe, place, ())
    frame = np.array(table.world_from_surface)
    assert table.name == "table" and table.size == pytest.approx((1.2, 0.8), abs=1e-5)
    np.testing.assert_allclose(frame[:3, 3], (1.5, 1.2, 0.75), atol=1e-5)
    assert np.degrees(np.arctan2(frame[1, 0], frame[0, 0])) == pytest.approx(20, abs=1e-3)
