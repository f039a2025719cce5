"""Automatic exposure over a sequence: equal for every division into shots, any workers, and slower than the light."""

import math

import numpy as np
import pytest

from sequence_recipe import CHANNELS, eventful_recipe
from small import small_recipe
from viewsphere import Dataset, generate, plan, render
from viewsphere.check import check
from viewsphere.engines.shared.metering import Meter
from viewsphere.model.sensors.imager import MountedImager
from viewsphere.rendering.imager.metering import Reading, Settings

AUTO = {"preset": "phone", "white_balance": "auto", "adaptation": 0.5}
KEPT = ("rgb", "bayer", "rgb_linear", "depth", "instances", "flow", "scene_flow", "motion_boundaries")


def eventful(**changes):
    camera = {"size": [64, 48], "fov_deg": 50, "imager": AUTO}
    return eventful_recipe(24, **{"camera": camera, "channels": KEPT, "formats": [], **changes})


def by_frame(samples):
    return {(s.sequence, s.instant, s.sensor): {n: s.channels[n].tobytes() for n in s.channels} for s in samples}


def test_weights_are_those_of_an_exponential_memory_on_a_fixed_grid():
    imager = MountedImager(full_well=1e4, read_noise=1.0, adaptation=0.4, fps=10.0)
    for instant in range(40):
        weights = imager.metering(instant)
        assert max(weights) <= instant and all(at % 2 == 0 and at >= 0 for at in weights)
        assert instant - max(weights) <= 1
        if instant > 13:
            assert weights == {at: pytest.approx(math.exp((at - instant) / 4)) for at in weights} and len(weights) == 7
    assert set(imager.metering(0)) == {0}
    for other in ({"adaptation": 0.0}, {"fps": None}, {"exposure": 0.01, "iso": 100.0}):
        assert imager.model_copy(update=other).metering(5) == {}


def test_a_lamp_that_goes_on_is_followed_slowly():
    """The key is that of the light before, then approaches the new one, in stops, as an exponential."""
    recipe = small_recipe(
        viewpoints={"azimuth": [0], "elevation": 20, "distance": 1.0},
        camera={"size": [8, 6], "fov_deg": 40, "imager": {"preset": "webcam", "adaptation": 1.0}},
        time={"frames": 60, "fps": 10},
        channels=["rgb"],
        formats=[],
        shot_frames=60,
    )
    shot = next(iter(plan(recipe).shots(lambda spec, step=None: np.zeros((8, 3)))))
    asked = []

    def glance(instant, camera):
        asked.append(instant)
        return np.full((camera.height, camera.width, 4), 0.1 if instant < 20 else 1.6, np.float32)

    meter = Meter(shot)
    stops = np.array([meter.reading(i, 0, glance).key for i in range(60)]) - math.log2(0.1)
    assert stops[:20] == pytest.approx(np.zeros(20), abs=1e-5)
    assert (np.diff(stops[20:]) > -1e-9).all() and 1 < stops[24] < 3 and stops[59] > 3.8
    assert len(asked) == len(set(asked)) == 12  # every fifth instant, once


@pytest.mark.slow
def test_pictures_and_labels_are_equal_however_the_sequence_is_cut():
    whole = by_frame(render(eventful(shot_frames=24)))
    assert len(whole) == 2 * 24 * 2
    for frames in (5, 7):
        other = by_frame(render(eventful(shot_frames=frames)))
        assert other.keys() == whole.keys()
        wrong = {(key, name) for key in whole for name in whole[key] if whole[key][name] != other[key][name]}
        assert not wrong, sorted(wrong)[:5]


@pytest.mark.slow
def test_an_imager_changes_no_label_of_a_sequence():
    camera = {"size": [64, 48], "fov_deg": 50}
    names = [name for name in CHANNELS if name != "rgb"]
    shots = [list(render(eventful_recipe(12, camera=c, shot_frames=5))) for c in (camera, {**camera, "imager": AUTO})]
    for plain, taken in zip(*shots, strict=True):
        assert all(plain.channels[name].tobytes() == taken.channels[name].tobytes() for name in names)
        assert repr(plain.objects) == repr(taken.objects)
        assert not np.array_equal(plain.rgb, taken.rgb)


@pytest.mark.slow
def test_workers_change_nothing_and_pictures_are_painted_again(tmp_path):
    recipe = eventful(shot_frames=7)
    generate(recipe, tmp_path / "one", workers=0)
    generate(recipe, tmp_path / "two", workers=2)
    assert by_frame(Dataset(tmp_path / "one")) == by_frame(Dataset(tmp_path / "two"))
    report = check(Dataset(tmp_path / "one"), repaint=None)
    assert report.ok, report.findings


@pytest.mark.slow
def test_exposure_over_a_sequence_keeps_the_picture_near_its_key():
    keys = []
    for sample in render(eventful(shot_frames=12, seed=7)):
        imager = sample.finish.imager
        if sample.sensor == "left":
            keys.append(Reading.of(sample.rgb_linear).key)
            assert Settings.of(imager, Reading.of(sample.rgb_linear)).seconds <= 0.1
            assert 60 < np.median(sample.rgb) < 180
    assert len(keys) == 48


@pytest.mark.slow
@pytest.mark.usefixtures("blender")
@pytest.mark.parametrize("engine", [{"name": "cycles", "samples": 4}, "workbench"])
def test_blender_s_pictures_go_through_the_imager(engine):
    views = {"azimuth": [30], "elevation": 20, "distance": 1.0}
    camera = {"fov_deg": 40, "size": [64, 48], "imager": "webcam"}
    same = {"viewpoints": views, "camera": camera, "channels": ["rgb", "bayer"], "formats": [], "engine": engine}
    samples, again = (
        list(render(small_recipe(time={"frames": 4, "fps": 10}, shot_frames=frames, **same))) for frames in (4, 2)
    )
    for sample, other in zip(samples, again, strict=True):
        assert 300 < sample.bayer.mean() < 2500 and 60 < np.median(sample.rgb) < 200
        assert np.array_equal(sample.bayer, other.bayer)
