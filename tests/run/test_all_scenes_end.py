"""Random rooms, tables, streets and shelves end with as many scenes as they ask for."""

import os

import pytest

from viewsphere.planning.plan import plan
from viewsphere.recipe.recipe import Recipe
from viewsphere.run.shots.framing import Framing
from viewsphere.run.shots.stages import Stages

COUNT = int(os.environ.get("SCENES", "20"))
"""Scenes of each kind."""

MUGS = [{"source": ["zoo:mug", "zoo:bottle"], "count": 3}]
NEAR = {"kind": "sphere", "count": 1, "elevation": [10, 40], "distance": [0.5, 0.9]}
KINDS = {
    "table": {"models": MUGS, "scenes": {"objects": [2, 6], "gap": 0.02, "surface": {"size": [0.4, 0.4], "height": 0.7}}},
    "shelf": {
        "models": MUGS,
        "scenes": {"objects": [1, 4], "gap": 0.01, "surface": "shelf_2_board_8"},
        "scene": {"place": "zoo:room"},
    },
    "street": {
        "models": [{"source": ["zoo:car", "zoo:person"], "count": 3}],
        "scenes": {"objects": [3, 6], "gap": 0.6, "layout": "traffic"},
        "viewpoints": {"kind": "sphere", "count": 1, "elevation": [5, 14], "distance": [8, 15]},
        "scene": {"place": "zoo:neighbourhood"},
    },
    "rooms": {
        "models": [{"source": "zoo:chair", "count": 4}],
        "scenes": {"objects": 2},
        "viewpoints": {"kind": "sphere", "count": 1, "elevation": [10, 25], "distance": [2, 3]},
        "scene": {"place": {"source": "zoo:room", "draw": "per_model"}},
    },
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_every_scene_is_composed(kind):
    values = {
        "name": kind,
        "viewpoints": NEAR,
        "camera": {"size": [32, 32], "fov_deg": 65},
        "engine": {"bounces": "off"},
        "channels": ["instances"],
        "formats": [],
        "splits": {"by": "frame", "train": 1},
        **KINDS[kind],
    }
    recipe = Recipe(**{**values, "scenes": {"count": COUNT, **values["scenes"]}})
    planned, stages = plan(recipe), Stages()
    framing = Framing(planned, planned, stages, stages.box)
    shots = [framing.shot(row) for row in planned.rows]
    print(kind, len(shots), "scenes,", sum(shot.redraw > 0 for shot in shots), "redrawn")
    assert len(shots) == COUNT
