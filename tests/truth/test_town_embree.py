"""Which points are hidden in a whole neighbourhood with twenty cars that drive and spin through it, against Embree.

Embree's rays are float32: each difference is settled by float64 rays at every triangle, and none goes against us.
"""

import numpy as np
import pytest
from test_point_raster import embree_scene
from two_views import brute_hidden

import viewsphere as vs
from viewsphere.engines.shared.arranged import Arrangements
from viewsphere.run.shots.stages import Stages
from viewsphere.truth.correspondences.correspondence import Match
from viewsphere.truth.raster.visibility import rasterize
from viewsphere.truth.shot_views import ShotViews
from viewsphere.truth.surface_points.draws import points_on
from viewsphere.truth.surface_points.raster import OCCLUDED

pytest.importorskip("embreex")
pytestmark = [pytest.mark.slow]
POINTS = 100_000


@pytest.fixture(scope="module")
def town():
    """A shot of three instants; its cars drive, turn about their own axes, and rise from the ground."""
    driving = [
        {"kind": "path", "lane": "any", "speed": {"uniform": [4, 12]}, "offset": {"uniform": [80, 120]}},
        {"kind": "oscillate", "rotation_deg": [3, 2, 10], "position": [0.5, 0, 0.1], "period": 1.5},
    ]
    recipe = vs.Recipe(
        models=[{"source": "zoo:car", "count": 4, "motion": driving}],
        viewpoints={"kind": "mast", "position": [3.0, -22.0, 2.5], "look": "center"},
        scenes={"count": 1, "objects": 20, "repeat": True},
        scene={"place": "zoo:neighbourhood"},
        time={"frames": 3, "fps": 10},
        camera={"size": [640, 480], "fov_deg": 60},
        splits={"by": "sequence"},
    )
    stages = Stages()
    shot = vs.plan(recipe).shot(0, stages.box)
    arranged = Arrangements.build(shot, stages.model)
    return shot, ShotViews(shot, lambda i: arranged.at(i).geometry)


def settled(there, world, state, own) -> int:
    """How many points (N, 3) in the picture Embree judges otherwise than `state` (N,) says; fails where Embree is right."""
    scene, center = embree_scene(there.geometry), there.camera.center
    away = world - center
    origin = np.broadcast_to(center.astype(np.float32), away.shape).copy()
    hit = scene.run(origin, away.astype(np.float32), output=True)
    theirs = (hit["tfar"] < 1 - 2e-5) & (hit["primID"] != own)
    differ = np.flatnonzero(theirs != (state == OCCLUDED))
    hidden, _ = brute_hidden(there, world[differ], own[differ], chunk=1)
    assert np.array_equal(hidden, state[differ] == OCCLUDED)
    return len(differ)


@pytest.mark.parametrize("on", ["cars", "everything"])
def test_a_hundred_thousand_points_in_the_picture(town, on):
    shot, views = town
    rng = np.random.default_rng(0)
    first, there = views.view(0, 0), views.view(2, 0)
    cars = [i for i, thing in enumerate(shot.things) if thing.model.source == "zoo:car" and not thing.motion.is_still]
    assert len(cars) == 20 and len(first.geometry.triangles) > 750_000
    drawn = points_on(first, 10 * POINTS, rng, things=cars if on == "cars" else range(len(first.things)))
    points = drawn.chosen(np.flatnonzero(drawn.in_view(there).state <= OCCLUDED)[:POINTS])
    seen = points.in_view(there)
    own = np.array(there.geometry.triangle_start)[points.thing] + points.triangle
    differences = settled(there, seen.world, seen.state, own)
    hidden = (seen.state == OCCLUDED).mean()
    print(f"{on}: {len(points):,} points, {hidden:.3f} hidden, {differences} differ")
    assert len(points) == POINTS and 0.5 < hidden < 0.99 and differences < 200


def test_all_pixels_of_the_town_an_instant_later(town):
    _, views = town
    here, there = views.view(0, 0), views.view(1, 0)
    match = Match(here, rasterize(here.geometry, here.camera), there)
    inside = (match.state <= OCCLUDED) & np.isfinite(match.xyz).all(axis=-1)
    world = (match.xyz[inside] - there.camera.t) @ there.camera.R
    differences = settled(there, world, match.state[inside], match.placed.own()[inside])
    hidden = (match.state[inside] == OCCLUDED).mean()
    print(f"pixels: {inside.sum():,}, {hidden:.4f} hidden, {differences} differ")
    assert inside.sum() > 100_000 and hidden > 0.002 and differences < 0.01 * inside.sum()
