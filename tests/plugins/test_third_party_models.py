"""Sources, families and places of other packages: a broken one is an error only where it is named; none changes pictures."""

from __future__ import annotations

import re
from contextlib import ExitStack

import pytest
from typer.testing import CliRunner

import viewsphere_zoo as zoo
from installed import example, installed
from scratch import scratch_cache
from small import small_recipe
from viewsphere import Recipe, plan
from viewsphere.assets.cache import load
from viewsphere.assets.metadata.stuff import stuff_of
from viewsphere.cli import doctor
from viewsphere.cli.commands import app
from viewsphere.cli.doctor import _downloads
from viewsphere.cli.next_step import for_command
from viewsphere.errors import PluginError, RecipeError, UserError
from viewsphere.model.annotations.keypoints import At
from viewsphere.model.model_spec import ModelSpec
from viewsphere.planning.models import model_specs
from viewsphere.plugins import gap
from viewsphere.plugins.family import ZooFamily
from viewsphere.plugins.source import family_of, model_for, place_names, sources, with_roads
from viewsphere.run.reports.plugin_list import overview

SOURCE = """
from viewsphere.plugins.source import SourceModel, SourceSpec

def fail(*_):
    raise ValueError("no library")

SOURCE = SourceSpec(names={names}, expand=lambda name: (SourceModel(name),), load={load}, credit=lambda model: None, {more})
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
    assert "zoo" in sources() and "zoo:town" in place_names()
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
    assert "zoo" in sources() and [*sources()][-1] == "acme"
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


WALKER = """
import numpy as np
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.families.person import FAMILY as PERSON

FAMILY = ZooFamily(random=lambda rng: PERSON.random(np.random.default_rng(2)), home="street", clips=PERSON.clips)
"""


def spec_of(source):
    return ModelSpec(key="a", source=source, seed=1, category="a", category_id=1)


@pytest.mark.slow
def test_files_of_a_moving_family_of_another_package_are_not_kept_in_the_cache(install, monkeypatch, tmp_path):
    scratch_cache(monkeypatch, tmp_path / "cache")
    install("families", "walker", WALKER)
    file = zoo.file_of(spec_of("zoo:walker"))
    assert file is not None and file.stat().st_size > 0 and zoo.file_of(spec_of("zoo:walker")) == file
    assert not file.is_relative_to(tmp_path / "cache") and not list(tmp_path.glob("cache/**/walker*"))


PEG = example("Pegs that stand on a foot.")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("random=peg_random", "random=lambda rng: 3", r"ZooFamily\.random: expected a function that returns a Mesh; found int"),
        (
            "random=peg_random",
            "clips=('nod',), random=peg_random",
            r"ZooFamily\.random: expected a function that returns a RiggedModel; found Mesh",
        ),
    ],
    ids=["random", "clips"],
)
def test_a_family_that_makes_no_model_is_an_error_of_its_file(install, old, new, message):
    file = install("families", "peg", PEG.replace(old, new))
    with pytest.raises(PluginError, match=f"^{re.escape(str(file))}: {message}"):
        load(spec_of("zoo:peg"))


def test_the_lines_of_a_skeleton_join_named_points():
    def made(**more):
        return ZooFamily(random=len, home="table", keypoints={"top": At("a", (0, 0, 1)), "low": At("a", (0, 0, 0))}, **more)

    assert made(skeleton=(("top", "low"),)).skeleton == (("top", "low"),)
    with pytest.raises(PluginError, match=r"^ZooFamily\.skeleton: 'lo' is unknown; did you mean 'low'\? Valid: top, low$"):
        made(skeleton=(("top", "lo"),))


@pytest.mark.parametrize(
    ("code", "message"),
    [
        (source(), r"SourceSpec\.load: expected a function that returns a Mesh or a Path; found int, for acme"),
        (
            source(more="family=lambda name: 3"),
            r"SourceSpec\.family: expected .* returns a ZooFamily or None; found int, for acme",
        ),
        (
            source().replace("(SourceModel(name),)", "name"),
            r"SourceSpec\.expand: expected a function that returns a tuple; found str, for acme",
        ),
    ],
    ids=["load", "family", "expand"],
)
def test_a_source_that_returns_another_type_is_an_error_of_its_file(install, code, message):
    file = install("sources", "acme", code)
    with pytest.raises(PluginError, match=f"^{re.escape(str(file))}: {message}"):
        for spec in model_specs(small_recipe(models=[{"source": "acme:a"}])):
            family_of(spec.source)
            load(spec)


GAP = "found no families, places of viewsphere's own: install viewsphere again (scripts/setup in a clone)"


@pytest.fixture
def stale(monkeypatch, tmp_path):
    """An installation as before viewsphere had entry points: a clone was updated, and not installed again."""
    about = tmp_path / "stale" / "viewsphere-0.0.dist-info"
    about.mkdir(parents=True)
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: viewsphere\nVersion: 0.0\n")
    (about / "entry_points.txt").touch()
    monkeypatch.syspath_prepend(str(tmp_path / "stale"))
    monkeypatch.chdir(tmp_path)


@pytest.mark.usefixtures("stale")
def test_messages_of_an_installation_that_lacks_sources_name_the_mistake_and_the_remedy(tmp_path):
    (tmp_path / "a.obj").write_text("v 0 0 0\nv .1 0 0\nv 0 .1 0\nf 1 2 3\n")
    for models, scene, message in (
        ([{"source": "no.obj", "category": "a"}], {}, "expected a file, folder, pattern or a source's model; found no"),
        (
            [{"source": "a.obj", "category": "a"}],
            {"place": "zoo:town"},
            "scene.place: expected a place or a model file; found none at",
        ),
        ([{"source": "zoo:car"}], {}, "expected a category, such as car; found none"),
    ):
        with pytest.raises(RecipeError, match=f"{message}.*{re.escape(GAP)}"):
            plan(Recipe(models=models, viewpoints={"distance": 4}, scene=scene))
    with pytest.raises(UserError, match=re.escape(f"expected a source with a model as table; {GAP}")):
        model_for("table")
    assert for_command("inspect").endswith("viewsphere inspect a.obj")


@pytest.mark.usefixtures("stale")
def test_viewsphere_plugins_names_what_an_installation_lacks():
    assert {(found.kind, found.name) for found in overview() if found.error == GAP} == {
        (kind, "(all)") for kind in ("families", "places")
    }


@pytest.mark.slow
@pytest.mark.usefixtures("stale")
def test_commands_work_where_an_installation_lacks_sources(monkeypatch, tmp_path):
    (tmp_path / "a.obj").write_text("v 0 0 0\nv .1 0 0\nv 0 .1 0\nf 1 2 3\n")
    run = CliRunner().invoke(app, ["inspect", "a.obj"])
    assert run.exit_code == 0 and "symmetries" in run.stdout, run.output
    blender = {"python": None, "problem": "none", "devices": [], "graphics": None, "install": None}
    monkeypatch.setattr(doctor, "_blender", lambda: blender)
    run = CliRunner().invoke(app, ["doctor"])
    assert run.exit_code == 0 and f"plug-ins     {GAP}\n" in run.stdout and "not measured: it needs a model" in run.stdout
    run = CliRunner().invoke(app, ["doctor", "--setup", "people"])
    assert run.exit_code and GAP in str(run.exception)


def test_an_installation_that_is_whole_lacks_nothing(install):
    install("families", "acme", "1 / 0")
    assert gap() == "" and not any(found.name == "(all)" for found in overview())
