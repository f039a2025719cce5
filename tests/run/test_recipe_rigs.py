"""Data sets of recipes with rigs: samples, channels, stores, proofs, additions, and stereo's identity."""

import math

import numpy as np
import pytest

import viewsphere as vs
from viewsphere.check import check
from viewsphere.errors import UserError
from viewsphere.geometry.camera import pixel_rays
from viewsphere.model.sensors.rig import Rig
from viewsphere.model.shot import Shot
from viewsphere.planning.plan import plan
from viewsphere.preview import contact_sheet, dataset_samples, preview_samples
from viewsphere.recipe.recipe import Recipe
from viewsphere.run.exports.exporting import export
from viewsphere.run.generate import generate
from viewsphere.run.shots.stages import Stages

BASE = {
    "models": [{"source": "zoo:chair"}],
    "viewpoints": {"distance": 3, "azimuth": [0, 140], "elevation": 20},
    "camera": {"size": [96, 72]},
    "formats": ["native"],
}
MIXED = {
    "sensors": {
        "front": {},
        "wide": {"position": [0.2, 0, 0], "look": [0, 0, 3], "size": [64, 64], "fov_deg": 70,
                 "distortion": {"model": "brown_conrady", "coefficients": [-0.1, 0.02, 0, 0]}},
        "labels": {"position": [-0.2, 0, 0], "rotation": [0, 4, 0], "channels": ["depth", "instances"]},
    }
}  # fmt: skip


@pytest.fixture(scope="module")
def mixed(tmp_path_factory):
    out = tmp_path_factory.mktemp("rig") / "out"
    generate(Recipe(**BASE, rig=MIXED), out)
    return vs.Dataset(out)


def test_every_sensor_has_its_size_lens_and_channels(mixed):
    assert [s.sensor for s in mixed] == ["front", "wide", "labels"] * 2
    assert [s.instant for s in mixed] == [0, 0, 0, 1, 1, 1] and [s.index for s in mixed] == list(range(6))
    for sample in mixed:
        labels = ("depth", "instances")
        assert tuple(sample.channels) == (labels if sample.sensor == "labels" else ("rgb", *labels, "normals"))
        assert sample.depth.shape == ((64, 64) if sample.sensor == "wide" else (72, 96))
        assert (sample.camera.distortion is not None) == (sample.sensor == "wide")
    front, wide = mixed[0], mixed[1]
    baseline = front.camera.R @ (wide.camera.center - front.camera.center)
    np.testing.assert_allclose(baseline, [0.2, 0, 0], atol=1e-12)


def test_all_proofs_hold(mixed):
    report = check(mixed, sample=None)
    assert report.ok, report.findings
    assert report.checked["camera"] == 6 and report.checked["normals"] == 4


def test_what_is_rendered_in_memory_is_what_is_stored(mixed):
    for kept, again in zip(mixed, vs.render(Recipe(**BASE, rig=MIXED)), strict=True):
        assert (again.sensor, again.pose) == (kept.sensor, kept.pose) and tuple(again.channels) == tuple(kept.channels)
        assert all(np.array_equal(again.channels[n], kept.channels[n]) for n in kept.channels)
        assert [o.rle for o in again.objects] == [o.rle for o in kept.objects]


def test_a_preview_shows_the_sensors_with_pictures(mixed):
    shown = dataset_samples(mixed)
    assert [s.sensor for s in shown] == ["front", "wide"] * 2
    assert contact_sheet(shown, ["depth"]).ndim == 3
    small = list(preview_samples(Recipe(**BASE, rig=MIXED), width=40))
    assert [s.width for s in small] == [40] * 6 and all("rgb" in s.channels for s in small)


def test_a_format_that_lacks_a_sensor_s_channel_is_refused(mixed, tmp_path):
    with pytest.raises(UserError, match=r"rig\.sensors\.labels\.channels: expected rgb, which format coco needs"):
        generate(Recipe(**BASE | {"formats": ["coco"]}, rig=MIXED), tmp_path / "out")
    with pytest.raises(UserError, match=r"format coco: expected channel rgb of every frame, found none of sensor labels"):
        export(mixed.root, ["coco"])


def test_the_first_sensor_sees_what_a_single_camera_sees(mixed):
    alone = list(vs.render(Recipe(**BASE)))
    for one, front in zip(alone, [s for s in mixed if s.sensor == "front"], strict=True):
        assert one.pose == front.pose and np.array_equal(one.depth, front.depth) and np.array_equal(one.rgb, front.rgb)


@pytest.mark.slow
def test_channels_and_poses_are_added_for_every_sensor(tmp_path):
    out = tmp_path / "out"
    generate(Recipe(**BASE, rig=MIXED), out)
    more = BASE | {"viewpoints": BASE["viewpoints"] | {"azimuth": [0, 140, 250]}}
    names = ["rgb", "depth", "instances", "normals", "categories"]
    generate(Recipe(**more, rig=MIXED, channels=names), out, append=True)
    found = vs.Dataset(out)
    assert [s.sensor for s in found] == ["front", "wide", "labels"] * 3
    for sample in found:
        assert ("categories" in sample.channels) == (sample.sensor != "labels")
        assert sample.channels["depth"].shape == (sample.height, sample.width)
    assert check(found, sample=None).ok
    with pytest.raises(UserError, match=r"^rig: expected"):
        generate(Recipe(**more, rig={"kind": "stereo", "baseline": 0.1}), out, append=True)
    with pytest.raises(UserError, match=r"^rig: expected"):
        generate(Recipe(**more), out, append=True)


def test_a_data_set_of_one_camera_takes_no_rig(tmp_path):
    generate(Recipe(**BASE), tmp_path / "out")
    assert (
        b"channels"
        not in next((tmp_path / "out/store/shots").rglob("shot.json")).read_bytes().split(b'"rig"')[1].split(b"}]")[0]
    )
    with pytest.raises(UserError, match=r"^rig: expected"):
        generate(Recipe(**BASE, rig={"kind": "stereo", "baseline": 0.1}), tmp_path / "out", append=True)


@pytest.mark.slow
def test_workers_and_scenes(tmp_path):
    """Random scenes by two processes: the same samples as in this one."""
    recipe = Recipe(**BASE, scenes={"count": 2, "objects": 1}, splits={"by": "scene"}, rig={"kind": "surround", "count": 3})
    generate(recipe, tmp_path / "a")
    generate(recipe, tmp_path / "b", workers=2)
    first, second = vs.Dataset(tmp_path / "a"), vs.Dataset(tmp_path / "b")
    assert len(first) == len(second) == 2 * 2 * 3
    for a, b in zip(first, second, strict=True):
        assert a.camera.R.tolist() == b.camera.R.tolist() and np.array_equal(a.depth, b.depth) and np.array_equal(a.rgb, b.rgb)


def test_disparity_times_depth_is_focal_length_times_baseline():
    """A plane that fills both pictures, found by both sensors: fx B / z, and equal depth on equal rows."""
    recipe = Recipe(
        models=[{"source": "zoo:chair"}], viewpoints={"distance": 3, "azimuth": 30, "elevation": 60}, camera={"size": [96, 72]},
        rig={"kind": "stereo", "baseline": 0.25}, channels=["depth"],
    )  # fmt: skip
    left, right = vs.render(recipe)
    camera = left.camera
    points = pixel_rays(camera.intrinsics) * left.depth[..., None].astype(float)
    normal, height = camera.R @ [0, 0, 1.0], None
    heights = points @ normal
    ground = np.abs(heights - np.median(heights[-8:])) < 1e-4 * 3
    height = float(np.median(heights[ground]))
    rays = pixel_rays(right.camera.intrinsics)
    expected = (height / (rays @ normal)).astype(float)  # the ground is as high above both, which are level
    seen = np.abs(right.depth / expected - 1) < 1e-5
    assert ground.mean() > 0.3 and seen.mean() > 0.3
    in_right = points @ np.eye(3) - [0.25, 0, 0]
    x_left = np.arange(96) + 0.5
    x_right = camera.intrinsics.fx * in_right[..., 0] / in_right[..., 2] + camera.intrinsics.cx
    disparity = x_left - x_right
    np.testing.assert_allclose((disparity * left.depth)[ground], camera.intrinsics.fx * 0.25, rtol=1e-6)
    columns = np.floor(x_right).astype(int)
    rows, where = np.nonzero(ground & (columns >= 0) & (columns < 96))
    there = seen[rows, columns[rows, where]]
    assert there.sum() > 500
    apart = right.depth[rows, columns[rows, where]][there] / left.depth[rows, where][there] - 1
    assert np.abs(apart).max() < 1e-5  # rows of level cameras meet the level ground at one depth


def test_a_sensor_inside_of_a_model_is_refused_before_rendering(tmp_path):
    rig = {"sensors": {"a": {}, "b": {"position": [0, 0, 3]}}}
    with pytest.raises(UserError, match=r"rig: expected all sensors outside of the models; found b at .* model chair"):
        generate(Recipe(**BASE, rig=rig), tmp_path / "out")
    assert not list((tmp_path / "out" / "store" / "shots").rglob("manifest*"))


def zoomed() -> tuple[Shot, Shot]:
    """A recipe's shot of stereo, of which the second instant has twice the focal length; and one of that lens alone."""
    shot = plan(Recipe(**BASE, rig={"kind": "stereo", "baseline": 0.2})).shot(0, Stages().box)
    lens = shot.rig.sensors[0].intrinsics
    near = lens.model_copy(update={"fx": 2 * lens.fx, "fy": 2 * lens.fy})
    second = shot.instants[0].model_copy(update={"index": 1})
    sensors = tuple(sensor.model_copy(update={"intrinsics": near}) for sensor in shot.rig.sensors)
    alone = shot.model_copy(update={"instants": (second,), "rig": Rig(sensors=sensors), "first": shot.first + 2})
    instants = shot.instants[0], second.model_copy(update={"intrinsics": near})
    return shot.model_copy(update={"instants": instants}), alone


def zooms(shot, alone):
    samples = list(Stages().render(shot))
    for sample, expected in zip(samples[2:], Stages().render(alone), strict=True):
        assert math.isclose(sample.camera.intrinsics.fx, 2 * samples[0].camera.intrinsics.fx)
        assert (sample.sensor, sample.instant, sample.index) == (expected.sensor, 1, expected.index)
        assert all(np.array_equal(sample.channels[name], expected.channels[name]) for name in shot.channels)
        assert [o.box2d for o in sample.objects] == [o.box2d for o in expected.objects]


def test_lenses_zoom_on_raster():
    zooms(*zoomed())


def test_lenses_zoom_in_cycles(blender):
    options = {"engine": "cycles", "engine_options": {"samples": 4, "denoise": "off"}}
    zooms(*(shot.model_copy(update=options) for shot in zoomed()))
