"""Instance maps against Cycles' own pass of object indices: of models, and of a scene of the user's own."""

from __future__ import annotations

import re
from types import SimpleNamespace

import numpy as np
import pytest
from test_saved_blend import instanced, recipe_of  # noqa: F401 (a fixture)

from place_files import blocks, write_place
from sealing import seal_again
from small import small_recipe
from viewsphere import Dataset, generate
from viewsphere.assets.exporting.glb import glb_bytes
from viewsphere.blender.interpreter import find_blender
from viewsphere.blender.process import BlenderProcess
from viewsphere.check import check
from viewsphere.check.cycles import near
from viewsphere.codecs.png_tiff import encode_png
from viewsphere.engines.shared.blender import staging
from viewsphere.errors import MissingExtraError, ModelError
from viewsphere.formats.blend import StoredModels
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.thing import Thing


def test_an_edge_is_a_pixel_whose_neighbour_is_seen():
    kept = np.zeros((5, 6), np.int32)
    kept[1:4, 1:3] = 7
    seen = np.full((5, 6), 7, np.int32)
    assert near(kept, seen)[:, :4].all() and not near(kept, seen)[:, 4:].any()
    assert near(kept, kept).all()


@pytest.mark.usefixtures("blender")
def test_labels_are_what_cycles_sees(tmp_path):
    generate(recipe_of(engine="raster"), tmp_path / "out")
    report = check(Dataset(tmp_path / "out"), sample=0, against_cycles=2)
    assert report.ok, report.findings
    assert report.checked["cycles"] == 2
    (note,) = (note for note in report.notes if note.startswith("Cycles'"))
    assert int(note.split(" frames, ")[1].split()[0]) <= 10


@pytest.fixture
def dying(monkeypatch):
    """Lets Blender die so many times when it is asked for numbers; gives the list of Blenders that are started from then on."""
    started, ask, start = list[BlenderProcess](), BlenderProcess.ask, staging._started

    def made(times):
        deaths = iter(range(times))

        def asked(self, do, *given, **told):
            if do == "number" and next(deaths, None) is not None:
                self.close()
            return ask(self, do, *given, **told)

        monkeypatch.setattr(BlenderProcess, "ask", asked)
        monkeypatch.setattr(staging, "_started", lambda *given: started.append(start(*given)) or started[-1])
        return started

    return made


@pytest.mark.usefixtures("blender")
@pytest.mark.parametrize("times", [0, 1])
def test_a_blender_serves_all_frames_and_another_one_follows_if_it_dies(tmp_path, dying, times):
    generate(recipe_of(engine="raster"), tmp_path / "out")
    staging.keeper_of(find_blender()).drop()
    started = dying(times)
    report = check(Dataset(tmp_path / "out"), sample=0, rays=False, against_cycles=2)
    assert report.ok and report.checked["cycles"] == 2
    assert len(started) == 1 + times


@pytest.mark.usefixtures("blender")
def test_a_blender_that_dies_twice_is_one_line(tmp_path, dying):
    generate(recipe_of(engine="raster"), tmp_path / "out")
    dying(2)
    with pytest.raises(ModelError, match=r"^hair_drier_000, hair_drier_001: Blender was ended before `number` was asked$"):
        check(Dataset(tmp_path / "out"), sample=0, rays=False, against_cycles=1)


@pytest.mark.usefixtures("blender")
def test_what_cycles_sees_otherwise_is_found(tmp_path, monkeypatch):
    """Here a frame's map is that of another."""
    generate(recipe_of(engine="raster"), tmp_path / "out")
    dataset = Dataset(tmp_path / "out")
    other = dataset[2].channels["instances"]
    monkeypatch.setattr("viewsphere.check.cycles.kept_map", lambda sample: other)
    findings = [f for f in check(dataset, sample=0, rays=False, against_cycles=1).findings if f.check == "cycles"]
    assert len(findings) == 1 and findings[0].frame == 0
    assert "are not what Cycles sees, and on no edge" in findings[0].message


def test_instances_of_a_users_scene_are_what_cycles_sees(instanced):  # noqa: F811
    report = check(instanced[0], sample=0, against_cycles=2)
    assert not [finding for finding in report.findings if finding.check == "cycles"]
    assert report.checked["cycles"] == 2


@pytest.mark.usefixtures("blender")
def test_a_damaged_file_is_a_finding(tmp_path):
    generate(recipe_of(engine="raster"), tmp_path / "out")
    dataset = Dataset(tmp_path / "out")
    cut, other = (dataset.path(dataset[i].files["instances"]) for i in (0, 6))
    cut.write_bytes(cut.read_bytes()[:-40])
    other.write_bytes(encode_png(np.zeros((5, 6), np.uint8)))
    seal_again(dataset.root)
    report = check(Dataset(dataset.root), sample=0, rays=False, against_cycles=2)
    found = {finding.frame: finding.message for finding in report.findings if finding.check == "cycles"}
    assert cut.name in found[0]
    assert "expected an instance map of shape (72, 96), found (5, 6)" in found[6]
    assert report.checked["cycles"] == 0
    model = dataset.path(dataset.models[0].glb)
    model.write_bytes(model.read_bytes()[:200])
    again = check(Dataset(dataset.root), sample=0, rays=False, against_cycles=2)
    assert any(finding.frame == 6 and model.name in finding.message for finding in again.findings if finding.check == "cycles")


def test_a_blender_that_is_not_there_is_told_before_any_work(small_dataset, monkeypatch):
    def none(python=None):
        raise MissingExtraError("Blender: expected a Python that has bpy, found none")

    monkeypatch.setattr("viewsphere.blender.interpreter.find_blender", none)
    monkeypatch.setattr("viewsphere.check.damaged", lambda dataset: pytest.fail("work was done before"))
    with pytest.raises(MissingExtraError, match="expected a Python that has bpy"):
        check(small_dataset, against_cycles=1)


@pytest.mark.usefixtures("blender")
@pytest.mark.parametrize("spoil", [lambda place: place.unlink(), lambda place: place.write_bytes(write_box())])
def test_a_place_that_is_not_what_it_was_is_left_out_with_a_word(spoil, tmp_path):
    place = write_place(tmp_path / "place.glb")
    scene = {"place": {"source": str(place)}}
    generate(small_recipe(scene=scene, engine="raster", channels=["instances"], formats=[]), tmp_path / "out")
    whole = check(Dataset(tmp_path / "out"), sample=0, rays=False, against_cycles=1)
    assert whole.ok and whole.checked["cycles"] == 1, whole.findings
    spoil(place)
    report = check(Dataset(tmp_path / "out"), sample=0, rays=False, against_cycles=2)
    assert report.ok, report.findings
    assert report.checked["cycles"] == 0
    (note,) = (note for note in report.notes if note.startswith("Cycles'"))
    assert re.search(r"; 2 left out whose scenery is not what it was \(.*place.*\)$", note), note


def write_box() -> bytes:
    """Another place: a floor alone."""
    return glb_bytes(blocks(((-10.0, -10.0, -0.05), (10.0, 10.0, 0.0))))


def test_models_are_those_of_the_objects_that_a_sample_has():
    """A sample of a sequence lacks the objects that are not there, so its objects are known by their numbers."""
    first, second = (Thing(id=i, model=spec(f"model_{i}")) for i in (1, 2))
    seen = SimpleNamespace(id=2, key="kept_2", track="")
    models = StoredModels.for_sample(None, SimpleNamespace(objects=(first, second)), SimpleNamespace(objects=(seen,)))
    assert models.keys == {(second.model, None): ("kept_2", "kept_2")}


def spec(key):
    return ModelSpec(key=key, source=f"{key}.glb", category="box", category_id=1)
