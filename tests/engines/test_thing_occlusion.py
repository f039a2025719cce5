"""Ambient occlusion of a sequence: baked once for each target, moved with it, and multiplied where several are near."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from light_stage import LightStage, points
from test_occlusion import camera, open_share, some
from test_raster import box, mesh_of

import viewsphere_zoo as zoo
from shots import still_shot
from viewsphere.engines import raster
from viewsphere.geometry.rotation import transform
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Ground, Scene
from viewsphere.model.thing import Motion, Thing

BLOCK = mesh_of(np.concatenate([box((-0.5, -0.5, 0.0), (0.5, 0.5, 0.3)), box((-0.5, -0.5, 0.3), (-0.3, 0.5, 1.2))]))
MESHES = {"block": BLOCK, "wall": mesh_of(box((-0.1, -1.0, 0.0), (0.1, 1.0, 1.5)))}


def pose(x=0.0, y=0.0, z=0.0, turn=0.0, tilt=0.0):
    """Tilted about x, then turned about z (degrees), then moved."""
    (c, s), (d, e) = ((math.cos(math.radians(a)), math.sin(math.radians(a))) for a in (turn, tilt))
    return ((c, -s * d, s * e, x), (s, c * d, -c * e, y), (0.0, e, d, z), (0.0, 0.0, 0.0, 1.0))


def occluded_at(keys, poses, meshes=MESHES, ground=False):
    """The stage's occlusion where these models stand, and a stage to ask about samples, which knows their triangles."""
    things = [
        Thing(id=i + 1, model=ModelSpec(key=key, source="memory", category="c", category_id=1), motion=Motion.still(where))
        for i, (key, where) in enumerate(zip(keys, poses, strict=True))
    ]
    shot = still_shot(things, scene=Scene(ground=Ground() if ground else None, floor=0.0), sequence="s")
    stage = raster.stage(shot, lambda spec: meshes[spec.key])
    baked = stage.baked(0)
    placed = [
        replace(
            meshes[key],
            vertices=transform(where, meshes[key].vertices).astype(np.float32),
            normals=transform(np.array(where)[:3, :3], meshes[key].normals).astype(np.float32),
        )
        for key, where in zip(keys, poses, strict=True)
    ]
    asking = LightStage(*placed, ground=ground)
    asking.origin, asking.unit = np.zeros(3), baked.unit
    return baked.occlusion, asking, stage


def step_samples(where, away=0.0):
    """On the lower step of a block, beside its higher part."""
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(-0.28, 0.45, 9), np.linspace(-0.4, 0.4, 9)))
    own = points(transform(where, np.stack([x, y, np.full_like(x, 0.3 + away)], axis=1)), np.array(where)[:3, 2])
    return own


@pytest.mark.parametrize("tilt", [0.0, 90.0, 180.0])
@pytest.mark.slow
def test_it_moves_with_the_target(tilt):
    still, moved = pose(tilt=tilt), pose(3.0, -7.0, 2.0, 40.0, tilt)
    found = []
    for where in (still, moved):
        occlusion, asking, _ = occluded_at(["block"], [where])
        found.append(asking.occlusion(occlusion, step_samples(where)))
    np.testing.assert_allclose(found[0], found[1], atol=2e-4)
    assert np.ptp(found[0][:, 0]) > 0.2


@pytest.mark.parametrize("tilt", [0.0, 3.0, 17.0, 50.0, 120.0])
@pytest.mark.slow
def test_a_target_in_any_tilt_against_rays(tilt):
    pytest.importorskip("embreex")
    where = pose(0.3, 0.2, 1.5, 25.0, tilt)
    occlusion, asking, _ = occluded_at(["block"], [where])
    s = step_samples(where, away=1e-4)
    truth, _ = open_share(asking, s, upper=False)
    assert np.abs(asking.occlusion(occlusion, s)[:, 0] - truth).mean() < 0.07


@pytest.mark.slow
def test_two_cars_beside_each_other_against_rays():
    pytest.importorskip("embreex")
    cars = {"car": zoo.build("car", np.random.default_rng(3))}
    occlusion, asking, _ = occluded_at(["car", "car"], [pose(-1.3), pose(1.3, 0.4, turn=180)], cars, ground=True)
    s = asking.seen(camera(25, 25, 9.0, (0.0, 0.0, 0.6)))
    s = some(s, np.random.default_rng(1).permutation(len(s.place))[:2500])
    found = asking.occlusion(occlusion, s)[:, 0]
    truth, count = open_share(asking, s, upper=True)
    sure = count > 25
    assert np.abs(found[sure] - truth[sure]).mean() < 0.08
    assert np.corrcoef(found[sure], truth[sure])[0, 1] > 0.7


@pytest.mark.slow
def test_what_is_beside_a_wall_loses_light():
    """More the nearer it is, none far away, and nothing of it depends on the order."""
    s = step_samples(pose())
    stands = [(["block"], [pose()]), (["block", "wall"], [pose(), pose(0.75)]), (["block", "wall"], [pose(), pose(9.0)])]
    stands.append((["wall", "block"], [pose(0.75), pose()]))
    shares = [asking.occlusion(occlusion, s)[:, 0] for occlusion, asking, _ in (occluded_at(*each) for each in stands)]
    assert shares[1].mean() < shares[2].mean() - 0.02
    assert np.abs(shares[2] - shares[0]).mean() < 0.03  # alone it has finer margins
    np.testing.assert_allclose(shares[3], shares[1], atol=1e-6)


def test_a_target_is_baked_once_in_all_of_its_places():
    poses = [pose(2.0 * i, 0.0, 0.0, 33.0 * i) for i in range(4)]
    occlusion, _, stage = occluded_at(["block"] * 4, poses)
    assert len(stage._shades._known) == 1 and len(occlusion.grid) == 4
    assert len(occlusion.volume) == np.prod(occlusion.grid[0, 1:]) and (occlusion.grid == occlusion.grid[0]).all()


@pytest.mark.slow
def test_a_target_that_rises_darkens_the_ground_less():
    below = points([[0.0, 0.0, 0.0]], (0, 0, 1), is_ground=True)
    shares = []
    for z in (0.0, 0.5, 2.0, 50.0):
        occlusion, asking, _ = occluded_at(["block"], [pose(z=z)], ground=True)
        shares.append(asking.occlusion(occlusion, below)[0, 0])
    assert shares[0] < 0.2 and (np.diff(shares) > 0.05).all() and shares[3] > 0.99
