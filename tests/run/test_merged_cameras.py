"""Data sets of different cameras joined: formats refuse the cameras of every part, and rows keep their poses."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from cube_dataset import LENS, make
from small import small_recipe
from truth_scenes import PARALLEL
from viewsphere import Dataset, generate, plugins
from viewsphere.check import check
from viewsphere.errors import StoreError, UserError
from viewsphere.geometry.lenses import read_parameters
from viewsphere.model.sensors.rolling import Rolling
from viewsphere.plugins.format import FormatSpec
from viewsphere.recipe.formats import FormatEntry
from viewsphere.run.datasets.merging import merge
from viewsphere.run.exports.exporting import export
from viewsphere.run.exports.scope import refusals, scope_of, scope_of_foreign

SIZE = {"size": [64, 48]}
CAMERAS = {
    "pinhole": {**SIZE, "fov_deg": 45},
    "parallel": {**SIZE, "projection": "orthographic", "width_m": 0.4},
    "panorama": {**SIZE, "projection": "cylindrical", "span": {"horizontal": 120}},
    "rolling": {**SIZE, "fov_deg": 45, "rolling": {"readout": 0.08}},
}


def recipe(camera, **changes):
    """One moving post box, seen by a camera that goes around it; a tenth of a second a picture."""
    model = {"source": "zoo:post_box", "category": "post box", "count": 1, "scale": {"length": 0.18}}
    values = {
        "models": [model | {"motion": {"kind": "constant", "velocity": [0.5, 0, 0]}}],
        "viewpoints": {"kind": "orbit", "azimuth": [0, 50], "elevation": 20, "distance": 0.9},
        "time": {"frames": 2, "fps": 10},
        "camera": CAMERAS[camera],
        "channels": ["rgb", "depth_ray", "instances", *([] if camera == "panorama" else ["depth", "position"])],
        "annotations": [],
        "splits": {"by": "sequence"},
        "formats": [],
    }
    return small_recipe(**values | changes)


@pytest.fixture(scope="module")
def sources(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cameras")
    for name in CAMERAS:
        generate(recipe(name), folder / name, workers=0)
    generate(recipe("rolling", seed=7), folder / "rolling2", workers=0)
    return folder


def refused(dataset):
    """The formats that refuse a data set, with their reasons."""
    scope, specs = scope_of(dataset), plugins.loadable(FormatSpec)
    answers = {name: list(refusals(spec, FormatEntry(name=name), scope)) for name, spec in specs.items() if spec.writer}
    return {name: sorted(reasons) for name, reasons in answers.items() if reasons}


@pytest.mark.parametrize("other", ["parallel", "panorama", "rolling"])
def test_formats_refuse_the_cameras_of_every_part_in_any_order(sources, tmp_path, other):
    one, two = sources / "pinhole", sources / other
    there = refused(merge([one, two], tmp_path / "there", mixed=True))
    back = refused(merge([two, one], tmp_path / "back", mixed=True))
    assert there == back
    assert there.keys() >= refused(Dataset(two)).keys() >= {"kitti", "bop", "tum"}
    with pytest.raises(UserError, match="format kitti: expected"):
        export(tmp_path / "there", ["kitti"])
    assert all(len(set(reasons)) == len(reasons) for reasons in there.values())


def test_pictures_of_unknown_rigs_show_each_lens_that_a_part_has(tmp_path):
    pinhole, parallel = (
        make(tmp_path / name, intrinsics=lens)
        for name, lens in (("a", LENS), ("b", LENS.model_copy(update={"distortion": PARALLEL})))
    )
    samples = [pinhole[0], pinhole[1], parallel[0], parallel[1]]
    frames = [SimpleNamespace(sample=replace(sample, origin=None)) for sample in samples]
    facts = {"categories": (), "splits": ("train",), "max_objects": 1, "channels": ("rgb", "depth")}
    scope = scope_of_foreign(SimpleNamespace(frames=lambda: iter(frames), **facts))
    assert [sample.camera.lens.name for sample in scope.pictures] == ["pinhole", "orthographic"]
    spec = plugins.load(FormatSpec, "tum")
    assert any("orthographic of camera" in reason for reason in refusals(spec, FormatEntry(name="tum"), scope))


def test_merged_rows_keep_their_poses_and_check_proves_them(sources, tmp_path):
    joined = merge([sources / "rolling", sources / "rolling2"], tmp_path / "out")
    old = [sample for name in ("rolling", "rolling2") for sample in Dataset(sources / name)]
    for new, was in zip(joined, old, strict=True):
        assert np.array_equal(new.camera.rows.rotation, was.camera.rows.rotation)
        assert np.array_equal(new.camera.rows.translation, was.camera.rows.translation)
        assert new.camera.rows.moving.keys() == was.camera.rows.moving.keys() != set()
        assert all(np.array_equal(new.camera.rows.moving[i], was.camera.rows.moving[i]) for i in was.camera.rows.moving)
    report = check(joined)
    assert report.ok, report.findings
    assert report.not_run.keys() <= {"plan", "recipe", "sources"}
    twice = merge([joined.root, sources / "pinhole"], tmp_path / "twice", mixed=True)
    assert [sample.camera.rows is not None for sample in twice] == [True] * 4 + [False] * 2


def test_a_rolling_record_with_another_lens_than_its_shot_is_damage(sources, tmp_path):
    joined = merge([sources / "rolling", sources / "rolling2"], tmp_path / "out")
    file = joined.store.shot_folder(joined.rows[0].key) / "frames.json"
    file.write_text(file.read_text("utf-8").replace('"readout":0.08', '"readout":0.07'), "utf-8")
    with pytest.raises(StoreError, match="another lens than the shot's"):
        _ = Dataset(tmp_path / "out")[0].camera


BENT = [read_parameters({"model": "fisheye", "coefficients": [k, 0, 0, 0]}) for k in (0.01, 0.02)]


@pytest.mark.parametrize(
    ("first", "second", "told"),
    [
        ({}, {"rolling": Rolling(readout=0.03)}, "found 64x48 .*, a rolling shutter of 0.03 s, down: join"),
        (
            {"rolling": Rolling(readout=0.03)},
            {"rolling": Rolling(readout=0.03, direction="up")},
            "0.03 s, down; .* 0.03 s, up:",
        ),
        ({"distortion": BENT[0]}, {"distortion": BENT[1]}, "fisheye 0.01 0 0 0; .*fisheye 0.02 0 0 0:"),
        ({}, {"skew": 0.5}, "; found 64x48 .* skew 0.5: join"),
        ({"cx": 32.0}, {"cx": 32.0 + 2**-40}, " cx 32 .*; found .* cx 32.0000000000009"),
    ],
)
def test_a_refused_camera_names_its_difference(tmp_path, first, second, told):
    size = {"width": 64, "height": 48}
    for name, changes in (("a", first), ("b", second)):
        make(tmp_path / name, intrinsics=LENS.model_copy(update=size | changes))
    with pytest.raises(UserError, match=told):
        merge([tmp_path / "a", tmp_path / "b"], tmp_path / "c")
