"""Shadows and light in a place far larger than its targets, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from test_raster import BLACK, DARK, SPEC, box, camera, mesh_of, rectangle

from shots import painted, still_shot
from viewsphere.assets.mesh import Material
from viewsphere.engines import raster
from viewsphere.engines.raster.shadows.arriving import arriving
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Finish, Scene, Sky, Sun
from viewsphere.model.thing import Motion, Thing

SUN = Sun(azimuth=90, elevation=45, strength=3.0)
SCENE = Scene(sun=SUN, sky=DARK, finish=Finish(background=BLACK))
FLOOR = Material("floor", (0.5, 0.5, 0.5, 1.0), roughness=1.0, specular=0.0)
SIDE = 400.0


def floor():
    return mesh_of(rectangle((-SIDE / 2, -SIDE / 2, 0), (SIDE, 0, 0), (0, SIDE, 0)), FLOOR)


def moved(x, y, z=0.0):
    return ((1, 0, 0, x), (0, 1, 0, y), (0, 0, 1, z), (0, 0, 0, 1))


def stage_of(target, scenery, scene=SCENE, **options):
    """A target on scenery: (mesh, world from object) each."""
    meshes = {"target": target, **{f"piece{i}": mesh for i, (mesh, _) in enumerate(scenery)}}
    things = (
        Thing(id=1, model=SPEC.model_copy(update={"key": "target"})),
        *(
            Thing(
                id=0,
                model=ModelSpec(key=f"piece{i}", source="memory", category="", category_id=0),
                motion=Motion.still(move),
                scenery=True,
            )
            for i, (_, move) in enumerate(scenery)
        ),
    )
    return raster.stage(still_shot(things, scene=scene, engine_options=options), lambda spec, step=None: meshes[spec.key])


def from_above(stage, x, y, scale, size=160):
    """Brightness of the floor around (x, y), `scale` pixels a metre, and each pixel's world x and y."""
    at = np.array([x + 0.011, y + 0.007])
    view = camera(size, size, scale * 50.0, elevation=90, distance=50.0, target=(*at, 0.0))
    seen = painted(stage, view).astype(int).sum(axis=2)
    along = (np.arange(size) + 0.5 - size / 2) / scale
    return seen, *np.meshgrid(along + at[0], at[1] - along)


BOX = mesh_of(box((-0.5, -0.5, 0.0), (0.5, 0.5, 1.0)))


def shadow_is_right(seen, x, y, low, high, blur):
    """The shadow of a box between these corners; the sun stands over +X at 45 degrees."""
    (x0, y0, _), (x1, y1, top) = low, high
    roof = (x > x0 - blur - 0.1 * top) & (x < x1 + blur + 0.1 * top) & (np.abs(y - (y0 + y1) / 2) < (y1 - y0) * 0.6 + blur)
    deep = (x > x0 - top + blur) & (x < x0 - blur - 0.1 * top) & (y > y0 + blur) & (y < y1 - blur)
    near = (x > x0 - top - blur) & (x < x1 + blur) & (y > y0 - blur) & (y < y1 + blur)
    lit = ~near & ~roof
    assert deep.sum() > 50 and lit.sum() > 50
    assert seen[deep].max() < 0.08 * np.median(seen[lit])
    assert seen[lit].min() > 0.95 * np.median(seen[lit])


def test_a_target_s_shadow_is_sharp_in_a_large_place():
    """1 m on a floor of 400 m: the edge of its shadow is met to 4 cm, a hundredth of what one map of all could."""
    seen, x, y = from_above(stage_of(BOX, [(floor(), moved(0, 0))]), 0, 0, 40)
    shadow_is_right(seen, x, y, (-0.5, -0.5, 0), (0.5, 0.5, 1), 0.04)


@pytest.mark.parametrize(("x", "y", "blur"), [(5.0, 3.0, 0.15), (-30.0, 12.0, 0.5), (20.0, -80.0, 1.0)])
def test_scenery_casts_shadows_near_and_far(x, y, blur):
    house = mesh_of(box((-4, -5, 0), (4, 5, 6)))
    stage = stage_of(BOX, [(floor(), moved(0, 0)), (house, moved(x - 6, y))])
    seen, wx, wy = from_above(stage, x - 10, y, 4)
    away = np.hypot(wx, wy) > 3  # from the target, which has a shadow of its own
    shadow_is_right(np.where(away, seen, np.median(seen)), wx - (x - 6), wy - y, (-4, -5, 0), (4, 5, 6), blur)


def test_scenery_shades_the_target():
    """A wall between sun and target: the target's sunny side is dark."""
    wall = mesh_of(box((3, -5, 0), (3.2, 5, 8)))
    view = camera(64, 64, 300.0, azimuth=90, elevation=0, distance=2.0, target=(0.5, 0, 0.5))

    def face(scenery):
        stage = stage_of(BOX, scenery)
        return painted(stage, view).astype(int)[24:40, 24:40]

    assert face([(floor(), moved(0, 0))]).min() > 150
    assert face([(floor(), moved(0, 0)), (wall, moved(0, 0))]).max() < 80  # what the surroundings throw back


def test_no_acne_on_the_floor_and_on_walls():
    """Even light on the whole floor, across the borders of all shadow maps."""
    stage = stage_of(BOX, [(floor(), moved(0, 0))])
    for scale in (0.5, 2.0, 8.0):
        seen, x, y = from_above(stage, 0, 0, scale)
        away = (np.abs(x) > 3) | (np.abs(y) > 3)
        assert np.ptp(seen[away]) <= 6


def test_a_target_darkens_the_scenery_it_stands_on_as_it_does_the_ground():
    """Under the sky alone: as dark beside its foot on a road as on the ground, and not on a roof above."""
    scene = Scene(sun=None, sky=Sky(), finish=Finish(background=BLACK))
    stage = stage_of(BOX, [(floor(), moved(0, 0))], scene)
    seen, x, y = from_above(stage, 0, 0, 40)
    foot = (np.abs(x) < 0.56) & (np.abs(x) > 0.54) & (np.abs(y) < 0.3)
    far = np.hypot(x, y) > 1.7
    assert seen[foot].mean() < 0.85 * seen[far].mean()
    high = stage_of(
        BOX, [(floor(), moved(0, 0)), (mesh_of(rectangle((-9, -9, 0), (18, 0, 0), (0, 18, 0)), FLOOR), moved(0, 0, 3))]
    )
    above, x, y = from_above(high, 0, 0, 8)
    inner = (np.abs(x) < 8) & (np.abs(y) < 8)
    assert np.ptp(above[inner]) <= 3


@pytest.mark.slow
def test_the_next_target_is_lit_by_the_same_place_and_another_sun_by_another():
    """Kept shadows are those of the place and the sun at hand."""
    house = mesh_of(box((-4, -5, 0), (4, 5, 6)))
    place = [(floor(), moved(0, 0)), (house, moved(20, 0))]
    first = stage_of(BOX, place)
    second = stage_of(mesh_of(box((-0.4, -0.6, 0), (0.4, 0.6, 0.9))), place)
    assert first.baked(0).lights.views.depth.size == second.baked(0).lights.views.depth.size
    west = stage_of(BOX, place, SCENE.model_copy(update={"sun": Sun(azimuth=270, elevation=45)}))
    for stage, shaded, lit in ((second, 13, 27), (west, 27, 13)):
        seen, x, _ = from_above(stage, 20, 0, 4)
        at = [int(np.abs(x[0] - v).argmin()) for v in (shaded, lit)]
        assert seen[80, at[0]] < 0.1 * seen[80, at[1]]


def test_without_scenery_there_are_no_wide_maps():
    assert len(stage_of(BOX, []).baked(0).lights.views.form) == 1
    assert len(stage_of(BOX, [(floor(), moved(0, 0))]).baked(0).lights.views.form) > 1
    no_sun = SCENE.model_copy(update={"sun": None, "sky": Sky()})
    assert len(stage_of(BOX, [(floor(), moved(0, 0))], no_sun).baked(0).lights.views.form) == 0


def test_no_corner_of_a_place_is_beyond_its_shadow_map():
    """A sun that looks along a diagonal sees corners far from the middle of its map: what lies in a closed hall stays dark."""
    bounce_scene = mesh_of(box((-8, -8, -0.2), (8, 8, 4)))
    sun = Sun(azimuth=45, elevation=30, strength=3.0)
    small = mesh_of(box((0, 0, 0), (0.3, 0.3, 0.3)))
    baked = stage_of(small, [(bounce_scene, moved(0, 0))], Scene(sun=sun, sky=DARK)).baked(0)
    x, y = np.meshgrid(np.linspace(-7.4, 7.4, 40), np.linspace(-7.4, 7.4, 40))
    places = (np.stack([x, y, np.full_like(x, 0.01)], axis=-1).reshape(-1, 3) - baked.origin) / baked.unit
    _, share = arriving(baked.lights, 0, places, 0.4 / baked.unit)
    assert share.max() < 0.01
