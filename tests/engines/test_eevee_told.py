"""What EEVEE and Workbench need no Blender for: their options, what is refused, the sky behind Workbench's pictures."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest
from cycles_scenes import moved_camera, recipe_of, stages

from shots import camera_of
from viewsphere import plan, plugins, render
from viewsphere.blender.interpreter import VARIABLE
from viewsphere.engines import eevee, workbench
from viewsphere.engines.shared.blender.backdrop import Backdrop
from viewsphere.engines.shared.blender.options import EEVEE_PRESETS, WORKBENCH_PRESETS, Eevee, Workbench, options_of
from viewsphere.engines.shared.blender.requests import scene_request, settings_request
from viewsphere.engines.shared.blender.staging import SPARE, clip_of
from viewsphere.errors import RecipeError
from viewsphere.planning.engine_digest import engine_digest
from viewsphere.rendering.finish import finished
from viewsphere.rendering.sky.sun import sun_light
from viewsphere.truth.raster.geometry import build_geometry
from viewsphere.truth.raster.visibility import rasterize

NAMES = "eevee", "workbench"


@pytest.fixture
def named(monkeypatch, tmp_path):
    """An interpreter that is there, and would not start."""
    (tmp_path / "python").touch(mode=0o755)
    monkeypatch.setenv(VARIABLE, str(tmp_path / "python"))


def shot_of(engine, **given):
    return next(plan(recipe_of(engine, **given)).shots(stages().box))


def geometry_of(shot):
    meshes = [stages().model(p.model) for p in shot.things]
    return build_geometry(shot.things, meshes, shot.scene.ground is not None, shot.label_alpha), meshes


def test_they_are_engines_of_their_own():
    assert {"cycles", *NAMES} <= set(plugins.names("engines"))
    assert len({engine_digest(name) for name in ("cycles", *NAMES)}) == 3


def test_presets_differ_and_other_options_change_them():
    assert options_of("eevee", {}) == Eevee() == EEVEE_PRESETS["good"]
    assert options_of("workbench", {}) == Workbench() == WORKBENCH_PRESETS["good"]
    for presets in (EEVEE_PRESETS, WORKBENCH_PRESETS):
        assert presets["draft"].samples < presets["good"].samples < presets["final"].samples
    changed = options_of("eevee", {"quality": "draft", "samples": 9, "raytracing": True, "settings": {"gi_diffuse_bounces": 1}})
    assert changed == Eevee(samples=9, raytracing=True, settings={"gi_diffuse_bounces": 1})
    assert settings_request(changed) | {"python": None} == {
        "renderer": "eevee",
        "samples": 9,
        "raytracing": True,
        "threads": 1,
        "python": None,
        "replace_after": 100,
        "own": {"gi_diffuse_bounces": 1},
    }


@pytest.mark.parametrize(
    ("name", "given", "said"),
    [
        ("eevee", {"denoise": "fast"}, "engine.denoise: 'denoise' is unknown. Valid: samples, "),
        ("eevee", {"bounces": 2}, "engine.bounces: "),
        ("eevee", {"raytracing": "yes"}, "engine.raytracing: expected true or false, found 'yes'"),
        ("eevee", {"samples": 0}, "engine.samples: expected an integer in 1..65536"),
        ("eevee", {"settings": []}, "engine.settings: expected names of EEVEE settings"),
        ("workbench", {"device": "cuda"}, "engine.device: "),
        ("workbench", {"raytracing": True}, "engine.raytracing: "),
        ("workbench", {"samples": 7}, "engine.samples: expected 1, 5, 8, 11, 16 or 32, found 7"),
        ("workbench", {"samples": True}, "engine.samples: "),
        ("workbench", {"quality": "best"}, "engine.quality: expected draft, good or final"),
    ],
)
def test_a_wrong_option_is_one_line(name, given, said):
    with pytest.raises(RecipeError, match=said) as caught:
        {"eevee": eevee, "workbench": workbench}[name].ENGINE.check(given)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    "scene",
    [
        {"ground": "catcher"},
        {"background": "environment"},
        {"ground": {"catcher": True, "roughness": 0.5}},
        {"ground": {"choice": ["grey", "catcher"]}},
    ],
)
def test_a_catcher_is_a_mistake_of_the_plan(name, scene):
    with pytest.raises(RecipeError, match=rf"^scene\.ground: .* engine: {name}; found catcher, .* raster$") as caught:
        plan(recipe_of({"name": name}, scene=scene))
    assert "\n" not in str(caught.value)
    plan(recipe_of({"name": "cycles"}, scene=scene))


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    ("scene", "grounds"),
    [
        ({"background": "environment", "ground": "off"}, {None}),
        ({"background": "environment", "ground": "on"}, {False}),
        ({"ground": {"choice": ["grey", "white"]}}, {False}),
    ],
)
def test_other_grounds_are_planned_as_they_are_said(name, scene, grounds):
    """No ground, or one that is no catcher."""
    planned = plan(recipe_of({"name": name}, scene=scene))
    made = {shot.scene.ground and shot.scene.ground.catcher for shot in planned.shots(stages().box)}
    assert made == grounds


@pytest.mark.slow
def test_plan_refuses_a_catcher_by_the_recipe_s_line(tmp_path):
    recipe = (
        "models: [{source: zoo:chair}]\nviewpoints: {distance: 2}\nengine: workbench\nscene:\n  sun: on\n  ground: catcher\n"
    )
    (tmp_path / "recipe.yaml").write_text(recipe)
    run = subprocess.run(
        [sys.executable, "-m", "viewsphere", "plan", "recipe.yaml"], cwd=tmp_path, capture_output=True, text=True
    )
    assert run.returncode == 2
    assert "recipe.yaml:6: scene.ground: expected" in run.stderr and len(run.stderr.splitlines()) == 1


@pytest.mark.parametrize("scene", [{}, {"ground": False}, {"sky": "daylight"}, {"sun": "off"}])
def test_what_is_told_is_plain_and_light_comes_from_above(scene):
    shot = shot_of({"name": "workbench"}, scene=scene)
    geometry, meshes = geometry_of(shot)
    told = scene_request(shot.things, meshes, geometry, shot.scene, options_of("workbench", {}), lambda array: "array")
    assert json.loads(json.dumps(told)).keys() == told.keys()
    above, below = np.array(told["hemispheres"])
    assert (above > 0).all() and (below > 0).all()
    sun = sun_light(shot.scene.sky, shot.scene.sun)
    direct = 0 if sun is None else np.array(sun.irradiance) * sun.direction[2] / np.pi
    assert (above + direct).sum() > 0.8 * below.sum()


def test_the_ground_fades_where_blender_is_told_to():
    """Workbench's, which is faded here, and the others', by Blender's nodes."""
    shot = shot_of({"name": "workbench"}, scene={"ground": "on"})
    geometry, meshes = geometry_of(shot)
    told = scene_request(shot.things, meshes, geometry, shot.scene, options_of("workbench", {}), lambda array: "array")
    fading, backdrop = told["ground"]["fading"], Backdrop.for_shot(shot, geometry)
    camera = moved_camera(shot, backdrop.middle - shot.instants[0].focus)
    before = np.linalg.norm(backdrop.middle - camera.center)

    def left(behind, rise):
        away, rise = np.broadcast_arrays(before + np.atleast_2d(behind), np.atleast_2d(rise))
        return backdrop._left(away, rise, camera, np.full(away.shape, backdrop.ground, np.int32))[0]

    begin, end, flat = (fading[name] for name in ("begin", "end", "flat"))
    assert 0 < begin < end
    assert 0 < flat < 1
    np.testing.assert_allclose(left([0, begin, end, 2 * end], 1.0), [1, 1, 0, 0], atol=1e-6)
    np.testing.assert_allclose(left(0.0, [1, flat, 0]), [1, 1, 0], atol=1e-6)
    for steps in (left(np.linspace(begin, end, 9), 1.0), left(0.0, np.linspace(flat, 0, 9))):
        assert (np.diff(steps) < 0).all()


@pytest.mark.parametrize("scene", [{}, {"ground": False}, {"ground": False, "sky": "daylight"}])
def test_the_sky_behind_is_rasters(scene):
    recipe = recipe_of({"name": "raster"}, scene=scene, viewpoints={"azimuth": [130], "elevation": [3], "distance": 0.9})
    (raster,) = render(recipe)
    shot = next(plan(recipe).shots(stages().box))
    geometry, _ = geometry_of(shot)
    visibility = rasterize(geometry, raster.camera)
    nothing = np.zeros((96, 96, 4), np.float32)
    backdrop = Backdrop.for_shot(shot, geometry)
    behind = backdrop.behind(nothing, raster.camera, visibility, False)
    assert np.array_equal(behind[..., 3], np.ones((96, 96)))
    picture = finished(behind, None, shot.scene.finish, lambda: None)
    sky = visibility.triangle < 0
    assert sky.sum() > 1000
    assert np.abs(picture.astype(int) - raster.channels["rgb"])[sky].mean() < 2
    assert not backdrop.behind(nothing, raster.camera, visibility, True).any()


def test_the_ground_fades_and_what_stands_before_it_does_not():
    shot = shot_of({"name": "raster"}, scene={"background": "transparent", "ground": "on"}, channels=["rgba"])
    geometry, _ = geometry_of(shot)
    pose = shot.instants[0].viewpoint.model_copy(update={"elevation_deg": 6})
    camera = camera_of(shot.rig.sensors[0].intrinsics, pose, (0.0, 0.0, 0.05))
    visibility = rasterize(geometry, camera)
    left = Backdrop.for_shot(shot, geometry).behind(np.ones((96, 96, 4), np.float32), camera, visibility, True)[..., 3]
    is_object = (visibility.triangle >= 0) & (geometry.triangle_object[visibility.triangle] > 0)
    is_ground = (visibility.triangle >= 0) & ~is_object
    assert (left[is_object] == 1).all()
    assert left[is_ground].min() < 0.1
    assert left[95].min() > 0.99


def test_a_camera_sees_what_there_is_and_little_more():
    shot = shot_of({"name": "raster"}, viewpoints={"azimuth": [0], "elevation": [10], "distance": 1.5})
    geometry, _ = geometry_of(shot)
    camera = shot.camera(0)
    near, far = clip_of(rasterize(geometry, camera), geometry, camera)
    away = (geometry.vertices @ camera.R.T + camera.t)[:, 2]
    assert near < away.min() and far > away.max()
    assert far / near < 2 * SPARE**2
    beside = moved_camera(shot, (50.0, 0, 0))
    near, far = clip_of(rasterize(geometry, beside), geometry, beside)
    assert 0 < near < far
