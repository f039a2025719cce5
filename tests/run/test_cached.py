"""Data sets have the same bytes with a cold cache, a warm one, a damaged one, and none."""

import pytest

from scratch import scratch_cache
from small import small_recipe, tree_hash
from viewsphere.assets.exporting import export
from viewsphere.caches import budget
from viewsphere.engines.raster.indirect import bounces
from viewsphere.run.generate import generate
from viewsphere.run.shots import models

SKY = {"daylight": {"turbidity": 2.5}}
ROOM = {
    "models": [{"source": "zoo:chair", "category": "chair", "scale": {"length": 0.3}}],
    "viewpoints": {"azimuth": [30], "elevation": [20], "distance": 1.0},
    "camera": {"size": [48, 32], "fov_deg": 40},
    "engine": {"name": "raster", "bounces": "on"},
    "scene": {"sky": SKY, "sun": {"azimuth": 75, "elevation": 42}, "ground": True},
    "channels": ["rgb", "depth", "instances"],
    "formats": ["native"],
}


PERSON = {"source": "zoo:person", "category": "person", "scale": {"length": 0.3}, "frames": [1, 5]}


@pytest.mark.parametrize("is_moving", [False, True])
@pytest.mark.slow
def test_exports_of_models_are_written_once_and_equal(is_moving, tmp_path, monkeypatch):
    scratch_cache(monkeypatch, tmp_path / "cache")
    written, write, changes = [], models.export_obj, {"models": [PERSON]} if is_moving else {}
    for module in (models, export):
        monkeypatch.setattr(module, "export_obj", lambda *given: written.append(given) or write(*given))

    def made(name):
        written.clear()
        recipe = small_recipe(viewpoints={"azimuth": [0], "elevation": [15], "distance": 1.0}, **changes)
        generate(recipe, tmp_path / name, workers=0)
        return tree_hash(tmp_path / name), len(written)

    cold, count = made("cold")
    assert count == (3 if is_moving else 2)  # the poses of both frames and at rest, or two models
    assert made("warm") == (cold, 0)
    monkeypatch.setenv("VIEWSPHERE_CACHE", str(tmp_path / "a file"))
    (tmp_path / "a file").touch()
    assert made("without") == (cold, count)


@pytest.fixture
def rendered(tmp_path, monkeypatch):
    """Renders the room as a new process would, and counts how often its light is baked."""
    baked = []
    bake = bounces._baked
    monkeypatch.setattr(bounces, "_baked", lambda lighting: baked.append(1) or bake(lighting))

    def render(name):
        for kept in (bounces._bake, bounces._look, bounces.tree_of_scene):
            kept.cache_clear()
        baked.clear()
        generate(small_recipe(**ROOM), tmp_path / name, workers=0)
        return tree_hash(tmp_path / name), len(baked)

    return render


@pytest.mark.slow
def test_the_cache_changes_no_byte(rendered, tmp_path, monkeypatch):
    scratch_cache(monkeypatch, tmp_path / "cache")
    cold, times = rendered("cold")
    assert times >= 1  # one more where kernels are compiled first, for which a tiny scene is baked
    kinds = {entry.kind for entry in budget.entries()}
    assert kinds >= {"exports", "light", "zoo"}
    assert rendered("warm") == (cold, 0)
    for entry in budget.entries(("exports", "light", "zoo")):
        whole = bytearray(entry.file.read_bytes())
        whole[len(whole) // 2] ^= 4
        entry.file.write_bytes(whole)
    found, times = rendered("damaged")
    assert found == cold and times >= 1  # as for cold
    assert rendered("mended") == (cold, 0)
    budget.clear()
    monkeypatch.setenv("VIEWSPHERE_CACHE_LIMIT", "1")
    assert rendered("without") == (cold, 1)
    assert not [*budget.entries()]
