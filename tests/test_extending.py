"""The worked example of docs/extending.md is real: its code is taken from the page and run."""

import csv
import inspect
import json
import os
import pickle
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from importlib import metadata
from itertools import chain
from pathlib import Path

import numpy as np
import pytest
import yaml
from PIL import Image

import viewsphere_zoo as zoo
from deadline import DEADLINE
from installed import example, installed, write_package
from scratch import scratch_cache
from sealing import seal_again
from sequence_recipe import eventful_recipe
from small import small_recipe, tree_hash
from viewsphere import Dataset, Recipe, generate, labels, plan, plugins, render
from viewsphere.assets.inspect import describe
from viewsphere.assets.sandbox.client import READ_HERE
from viewsphere.check import check
from viewsphere.errors import ModelError, PluginError, RecipeError, UserError
from viewsphere.formats import coco
from viewsphere.labels import LabelSpec
from viewsphere.planning.models import model_specs
from viewsphere.plugins.format import FormatSpec
from viewsphere.rendering.effects import steps_of
from viewsphere.run.exports.exporting import export
from viewsphere.run.exports.writable import writable_formats
from viewsphere.run.reports import plugin_list
from viewsphere.run.reports.format_list import listed
from viewsphere.run.reports.plugin_list import overview
from viewsphere.store.shots.sample_records import from_whole_sample, whole_sample

PAGE = Path(__file__).parent.parent / "docs" / "extending.md"


EXAMPLES = {
    text.split(":")[0].split('"')[-1]: text for text in re.findall(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
}


@pytest.fixture
def install(tmp_path: Path) -> Iterator[Callable[[str, str, str], Path]]:
    """Installs a plug-in as a package of its own, until the test is over."""
    with ExitStack() as stack:
        yield lambda group, name, code: stack.enter_context(installed(tmp_path / "site", group, name, code))


@pytest.fixture
def csv_boxes(install: Callable[[str, str, str], Path]) -> None:
    install("formats", "csv_boxes", EXAMPLES["One row an object"])


def _forget_labels() -> None:
    for table in vars(labels).values():
        if hasattr(table, "cache_clear"):
            table.cache_clear()


@pytest.fixture
def labelled(install: Callable[[str, str, str], Path]) -> Iterator[Callable[[str, str], None]]:
    """Installs a label; the tables of labels are made again before and after."""

    def add(name: str, code: str) -> None:
        install("labels", name, code)
        _forget_labels()

    yield add
    _forget_labels()


@pytest.fixture
def shipped(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Callable[[str, str], None]]:
    """Puts a module of labels beside those of viewsphere; the tables of labels are made again before and after."""
    folder, added = tmp_path / "shipped", list[str]()
    folder.mkdir()
    monkeypatch.setattr(labels, "__path__", [*labels.__path__, str(folder)])

    def add(name: str, code: str) -> None:
        (folder / f"{name}.py").write_text(code)
        added.append(name)
        _forget_labels()

    yield add
    monkeypatch.undo()
    for name in added:
        sys.modules.pop(f"viewsphere.labels.{name}", None)
        vars(labels).pop(name, None)
    _forget_labels()


HIDDEN = EXAMPLES["hidden_next and hidden_previous"]


@pytest.mark.slow
def test_a_label_of_motion_after_tracks_in_the_alphabet_is_computed_again_from_its_own_instants(labelled, tmp_path):
    """Picking points at four instants writes over the triangles of the instants that labels before it have asked for."""
    code = HIDDEN.replace("hidden_", "unseen_")  # after `tracks` in the alphabet
    labelled("unseen_next unseen_previous", code)
    recipe = eventful_recipe(8, channels=["rgb", "flow", "unseen_next", "unseen_previous", "tracks"], formats=[])
    generate(recipe, tmp_path / "out")
    dataset = Dataset(tmp_path / "out")
    report = check(dataset)
    assert report.ok, report.findings
    assert report.checked["unseen_next"] == report.checked["tracks"] == len(dataset) > 0
    for sample in dataset:
        known = sample.channels["unseen_next"][np.isfinite(sample.flow[..., 0])]
        assert set(np.unique(known)) <= {0, 1}
    assert any(sample.channels[name].any() for sample in dataset for name in ("unseen_next", "unseen_previous"))


def test_a_label_of_pixels_is_one_file(labelled, tmp_path):
    labelled("borders", EXAMPLES["borders"])
    generate(small_recipe(channels=["rgb", "instances", "borders"], formats=[]), tmp_path / "out")
    dataset = Dataset(tmp_path / "out")
    for sample in dataset:
        assert sample.borders.dtype == np.int32
        across, down = (np.diff(sample.instances, axis=axis) != 0 for axis in (1, 0))
        assert np.array_equal(sample.borders[:-1, :-1] > 0, across[:-1] | down[:, :-1])
    report = check(dataset)
    assert report.ok, report.findings
    assert report.checked["borders"] == len(dataset) > 0


ASPECT = """
from viewsphere.labels import Field, ObjectLabel

def of_box(placement):
    low, high = placement.box.min(axis=0), placement.box.max(axis=0)
    return {"aspect": float((high - low)[2] / (high - low)[0])}

LABEL = ObjectLabel.from_placement(of_box, name="aspect", meaning="tall", fields=(Field("aspect", "height over width", float),))
"""


@pytest.mark.parametrize("way", ["labelled", "shipped"])
def test_a_label_of_objects_is_one_file(way, request, tmp_path):
    request.getfixturevalue(way)("aspect", ASPECT)
    generate(small_recipe(formats=[]), tmp_path / "out")
    sample = next(iter(render(small_recipe())))
    kept = Dataset(tmp_path / "out")[0]
    width, height, _ = sample.objects[0].size
    assert sample.objects[0].aspect == kept.objects[0].aspect == pytest.approx(height / width)
    assert kept.objects[0].extra == {"aspect": kept.objects[0].aspect}
    spelled = json.loads(json.dumps(whole_sample(kept)))
    assert from_whole_sample(spelled, kept.channels, kept.files).objects[0].aspect == kept.objects[0].aspect
    assert "aspect" not in (next((tmp_path / "out").rglob("frames.json"))).read_text()
    assert pickle.loads(pickle.dumps(kept.objects[0])).aspect == kept.objects[0].aspect
    with pytest.raises(AttributeError, match="no 'aspekt'"):
        _ = kept.objects[0].aspekt


def test_a_label_of_another_name_than_its_file_is_refused(labelled):
    labelled("other", EXAMPLES["borders"])
    assert "other" not in labels.labels() and "depth" in labels.labels()
    with pytest.raises(PluginError, match=r"LABEL\.name: expected 'other', the name of its file; found 'borders'"):
        plan(small_recipe(channels=["rgb", "other"]))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("encoding=", "encodin=", r"ChannelLabel\.encodin: 'encodin' is unknown; did you mean 'encoding'\?"),
        ("compute=compute", "compute='depth'", r"ChannelLabel\.compute: expected a function; found 'depth'"),
        ("compute=compute", "compute=max", r"ChannelLabel\.meaning: expected a value; found nothing"),
        ("    ids={},\n", "", r"ChannelLabel\.ids: label 'borders' holds whole numbers"),
        (
            "def compute(context)",
            "def compute(context, i)",
            r"ChannelLabel\.compute: expected a function of 1 value; found",
        ),
    ],
)
def test_a_faulty_label_is_refused_where_it_is_named_and_nowhere_else(labelled, old, new, message):
    code = EXAMPLES["borders"].replace(old, new)
    labelled("borders", code.replace("    meaning=", "    # meaning=") if new == "compute=max" else code)
    with pytest.raises(PluginError, match=message):
        plan(small_recipe(channels=["rgb", "borders"]))
    assert plan(small_recipe(channels=["rgb", "depth"])).frames


def test_a_channel_that_needs_its_neighbours_is_refused_for_still_pictures(labelled):
    code = EXAMPLES["borders"].replace("import ChannelLabel", "import ChannelLabel, Next, Previous")
    labelled("borders", code.replace("compute=compute,", "compute=compute, needs=(Previous(), Next()),"))
    with pytest.raises(RecipeError, match=r"channels\[1\]: expected time beside borders, .*; found none: set time"):
        plan(small_recipe(channels=["rgb", "borders"]))


def test_a_label_that_reads_a_view_without_listing_it_is_refused(labelled):
    """Else a run would compute it, and `check` could not: it gives labels no views that they do not need."""
    labelled("hidden_next hidden_previous", HIDDEN.replace("needs=(other,)", "needs=(Previous(),)"))
    recipe = eventful_recipe(8, channels=["rgb", "hidden_next"], formats=[])
    with pytest.raises(
        PluginError, match=r"label hidden_next: `compute` reads Next\(instants=1\), which `needs` does not list"
    ):
        next(iter(render(recipe)))


EDGES = """
import numpy as np
from viewsphere.labels import ChannelLabel, by_table

def _label(name, axis):
    def compute(context):
        ids, out = context.instances.ids, context.empty(np.int32)
        out[...] = 0
        before, after = (np.take(ids, range(*ends, 1), axis) for ends in ((0, ids.shape[axis] - 1), (1, ids.shape[axis])))
        np.moveaxis(out, axis, 0)[:-1] = np.moveaxis(np.where(before != after, before, 0), axis, 0)
        return out

    return ChannelLabel(
        name=name, meaning="ids before a border", dtype=np.int32, encoding="png16", ids={"object": by_table}, compute=compute
    )

LABELS = (_label("edges_down", 0), _label("edges_across", axis=1))
"""
TWINS = "edges_down edges_across"


def _has_edges(folder: Path) -> None:
    generate(small_recipe(channels=["rgb", "instances", *TWINS.split()], formats=[]), folder)
    dataset = Dataset(folder)
    for sample in dataset:
        for name, axis in zip(TWINS.split(), (0, 1), strict=True):
            differ = np.diff(sample.instances, axis=axis) != 0
            kept = np.take(sample.channels[name], range(differ.shape[axis]), axis)
            assert np.array_equal(kept > 0, differ & (np.take(sample.instances, range(differ.shape[axis]), axis) > 0))
    report = check(dataset)
    assert report.ok, report.findings
    assert all(report.checked[name] == len(dataset) > 0 for name in TWINS.split())


def test_several_labels_are_one_file_with_an_entry_point_each(labelled, tmp_path):
    labelled(TWINS, EDGES)
    _has_edges(tmp_path / "out")


def test_several_labels_are_one_file_of_the_package_and_are_listed_without_import(shipped, tmp_path):
    shipped("edges", EDGES)
    assert set(TWINS.split()) < set(plugins.names("labels")) and "edges" not in plugins.names("labels")
    assert "viewsphere.labels.edges" not in sys.modules
    _has_edges(tmp_path / "out")


@pytest.mark.parametrize(
    ("points", "code", "message"),
    [
        ("edges_down", EDGES, "LABELS: expected the names edges_down, each once, .*; found edges_down, edges_across"),
        (
            f"{TWINS} edges",
            EDGES,
            "LABELS: expected the names edges, edges_across, edges_down, .*; found",
        ),
        (TWINS, EDGES.replace('"edges_across"', '"edges_down"'), "LABELS: .*; found edges_down, edges_down"),
        (TWINS, EDGES.replace("(_label(", "[_label(").replace("=1))", "=1)]"), r"LABELS\[0\]: expected a LabelSpec in a tuple"),
        (
            TWINS,
            EDGES.replace('_label("edges_down", 0)', '"edges_down"'),
            r"LABELS\[0\]: expected a LabelSpec in a tuple",
        ),
    ],
)
def test_labels_of_a_file_that_are_not_those_of_its_entry_points_are_refused(labelled, points, code, message):
    labelled(points, code)
    with pytest.raises(PluginError, match=message):
        plan(small_recipe(channels=["rgb", "edges_down"]))


@pytest.mark.parametrize(
    ("code", "message"),
    [
        (EDGES.replace('_label("edges_down", 0)', "_label(NAME, 0)"), "expected a tuple of calls, each with its name as text"),
        (EDGES.replace("LABELS = ", "NAME = 'edges'\nLABELS = EDGES = "), ""),
    ],
)
def test_names_of_shipped_labels_stand_in_the_text(shipped, code, message):
    shipped("edges", code)
    if message:
        with pytest.raises(PluginError, match=message):
            plugins.names("labels")
    else:
        assert set(TWINS.split()) < set(plugins.names("labels"))


def test_an_engine_is_one_file(install):
    install("engines", "flat", EXAMPLES["flat"])
    recipe = small_recipe(engine="flat", channels=["rgb", "rgba", "depth", "instances"], formats=[])
    plain = {sample.index: sample for sample in render(small_recipe(channels=["rgb", "depth", "instances"], formats=[]))}
    for sample in render(recipe):
        seen = sample.instances > 0
        assert len(np.unique(sample.rgb[seen], axis=0)) == 1 and (sample.rgb[seen] != sample.rgb[~seen][0]).any(axis=1).all()
        assert np.array_equal(sample.channels["rgba"][..., 3] > 0, seen)
        assert np.array_equal(sample.depth, plain[sample.index].depth)
    with pytest.raises(UserError, match="engine: flat has no options; found gloss"):
        next(iter(render(small_recipe(engine={"name": "flat", "gloss": 1}, formats=[]))))


def test_an_engine_whose_program_does_not_exist_is_refused_by_name(install):
    code = EXAMPLES["flat"].replace("stage=Flat)", "stage=Flat, programs=(__import__('pathlib').Path('gone'),))")
    install("engines", "flat", code)
    with pytest.raises(PluginError, match=r"EngineSpec\.programs: expected files and folders that exist; found gone"):
        plan(small_recipe(engine="flat", formats=[]))


def test_a_stage_that_lacks_a_method_is_refused_by_name(install):
    install("engines", "flat", EXAMPLES["flat"].replace("def paint(", "def color("))
    with pytest.raises(PluginError, match=r"EngineSpec\.stage: expected a stage with at, paint, for_shot; found no paint"):
        next(iter(render(small_recipe(engine="flat", formats=[]))))


GROUPS = {
    "csv_boxes": ("formats", "One row an object"),
    "lines": ("formats", "One JSON line a picture"),
    "borders": ("labels", "borders"),
    "hidden_next hidden_previous": ("labels", "hidden_next and hidden_previous"),
    "flat": ("engines", "flat"),
    "circle": ("placers", "In a circle around the middle, all facing it; where the circle begins is drawn."),
    "bounce": ("motions", "Falls from a height, and bounces."),
    "pairs": ("samplers", "Every model beside the next one, from all poses."),
    "division": ("lenses", "division"),
    "dots": ("materials", "dots"),
    "tri": ("readers", "Triangles as text"),
    "ring": ("lights", "ring"),
    "hot_pixels": ("effects", "hot_pixels"),
    "parts": ("sources", "Our library of parts"),
    "peg": ("families", "Pegs that stand on a foot."),
    "pegs": ("places", "A pair of pegs on an empty floor."),
    "swing": ("trajectories", "swing"),
}
"""The plug-ins of the page: their groups, and how their examples begin."""

INSTALLED = """
models: [{source: "zoo:peg", count: 3}, {source: "parts/*.tri", category: part}, {source: "zoo:box", category: box}]
viewpoints: {azimuth: [0, 40], elevation: 20, distance: 2}
camera: {size: [96, 72], fov_deg: 40, distortion: {model: division, k: -0.3}}
scene: {ground: {material: dots}, lights: {kind: ring, position: [0, 0, 1], strength: 4}, effects: {hot_pixels: [0.1, 1]}}
channels: [rgb, instances, borders]
formats: [csv_boxes, lines]
splits: {by: frame, train: 1}
"""
RECIPES = {
    "still": "engine: flat\nscenes: {count: 2, objects: 3, layout: circle}\n",
    "pairs": "scenes: {sampler: pairs, gap: 0.2}\n",
    "moving": "time: {frames: 2, fps: 10}\nscenes: {count: 1, objects: 2}\n",
}


@pytest.mark.slow
def test_the_page_s_plug_ins_work_in_a_package_that_is_installed(tmp_path):
    """Written as pip writes it: modules, and metadata with entry points; then used by the command line."""
    site = tmp_path / "site"
    write_package(site, "my_package", {(group, name): example(begins) for name, (group, begins) in GROUPS.items()})
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "a.tri").write_text(TETRAHEDRON.replace("1", "0.2"))
    for name, more in RECIPES.items():
        moves = ", motion: {kind: bounce, height: 1}}]" if name == "moving" else "}]"
        text = INSTALLED.replace("}]", moves, 1)
        if name == "moving":
            text = text.replace("viewpoints: {azimuth: [0, 40], elevation: 20, ", "viewpoints: {kind: swing, ")
            text = text.replace("borders]", "borders, hidden_next, hidden_previous]")
        (tmp_path / f"{name}.yaml").write_text(text + more)
        for words in (("render", f"{name}.yaml", "-o", name, "--workers", "0"), ("check", name, "--workers", "0")):
            run = subprocess.run(
                [sys.executable, "-m", "viewsphere", *words],
                cwd=tmp_path,
                env=os.environ | {"PYTHONPATH": os.pathsep.join([str(site), os.environ.get("PYTHONPATH", "")])},
                capture_output=True,
                text=True,
                timeout=DEADLINE,
            )
            assert run.returncode == 0, run.stdout + run.stderr
        assert (tmp_path / name / "csv_boxes" / "boxes.csv").stat().st_size > 60
        assert len(Dataset(tmp_path / name)) > 0


BOLT = "v 0 0 0\nv .1 0 0\nv 0 .1 0\nv 0 0 .1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


@pytest.fixture
def parts(install, monkeypatch, tmp_path):
    """A library of two parts, and the source that finds them."""
    for name in ("bolt", "nut"):
        (tmp_path / f"{name}.obj").write_text(BOLT)
    monkeypatch.setenv("PARTS", str(tmp_path))
    install("sources", "parts", EXAMPLES["Our library of parts"])


def parts_recipe(source):
    return small_recipe(models=[{"source": source}], channels=["rgb", "instances"], formats=[])


@pytest.mark.usefixtures("parts")
def test_a_source_of_models_is_one_file(tmp_path):
    recipe = parts_recipe("parts:*")
    assert [(spec.key, spec.category, spec.seed) for spec in model_specs(recipe)] == [
        ("bolt", "bolt", None),
        ("nut", "nut", None),
    ]
    generate(recipe, tmp_path / "out")
    dataset = Dataset(tmp_path / "out")
    assert {sample.objects[0].category for sample in dataset} == {"bolt", "nut"}
    assert dataset.store.model_info("bolt").credit.licence == "CC0-1.0"
    report = check(dataset)
    assert report.ok, report.findings
    with pytest.raises(RecipeError, match=r"models\[0\]\.source: parts: expected a part, such as bolt; found 'screw'"):
        plan(parts_recipe("parts:screw"))


@pytest.mark.usefixtures("parts")
def test_a_part_that_changed_is_found(tmp_path):
    generate(parts_recipe("parts:bolt"), tmp_path / "out")
    (tmp_path / "bolt.obj").write_text(BOLT.replace("v .1 0 0", "v .2 0 0"))
    with pytest.raises(UserError, match=r"model 'bolt' \(parts:bolt\) changed since this data set was begun"):
        generate(parts_recipe("parts:*"), tmp_path / "out", append=True)


PEG = example("Pegs that stand on a foot.")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("home=", "hom=", r"ZooFamily\.hom: 'hom' is unknown; did you mean 'home'\?"),
        ('home="table"', 'home="tabel"', r"ZooFamily\.home: 'tabel' is unknown; did you mean 'table'\?"),
        (
            '"household item"',
            '"houshold item"',
            r"ZooFamily\.classes: 'houshold item' is unknown; did you mean",
        ),
        ('{"": "household item"}', '{"stem": "pole"}', r"ZooFamily\.classes: expected the class of all other parts"),
        ("random=peg_random,\n", "", r"ZooFamily\.random: expected a value; found nothing"),
        ("random=peg_random", "random=lambda: None", r"ZooFamily\.random: expected a function of 1 value; found"),
        (
            "random=peg_random",
            "random=peg_random, rooms=len",
            r"ZooFamily\.draw: expected a function, whose parameters rooms takes",
        ),
    ],
)
def test_a_faulty_family_is_refused_where_it_is_named_and_nowhere_else(install, old, new, message):
    file = install("families", "peg", PEG.replace(old, new))
    with pytest.raises(PluginError, match=f"^{re.escape(str(file))}: {message}"):
        zoo.family("peg")
    assert "car" in zoo.family_names()
    assert plan(small_recipe()).frames


def test_a_package_of_plug_ins_is_listed_and_one_that_is_broken_breaks_nothing_else(tmp_path, monkeypatch):
    for name, code in (("good", ""), ("bad", "1 / 0")):
        site = tmp_path / name
        folder = write_package(site, f"{name}_families", {("packages", "families"): ""})
        (folder / "families.py").rename(folder / "peg.py")
        (folder / "peg.py").write_text(example("Pegs that stand on a foot."))
        (folder / "__init__.py").write_text(code)
        entry = site / f"{name}_families-1.0.dist-info" / "entry_points.txt"
        entry.write_text(f"[viewsphere.packages]\nfamilies = {name}_families\n")
        monkeypatch.syspath_prepend(str(site))
    assert {"peg", "car", "bad_families"} <= set(plugins.names("families"))
    assert plugins.is_third_party("families", "peg") and not plugins.is_third_party("families", "car")
    assert zoo.build("peg", np.random.default_rng(0)).parts == ("foot", "stem")
    with pytest.raises(PluginError, match="bad_families cannot be imported: ZeroDivisionError"):
        zoo.family("bad_families")


def write_packages(site: Path, package: str, entries: str, **modules: str) -> None:
    """Write a distribution with these modules, named by entry points of the group of packages."""
    folder = write_package(site, package, {("packages", name): code for name, code in modules.items()})
    entry = folder.parent / f"{package}-1.0.dist-info" / "entry_points.txt"
    entry.write_text(f"[viewsphere.packages]\n{entries}\n")


@pytest.mark.parametrize(
    ("code", "error"),
    [
        ("LABELS = (\n  oops oops", "plug-in lab cannot be imported: SyntaxError"),
        ("LABELS = make()", "plug-in lab cannot be imported: NameError"),
        ("def make():\n    return ()\n\n\nLABELS = make()", "LABELS: expected a tuple of calls, each with its name as text"),
        ("TEXT = '''\nLABELS = (oops oops)\n'''", "LABELS: cannot be read: "),
    ],
)
def test_labels_of_a_package_whose_names_cannot_be_read_break_nothing_else(code, error, tmp_path, monkeypatch):
    package = f"odd_labels_{len(code)}"
    write_packages(tmp_path, package, f"labels = {package}", lab=code)
    monkeypatch.syspath_prepend(str(tmp_path))
    assert {"lab", "depth"} < set(plugins.names("labels"))
    assert plan(small_recipe()).frames
    with pytest.raises(PluginError, match=f"^{re.escape(str(tmp_path / package / 'lab.py'))}: {error}"):
        plugins.load(LabelSpec, "lab")


def test_several_labels_are_one_file_of_a_package(tmp_path, monkeypatch):
    write_packages(tmp_path, "edge_labels", "labels = edge_labels", edges=EDGES)
    monkeypatch.syspath_prepend(str(tmp_path))
    assert {plugins.load(LabelSpec, name).name for name in TWINS.split()} == set(TWINS.split())


def test_a_package_of_a_kind_that_there_is_not_is_listed_with_the_one_that_was_meant(tmp_path, monkeypatch):
    write_packages(tmp_path, "odd_kinds", "family = odd_kinds")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(plugin_list, "names", lambda _kind: ())
    (found,) = overview()
    assert (found.kind, found.name, found.distribution) == ("viewsphere.packages", "odd_kinds", "odd_kinds 1.0")
    assert found.error.startswith("viewsphere.packages: 'family' is unknown; did you mean 'families'? Valid: ")
    assert ", families," in found.error


@pytest.mark.slow
def test_a_family_of_the_zoo_is_one_file_and_so_is_a_place(install, monkeypatch, tmp_path):
    scratch_cache(monkeypatch, tmp_path / "cache")
    for name in ("peg", "pegs"):
        install(GROUPS[name][0], name, example(GROUPS[name][1]))
    recipe = small_recipe(
        models=[{"source": "zoo:peg", "count": 2}],
        viewpoints={"azimuth": 0, "elevation": 10, "distance": 0.6},
        channels=["rgb", "instances"],
        formats=[],
        scene={"place": "zoo:pegs"},
    )
    samples = list(render(recipe))
    assert len({sample.objects[0].model for sample in samples}) == len(samples) == 2
    for sample in samples:
        seen = sample.objects[0]
        assert seen.category == "peg" and 0.08 <= seen.size[1] <= 0.16
        assert (sample.instances == seen.id).sum() > 20
    peg = zoo.family("peg")
    model = inspect.getmodule(peg.random).peg()
    assert peg.home == "table" and model.parts == ("foot", "stem") and model.vertices[:, 2].min() == 0
    a, b, c = np.moveaxis(model.vertices[model.triangles].astype(float), 1, 0)
    solid = np.pi * (0.03**2 * 0.012 + 0.01**2 * 0.108)
    assert (a * np.cross(b, c)).sum() / 6 == pytest.approx(solid, rel=0.02)  # outside is outside


def test_every_example_of_the_page_is_used():
    begins = [*(begins for _, begins in GROUPS.values()), "The same table", "barrel"]
    assert all(any(code.startswith(f'"""{one}') for one in begins) for code in EXAMPLES.values())


def test_a_material_is_one_file(install):
    install("materials", "dots", EXAMPLES["dots"])
    assert "dots" in plugins.names("materials")
    scene = {"ground": {"material": "dots"}, "materials": [{"texture": "dots"}]}
    dotted, plain = (next(iter(render(small_recipe(scene=own)))) for own in (scene, {"ground": "on"}))
    assert np.array_equal(dotted.instances, plain.instances)
    for seen in (dotted.instances > 0, dotted.instances == 0):
        assert np.abs(dotted.rgb[seen].astype(int) - plain.rgb[seen]).mean() > 5


@pytest.mark.usefixtures("csv_boxes")
def test_a_format_is_one_file(small_dataset, tmp_path):
    assert "csv_boxes" in plugins.names("formats")
    export(small_dataset.root, ["csv_boxes"])
    folder = small_dataset.root / "csv_boxes"
    with (folder / "boxes.csv").open() as file:
        rows = list(csv.DictReader(file))
    seen = [(s, o) for s in small_dataset for o in s.objects if o.box2d is not None]
    assert len(rows) == len(seen) > 0
    for row, (sample, o) in zip(rows, seen, strict=True):
        assert tuple(float(row[k]) for k in ("x0", "y0", "x1", "y1")) == o.box2d
        assert row["category"] == o.category
        assert np.array_equal(np.asarray(Image.open(folder / row["image"])), sample.rgb)


def test_a_format_may_prepare_its_samples(small_dataset, tmp_path):
    for begins in ("One row an object", "The same table"):
        with installed(tmp_path / "site", "formats", "csv_boxes", EXAMPLES[begins]):
            export(small_dataset.root, ["csv_boxes"], output=tmp_path / begins)
    assert len(list((tmp_path / "The same table").rglob("*.png"))) == len(small_dataset)
    assert tree_hash(tmp_path / "The same table") == tree_hash(tmp_path / "One row an object")


@pytest.mark.slow
def test_a_format_may_be_a_tree(small_dataset, install):
    install("formats", "lines", EXAMPLES["One JSON line a picture"])
    export(small_dataset.root, ["lines"])
    folder = small_dataset.root / "lines"
    lines = [
        json.loads(line) for split in small_dataset.splits for line in (folder / f"{split}.jsonl").read_text().splitlines()
    ]
    assert len(lines) == len(small_dataset)
    by_image = {line["image"]: line["boxes"] for line in lines}
    for sample in small_dataset:
        boxes = by_image[f"{sample.split}/{sample.index:08d}.png"]
        assert boxes == [{"category": o.category, "box": list(o.box2d)} for o in sample.objects if o.box2d]
    assert check(small_dataset, rays=False).ok
    file = folder / f"{small_dataset[0].split}.jsonl"
    file.write_text(file.read_text().replace("post box", "posh box", 1))
    seal_again(small_dataset.root)
    assert [f.check for f in check(small_dataset, rays=False).findings] == ["lines"]


@pytest.mark.slow
@pytest.mark.usefixtures("csv_boxes")
@pytest.mark.parametrize("name", ["boxes.csv", "{split}/{index:06d}.png"])
def test_it_proves_itself(small_dataset, name):
    export(small_dataset.root, ["csv_boxes"])
    assert check(small_dataset, rays=False).checked["csv_boxes"] == len(small_dataset)
    sample = small_dataset[1]
    file = small_dataset.root / "csv_boxes" / name.format(split=sample.split, index=sample.index)
    data = file.read_bytes()
    file.unlink()
    file.write_bytes(data[:-3])
    seal_again(small_dataset.root)
    assert [f.check for f in check(small_dataset, rays=False).findings] == ["csv_boxes"]


@pytest.mark.usefixtures("csv_boxes")
def test_every_sample_is_read_once_for_all_formats(small_dataset, tmp_path, monkeypatch):
    read = []
    samples = Dataset._sample
    monkeypatch.setattr(Dataset, "_sample", lambda self, *args: read.append(args) or samples(self, *args))
    export(small_dataset.root, ["csv_boxes", "coco", "native"])
    assert len(read) == len(small_dataset)


def test_entry_points_are_read_once_and_again_where_a_package_was_installed(monkeypatch, tmp_path):
    monkeypatch.syspath_prepend(tmp_path)
    os.utime(tmp_path, ns=(1, 1))  # however coarse the clock of files is, what is installed now comes later
    read = []
    monkeypatch.setattr(metadata, "entry_points", lambda own=metadata.entry_points: read.append(None) or own())
    assert "mine" not in plugins.names("formats")
    assert plugins.load(FormatSpec, "coco") is coco.FORMAT
    assert len(read) == 1
    folder = tmp_path / "mine-1.0.dist-info"
    folder.mkdir()
    (folder / "METADATA").write_text("Metadata-Version: 2.1\nName: mine\nVersion: 1.0\n")
    (folder / "entry_points.txt").write_text("[viewsphere.formats]\nmine = viewsphere.formats.csv\n")
    os.utime(tmp_path, ns=(2, 2))
    assert "mine" in plugins.names("formats")
    assert plugins.load(FormatSpec, "mine") is plugins.load(FormatSpec, "csv")
    assert len(read) == 2


LACKING = "from viewsphere.errors import MissingExtraError\nraise MissingExtraError('broken needs foo: pip install foo')"


@pytest.mark.parametrize(
    ("source", "error"), [("import no_such_package", "ModuleNotFoundError"), (LACKING, "MissingExtraError: broken needs foo")]
)
@pytest.mark.slow
def test_a_broken_package_is_listed_with_its_reason_and_breaks_nothing_else(small_dataset, tmp_path, source, error):
    with installed(tmp_path / "site", "formats", "broken", source) as file:
        (found,) = (one for one in overview() if one.error is not None)
        assert (found.kind, found.name) == ("formats", "broken")
        assert found.distribution.endswith(" 1.0") and found.distribution.startswith("my_package")
        assert found.error.startswith(f"{file}: ") and error in found.error
        assert "broken" not in writable_formats() and "coco" in writable_formats()
        assert all(one.name != "broken" for one in listed())
        export(small_dataset.root, ["csv"])
        assert check(small_dataset, rays=False, sample=0).ok
        with pytest.raises(PluginError, match=f"broken cannot be imported: {error}"):
            export(small_dataset.root, ["broken"])


def test_a_trajectory_is_one_file(install):
    install("trajectories", "swing", EXAMPLES["swing"])
    swing = {"kind": "swing", "distance": 1.0, "degrees": 40, "period": 0.4}
    recipe = small_recipe(viewpoints=swing, time={"frames": 3, "fps": 10}, channels=["rgb"], formats=[])
    samples = list(render(recipe))[:3]
    assert [sample.pose.azimuth_deg for sample in samples] == pytest.approx([0, 40, 0], abs=1e-6)
    assert {round(sample.pose.distance, 6) for sample in samples} == {1.0}
    with pytest.raises(RecipeError, match=r"viewpoints\.perod: 'perod' is unknown; did you mean 'period'\?"):
        small_recipe(viewpoints=swing | {"perod": 1})
    with pytest.raises(RecipeError, match=r"viewpoints\.kind: 'swin' is unknown; did you mean 'swing'\?"):
        small_recipe(viewpoints=swing | {"kind": "swin"})
    with pytest.raises(RecipeError, match="time"):
        plan(small_recipe(viewpoints=swing))


RING = {"kind": "ring", "at": {"elevation": {"uniform": [40, 60]}, "distance": 2}, "strength": 9, "color": "red", "count": 2}


def lit(*lights, **fields):
    """A recipe without sun and sky."""
    return small_recipe(scene={"sun": "off", "sky": {"strength": 0}, "lights": list(lights)}, formats=[], **fields)


def test_a_light_is_one_file(install):
    install("lights", "ring", EXAMPLES["ring"])
    assert "ring" in plugins.names("lights")
    dark, seen = (next(iter(render(lit(*lights)))) for lights in ((), (RING,)))
    assert dark.rgb.max() == 0 and seen.rgb[..., 0].max() > 60 and seen.rgb[..., 1:].max() == 0
    lights = seen.origin.shot.scene.lights
    assert len(lights) == 16 and {light.kind for light in lights} == {"point"}
    middles = [np.mean([light.position for light in some], axis=0) for some in (lights[:8], lights[8:])]
    assert np.linalg.norm(middles, axis=1) == pytest.approx(2) and not np.allclose(*middles)
    with pytest.raises(RecipeError, match=r"scene\.lights\[0\]\.widht: 'widht' is unknown; did you mean 'width'\?"):
        lit(RING | {"widht": 1})
    with pytest.raises(RecipeError, match=r"scene\.lights\[0\]\.kind: 'rng' is unknown; did you mean 'ring'\?"):
        lit(RING | {"kind": "rng"})


@pytest.mark.slow
def test_a_light_shines_in_blender_too(install):
    install("lights", "ring", EXAMPLES["ring"])
    engines = ({"name": "raster", "bounces": "off"}, {"name": "cycles", "samples": 64, "bounces": 0, "denoise": "off"})
    raster, cycles = (next(iter(render(lit(RING, engine=engine)))) for engine in engines)
    thing = raster.instances > 0
    assert cycles.rgb[thing][:, 0].mean() == pytest.approx(raster.rgb[thing][:, 0].mean(), rel=0.1)
    assert cycles.rgb[..., 1:].max() == 0


def test_a_light_without_a_kind_is_refused_by_name(install):
    code = EXAMPLES["ring"]
    file = install("lights", "ring", code.replace("(Placed)", "(Frozen)").replace("import Drawn", "import Drawn, Frozen"))
    message = r"LightSpec\.options: expected a class with the fields kind, count, strength, color; found no count"
    with pytest.raises(PluginError, match=f"^{re.escape(str(file))}: {message}"):
        lit(RING)


HOT = {"hot_pixels": [0.2, 0.9], "hot_pixels_level": {"choice": [0.25, 1]}, "blur": 0.1, "jpeg": 0.2}


def affected(effects, **fields):
    """A recipe of few frames with effects."""
    return small_recipe(scene={"effects": effects}, formats=[], **fields)


def test_an_effect_is_one_file(install, tmp_path):
    plain = {sample.index: sample for sample in render(affected({"blur": 0.1, "jpeg": 0.2}))}
    old = affected({"blur": 0.1}).digest
    install("effects", "hot_pixels", EXAMPLES["hot_pixels"])
    assert "hot_pixels" in plugins.names("effects") and affected({"blur": 0.1}).digest == old
    recipe = affected(HOT)
    assert recipe.digest != affected(HOT | {"hot_pixels": [0.2, 0.8]}).digest
    assert pickle.loads(pickle.dumps(recipe)) == recipe
    assert Recipe.model_validate(yaml.safe_load(recipe.to_yaml())).scene == recipe.scene
    assert plan(recipe).frames == len(plain)
    generate(recipe, tmp_path / "out")
    dataset = Dataset(tmp_path / "out")
    assert len(dataset) == len(plain)
    report = check(dataset)
    assert report.ok, report.findings
    drawn = [sample.origin.shot.finish(sample.origin.instant).effects for sample in render(recipe)]
    assert len({each.seed for each in drawn}) == len({each.values["hot_pixels"] for each in drawn}) == len(plain)
    assert all(0.2 <= each.values["hot_pixels"] <= 0.9 for each in drawn)
    assert {each.values["hot_pixels_level"] for each in drawn} <= {0.25, 1.0}
    for sample in dataset:
        assert np.array_equal(sample.instances, plain[sample.index].instances)
        assert (sample.rgb != plain[sample.index].rgb).any()


def test_an_effect_of_a_name_that_is_not_there_is_refused(install):
    install("effects", "hot_pixels", EXAMPLES["hot_pixels"])
    with pytest.raises(RecipeError, match=r"scene\.effects\.hot_pixel: 'hot_pixel' is unknown; did you mean 'hot_pixels'\?"):
        affected({"hot_pixel": 0.5})
    with pytest.raises(RecipeError, match=r"effects\.hot_pixels_leve: .*; did you mean 'hot_pixels_level'\?"):
        affected({"hot_pixels": 0.5, "hot_pixels_leve": 0.5})
    with pytest.raises(RecipeError, match=r"scene\.effects\.hot_pixels: expected a number less than or equal to 1; found 2"):
        affected({"hot_pixels": 2})


def test_a_shot_with_an_effect_that_is_not_installed_any_more_is_refused(tmp_path):
    with installed(tmp_path / "site", "effects", "hot_pixels", EXAMPLES["hot_pixels"]):
        shot = next(iter(plan(affected(HOT)).shots(lambda *_: np.zeros((8, 3)))))
    with pytest.raises(UserError, match="effect: 'hot_pixels' is unknown"):
        steps_of(shot.finish(0).effects)


GLOW = """
import numpy as np
from typing import Literal
from pydantic import Field
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Count, Portion
from viewsphere.plugins.effect import EffectSpec

class Glow(Frozen):
    glow: Portion = Field(default=0.0, description="light of a window")
    glow_at: tuple[Portion, Portion] = Field(default=(0.5, 0.5), description="its place")
    glow_light: tuple[float, ...] = Field(default=(0.5,), description="its light, one or three channels")
    glow_rows: Count = Field(default=3, description="its rows")
    glow_side: Literal["left", "right"] = Field(default="left", description="its side")
    glow_inside: bool = Field(default=True, description="whether it is inside")

def apply(picture, options, context):
    assert type(options) is Glow and type(options.glow_at) is tuple, options
    out, row = picture.copy(), int(options.glow_at[1] * 40)
    out[row:row + options.glow_rows, :20, :3] = np.float32(options.glow_light)
    return out

EFFECT = EffectSpec(name="glow", options=Glow, strongest="all light", stage="lens", order=1, apply=apply)
"""


@pytest.mark.parametrize(
    ("given", "allowed"),
    [
        ({"glow_at": [0.1, 0.9]}, lambda values: values == [0.1, 0.9]),
        ({"glow_at": [[0.1, 0.2], 0.9]}, lambda values: 0.1 <= values[0] <= 0.2 and values[1] == 0.9),
        ({"glow_at": {"uniform": [[0, 0.5], [0.5, 1]]}}, lambda values: values[0] <= 0.5 <= values[1]),
        ({"glow_light": [0.1, 0.2, 0.3]}, lambda values: values == [0.1, 0.2, 0.3]),
        ({"glow_light": {"choice": [[0.1], [0.4, 0.5, 0.6]]}}, lambda values: values in ([0.1], [0.4, 0.5, 0.6])),
        ({"glow_rows": {"uniform": [2, 5]}}, lambda value: type(value) is int and 2 <= value <= 5),
        ({"glow_side": {"choice": ["left", "right"]}}, lambda value: value in ("left", "right")),
        ({"glow_inside": {"choice": [True, False]}}, lambda value: type(value) is bool),
    ],
)
@pytest.mark.slow
def test_an_effect_s_options_of_all_types_are_given_and_drawn(install, tmp_path, given, allowed):
    install("effects", "glow", GLOW)
    recipe = small_recipe(scene={"effects": {"glow": 0.5, **given}}, channels=["rgb"], formats=[], viewpoints={"distance": 1})
    assert Recipe.model_validate(yaml.safe_load(recipe.to_yaml())).scene == recipe.scene
    generate(recipe, tmp_path / "out", workers=0)
    dataset = Dataset(tmp_path / "out")
    for sample, rendered in zip(dataset, render(recipe), strict=True):
        assert np.array_equal(sample.rgb, rendered.rgb)
        values = rendered.origin.shot.finish(rendered.origin.instant).effects.values
        assert all(allowed(values[name]) for name in given)
    assert check(dataset, rays=False).ok


def test_a_whole_number_of_an_effect_has_no_short_form(install):
    install("effects", "glow", GLOW)
    with pytest.raises(RecipeError, match=r"scene\.effects\.glow_rows: expected a whole number; found \[1, 5\]"):
        affected({"glow": 0.5, "glow_rows": [1, 5]})


TWO = """
import numpy as np
from pydantic import Field
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Portion, Signed
from viewsphere.plugins.effect import EffectSpec

class Levels(Frozen):
    lift: Signed = Field(default=0.0, description="added light")
    gain: Portion = Field(default=0.0, description="more light")

def apply(picture, options, context):
    return np.clip(picture * np.float32(1 + options.gain) + np.float32(options.lift), 0, 1)

def effect(name):
    return EffectSpec(name=name, options=Levels, strongest="more", stage="computer", order=1, apply=apply)

EFFECTS = (effect("lift"), effect("gain"))
"""


def test_several_effects_are_one_file_and_one_step(install):
    install("effects", "lift gain", TWO)
    (step,) = chain(*steps_of(affected({"lift": 0.1, "gain": 0.5}).scene.effects.effects))
    assert step(np.full((2, 2, 3), 0.2, np.float32), None) == pytest.approx(0.4)
    assert len(list(chain(*steps_of(affected({"lift": -0.1}).scene.effects.effects)))) == 1


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("strongest=", "stronges=", r"EffectSpec\.stronges: 'stronges' is unknown; did you mean 'strongest'\?"),
        ('stage="sensor"', 'stage="sensr"', r"EffectSpec\.stage: 'sensr' is unknown; did you mean 'sensor'\?"),
        ("order=50", "order='last'", r"EffectSpec\.order: expected a whole number; found 'last'"),
        (
            "options, context)",
            "options)",
            r"EffectSpec\.apply: expected a function of 3 values; found apply\(picture, options\)",
        ),
        (
            'name="hot_pixels"',
            'name="pixels"',
            r"EffectSpec\.options: expected a class with the fields pixels; found no pixels",
        ),
        ("hot_pixels: Portion", "hot_pixels: float", r"EffectSpec\.options: hot_pixels: expected a strength, 0 by default"),
        ("default=0.0", "default=0.5", r"EffectSpec\.options: hot_pixels: expected a strength, 0 by default"),
        (
            'default=1.0, description="their light; 1 is white"',
            'description="their light"',
            r"EffectSpec\.options: hot_pixels_level: expected a default and a description; found no default",
        ),
        ("hot_pixels_level", "seed", r"EffectSpec\.options: seed: expected another name than draw and seed"),
    ],
)
@pytest.mark.slow
def test_a_faulty_effect_is_refused_where_it_is_named_and_nowhere_else(install, old, new, message):
    file = install("effects", "hot_pixels", EXAMPLES["hot_pixels"].replace(old, new))
    with pytest.raises(PluginError, match=f"^{re.escape(str(file))}: {message}"):
        affected({"hot_pixels": 0.5})
    assert plan(affected({"blur": 0.5})).frames
    assert all(each.error for each in overview() if each.name == "hot_pixels")


def test_effects_with_fields_of_one_name_are_refused_together(install):
    file = install("effects", "hot_pixels", EXAMPLES["hot_pixels"].replace("hot_pixels_level", "focus"))
    message = "EffectSpec.options: focus: expected a name that no other effect has; found a field of depth_of_field"
    with pytest.raises(PluginError, match=f"^{re.escape(f'{file}: {message}')}"):
        affected({"hot_pixels": 0.5})


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("    is_noisy=True,\n", "", "effect hot_pixels: its `apply` reads `context.seed`, which is for noisy effects"),
        ("return out", "return out[1:]", r"effect hot_pixels: expected its `apply` to return float32 of shape \(.*, 3\)"),
        ("return out", "return None", r"EffectSpec\.apply: expected a function that returns a ndarray; found NoneType"),
        (
            "return out",
            "return np.where(is_hot[..., None], np.float32(np.nan), out)",
            r"effect hot_pixels: expected its `apply` to return finite numbers; found NaN or infinity in \d+ of \d+ values",
        ),
    ],
)
def test_an_effect_that_returns_no_picture_is_refused(install, old, new, message):
    install("effects", "hot_pixels", EXAMPLES["hot_pixels"].replace(old, new))
    with pytest.raises(PluginError, match=message):
        next(iter(render(affected({"hot_pixels": 0.5}))))


TETRAHEDRON = "0 0 0 1 0 0 0 0 1\n0 0 0 0 1 0 1 0 0\n0 0 0 0 0 1 0 1 0\n1 0 0 0 1 0 0 0 1\n"


@pytest.fixture
def tri(install, monkeypatch, tmp_path):
    """Installs the page's reader; returns a function that writes a model file. Files are read in processes of their own."""
    install("readers", "tri", EXAMPLES["Triangles as text"])
    monkeypatch.delenv(READ_HERE)
    scratch_cache(monkeypatch, tmp_path / "cache")

    def write(name: str, text: str = TETRAHEDRON) -> Path:
        file = tmp_path / "models" / name
        file.parent.mkdir(exist_ok=True)
        file.write_text(text)
        return file

    return write


def test_a_reader_is_one_file(tri, tmp_path):
    for name in ("a.tri", "b.TRI"):
        tri(name)
    recipe = small_recipe(
        models=[{"source": str(tmp_path / "models"), "category": "part"}], channels=["rgb", "instances"], formats=[]
    )
    samples = list(render(recipe))
    assert {Path(sample.objects[0].model).stem for sample in samples} == {"a", "b"}
    assert all((sample.instances > 0).any() for sample in samples)
    report = describe(tmp_path / "models" / "a.tri")
    assert (report.format, report.triangles, report.up) == ("tri", 4, "+z")


@pytest.mark.slow
def test_a_reader_of_a_third_party_has_the_sandbox_s_limits(tri, install, monkeypatch, tmp_path):
    with pytest.raises(ModelError, match=r"text\.tri: expected nine numbers a line; found something else$"):
        describe(tri("text.tri", "one two"))
    monkeypatch.setenv("VIEWSPHERE_MAX_TRIANGLES", "4")
    with pytest.raises(ModelError, match="expected at most 4 triangles"):
        describe(tri("many.tri", TETRAHEDRON + "0 0 0 2 0 0 0 0 2\n"))
    code = EXAMPLES["Triangles as text"].replace("tri", "bad")
    install("readers", "bad", code.replace("    lines =", "    import os\n\n    os.abort()\n    lines ="))
    with pytest.raises(ModelError, match=r"crash\.bad: reading it crashed \(SIGABRT\)"):
        describe(tri("crash.bad"))


def test_files_of_a_suffix_that_viewsphere_reads_stay_its_own(install, tri):
    code = EXAMPLES["Triangles as text"].replace('suffixes=("tri",)', 'suffixes=("obj",)')
    install("readers", "other", code)
    assert describe(tri("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 1\nf 1 2 3\n")).triangles == 1


def test_a_reader_without_its_packages_names_what_to_install(install, tri):
    code = EXAMPLES["Triangles as text"].replace('("tri",)', '("far",)')
    install("readers", "far", code.replace("read=read", 'packages=("no_such",), install="far", read=read'))
    with pytest.raises(ModelError, match=r"a\.far: needs no_such, which is not installed: pip install 'far'"):
        describe(tri("a.far"))


def test_a_reader_that_cannot_be_loaded_is_named_where_its_suffix_is_unknown(install, tri):
    install("readers", "broken", EXAMPLES["Triangles as text"].replace("suffixes=", "sufixes="))
    with pytest.raises(ModelError, match=r"found '\.bro'; broken cannot be loaded: see `viewsphere plugins`"):
        describe(tri("a.bro"))
    assert describe(tri("a.tri")).triangles == 4


def test_any_material_is_one_that_is_shipped(tmp_path):
    fields = {"models": [{"source": "zoo:car"}], "viewpoints": {"distance": 8}}
    fields["scene"] = {"materials": [{"models": "*", "texture": "any"}]}
    alone = Recipe(**fields)
    with installed(tmp_path / "site", "materials", "odd", "1 / 0"):
        assert "odd" in plugins.names("materials")
        assert Recipe(**fields).digest == alone.digest


@pytest.mark.slow
def test_viewsphere_plugins_names_distributions_and_failures(tmp_path):
    site = tmp_path / "site"
    write_package(site, "my_package", {("formats", "lines"): EXAMPLES["One JSON line a picture"], ("motions", "odd"): "1 / 0"})
    path = os.pathsep.join([str(site), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, "-m", "viewsphere", "plugins"]
    run = subprocess.run(command, env=os.environ | {"PYTHONPATH": path}, capture_output=True, text=True, timeout=DEADLINE)
    assert run.returncode == 0, run.stderr
    assert "    my_package 1.0: lines\n" in run.stdout
    assert "    my_package 1.0: odd cannot be loaded:\n" in run.stdout and "ZeroDivisionError" in run.stdout


TYPO = EXAMPLES["One row an object"]


@pytest.mark.parametrize(
    ("code", "message"),
    [
        (TYPO.replace("channels=", "chanels="), r"FormatSpec\.chanels: 'chanels' is unknown; did you mean 'channels'\?"),
        (
            TYPO.replace("about=__doc__, ", "").replace("writer=", "wrter=").replace("verify=", "verfy="),
            r"FormatSpec\.wrter: 'wrter' is unknown; did you mean 'writer'\?.*\n"
            r".*FormatSpec\.verfy: 'verfy' is unknown; .*\n.*FormatSpec\.about: expected a value; found nothing$",
        ),
        (TYPO.replace("verify=", "verfy="), r"FormatSpec\.verfy: 'verfy' is unknown; did you mean 'verify'\?"),
        (TYPO.replace('("rgb",)', '"rgb"'), r"FormatSpec\.channels: expected a list; found 'rgb'"),
        (TYPO.replace("FORMAT =", "FORMATS ="), r"expected FORMAT = FormatSpec\(\.\.\.\); found no FORMAT"),
        (
            TYPO.replace("(dataset, folder, sampled)", "(dataset, folder)"),
            r"FormatSpec\.verify: expected a function",
        ),
    ],
)
def test_a_misspelt_format_is_refused_before_anything_is_rendered(install, code, message, tmp_path):
    file = install("formats", "csv_boxes", code)
    with pytest.raises(PluginError, match=f"^{re.escape(str(file))}: {message}"):
        plan(small_recipe(formats=["csv_boxes"]))
    with pytest.raises(PluginError, match=message):
        generate(small_recipe(formats=["csv_boxes"]), tmp_path / "out")
    assert not list((tmp_path / "out").rglob("*.png"))
