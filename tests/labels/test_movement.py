"""Labels of how things and cameras move, in sequences whose motions are known in closed form."""

import numpy as np
import pytest
from PIL import Image, ImageDraw

import viewsphere as vs
from proven import close
from viewsphere.errors import RecipeError
from viewsphere.geometry.rotation import rigid, rotation_about, rotation_vector
from viewsphere.labels import drawable

SPEED, SPIN = (0.3, -0.2, 0.1), (0.0, 0.0, 40.0)


def recipe(**changes):
    said = {
        "models": [
            {"source": "zoo:post_box", "category": "box", "motion": {"kind": "constant", "velocity": SPEED, "spin_deg": SPIN}},
        ],
        "viewpoints": {"kind": "orbit", "azimuth": [0, 40], "elevation": [15, 20], "distance": [4, 3]},
        "rig": {"kind": "stereo", "baseline": 0.1},
        "time": {"frames": 6, "fps": 10},
        "camera": {"size": [32, 24], "fov_deg": 50},
        "channels": ["instances"],
        "annotations": ["velocity", "ego_motion", "sensor_poses"],
        "shot_frames": 2,
        "formats": [],
    }
    return vs.Recipe.model_validate({**said, **changes})


@pytest.fixture(scope="module")
def samples():
    return list(vs.render(recipe()))


def test_a_constant_motion_has_its_velocity(samples):
    for sample in samples:
        (box,) = sample.objects
        close("velocity", "closed form", box.velocity, SPEED, "m/s", atol=1e-9)
        close("velocity", "closed form", box.angular_velocity, np.radians(SPIN), "rad/s", atol=1e-9)
        if 0 < sample.instant < 5:
            np.testing.assert_allclose(box.acceleration, 0, atol=1e-7)
        else:
            assert box.acceleration is None


def test_a_swinging_thing_speeds_up_as_a_pendulum():
    """Central differences of a cosine are the cosine's own derivatives but for a known factor."""
    swing = {"kind": "oscillate", "position": [0.2, 0, 0], "period": 2.0}
    model = {"source": "zoo:post_box", "category": "box", "motion": swing}
    samples = list(vs.render(recipe(models=[model], rig=None, annotations=["velocity"])))
    places = np.array([s.objects[0].box3d.mean(axis=0) for s in samples])
    omega, step = np.pi, 0.1
    for i in range(1, 5):
        (box,) = samples[i].objects
        np.testing.assert_allclose(box.velocity, (places[i + 1] - places[i - 1]) / 0.2, atol=1e-12)
        bend = -(2 - 2 * np.cos(omega * step)) / step**2  # of any sine of this frequency
        middle = places[i] - places[i] @ [1, 0, 0] * np.array([1, 0, 0])
        np.testing.assert_allclose(box.acceleration[0], bend * (places[i][0] - _rest(places, omega * step)), atol=1e-7)
        np.testing.assert_allclose(box.acceleration[1:], 0, atol=1e-7)
        assert middle[0] == 0


def _rest(places, angle):
    """The middle of a swing, from three of its points."""
    a, b, c = places[:3, 0]
    return (a + c - 2 * np.cos(angle) * b) / (2 - 2 * np.cos(angle))


def test_ego_motion_joins_the_cameras_of_neighbours(samples):
    by = {(s.sensor, s.instant): s for s in samples}
    for (sensor, instant), sample in by.items():
        for offset, pose in ((-1, sample.camera_from_previous), (1, sample.camera_from_next)):
            other = by.get((sensor, instant + offset))
            assert (pose is None) == (other is None)
            if other is not None:
                expected = rigid(sample.camera.R, sample.camera.t) @ np.linalg.inv(rigid(other.camera.R, other.camera.t))
                close("ego_motion", "both cameras", pose, expected, "m", atol=1e-9)


def test_the_right_eye_stands_a_baseline_from_the_left(samples):
    for sample in samples:
        left, right = sample.camera_from_sensors
        own = 0 if sample.sensor == samples[0].sensor else 1
        np.testing.assert_allclose((left, right)[own], np.eye(4), atol=1e-9)
        aside = (0.1 if own == 0 else -0.1, 0, 0)
        close("sensor_poses", "the rig's baseline", (left, right)[1 - own][:3, 3], aside, "m", atol=1e-9)


def test_they_are_kept_and_proved(tmp_path):
    vs.generate(recipe(), tmp_path)
    dataset = vs.open(tmp_path)
    for kept, again in zip(dataset, vs.render(recipe()), strict=True):
        np.testing.assert_array_equal(kept.objects[0].velocity, again.objects[0].velocity)
        np.testing.assert_array_equal(kept.camera_from_sensors, again.camera_from_sensors)
        assert kept.requested == again.requested == ("velocity", "ego_motion", "sensor_poses")


@pytest.mark.parametrize(("name", "lacking"), [("velocity", "time"), ("ego_motion", "time"), ("sensor_poses", "rig")])
def test_what_they_need_is_told_before_rendering(name, lacking):
    still = {"viewpoints": {"azimuth": [0], "elevation": [20], "distance": 3}, "time": None, "rig": None}
    models = [{"source": "zoo:post_box", "category": "box"}]
    with pytest.raises(RecipeError, match=rf"annotations\[0\]: expected {lacking} beside {name}"):
        vs.plan(recipe(**still, models=models, annotations=[name]))


@pytest.mark.parametrize("vector", [(0, 0, 0), (0.3, -0.2, 0.9), (0, np.pi, 0), (1e-9, 0, 0), (2.0, 1.0, -0.5)])
def test_rotation_vectors_come_back(vector):
    np.testing.assert_allclose(rotation_vector(rotation_about(vector)), vector, atol=2e-12)


def drawn(sample, name, zoom=8):
    """A label's lines on black, (H, W, 3)."""
    picture = Image.new("RGB", (sample.width * zoom, sample.height * zoom))
    drawable()[name].lines(ImageDraw.Draw(picture, "RGBA"), sample, float(zoom))
    return np.asarray(picture)


@pytest.mark.parametrize(("name", "side"), [("ego_motion", "left"), ("sensor_poses", "right")])
def test_small_maps_of_cameras_lie_in_their_corners(samples, name, side):
    """Of two eyes neither sees the other, so nothing else is drawn."""
    for sample in samples[:2]:
        rows, columns = np.nonzero(drawn(sample, name).any(axis=2))
        assert rows.min() >= 0.55 * sample.height * 8
        assert (columns.max() < 0.45 * sample.width * 8) if side == "left" else (columns.min() > 0.55 * sample.width * 8)


def test_the_axes_of_a_sensor_in_front_are_drawn():
    """Its y, downwards, is as long as a tenth of a metre is at its distance of 0.8 m."""
    rig = {"sensors": {"back": {}, "front": {"position": [0, 0, 0.8]}}}
    sample = next(iter(vs.render(recipe(rig=rig, annotations=["sensor_poses"]))))
    picture = drawn(sample, "sensor_poses")
    green = (picture == (40, 160, 60)).all(axis=2)
    rows, columns = np.nonzero(green)
    assert abs(np.ptp(rows) - 0.1 / 0.8 * sample.camera.K[1, 1] * 8) < 4
    assert abs(columns.mean() - sample.width * 4) < 2
