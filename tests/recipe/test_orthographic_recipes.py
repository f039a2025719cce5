"""An orthographic camera of a recipe: its errors, a data set that is checked, and every format's answer."""

from __future__ import annotations

import json

import numpy as np
import pytest

from cube_dataset import make
from small import small_recipe
from truth_scenes import PARALLEL
from viewsphere import Dataset, Recipe, generate, plan, plugins, render
from viewsphere.check import check
from viewsphere.errors import RecipeError, UserError
from viewsphere.geometry.lenses.orthographic import NARROWEST
from viewsphere.labels.box3d import LABEL
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.plugins.engine import EngineSpec
from viewsphere.plugins.format import FormatSpec
from viewsphere.recipe.formats import FormatEntry
from viewsphere.run.exports.exporting import write
from viewsphere.run.exports.scope import not_held, refuse, scope_of
from viewsphere.run.reports.rig_view import recipe_rig, rig_lines, rig_mesh

CAMERA = {"size": [96, 72], "projection": "orthographic", "width_m": 0.32}
STEREO = {"kind": "stereo", "baseline": 0.1}
CHANNELS = [
    "rgb", "depth", "depth_ray", "instances", "normals", "position", "barycentrics", "coordinates", "nocs", "voxels",
]  # fmt: skip
WIDE = Intrinsics(width=96, height=72, fx=40, fy=40, cx=48, cy=36, distortion=PARALLEL)


def parallel_recipe(**changes) -> Recipe:
    return small_recipe(**{"camera": CAMERA, "channels": CHANNELS, **changes})


def test_its_width_gives_square_pixels_and_is_written_as_it_was_given():
    recipe = parallel_recipe()
    lens = recipe.camera.intrinsics
    assert (lens.fx, lens.fy, lens.cx, lens.cy, lens.lens.name) == (300, 300, 48, 36, "orthographic")
    written = recipe.camera.model_dump(mode="json", exclude_defaults=True)
    assert written == CAMERA and parallel_recipe(camera=written).digest == recipe.digest


@pytest.mark.parametrize(
    "camera, told",
    [
        ({"width_m": 0}, "camera.width_m: expected a number greater than or equal to 0.000001; found 0"),
        ({"width_m": -1}, "camera.width_m: expected a number greater than or equal to 0.000001; found -1"),
        ({"width_m": 1e-300}, "camera.width_m: expected a number greater than or equal to 0.000001; found 1e-300"),
        ({"width_m": float("nan")}, "camera.width_m: expected a finite number; found nan"),
        ({"width_m": float("inf")}, "camera.width_m: expected a finite number; found inf"),
        ({"fov_deg": 30}, "camera.fov_deg: expected none beside projection: orthographic"),
        ({"distortion": {"model": "fisheye", "coefficients": [0, 0, 0, 0]}}, "camera.distortion: expected none beside proj"),
    ],
)
def test_a_wrong_camera_is_one_line(camera, told):
    with pytest.raises(RecipeError, match=told) as error:
        parallel_recipe(camera={**CAMERA, **camera})
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "camera, told",
    [
        (
            {"projection": "orthographic", "width_n": 2},
            "camera.width_n: 'width_n' is unknown; did you mean 'width_m'? Valid: projection, width_m, size, rolling, imager, "
            "also",
        ),
        ({"width_m": 2}, "camera.width_m: expected projection: orthographic beside it; found none: set projection"),
        (
            {"span": {"horizontal": 90}, "fov_deg": 40},
            "camera.span: expected projection: cylindrical or equirectangular beside it; found none: set projection",
        ),
    ],
)
def test_an_option_without_its_lens_and_a_lens_without_its_option_are_told(camera, told):
    with pytest.raises(RecipeError) as error:
        parallel_recipe(camera=camera)
    assert str(error.value) == told


OPEN = {"size": [96, 72], "projection": "orthographic"}
FILLED = {"azimuth": [0, 50], "elevation": 20, "distance": {"fill": [0.8, 0.2]}}


@pytest.mark.parametrize(
    "changes, told",
    [
        ({"camera": OPEN}, "camera: expected width_m beside projection: orthographic, the width .* or distance: {fill: ...}"),
        ({"viewpoints": FILLED}, "viewpoints.distance: expected metres beside the width_m of projection: .* leave one of them"),
        (
            {"camera": {"size": [96, 72], "fov_deg": 40}, "rig": {"sensors": {"a": {}, "b": {"projection": "orthographic"}}}},
            "rig.sensors.b: expected width_m beside projection: orthographic, .* found none: set it$",
        ),
    ],
)
def test_a_picture_has_one_width(changes, told):
    with pytest.raises(RecipeError, match=told):
        plan(parallel_recipe(channels=["rgb"], **changes))


def test_a_filled_share_sets_the_width_of_each_picture_and_the_distance_places_the_camera():
    """A box of 0.2 x 0.2 x 0.1 m, seen along an axis, is 0.2 / share metres of the picture wide."""
    views = {"azimuth": 0, "elevation": 0, "distance": {"fill": [0.8, 0.2]}}
    recipe = parallel_recipe(camera=OPEN, viewpoints=views, channels=["instances"])
    samples = list(render(recipe))
    for sample in samples:
        (x0, y0, x1, y1), lens = sample.objects[0].box2d_unclipped, sample.camera.intrinsics
        assert max((x1 - x0) / 96, (y1 - y0) / 72) == pytest.approx(sample.pose.fill, rel=1e-9)
        box = np.array(sample.objects[0].box3d)
        width, height = np.ptp(box @ sample.camera.R[0]), np.ptp(box @ sample.camera.R[1])
        assert lens.fx == lens.fy == pytest.approx(sample.pose.fill / max(width / 96, height / 72), rel=1e-6)
        away = np.linalg.norm(sample.camera.center - np.array(sample.pose.target or sample.objects[0].box3d.mean(axis=0)))
        assert away == pytest.approx(sample.pose.distance, rel=1e-6)
        assert np.ptp(box, axis=0).max() < sample.pose.distance < 30 * np.ptp(box, axis=0).max()
    assert samples[0].camera.intrinsics.fx == pytest.approx(4 * samples[1].camera.intrinsics.fx)


def test_the_distance_s_jitter_moves_the_camera_alone():
    recipe = parallel_recipe(camera=OPEN, viewpoints={**FILLED, "azimuth": 0}, channels=["instances"])
    far = parallel_recipe(
        camera=OPEN, viewpoints={**FILLED, "azimuth": 0}, channels=["instances"], scene={"jitter": {"distance": 0.5}}
    )
    for near, away in zip(render(recipe), render(far), strict=True):
        assert away.camera.intrinsics == near.camera.intrinsics
        assert away.pose.distance == pytest.approx(1.5 * near.pose.distance)


def test_both_cameras_of_a_rig_have_the_width_of_the_first_and_check_proves_the_set(tmp_path):
    recipe = parallel_recipe(
        camera=OPEN, viewpoints=FILLED, rig=STEREO, channels=["rgb", "depth", "instances", "normals"], formats=["native"]
    )
    generate(recipe, tmp_path / "out", workers=0)
    dataset = Dataset(tmp_path / "out")
    assert not check(dataset).findings
    assert dataset[0].camera.intrinsics == dataset[1].camera.intrinsics
    assert len({sample.camera.intrinsics.fx for sample in dataset}) > 2


@pytest.mark.slow
def test_the_smallest_width_gives_a_data_set_that_passes_check(tmp_path):
    generate(parallel_recipe(camera={**CAMERA, "width_m": NARROWEST}, formats=[]), tmp_path / "out", workers=0)
    assert not check(Dataset(tmp_path / "out")).findings


@pytest.mark.parametrize(
    "changes, told",
    [
        (
            {"rig": STEREO, "channels": ["rgb", "disparity"]},
            "channels: disparity: expected a lens whose rays pass through one centre; found orthographic, whose disparity is "
            "constant, baseline x 300 pixels a metre: leave it out",
        ),
        ({"rig": STEREO, "channels": ["rgb", "disparity_state"]}, "channels: disparity_state: expected a lens whose rays"),
        (
            {"channels": ["rgb", "depth_sensor"]},
            "channels: depth_sensor: expected .* as range cameras have; found ortho",
        ),
        ({"scene": {"rain": 5}}, "scene.rain: expected off beside projection: orthographic"),
        ({"variations": {"a": {}, "b": {"rain": 5}}}, "^variations.b.rain: expected off beside projection: orthographic"),
        ({"variations": {"b": {"effects": {"edge_highlight": 1}}}}, "^variations.b.effects.edge_highlight: expected 0 beside"),
        ({"scene": {"effects": {"depth_of_field": 0.5}}}, "scene.effects.depth_of_field: expected 0 beside projection"),
        ({"scene": {"effects": {"edge_highlight": 0.5}}}, "scene.effects.edge_highlight: expected 0 beside projection"),
    ],
)
def test_what_it_cannot_have_is_one_line_before_anything_is_rendered(changes, told):
    with pytest.raises(RecipeError, match=told) as error:
        plan(parallel_recipe(**changes))
    assert "\n" not in str(error.value)


def test_an_engine_without_parallel_rays_refuses_it(monkeypatch):
    spec = plugins.load(EngineSpec, "raster")
    monkeypatch.setitem(vars(spec), "parallel_rays", False)
    with pytest.raises(RecipeError, match="engine: expected one that paints parallel rays beside projection: orthographic"):
        plan(parallel_recipe())


def test_a_stereo_rig_of_it_has_all_other_labels():
    assert plan(parallel_recipe(rig=STEREO)).frames == 24


@pytest.mark.slow
def test_a_data_set_of_it_is_proved_and_read_back(tmp_path):
    generate(
        parallel_recipe(formats=["native", "coco", "pointcloud"], annotations=["amodal", "obb"]), tmp_path / "out", workers=0
    )
    dataset = Dataset(tmp_path / "out")
    report = check(dataset, repaint=2)
    assert not report.findings, report.findings
    assert report.checked["surface"] == len(dataset)
    sample = dataset[0]
    assert sample.camera.lens.name == "orthographic" and sample.camera.P[2].tolist() == [0, 0, 0, 1]
    homogeneous = np.column_stack([sample.objects[0].box3d, np.ones(8)]) @ sample.camera.P.T
    assert np.allclose(homogeneous[:, :2], sample.objects[0].box3d_pixels, rtol=0, atol=1e-9)
    cloud = sample.point_cloud(axes="world")
    assert np.abs(cloud.points - sample.position[np.isfinite(sample.depth)]).max() < 1e-6
    coco = next((tmp_path / "out" / "coco" / "annotations").glob("instances_train*.json"))
    assert '"model": "orthographic"' in json.dumps(json.loads(coco.read_text("utf-8")))


@pytest.mark.slow
def test_a_tampered_pixel_is_found(tmp_path):
    """A depth that is 1 % off, and a box a pixel off, contradict the exported models."""
    generate(parallel_recipe(formats=[]), tmp_path / "out", workers=0)
    sample = Dataset(tmp_path / "out")[0]
    assert not list(LABEL.prove(sample, {}))
    sample.objects[0].box3d_pixels[2] += 1
    assert any("px off P x vertex" in found for found in LABEL.prove(sample, {}))


def test_every_format_holds_it_or_refuses_it_with_words(tmp_path):
    """From the registry: a format says whether it holds parallel rays, and refuses cameras without a centre otherwise."""
    dataset = make(tmp_path / "out", several=True, intrinsics=WIDE)
    scope, held = scope_of(dataset), []
    for name, spec in plugins.loadable(FormatSpec).items():
        if spec.writer is None:
            continue
        entry = FormatEntry(name=name)
        reasons = [reason for reason in not_held(spec, entry, scope) if "orthographic of camera" in reason]
        assert bool(reasons) == (not spec.parallel_rays), name
        if reasons:
            with pytest.raises(UserError, match=f"format {name}: .*expected cameras whose rays pass through one centre"):
                refuse([entry], scope, "x")
        elif not list(not_held(spec, entry, scope)):
            held.append(name)
            (tmp_path / name).mkdir()
            write(dataset, [(entry, tmp_path / name)])
    assert len(held) > 5


def test_a_camera_s_picture_and_words_show_a_box_instead_of_a_pyramid():
    rig = recipe_rig(parallel_recipe())
    assert any("96 x 72, 0.32 x 0.24 m, orthographic" in line for line in rig_lines(rig))
    low, high = rig_mesh(rig).bounds
    np.testing.assert_allclose(np.subtract(high, low)[:2], [0.32, 0.32], rtol=0.2)
    filled = parallel_recipe(camera={**CAMERA, "width_m": None}, viewpoints={"distance": {"fill": 0.6}})
    text = list(rig_lines(recipe_rig(filled), filled))
    assert any("96 x 72, width from distance: {fill: ...}, orthographic" in line for line in text)
