"""viewsphere: the benchmark's own frame with 4x edge anti-aliasing, all its labels and files."""

import os
import sys
from pathlib import Path

os.environ.setdefault("NUMBA_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parent.parent))

from bench import Clock, one_frame
from bench_scene import reference_recipe
from view_loop import opened

from viewsphere import __version__, plan, plugins
from viewsphere.plugins.engine import EngineSpec
from viewsphere.run.shots.stages import Stages
from viewsphere.run.workers.allocator import keep_freed_memory
from viewsphere.store import Store

scene = opened()
keep_freed_memory()  # workers set the same
count = len(scene.told["views"])
stages = Stages()
shot = next(plan(reference_recipe(count, 4, scene.folder), shot_frames=count).shots(stages.box))
mesh = stages.model(shot.things[0].model)
stage = plugins.load(EngineSpec, "raster").stage(shot, lambda spec: mesh)
stage.at(0)
store = Store(scene.folder / "viewsphere")
(store.root / "store" / "writing").mkdir(parents=True)
clock = Clock()


def samples():
    """The frames that the benchmark asks for; a frame's files are written before the next is asked for."""
    for view in scene.views():
        sample = one_frame(clock, shot, view, stage, mesh)
        scene.keep(view, sample.channels["rgb"])
        yield sample


scene.ready(
    f"viewsphere {__version__}",
    "colour under sun and sky with soft shadows, 4x edges; depth, normals, ids, masks, 2D and 3D boxes, poses; all as files",
)
store.write_shot("car", samples(), shot=shot)
scene.finish()
