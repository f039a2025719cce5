"""Sources, families and places of other packages: a broken one is an error only where it is named; none changes pictures."""

from __future__ import annotations

from contextlib import ExitStack

import pytest

import viewsphere_zoo as zoo
from installed import example, installed
from small import small_recipe
from viewsphere import Recipe, plan
from viewsphere.assets.metadata.stuff import stuff_of
from viewsphere.cli.doctor import _downloads
from viewsphere.errors import PluginError, RecipeError, UserError
from viewsphere.planning.models import model_specs
from viewsphere.plugins.source import model_for, model_names, place_names, sources, with_roads

SOURCE = """
from viewsphere.plugins.source import SourceSpec

def fail(*_):
    raise ValueError("no library")

SOURCE = SourceSpec(names={names}, expand=lambda name: (name,), load={load}, credit=lambda model: None, {more})
"""


def source(names="lambda: ('a',)", load="lambda model: 7", more=""):
    return SOURCE.format(names=names, load=load, more=more)


FAILS = source(names="fail", more="family=fail, places=fail, place=fail")


@pytest.fixture
def install(tmp_path):
    """Installs a plug-in as a package of its own, until the test is over."""
    with ExitStack() as stack:
        yield lambda group, name, code: stack.enter_context(installed(tmp_path / "site", group, name, code))


@pytest.mark.parametrize("code", ["1 / 0", FAILS], ids=["import", "functions"])
def test_a_broken_source_is_an_error_only_where_it_is_named(install, code):
    install("sources", "acme", code)
    assert "zoo" in sources() and "zoo:car" in model_names() and "zoo:town" in place_names()
    assert [model_for(role) for role in ("example", "table", "box")] == ["zoo:car", "zoo:plain_table", "zoo:open_box"]
    assert stuff_of("Road.001", [""]) == stuff_of("road", [""]) and stuff_of("car", [""]) == stuff_of("car", ["any"])
    assert "people" in _downloads() and "zoo:town" in with_roads()
    assert plan(small_recipe()).frames
    with pytest.raises(RecipeError, match=r"expected a category.*did you mean 'zoo:car'"):
        Recipe(models=[{"source": "car"}])


def test_a_source_that_cannot_be_imported_is_named_by_who_uses_it(install):
    install("sources", "acme", "1 / 0")
    with pytest.raises(PluginError, match="plug-in acme cannot be imported: ZeroDivisionError"):
        plan(small_recipe(models=[{"source": "acme:a"}]))


def test_a_broken_family_of_the_name_of_a_category_changes_no_class(install):
    before = stuff_of("building", ["wall"])
    install("families", "building", "1 / 0")
    assert stuff_of("building", ["wall"]) == before


def test_models_that_viewsphere_itself_uses_stay_its_own(install):
    install("sources", "acme", source(more="roles={'example': 'a', 'table': 'a', 'box': 'a'}"))
    assert next(iter(sources())) == "zoo" and "acme" in sources()
    assert [model_for(role) for role in ("example", "table", "box")] == ["zoo:car", "zoo:plain_table", "zoo:open_box"]


def test_a_broken_place_does_not_hide_another_mistake(install):
    before = with_roads()
    install("places", "acme", "1 / 0")
    assert "zoo:acme" in place_names() and with_roads() == before
    with pytest.raises(UserError, match=r"`parked` needs a place with roads, and hall\.glb has none\. Use .*zoo:town"):
        small_recipe(scene={"place": {"source": "hall.glb", "parked": 0.5}})


@pytest.mark.parametrize("code", ["1 / 0", example("Pegs that stand on a foot.")], ids=["broken", "healthy"])
def test_any_family_is_one_that_is_shipped(install, code):
    alone = model_specs(small_recipe(models=[{"source": "zoo:any", "count": 4}]))
    install("families", "aardvark", code)
    assert "aardvark" in zoo.family_names() and "aardvark" not in zoo.things() and "car" in zoo.things()
    assert model_specs(small_recipe(models=[{"source": "zoo:any", "count": 4}])) == alone
