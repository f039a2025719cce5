"""Cycles sees through the backs of single-sided materials where the raster engine does, and they cast shadows there, too."""

import numpy as np
import pytest

import viewsphere as vs
from single_sided_gltf import TURNED, gltf

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("blender")]
CYCLES = {"name": "cycles", "samples": 16}


def pictures(folder, engine, faces):
    recipe = {
        "models": [{"source": str(folder / "m.gltf"), "category": "plate", "faces": faces}],
        "viewpoints": {"azimuth": [0, 50, 180], "elevation": 15, "distance": 8},
        "camera": {"size": [60, 48], "fov_deg": 40},
        "scene": {"ground": {"color": [0.5, 0.5, 0.5]}},
        "channels": ["rgb", "depth", "instances"],
        "engine": engine,
        "splits": {"by": "frame", "train": 1},
        "formats": [],
    }
    return [(s.rgb.astype(int), s.channels["instances"], s.depth) for s in vs.render(vs.Recipe.model_validate(recipe))]


@pytest.mark.parametrize("faces", ["as_file", "both"])
def test_pictures_of_both_engines_show_the_same_sides(tmp_path, faces):
    (tmp_path / "m.gltf").write_text(gltf([(0, {"translation": [0, 0, 1]} | TURNED), (1, {})]))
    painted, drawn = (pictures(tmp_path, engine, faces) for engine in (CYCLES, "raster"))
    for (cycles, ids, depth), (raster, other_ids, other_depth) in zip(painted, drawn, strict=True):
        np.testing.assert_array_equal(ids, other_ids)
        np.testing.assert_array_equal(depth, other_depth)
        off = np.abs(cycles - raster).max(axis=2) > 60
        assert off.mean() < 0.01, "expected the same surfaces and shadows but for their borders"
