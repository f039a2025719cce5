"""Kernels are compiled before workers come, and later not even loaded."""

from __future__ import annotations

import os
import subprocess
import sys

from viewsphere import Recipe, plan
from viewsphere.geometry.kernel_cache import sources_digest
from viewsphere.run import warm

RUN = """
import sys
from viewsphere import Recipe, generate
if __name__ == "__main__":
    viewpoints = {"azimuth": [0], "elevation": [20], "distance": float(sys.argv[2])}
    recipe = Recipe(
        models=[{"source": "zoo:chair"}], viewpoints=viewpoints, channels=["depth"], camera={"size": [32, 32]}, formats=[]
    )
    assert generate(recipe, sys.argv[1], workers=1).rendered == 1
    print("numba" in sys.modules)
"""


def test_the_parent_of_a_later_run_loads_no_kernels(tmp_path):
    (tmp_path / "run.py").write_text(RUN)
    environment = {**os.environ, "VIEWSPHERE_CACHE": str(tmp_path / "cache")}
    environment.pop("NUMBA_CACHE_DIR", None)

    def run(out, distance):
        words = [sys.executable, str(tmp_path / "run.py"), str(tmp_path / out), str(distance)]
        return subprocess.run(words, env=environment, capture_output=True, text=True, check=True).stdout

    assert [run("a", 3), run("b", 3), run("c", 4.5)] == ["True\n", "False\n", "False\n"]


def mark(**changes):
    recipe = Recipe.model_validate(
        {"models": [{"source": "zoo:chair"}], "viewpoints": {"azimuth": [0], "elevation": [20], "distance": 3}, **changes}
    )
    return warm._mark(warm._small(next(iter(plan(recipe).shots()))))


def test_a_mark_is_of_what_a_shot_uses_and_not_how_much_of_it():
    assert mark(seed=4, camera={"size": [64, 48]}) == mark()
    blurred = {"scene": {"effects": {"blur": 0.2}}}
    assert mark(**blurred) == mark(scene={"effects": {"blur": 0.7}})
    marks = [
        mark(),
        mark(**blurred),
        mark(channels=["rgb", "depth"]),
        mark(camera={"fov_deg": 50, "distortion": {"model": "brown_conrady", "coefficients": [-0.1, 0.02, 0, 0]}}),
    ]
    assert len(set(marks)) == len(marks)


def test_a_mark_is_void_when_a_source_changes(tmp_path):
    (tmp_path / "inside").mkdir()
    source = tmp_path / "inside" / "kernels.py"
    source.write_text("x = 1")
    before = sources_digest(tmp_path)
    source.write_text("x = 2")
    sources_digest.cache_clear()
    after = sources_digest(tmp_path)
    source.rename(tmp_path / "kernels.py")
    sources_digest.cache_clear()
    assert len({before, after, sources_digest(tmp_path)}) == 3
