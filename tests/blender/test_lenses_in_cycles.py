"""Orthographic and panoramic cameras of Blender's: Cycles' own ids and depths along its own rays, against the labels."""

from __future__ import annotations

import math

import numpy as np
import pytest

from small import small_recipe
from viewsphere import Dataset, Recipe, generate
from viewsphere.assets.cache import load_normalised
from viewsphere.check import check
from viewsphere.codecs.npz import load_array
from viewsphere.engines.shared.blender import staging
from viewsphere.engines.shared.blender.file_frame import FileFrame
from viewsphere.engines.shared.blender.lens import views_of
from viewsphere.geometry.lenses import lens_parameters
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.planning.plan import plan
from viewsphere.run.shots.stages import Stages
from viewsphere.truth.raster.visibility import rasterize

WIDTH, HEIGHT = 160, 80
SIZE = {"width": WIDTH, "height": HEIGHT}


def lens(model, fx, fy, cx=WIDTH / 2, cy=HEIGHT / 2):
    return Intrinsics(**SIZE, fx=fx, fy=fy, cx=cx, cy=cy, distortion=lens_parameters(model))


LENSES = {
    "orthographic": lens("orthographic", 70, 70),
    "orthographic, off centre, wide pixels": lens("orthographic", 50, 70, 71.3, 44.6),
    "equirectangular": lens("equirectangular", WIDTH / math.tau, HEIGHT / math.pi),
    "equirectangular, in part": lens("equirectangular", 61, 55, 63.2, 37.1),
    "cylindrical": lens("cylindrical", WIDTH / math.tau, WIDTH / math.tau),
    "cylindrical, in part": lens("cylindrical", 61, 55, 63.2, 37.1),
}
DEPTH_ERROR = 2e-5
"""Cycles' rays and depths are single: some hundred of their steps, as a share of the depth."""
GRAZED_ERROR = 2e-4
"""The same on surfaces that rays graze, as Cycles samples up to 0.005 pixels from the middle of a pixel."""


def shot_of(**changes):
    """Three models around a camera that sees all of them."""
    values = {
        "models": [{"source": "zoo:chair"}, {"source": "zoo:post_box"}],
        "scenes": {"count": 1, "objects": 6, "repeat": True, "layout": "scatter"},
        "viewpoints": {"azimuth": 25, "elevation": 10, "distance": 0.4},
        "camera": {"size": [WIDTH, HEIGHT], "fov_deg": 60},
        "scene": {"ground": "off"},
        "channels": ["instances"],
        "splits": {"by": "scene"},
    }
    return plan(Recipe.model_validate({**values, **changes})).shot(0, Stages().box)


def of_lens(shot, intrinsics):
    """The shot with another lens, from farther away if its rays are parallel."""
    sensor = shot.rig.sensors[0].model_copy(update={"intrinsics": intrinsics})
    now = shot.instants[0]
    if intrinsics.lens.is_parallel:
        pose = np.array(now.world_from_rig)
        pose[:3, 3] -= 4 * pose[:3, 2]
        now = now.model_copy(update={"world_from_rig": tuple(map(tuple, pose.tolist()))})
    return shot.model_copy(update={"rig": shot.rig.model_copy(update={"sensors": (sensor,)}), "instants": (now,)})


def load(spec, **more):
    return load_normalised(spec, **more)


@pytest.fixture(scope="module")
def around():
    return shot_of()


def cycles_depth(shot, camera):
    """Distances that Cycles measures through the middles of pixels, its own pass."""
    options = {"samples": 1, "bounces": 0, "denoise": "off", "settings": staging._SHARP}
    stage = staging.build_stage(shot.model_copy(update={"engine": "cycles", "engine_options": options}), load).arrangement(0)
    process = stage.keeper.process_for(stage)
    out = process.folder / "far.npy"
    view = staging.camera_request(camera)
    process.ask(
        "render", 600, camera=view, out=str(out), transparent=True, border=None, passes=["depth"], blur=None, least=0.01
    )
    return load_array(out.with_suffix(".depth.npy"))[..., 0]


def labels_of(shot, camera):
    """Ids of objects, and distances along the rays, of the raster's labels."""
    stage = staging.build_stage(shot.model_copy(update={"engine": "cycles", "engine_options": {}}), load)
    geometry = stage.at(0)
    visibility = rasterize(geometry, camera)
    ids = np.where(visibility.triangle >= 0, geometry.triangle_object[visibility.triangle], 0)
    with np.errstate(divide="ignore"):
        return ids, np.linalg.norm(camera.lens.directions(), axis=-1) / visibility.inverse_depth


@pytest.mark.usefixtures("blender")
@pytest.mark.parametrize("name", LENSES)
def test_cycles_sees_the_labels_ids_and_distances(name, around):
    shot = of_lens(around, LENSES[name])
    camera = shot.camera(0)
    assert [view.pixels for view in views_of(camera, is_traced=True)] == [None]
    seen = staging.indices(shot, 0, 0, load)
    ids, away = labels_of(shot, camera)
    assert len(np.unique(ids)) >= 6
    assert np.array_equal(seen, ids)
    far = cycles_depth(shot, camera)
    off = np.abs(far[ids > 0] / away[ids > 0] - 1)
    assert np.quantile(off, 0.99) < DEPTH_ERROR and off.max() < GRAZED_ERROR


def test_lenses_that_blender_s_cameras_lack_are_sampled_from_pinholes(around):
    shown = LENSES["equirectangular, in part"]
    for change in ({"skew": 0.5}, {"cx": 2.0 * WIDTH}, {"cy": 2.0 * HEIGHT}):
        camera = of_lens(around, shown.model_copy(update=change)).camera(0)
        assert all(view.pixels is not None for view in views_of(camera, is_traced=True))
    whole, bent = of_lens(around, shown).camera(0), lens_parameters("fisheye", coefficients=(0.0,) * 4)
    assert len(views_of(whole, is_traced=False)) > 1
    fisheye = Camera(shown.model_copy(update={"distortion": bent}), whole.R, whole.t)
    assert len(views_of(fisheye, is_traced=True)) > 1


@pytest.mark.parametrize("name", ["orthographic", "equirectangular", "cylindrical"])
@pytest.mark.parametrize("engine", ["cycles", "eevee", "workbench"])
@pytest.mark.slow
def test_pictures_show_things_where_the_labels_have_them(engine, name, around, request):
    """Pictures are solid on pixels of things but for edges, and less so a pixel away."""
    request.getfixturevalue("blender" if engine == "cycles" else "drawing")
    options = {"samples": 8, "denoise": "off"} if engine == "cycles" else {}
    shot = of_lens(around, LENSES[name])
    shot = shot.model_copy(update={"engine": engine, "engine_options": options, "channels": ("rgba", "instances")})
    (sample,) = Stages().render(shot)
    ids = sample.instances
    solid = sample.rgba[..., 3] > 127
    assert (ids > 0).sum() > 500
    off = [((np.roll(ids, by, axis=(0, 1)) > 0) != solid).sum() for by in ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1))]
    assert off[0] < 0.1 * (ids > 0).sum() and off[0] < 0.5 * min(off[1:])


@pytest.mark.usefixtures("blender")
def test_check_asks_cycles_about_a_data_set_of_panoramas(tmp_path):
    recipe = small_recipe(
        camera={"projection": "equirectangular", "size": [96, 48]}, channels=["rgb", "instances"], formats=[], engine="raster"
    )
    generate(recipe, tmp_path / "out", workers=0)
    report = check(Dataset(tmp_path / "out"), sample=0, rays=False, against_cycles=2)
    assert report.ok and report.checked["cycles"] == 2, report.findings


def test_a_width_is_in_the_units_of_the_users_file():
    pose = np.eye(4)
    pose[:3, 3] = 1, 2, 3
    there = FileFrame(pose, 0.01).camera(staging.camera_request(Camera(LENSES["orthographic"], np.eye(3), np.zeros(3))))
    assert there["lengths"] == {"ortho_scale": pytest.approx(100 * WIDTH / 70)}
    assert there["type"] == "ORTHO" and there["center"] == pytest.approx([100, 200, 300])
