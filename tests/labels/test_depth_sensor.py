"""depth_sensor: the noise, steps and holes of depth cameras, against the statistics of the models that they are named for."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

import viewsphere as vs
from proven import close, told
from truth_scenes import cube, lens, orbit_camera, placed
from viewsphere.errors import RecipeError
from viewsphere.labels import LabelContext
from viewsphere.labels.depth_sensor import LABEL, STEPS, _seen, _shadow
from viewsphere.store import Dataset
from viewsphere.truth.raster.visibility import rasterize

FOV = 40.0
WIDTH, HEIGHT = 160, 120


def recipe(elevation=90, distance=2.0, model="zoo:post_box", scene=None, camera=None, **options):
    """By default straight down upon the floor, which is a plane at one depth around the post box."""
    return vs.Recipe.model_validate(
        {
            "models": [{"source": model, "category": "thing", "scale": {"length": 0.05}}],
            "viewpoints": {"azimuth": [0], "elevation": [elevation], "distance": distance},
            "camera": camera or {"size": [WIDTH, HEIGHT], "fov_deg": FOV},
            "channels": ["depth", "depth_sensor", "normals_geometric", "instances"],
            "labels": {"depth_sensor": options},
            "scene": scene or {"ground": True},
            "formats": [],
        }
    )


def floor(**options):
    """Measured and exact depth of the floor alone, far from the object."""
    (sample,) = vs.render(recipe(**options))
    away = np.ones((HEIGHT, WIDTH), bool)
    away[20:-20, 30:-30] = False
    exact = sample.depth[away]
    assert np.ptp(exact) < 1e-4
    return sample.depth_sensor[away].astype(np.float64), float(exact.mean())


@pytest.mark.parametrize("distance", [1.0, 2.0, 4.0])
def test_axial_noise_grows_as_nguyen_measured_it(distance):
    measured, z = floor(distance=distance, step=0)
    wanted = 0.0012 + 0.0019 * (z - 0.4) ** 2
    assert measured.mean() == pytest.approx(z, abs=5 * wanted / math.sqrt(measured.size))
    assert measured.std() == pytest.approx(wanted, rel=5 / math.sqrt(2 * measured.size))
    told("depth_sensor", "deviation by Nguyen 2012, a share of it", measured.std() / wanted - 1)
    doubled, _ = floor(distance=distance, step=0, noise=2.0)
    assert doubled.std() == pytest.approx(2 * wanted, rel=5 / math.sqrt(2 * measured.size))


def test_without_noise_and_steps_depth_is_exact():
    measured, z = floor(noise=0.0, step=0)
    close("depth_sensor", "depth, without noise", measured, z, "m", atol=1e-6)


def test_a_kinect_measures_in_steps_of_its_disparity():
    measured, z = floor(distance=4.0)
    steps = STEPS / (100 * measured)
    np.testing.assert_allclose(steps, np.rint(steps), atol=1e-4)
    quiet, _ = floor(distance=4.0, noise=0.0)
    assert np.unique(quiet).size == 1
    assert abs(quiet[0] - z) <= z * z * 100 / STEPS  # half a step, about


@pytest.mark.parametrize("noise", [0.1, 0.3])
def test_stereo_depth_varies_as_its_disparity(noise):
    """Khoshelham and Elberink 2012: the deviation of depth is z^2 / (f b) times that of disparity."""
    measured, z = floor(kind="stereo", noise=noise, step=0, distance=2.0, baseline=0.1)
    focal = WIDTH / 2 / math.tan(math.radians(FOV / 2))
    wanted = z * z / (focal * 0.1) * noise
    assert measured.std() == pytest.approx(wanted, rel=0.08)
    stepped, _ = floor(kind="stereo", noise=noise, step=0.25, distance=2.0, baseline=0.1)
    disparity = focal * 0.1 / stepped / 0.25
    np.testing.assert_allclose(disparity, np.rint(disparity), atol=1e-3)


def test_a_shadow_is_as_wide_as_the_disparities_differ():
    """A near plate before a wall: beside its left edge the projector, to the right, does not see the wall."""
    depth = np.full((4, 100), 4.0)
    depth[:, 50:70] = 1.0
    reach = 20.0  # pixels times metres
    hidden = _shadow(depth, reach)
    width = reach / 1.0 - reach / 4.0
    np.testing.assert_array_equal(np.flatnonzero(hidden[0]), np.arange(50 - int(width), 50))
    assert not _shadow(np.full((4, 100), 2.0), reach).any()


def test_failures_are_as_many_as_asked_for():
    measured, _ = floor(failures=0.2, noise=0.0)
    share = np.isinf(measured).mean()
    assert share == pytest.approx(0.2, abs=5 * math.sqrt(0.16 / measured.size))


def test_what_is_out_of_range_or_flat_is_a_hole():
    measured, _ = floor(distance=3.0, range=[0.4, 2.0])
    assert np.isinf(measured).all()
    (sample,) = vs.render(recipe(elevation=6, distance=2.0, grazing_deg=60))
    ground = (sample.instances == 0) & np.isfinite(sample.depth)
    assert np.isinf(sample.depth_sensor[ground]).all()


@pytest.mark.parametrize("kind", ["kinect", "stereo"])
def test_a_fisheye_measures_nothing_where_its_lens_has_no_ray(kind):
    """Straight down over the floor; the picture's corners are beyond 180 degrees from the axis."""
    lens = {"size": [32, 32], "focal_px": 6, "distortion": {"model": "fisheye", "coefficients": [0, 0, 0, 0]}}
    (sample,) = vs.render(recipe(kind=kind, camera=lens, noise=0, step=0))
    away = np.hypot(*(np.mgrid[:32, :32] - 15.5)) / 6
    assert np.isinf(sample.depth_sensor[away > math.pi / 2]).all() and (away > math.pi).any()
    assert np.isfinite(sample.depth_sensor[away < 1]).mean() > 0.8


def test_depth_itself_stays_exact_and_the_seed_decides(tmp_path):
    one, again = (next(iter(vs.render(recipe()))) for _ in range(2))
    other = next(iter(vs.render(recipe(seed=7))))
    np.testing.assert_array_equal(one.depth_sensor, again.depth_sensor)
    assert (one.depth_sensor != other.depth_sensor).mean() > 0.5
    np.testing.assert_array_equal(one.depth, other.depth)
    vs.generate(recipe(), tmp_path, workers=0)
    np.testing.assert_array_equal(Dataset(tmp_path)[0].depth_sensor, one.depth_sensor)


def test_it_is_the_same_whether_other_labels_compare_pictures_or_not():
    """These ask for inverse depth that is not rounded; near a step that would decide which one is measured."""
    geometry, camera = placed(cube(0.7), ground=True), orbit_camera(lens(96, 72, 1.1), 0.4, 0.5, 5.0)
    around = SimpleNamespace(drawn_as=("shot", "camera", "0.0"))
    rounded, exact = (
        LabelContext(geometry, camera, rasterize(geometry, camera, keeps_exact=keeps), neighbours=around)
        for keeps in (False, True)
    )
    assert (rounded.inverse_depth != exact.inverse_depth).mean() > 0.5
    for one, other in zip(_seen(rounded), _seen(exact), strict=True):
        np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(LABEL.compute(rounded), LABEL.compute(exact))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"noise": -1}, r"labels\.depth_sensor\.noise: expected"),
        ({"noise": math.nan}, r"labels\.depth_sensor\.noise: expected"),
        ({"kind": "sonar"}, r"labels\.depth_sensor\.kind: 'sonar' is unknown"),
        ({"baseline": 0}, r"labels\.depth_sensor\.baseline: expected"),
        ({"failures": 1.0}, r"labels\.depth_sensor\.failures: expected"),
        ({"nois": 1}, r"labels\.depth_sensor"),
    ],
)
def test_options_that_are_none(options, message):
    with pytest.raises(RecipeError, match=message):
        vs.plan(recipe(**options))
