"""Short work hires no worker; long work, and work of unknown length, one a core."""

import pytest

import viewsphere as vs
from command_line import viewsphere
from small import small_recipe
from viewsphere.planning.extension import whole
from viewsphere.run.executors.local import LocalPool
from viewsphere.run.missing import Missing
from viewsphere.run.workers import worker_count as crew_size
from viewsphere.run.workers.worker_count import default_workers
from viewsphere.store import Store

CIRCLE = {"azimuth": {"start": 0, "stop": 360, "step": 5}, "elevation": [0, 20, 40], "distance": 1.0}
ONE = {"azimuth": [0], "elevation": [15], "distance": 1.0}
POST_BOX = {"source": "zoo:post_box", "category": "post box"}


@pytest.fixture(autouse=True)
def four_cores(monkeypatch):
    monkeypatch.setattr(crew_size, "cores", lambda: 4)


def workers_for(recipe, out):
    return default_workers(Missing(whole(vs.plan(recipe)), Store(out)))


def one_post_box(**changes):
    return small_recipe(models=[POST_BOX], viewpoints=ONE, **changes)


@pytest.mark.parametrize(
    ("recipe", "workers"),
    [
        (small_recipe(), 0),
        (small_recipe(viewpoints=CIRCLE), 4),
        (small_recipe(viewpoints=CIRCLE, camera={"size": [16, 16]}, shot_frames=216), 4),
        (small_recipe(models=[POST_BOX | {"count": 7}], viewpoints=ONE, camera={"size": [16, 16]}), 0),
        (small_recipe(models=[POST_BOX | {"count": 40}], viewpoints=ONE, camera={"size": [16, 16]}), 4),
        (small_recipe(camera={"size": [8192, 8192]}), 4),
        (one_post_box(camera={"size": [8192, 8192]}), 0),
        (small_recipe(engine={"name": "cycles"}), 4),
        (one_post_box(engine={"name": "cycles"}), 0),
        (small_recipe(scene={"place": "zoo:neighbourhood"}), 4),
    ],
)
def test_workers_of_an_empty_folder(recipe, workers, tmp_path):
    assert workers_for(recipe, tmp_path) == workers


def test_a_file_counts_by_its_size(tmp_path):
    for name in "ab":
        with (tmp_path / f"{name}.glb").open("wb") as file:
            file.truncate(40_000_000)
    two = [{"source": f"{tmp_path}/{name}.glb", "category": "car"} for name in "ab"]
    assert workers_for(small_recipe(models=two[:1], viewpoints=ONE), tmp_path / "out") == 0
    assert workers_for(small_recipe(models=two, viewpoints=ONE), tmp_path / "out") == 4


def test_finished_shots_and_models_do_not_count(tmp_path):
    recipe = small_recipe(viewpoints=CIRCLE, camera={"size": [16, 16]}, channels=["depth"], formats=[], shot_frames=216)
    assert workers_for(recipe, tmp_path) == 4
    vs.generate(recipe, tmp_path)
    assert workers_for(recipe, tmp_path) == 0


@pytest.fixture
def pool_sizes(monkeypatch):
    """The number of workers of each pool of the process at its end."""
    counts, dismiss = [], LocalPool._dismiss
    monkeypatch.setattr(LocalPool, "_dismiss", lambda pool: (counts.append(len(pool._pool)), dismiss(pool)))
    return counts


def test_render_hires_nobody_for_one_picture_unless_told_to(pool_sizes, tmp_path):
    recipe = tmp_path / "one.yaml"
    recipe.write_text(one_post_box(channels=["depth"], formats=[]).to_yaml(), "utf-8")
    assert viewsphere("render", recipe, "-o", tmp_path / "a").returncode == 0
    assert viewsphere("render", recipe, "-o", tmp_path / "a").returncode == 0
    assert pool_sizes == [0, 0]
    assert viewsphere("render", recipe, "-o", tmp_path / "b", "--workers", 2).returncode == 0
    assert pool_sizes == [0, 0, 1]
