"""Passes of Cycles: composed they are the picture, and they are raster's as far as light does not bounce."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from light_stage import ball, cuboid, flat
from test_passes import ALL, SUN, made, passes, still_life
from test_physics import SPEC, camera

from shots import still_shot
from viewsphere.assets.mesh import Material
from viewsphere.engines import cycles, raster
from viewsphere.geometry.lenses import lens_parameters
from viewsphere.model.channel import LIGHT_PASSES, MATERIAL_PASSES
from viewsphere.model.scene import Background, Finish, Ground, Scene
from viewsphere.model.thing import Thing
from viewsphere.rendering.background import display_background
from viewsphere.rendering.view import develop

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("blender")]

VIEW = camera(120, 90, 90, 25, 14, 4.2, (0, 0, 0.4))
CLEAR = Background()
COLORED = Background(color=(0.2, 0.4, 0.7))


def objects():
    """The still life with a metal ball and a clear pane instead of its green one."""
    cut, _, veil, coat, lamp = still_life()
    pane = flat(
        cuboid((-0.6, -0.9, 0), (0.5, -0.85, 0.8)), Material(base_color=(0.9, 0.9, 0.9, 1), transmission=1.0, roughness=0.0)
    )
    metal = made(ball(0.25, (1.2, -0.4, 0.25)), base_color=(0.9, 0.6, 0.3, 1), metallic=1.0, roughness=0.3)
    return [cut, pane, veil, coat, lamp, metal]


def stage_of(engine, ground, **options):
    meshes = objects()
    things = [Thing(id=i + 1, model=SPEC.model_copy(update={"key": f"m{i}"})) for i in range(len(meshes))]
    name = engine.__name__.rpartition(".")[2]
    shot = still_shot(things, scene=Scene(sun=SUN, ground=ground), engine=name, engine_options=options)
    return engine.stage(shot, lambda spec, step=None: meshes[int(spec.key[1:])])


@cache
def both(is_catcher: bool):
    """Cycles' passes, and raster's."""
    ground, finish = Ground(catcher=is_catcher), Finish(background=COLORED if is_catcher else CLEAR)
    noisy = stage_of(cycles, ground, samples=96, denoise="off")
    return passes(noisy, VIEW, ("rgb", *ALL), finish), passes(stage_of(raster, ground), VIEW, ALL, finish)


def test_composed_they_are_the_picture():
    found, _ = both(False)
    light = found["albedo"].astype(np.float64) * found["shading"] + found["residual"]
    composed = develop(np.dstack([light, np.ones((90, 120))]).astype(np.float32), None, Finish().view)
    apart = np.abs(composed.astype(int) - found["rgb"])
    assert apart.max() <= 1 and (apart > 0).mean() < 0.005
    assert (found["emission"] <= found["residual"] * (1 + 1e-5) + 1e-6).all()


def test_they_change_no_picture():
    stage = stage_of(cycles, Ground(), samples=4)
    alone = passes(stage, VIEW, ("rgb",))["rgb"]
    assert passes(stage, VIEW, ("rgb", *ALL))["rgb"].tobytes() == alone.tobytes()
    assert passes(stage, VIEW, ("rgb",))["rgb"].tobytes() == alone.tobytes()


@pytest.mark.parametrize("is_catcher", [False, True])
def test_they_are_raster_s(is_catcher):
    """Materials to the pixel; albedo within 1 %, but for edges and noise; light as far as it does not bounce."""
    found, expected = both(is_catcher)
    for name in MATERIAL_PASSES:
        assert np.mean(np.abs(found[name] - expected[name]) > 0.01) < 0.002, name
    albedo = expected["albedo"]
    apart = np.abs(found["albedo"] - albedo)
    assert np.median(apart[albedo > 0.05]) < 0.02
    assert np.mean(apart > 0.05) < 0.03
    assert found["albedo"].mean() == pytest.approx(albedo.mean(), rel=0.05 if is_catcher else 0.01)
    assert found["emission"].mean() == pytest.approx(expected["emission"].mean(), rel=0.05)
    diffuse = [(each["albedo"] * each["shading"]).mean() for each in (found, expected)]
    assert diffuse[0] == pytest.approx(diffuse[1], rel=0.1)
    for name in LIGHT_PASSES:
        assert np.isfinite(found[name]).all() and found[name].min() >= 0
    if is_catcher:
        assert found["albedo"][-10:].max() == 0


def test_lenses_and_passes_alone():
    """Without a picture; with a lens that Blender has not."""
    bent = VIEW.intrinsics.model_copy(
        update={"distortion": lens_parameters("brown_conrady", coefficients=(-0.1, 0.02, 0, 0, 0))}
    )
    view = type(VIEW)(bent, VIEW.R, VIEW.t)
    found = passes(stage_of(cycles, Ground(), samples=16, denoise="off"), view, ALL)
    expected = passes(stage_of(raster, Ground()), view, ALL)
    assert np.mean(np.abs(found["roughness"] - expected["roughness"]) > 0.01) < 0.02
    assert np.mean(np.abs(found["albedo"] - expected["albedo"]) > 0.05) < 0.05
    assert display_background(CLEAR, 8, 8) is None and found["residual"][0].min() > 0.1  # the sky
