"""A data set does not get frames that the engine of another day painted."""

import shutil

import pytest

from small import small_recipe, tree_hash
from viewsphere.errors import RecipeError, StoreError
from viewsphere.planning.engine_digest import engine_digest
from viewsphere.planning.fitting import LOOK
from viewsphere.run.generate import generate
from viewsphere.store import Store
from viewsphere.store.shots.manifest import sealed, unsealed

RECIPE = {"channels": ["rgb"], "formats": [], "shot_frames": 3}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    out = tmp_path_factory.mktemp("whole") / "out"
    generate(small_recipe(**RECIPE), out)
    return out


@pytest.fixture
def finished(whole, tmp_path):
    return shutil.copytree(whole, tmp_path / "out")


@pytest.fixture
def half(finished):
    """A data set that lacks a shot."""
    store = Store(finished)
    shutil.rmtree(store.shot_folder(list(store.plan().rows)[-1].key))
    return finished


def painted_by(out, look):
    """Let the data set say that its pictures have another look; None: that it says nothing."""
    file = Store(out).plan_file
    value = unsealed(file.read_text())
    for part in value["parts"]:
        part["settings"].pop(LOOK)
        if look is not None:
            part["settings"][LOOK] = look
    file.write_text(sealed(value))


def test_it_is_of_the_sources():
    assert len(engine_digest("raster")) == 16


def test_resuming_with_another_engine_is_refused_and_nothing_is_lost(half):
    painted_by(half, "0" * 16)
    before = tree_hash(half)
    with pytest.raises(
        StoreError, match="expected pictures as the raster engine that is installed paints them, found another's"
    ):
        generate(small_recipe(**RECIPE), half)
    assert tree_hash(half) == before


@pytest.mark.parametrize("look", [None, engine_digest("raster")])
def test_resuming_with_the_same_goes_on(half, look):
    painted_by(half, look)
    assert generate(small_recipe(**RECIPE), half).rendered == 3


def test_a_finished_data_set_is_exported_whatever_painted_it(finished):
    painted_by(finished, "0" * 16)
    assert generate(small_recipe(**RECIPE), finished, formats=["native"]).rendered == 0


def test_appending_with_another_engine_is_refused(finished):
    painted_by(finished, "0" * 16)
    more = small_recipe(**RECIPE, viewpoints={"azimuth": [0, 90, 120, 240], "elevation": [15, 50], "distance": 1.0})
    with pytest.raises(RecipeError, match="the engine's program: expected what the data set has; found another"):
        generate(more, finished, append=True)
