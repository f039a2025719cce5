"""Lamps of a place at night: which are lights, what glows, which windows are lit, and that a floor below one is lit by it."""

from dataclasses import replace

import numpy as np
import pytest
from light_stage import SPEC, flat, quad
from test_physics import camera

from shots import painted, still_shot
from viewsphere import Recipe
from viewsphere.assets.mesh import Material, Mesh
from viewsphere.engines import raster
from viewsphere.engines.shared.lamps import BELOW, GLOW, ROOM, lamplight, lit
from viewsphere.errors import RecipeError
from viewsphere.model.scene import Ground, Scene, Sky
from viewsphere.model.thing import Motion, Thing
from viewsphere.model.weather import Lamps
from viewsphere.planning.plan import plan

DARK = Sky(strength=0.0)
MIDDLE = np.array([0.0, 0.0, 0.5])


def still(x, y, z=0.0) -> Motion:
    return Motion.still(((1, 0, 0, x), (0, 1, 0, y), (0, 0, 1, z), (0, 0, 0, 1)))


def lantern() -> Mesh:
    """A lens of 0.2 x 0.2 m, 4 m above its foot."""
    return replace(flat(quad((-0.1, -0.1, 4.0), (0.2, 0, 0), (0, 0.2, 0)), Material(emissive=(0.5, 0.4, 0.3))), parts=("lens",))


def posts(places) -> list[Thing]:
    return [Thing(id=0, model=SPEC, scenery=True, motion=still(x, y)) for x, y in places]


def test_the_nearest_lenses_are_lights_that_look_down():
    things = posts([(30, 0), (3, 4), (0, 10), (0, -2)])
    scene = lamplight(Scene(lamps=Lamps(most=2, strength=50.0)), things, [lantern()] * 4, MIDDLE)
    assert [(light.position, light.strength) for light in scene.lights] == [
        (pytest.approx((x, y, 4 - BELOW - 0.5)), 50.0) for x, y in ((0, -2), (3, 4))
    ]
    assert all(light.kind == "spot" and light.toward[2] < light.position[2] for light in scene.lights)
    assert lamplight(Scene(), things, [lantern()] * 4, MIDDLE) == Scene()


def test_a_floor_below_a_lamp_is_lit_by_it():
    """The irradiance below is strength over the distance squared; a matt floor sends 1/pi of it."""
    foot = flat(quad((-0.05, -0.05, 0), (0.1, 0, 0), (0, 0, 0.1)), Material(base_color=(0, 0, 0, 1)))
    things = [Thing(id=1, model=SPEC, motion=still(0.5, 0.5)), *posts([(0, 0)])]
    models = {0: foot, 1: lantern()}
    found = {}
    for lamps in (None, Lamps(strength=30.0, color=(1.0, 1.0, 1.0))):
        scene = Scene(sun=None, sky=DARK, ground=Ground(color=(0.735, 0.735, 0.735), pattern="plain"), lamps=lamps)
        named = [t.model_copy(update={"model": SPEC.model_copy(update={"key": str(i)})}) for i, t in enumerate(things)]
        stage = raster.stage(still_shot(named, scene=scene), lambda spec, step=None: models[int(spec.key)])
        found[lamps is not None] = painted(stage, camera(32, 32, 30, 0, 80, 2.5))[16, 16, 0]
    assert found[False] < 3 and found[True] > 100


def test_what_glows_shines_and_a_share_of_windows_is_lit():
    panes = [flat(quad((4.0 * i, 0, 1), (1, 0, 0), (0, 0, 1)), Material()) for i in range(60)]
    house = Mesh(
        vertices=np.concatenate([p.vertices for p in panes]),
        triangles=np.concatenate([p.triangles + len(p.vertices) * i for i, p in enumerate(panes)]).astype(np.int32),
        normals=np.concatenate([p.normals for p in panes]),
        triangle_material=np.zeros(120, np.int32),
        triangle_part=np.zeros(120, np.int32),
        parts=("window",),
        materials=(Material(),),
    )
    things = posts([(0, 0), (5, 0), (5, 0)])
    one, other, same = lit(things, [house] * 3, Lamps(windows=0.5))
    shining = one.triangle_material.reshape(60, 2)
    assert (shining[:, 0] == shining[:, 1]).all() and 15 < shining[:, 0].sum() < 45
    assert one.materials[1].emissive == ROOM
    assert (other.triangle_material != one.triangle_material).any()
    assert (other.triangle_material == same.triangle_material).all()
    lamps = lit(posts([(0, 0), (9, 9)]), [lantern()] * 2, Lamps())
    assert lamps[0] is lamps[1] and lamps[0].materials[0].emissive == pytest.approx((0.5 * GLOW, 0.4 * GLOW, 0.3 * GLOW))
    assert lit(posts([(0, 0)]), [house], Lamps(windows=0.0))[0] is house
    screen = replace(lantern(), materials=(Material("screen", emissive=(0.4, 0.4, 0.4)),))
    assert lit(posts([(0, 0)]), [screen], Lamps())[0] is screen


def night(**scene) -> Recipe:
    return Recipe(
        models=[{"source": "zoo:post_box", "category": "box"}],
        viewpoints={"azimuth": 0, "elevation": 20, "distance": 2},
        scene={"sky": "night", **scene},
    )


def test_lamps_are_lit_at_night_unless_a_recipe_says_otherwise():
    def lamps(recipe):
        return plan(recipe).scenes.scene("post_box", "pose").lamps

    assert lamps(night()) == Lamps()
    assert lamps(night(lamps="off")) is None
    assert lamps(night(sky="daylight")) is None
    assert lamps(night(sky="daylight", lamps=True)) == Lamps()
    assert lamps(night(lamps={"most": 3})).most == 3


def test_the_moon_stands_for_the_sun_at_night():
    scenes = plan(night()).scenes
    moon = scenes.scene("post_box", "pose").sun
    assert moon is not None and moon.strength < 0.2 and moon.color[2] > moon.color[0]
    assert plan(night(sun="off")).scenes.scene("post_box", "pose").sun is None


@pytest.mark.parametrize(
    "sun", [{"elevation": 50.0}, {"date": "2026-06-21", "time": "12:00Z", "latitude": 48, "longitude": 11}]
)
def test_no_sun_stands_above_the_horizon_at_night(sun):
    with pytest.raises(RecipeError, match=r"scene\.sun: expected auto, off, or a date and time of the night beside sky: night"):
        plan(night(sun=sun))


def test_a_date_of_the_night_goes_with_a_sky_of_night():
    sun = {"date": "2026-06-21", "time": "00:00Z", "latitude": 48, "longitude": 11}
    assert not any("scene" in warning for warning in plan(night(sun=sun)).warnings)
