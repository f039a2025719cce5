"""Motion blur: few smeared pictures against many sharp ones, wherever a sequence is cut; labels know nothing of it."""

from __future__ import annotations

import numpy as np
import pytest
from blurred_scenes import SCENES, averaged, load, meshes, picture, psnr, sharp, thing, turned_y
from test_raster import box, mesh_of

from shots import still_shot
from viewsphere.engines import raster
from viewsphere.engines.raster import kernels_blur as kernels
from viewsphere.engines.raster.blurring import MOST, Blur
from viewsphere.model.instant import Viewpoint
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import IDENTITY, Ground, Scene, Sun
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.sensors.exposure import Exposure, Sweep
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Motion, Thing, TimeStep
from viewsphere.truth.raster.visibility import rasterize

SMALL = Intrinsics(width=96, height=72, fx=90, fy=90, cx=48, cy=36)
BLOCK, BENT = (mesh_of(box((-0.4, -0.3, 0.0), (0.4, 0.3, high))) for high in (0.6, 1.4))
STILL = {"block": BLOCK, "other": mesh_of(box((0.6, -0.4, 0.0), (1.0, 0.4, 0.9)))}


@pytest.fixture(scope="module")
def known():
    return meshes()


def compared(scene, pixels, known, count):
    """dB of the blurred picture and of the sharp one where the mean of many differs from the sharp one."""
    shot = SCENES[scene](pixels)
    wanted, one = averaged(shot, known, count), picture(sharp(shot), known)
    area = np.abs(one - wanted).max(axis=-1) > 2
    assert area.mean() > 0.05
    return psnr(picture(shot, known), wanted, area), psnr(one, wanted, area)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "pixels"), [("wheel", 40.0), ("wheel", 125.0), ("car", 40.0), ("car", 250.0), ("pan", 40.0), ("pan", 250.0)]
)
def test_it_is_the_mean_of_many_pictures(scene, pixels, known):
    blurred, one = compared(scene, pixels, known, 32)
    assert blurred > 40 and one < 30, (blurred, one)


@pytest.mark.slow
def test_a_passing_car_is_the_mean_of_some_pictures(known):
    blurred, one = compared("car", 15.0, known, 16)
    assert blurred > 40 and one < 30, (blurred, one)


def test_more_motion_takes_more_pictures(known):
    def count(pixels):
        shot = SCENES["pan"](pixels)
        stage = raster.stage(shot, load(known))
        return Blur(stage.arrangements, 0, 0).count(stage.at(0), rasterize(stage.at(0), shot.camera(0)))

    found = [count(pixels) for pixels in (0.0, 0.5, 3.0, 12.0, 40.0, 150.0, 500.0)]
    assert found[:3] == [1, 1, 2] and found == sorted(found) and found[-1] == MOST


@pytest.mark.slow
def test_less_than_a_pixel_is_nothing(known):
    shot = SCENES["pan"](0.5)
    np.testing.assert_array_equal(picture(shot, known), picture(sharp(shot), known))


def drive(count: int) -> Shot:
    """A block that drives and turns, another that stands, and a camera that moves on, over some instants."""
    nodes, shutter = np.linspace(-0.5, 0.5, 3), 0.6

    def where(t):
        return turned_y(0.4 * t, 0.3 * t - 0.8, 0.0, 0.1 * t + 0.2)

    spec = ModelSpec(key="block", source="memory", category="c", category_id=1)
    own = Thing(id=1, model=spec, motion=Motion(poses=tuple(where(t) for t in range(count))))
    other, _ = thing(2, "other", [IDENTITY])
    views = [Viewpoint(index=i, azimuth_deg=20 + 2 * i, elevation_deg=20, distance=5) for i in range(count)]
    scene = Scene(ground=Ground(), sun=Sun(azimuth=60, elevation=40), floor=-1.0)
    shot = still_shot([own, other], SMALL, views, (0, 0, 0.5), scene=scene, sequence="s")
    moments = tuple((nodes * shutter).tolist())
    exposures = []
    for t, now in enumerate(shot.instants):
        poses = tuple(where(t + u) for u in moments)
        moved = [np.array(now.world_from_rig) + np.outer([0.2 * u, 0.0, 0.0, 0.0], [0, 0, 0, 1]) for u in moments]
        rig = tuple(tuple(map(tuple, m.tolist())) for m in moved)
        sweeps = Sweep(moments=moments, motion=Motion(poses=poses)), None
        exposures.append(Exposure(things=sweeps, rig=Sweep(moments=moments, motion=Motion(poses=rig))))
    return Shot.model_validate(shot.model_dump() | {"shutter": shutter, "exposures": [e.model_dump() for e in exposures]})


def cut(shot: Shot, first: int, stop: int) -> Shot:
    things = [
        each if each.motion.is_still else each.model_copy(update={"motion": Motion(poses=each.motion.poses[first:stop])})
        for each in shot.things
    ]
    parts = {"instants": shot.instants[first:stop], "exposures": shot.exposures[first:stop]}
    return shot.model_copy(update={"things": tuple(things), **parts})


def shown(stage, i):
    return stage.paint(i, 0, rasterize(stage.at(i), stage.shot.camera(i)), ("rgb",))["rgb"]


@pytest.mark.slow
def test_however_a_sequence_is_cut_its_pictures_are_the_same():
    shot = drive(5)
    stage = raster.stage(shot, load(STILL))
    whole = [shown(stage, i) for i in range(5)]
    assert all(not np.array_equal(whole[i], shown(raster.stage(sharp_instants(shot), load(STILL)), i)) for i in range(2))
    assert np.array_equal(shown(stage, 1), whole[1])  # out of order
    for first, stop in ((0, 1), (1, 2), (2, 5)):
        part = raster.stage(cut(shot, first, stop), load(STILL))
        for i in range(first, stop):
            assert np.array_equal(shown(part, i - first), whole[i]), i


def sharp_instants(shot: Shot) -> Shot:
    return shot.model_copy(update={"shutter": 0.0, "exposures": ()})


@pytest.mark.slow
def test_what_labels_are_made_of_stays_as_it_was():
    shot = drive(3)
    stage = raster.stage(shot, load(STILL))
    geometries = [stage.at(i) for i in range(3)]
    before = [(g.vertices.copy(), g.normals.copy(), g.triangle_normals.copy(), g.bounds.copy()) for g in geometries]
    shown(stage, 1)
    for geometry, arrays in zip(geometries, before, strict=True):
        now = geometry.vertices, geometry.normals, geometry.triangle_normals, geometry.bounds
        assert all(np.array_equal(a, b) for a, b in zip(now, arrays, strict=True))
    assert stage.at(1) is geometries[1]


def test_what_deforms_blurs_too():
    """A block that grows from one instant to the next: at the height between, about half of it is seen."""
    steps = tuple(TimeStep(frame=k) for k in range(3))
    spec = ModelSpec(key="block", source="memory", category="c", category_id=1)
    sweep = Sweep(moments=(-1.0, 0.0, 1.0), motion=Motion(steps=steps))
    own = Thing(id=1, model=spec, motion=Motion.still(IDENTITY, steps[1]))
    view = Viewpoint(index=0, azimuth_deg=0, elevation_deg=0, distance=4)
    shot = still_shot([own], SMALL, [view], (0, 0, 0.7), sequence="s", shutter=1.0, exposures=(Exposure(things=(sweep,)),))
    middle = mesh_of(box((-0.4, -0.3, 0.0), (0.4, 0.3, 1.0)))
    by_step = [BLOCK, middle, BENT]
    stage = raster.stage(shot, lambda spec, step=None: by_step[step.frame if step else 1])
    alpha = stage.paint(0, 0, rasterize(stage.at(0), shot.camera(0)), ("rgba",))["rgba"][:, 48, 3] / 255
    row = (36 - 90 * (np.array([0.5, 0.8, 0.9, 1.0, 1.1, 1.35]) - 0.7) / 3.7).astype(int)
    np.testing.assert_allclose(alpha[row], [1.0, 1.0, 0.75, 0.5, 0.25, 0.0], atol=0.17)


def test_a_bar_before_a_wall_smears_like_a_box_filter():
    """Dark and still behind, bright and nearer before, which moves by 8 pixels: its edges are ramps on both sides."""
    height, width = 40, 64
    picture_, way, depth = np.zeros((height, width, 4), np.float32), np.zeros((height, width, 2), np.float32), np.ones((40, 64))
    picture_[:, 20:44] = 1.0
    way[:, 20:44, 0] = 8.0
    depth[:, 20:44] = 2.0
    total, tiles, calmed = np.zeros_like(picture_), np.empty((3, 4, 2), np.float32), np.empty_like(picture_)
    kernels.calm(picture_, calmed)
    kernels.find_longest(way, tiles)
    kernels.smear(picture_, calmed, way, tiles, depth.astype(np.float32), total)
    x = np.arange(64)
    wanted = np.clip((4.0 - np.abs(x - 31.5) + 12) / 8, 0, 1)
    assert np.abs(total[20, :, 0] - wanted).max() < 0.15


def test_a_single_bright_pixel_is_dimmed_and_a_line_is_not():
    light = np.full((9, 9, 4), 0.1, np.float32)
    light[2, 2], light[5, :] = 50.0, 50.0
    out = np.empty_like(light)
    kernels.calm(light, out)
    assert out[2, 2, 0] == pytest.approx(0.3) and (out[5, 1:-1] == 50.0).all() and (out[0] == light[0]).all()


def test_exposures_that_cannot_be_are_refused():
    shot = drive(2)
    with pytest.raises(ValueError, match="increase"):
        Sweep(moments=(0.0, 0.0), motion=Motion())
    with pytest.raises(ValueError, match=r"one a moment \(2\); found 3"):
        Sweep(moments=(0.0, 1.0), motion=Motion(poses=(IDENTITY,) * 3))
    with pytest.raises(ValueError, match="an exposure an instant"):
        Shot.model_validate(shot.model_dump() | {"exposures": ()})
    assert Shot.model_validate_json(shot.model_dump_json()) == shot
