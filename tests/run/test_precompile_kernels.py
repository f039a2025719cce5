"""Kernels are compiled before workers come, and later not even loaded."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import numpy as np
import pytest

from shots import unit_box
from viewsphere import Recipe, plan
from viewsphere.geometry.mask import decode_rle, encode_rle
from viewsphere.kernels import entries
from viewsphere.kernels.digests import package_digest
from viewsphere.run.shots import precompile as warm

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


@pytest.mark.slow
def test_what_starts_workers_imports_no_numba():
    words = [sys.executable, "-c", "import sys, viewsphere.run.generate; print('numba' in sys.modules)"]
    assert subprocess.run(words, capture_output=True, text=True, check=True).stdout == "False\n"


@pytest.mark.slow
def test_the_parent_of_workers_loads_no_kernels(tmp_path):
    (tmp_path / "run.py").write_text(RUN)
    environment = {**os.environ, "VIEWSPHERE_CACHE": str(tmp_path / "cache")}
    environment.pop("NUMBA_CACHE_DIR", None)

    def run(out, distance):
        words = [sys.executable, str(tmp_path / "run.py"), str(tmp_path / out), str(distance)]
        return subprocess.run(words, env=environment, capture_output=True, text=True, check=True).stdout

    assert [run("a", 3), run("b", 3), run("c", 4.5)] == ["False\n"] * 3


@pytest.mark.skipif(os.name != "posix", reason="folders have locks on POSIX alone")
def test_of_processes_that_need_kernels_at_once_one_compiles_them(monkeypatch, tmp_path):
    compiled, both = [], Barrier(2)

    def compile_one(shot):
        compiled.append(shot)
        time.sleep(0.3)  # which leaves the other time to begin, too
        entries.save("digest/a.kernel", b"")

    def worker():
        both.wait()
        warm.compile_kernels(shot)

    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(warm, "_render", compile_one)
    monkeypatch.setattr(warm, "_names", lambda: {"digest/a.kernel"})
    shot = next(iter(plan(RECIPE).shots(unit_box)))
    with ThreadPoolExecutor(2) as workers:  # locks are those of open files: threads are to them as processes are
        for done in [workers.submit(worker) for _ in range(2)]:
            done.result()
    assert len(compiled) == 1
    assert warm.is_compiled(shot)


RECIPE = Recipe(models=[{"source": "zoo:chair"}], viewpoints={"azimuth": [0], "elevation": [20], "distance": 3})


def mark(**changes):
    recipe = Recipe.model_validate({**RECIPE.model_dump(mode="json", exclude_unset=True), **changes})
    return warm._mark(warm._small(next(iter(plan(recipe).shots(unit_box)))))


def test_a_mark_is_of_what_a_shot_uses_and_about_how_much_of_it():
    assert mark(seed=4, camera={"size": [64, 48]}) == mark()
    blurred = {"scene": {"effects": {"blur": 0.2}}}
    assert mark(**blurred) == mark(scene={"effects": {"blur": 0.7}})
    marks = [
        mark(),
        mark(**blurred),
        mark(scene={"effects": {"blur": 0.02}}),
        mark(engine={"name": "raster", "antialias": 1}),
        mark(engine={"name": "raster", "antialias": 4}),
        mark(channels=["rgb", "depth"]),
        mark(camera={"fov_deg": 50, "distortion": {"model": "brown_conrady", "coefficients": [-0.1, 0.02, 0, 0]}}),
    ]
    assert len(set(marks)) == len(marks)


def test_a_mark_is_void_when_a_source_changes_wherever_it_lies(tmp_path):
    (tmp_path / "one" / "inside").mkdir(parents=True)
    source = tmp_path / "one" / "inside" / "kernels.py"

    def digest(folder=tmp_path / "one"):
        package_digest.cache_clear()
        return package_digest(folder)

    source.write_text("x = 1")
    first = digest()
    os.utime(source, (1, 1))
    assert digest() == first
    shutil.copytree(tmp_path / "one", tmp_path / "other")
    assert digest(tmp_path / "other") == first
    source.write_text("x = 2")
    second = digest()
    source.rename(tmp_path / "one" / "kernels.py")
    assert len({first, second, digest()}) == 3


def test_a_mark_is_void_when_a_kernel_is_gone(tmp_path, monkeypatch):
    shot = next(iter(plan(RECIPE).shots(unit_box)))
    rendered, names = [], {"digest/a.kernel", "digest/b.kernel"}

    def render(small):
        rendered.append(small)
        for name in names:
            entries.save(name, b"")

    monkeypatch.setenv("VIEWSPHERE_CACHE", str(tmp_path))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setattr(warm, "_render", render)
    monkeypatch.setattr(warm, "_names", lambda: names)
    warm.compile_kernels(shot)
    warm.compile_kernels(shot)
    assert len(rendered) == 1
    (tmp_path / "kernels" / "digest" / "b.kernel").unlink()
    warm.compile_kernels(shot)
    warm.compile_kernels(shot)
    assert len(rendered) == 2


@pytest.mark.slow
def test_a_mark_lists_kernels_of_this_process():
    decode_rle(2, 2, encode_rle(np.ones((2, 2), bool)))
    names = [name for name in warm._names() if "/kernels_mask." in name]
    assert names and all(map(entries.has, names))
