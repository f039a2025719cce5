"""What models say of themselves is in the data set, is compared when it goes on, and is proved by check."""

import json

import numpy as np
import pytest
import trimesh

from command_line import viewsphere
from sealing import seal_again
from small import small_recipe
from viewsphere import Dataset, Recipe, generate
from viewsphere.check.models import differing
from viewsphere.errors import ModelError, RecipeError, StoreError
from viewsphere.planning.models import model_specs
from viewsphere.run.shots.stages import Stages

SAID = """\
axes: file  # millimetres, z up
symmetries: {discrete: [[-1, 0, 0, 40, 0, -1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]]}
keypoints: {points: {top: [20, 0, 200], left: [-30, 0, 0]}, skeleton: [[top, left]]}
"""


@pytest.fixture
def recipe(tmp_path):
    mesh = trimesh.creation.box((100, 300, 400))
    mesh.apply_translation((20, 0, 0))
    mesh.export(tmp_path / "box.stl")
    (tmp_path / "box.stl.viewsphere.yaml").write_text(SAID)

    def make(**settings):
        models = [{"source": str(tmp_path / "box.stl"), "category": "box", "unit": "mm", **settings}]
        views = {"azimuth": [20], "elevation": [30], "distance": 2.0}
        return small_recipe(models=models, viewpoints=views, channels=["instances"], formats=[])

    return make


def test_it_is_kept_and_compared(recipe, tmp_path):
    out, sidecar = tmp_path / "out", tmp_path / "box.stl.viewsphere.yaml"
    generate(recipe(), out)
    (info,) = Dataset(out).models
    assert info.diameter == pytest.approx(np.linalg.norm((0.1, 0.3, 0.4)))
    np.testing.assert_allclose(info.keypoints.points["top"], (0, 0, 0.2), atol=1e-9)
    np.testing.assert_allclose(info.keypoints.points["left"], (-0.05, 0, 0), atol=1e-9)
    np.testing.assert_allclose(info.symmetries.discrete, [np.diag((-1, -1, 1, 1))], atol=1e-9)
    sidecar.write_text(SAID + "# a remark changes nothing\n")
    assert generate(recipe(), out).rendered == 0
    sidecar.write_text(SAID.replace("200]", "199]"))
    with pytest.raises(StoreError, match=r"expected keypoints .* of model 'box', as the data set has"):
        generate(recipe(), out)
    sidecar.unlink()
    with pytest.raises(StoreError, match=r"expected symmetries .* of model 'box', as the data set has; found None"):
        generate(recipe(), out)


def test_records_of_older_versions_say_nothing(recipe, tmp_path):
    out = tmp_path / "out"
    generate(recipe(), out)
    file = out / "store" / "models" / "box" / "model.json"
    known = json.loads(file.read_text())
    for name in ("diameter", "symmetries", "keypoints"):
        del known[name]
    file.write_text(json.dumps(known))
    seal_again(out)
    (info,) = Dataset(out).models
    assert (info.diameter, info.symmetries, info.keypoints) == (None, None, None)
    assert not list(differing(Dataset(out), []))
    assert generate(recipe(), out).rendered == 0


@pytest.mark.slow
def test_check_looks_at_it(recipe, tmp_path):
    out = tmp_path / "out"
    generate(recipe(), out)
    assert not list(differing(Dataset(out), []))
    file = out / "store" / "models" / "box" / "model.json"
    known = json.loads(file.read_text())
    others = {
        "diameter": known["diameter"] + 1e-9,
        "symmetries": {"discrete": [], "continuous": [{"axis": [0, 0, 1], "offset": [0, 0, 0]}]},
        "keypoints": {"points": {"top": [0, 0, 0.9]}},
    }
    for name, other in others.items():
        file.write_text(json.dumps({**known, name: other}))
        (problem,) = differing(Dataset(out), [])
        assert name in problem[1]


def test_looks_are_kept_where_a_label_needs_them(recipe, tmp_path):
    sidecar, asked = tmp_path / "box.stl.viewsphere.yaml", {"annotations": ("looks",)}
    plain, out = tmp_path / "plain", tmp_path / "out"
    generate(recipe(), plain)
    assert Dataset(plain).models[0].looks is None
    generate(recipe().model_copy(update=asked), out)
    (info,) = Dataset(out).models
    assert [patch.share for patch in info.looks.patches] == [1.0] and info.looks.color is None
    assert not list(differing(Dataset(out), []))
    before = {file: file.read_bytes() for file in out.glob("store/models/box/*")}
    assert generate(recipe().model_copy(update=asked), out).rendered == 0
    assert {file: file.read_bytes() for file in before} == before
    file = out / "store" / "models" / "box" / "model.json"
    known = json.loads(file.read_text())
    known["looks"]["patches"][0]["color"] = [0.9, 0.0, 0.0]
    file.write_text(json.dumps(known))
    (problem,) = differing(Dataset(out), [])
    assert "expected looks of the GLB" in problem[1]
    file.write_bytes(before[file])
    sidecar.write_text(SAID + "color: navy\n")
    with pytest.raises(StoreError, match=r"expected looks .* of model 'box', as the data set has"):
        generate(recipe().model_copy(update=asked), out)


def test_what_is_said_of_looks(recipe, tmp_path):
    sidecar = tmp_path / "box.stl.viewsphere.yaml"
    sidecar.write_text(SAID + "color: navy\nmaterial: wooden\n")

    def said(**settings):
        (spec,) = model_specs(recipe(**settings))
        looks = Stages().metadata(spec).looks()
        return looks.color, looks.material

    assert said() == ("navy", "wooden") and said(color="dark blue") == ("dark blue", "wooden")
    for wrong, told in (("color: ''", "color"), ("material: 'a  b'", "words with single spaces"), ("colour: red", "'color'")):
        sidecar.write_text(wrong)
        with pytest.raises(ModelError, match=told):
            generate(recipe(), tmp_path / "out")


@pytest.mark.slow
def test_mistakes_are_told_before_anything_is_rendered(recipe, tmp_path):
    sidecar = tmp_path / "box.stl.viewsphere.yaml"
    sidecar.write_text("symmetries: {continuous: [{axis: [0, 0, 1], offset: [20, 0, 0]}]}")
    with pytest.raises(ModelError, match=r"yaml: symmetries\.continuous\[0\]: expected what takes the surface to itself"):
        generate(recipe(), tmp_path / "out")
    assert not list((tmp_path / "out").glob("store/shots/*"))
    sidecar.write_text("keypoints: {points: {top: [0, 0, .nan]}}")
    with pytest.raises(ModelError, match=r"yaml:1: keypoints\.points\.top\[2\]: expected"):
        generate(recipe(), tmp_path / "out")
    with pytest.raises(RecipeError, match=r"models\[0\].sidecar: expected a file .* found no 'no.yaml'"):
        generate(recipe(sidecar="no.yaml"), tmp_path / "out")
    with pytest.raises(RecipeError, match="models of a source cannot have a sidecar"):
        Recipe.model_validate({**recipe().model_dump(), "models": [{"source": "zoo:car", "sidecar": "a.yaml"}]})


def test_what_a_recipe_asks_for(recipe, tmp_path):
    (tmp_path / "box.stl.viewsphere.yaml").unlink()
    (tmp_path / "other.yaml").write_text("keypoints: {points: {middle: [20, 0, 0]}}")
    stages = Stages()

    def metadata(**settings):
        (spec,) = model_specs(recipe(**settings))
        return stages.metadata(spec)

    assert metadata().symmetries is None and metadata(symmetries="declared").symmetries is None
    assert len(metadata(symmetries="found").symmetries.discrete) == 3
    assert len(metadata(keypoints=5).keypoints.points) == 5
    np.testing.assert_allclose(metadata(sidecar=str(tmp_path / "other.yaml")).keypoints.points["middle"], 0, atol=1e-9)


@pytest.mark.slow
def test_the_command_line_ends_with_2(recipe, tmp_path):
    (tmp_path / "box.stl.viewsphere.yaml").write_text("keypoint: {}")
    (tmp_path / "recipe.yaml").write_text(
        "models: [{source: box.stl, category: box, unit: mm}]\nviewpoints: {azimuth: [0], elevation: [9], distance: 2}\n"
    )
    found = viewsphere("render", tmp_path / "recipe.yaml", "-o", tmp_path / "out")
    assert found.returncode == 2
    assert (
        "box.stl.viewsphere.yaml:1: keypoint: 'keypoint' is unknown; did" in found.stderr
        and "did you mean 'keypoints'" in found.stderr
    )
