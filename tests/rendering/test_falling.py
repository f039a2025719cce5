"""What falls: as many drops as the distributions say, in places that follow from the world and time, behind what is nearer."""

import math
from itertools import pairwise

import numpy as np
import pytest

from viewsphere.geometry.camera import orbit_rotation
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.model.weather import Rain, Snow
from viewsphere.rendering.weather import kernels_falling as kernels
from viewsphere.rendering.weather.falling import CLASSES, IN_A_CELL, _there, fall
from viewsphere.rendering.weather.precipitation import diameter, extinction, number, sizes, speed

LENS = Intrinsics(width=96, height=64, fx=80, fy=80, cx=48, cy=32)
RAIN = Rain(rate=20.0, seed=3, color=(1.0, 1.0, 1.0))
SNOW = Snow(rate=2.0, seed=3, color=(1.0, 1.0, 1.0))


def camera(x=0.0, y=0.0, z=1.5, azimuth=0.0) -> Camera:
    rotation = orbit_rotation(azimuth, 0.0)
    return Camera(LENS, rotation, -rotation @ np.array([x, y, z]))


def picture(falling, view=None, seconds=0.0, nearest=0.0):
    view = view or camera()
    out = np.zeros((LENS.height, LENS.width, 4), np.float32)
    fall(out, falling, view, seconds, np.full(out.shape[:2], nearest, np.float32))
    return out


def everywhere(seed, mean, size, reach=6):
    low, high = np.full(3, -reach, np.int64), np.full(3, reach - 1, np.int64)
    far, ahead = 1e6, np.array([0.0, 1.0, 0.0])
    return kernels.scatter(np.uint64(seed), low, high, size, mean, np.zeros(3), np.zeros(3), ahead, far, -1.0, 1_000_000)[0]


def test_a_volume_holds_as_many_drops_as_the_distribution_says():
    dense = number(RAIN, 1.0, 6.0)
    assert dense == pytest.approx(
        sum(8000 * math.exp(-4.1 * 20**-0.21 * d) * 0.001 for d in np.arange(1.0005, 6, 0.001)), rel=1e-5
    )
    size = (IN_A_CELL / dense) ** (1 / 3)
    places = everywhere(7, IN_A_CELL, size)
    expected = dense * (12 * size) ** 3
    assert abs(len(places) - expected) < 4 * math.sqrt(expected)
    counts, _ = np.histogramdd(places, bins=[12] * 3, range=[(-6 * size, 6 * size)] * 3)
    assert counts.mean() == pytest.approx(IN_A_CELL, rel=0.05) and counts.var() == pytest.approx(IN_A_CELL, rel=0.1)


def test_places_are_uniform_in_their_cells():
    places = everywhere(1, 6.0, 1.0)
    shares = places - np.floor(places)
    for axis in range(3):
        found = np.sort(shares[:, axis])
        assert np.abs(found - (np.arange(len(found)) + 0.5) / len(found)).max() < 1.95 / math.sqrt(len(found))


def test_diameters_divide_drops_into_equal_shares():
    edges = [diameter(RAIN, 0.8, 6.0, i / CLASSES) for i in range(CLASSES + 1)]
    each = [number(RAIN, a, b) for a, b in pairwise(edges)]
    assert edges[0] == pytest.approx(0.8) and edges[-1] == pytest.approx(6.0)
    np.testing.assert_allclose(each, number(RAIN, 0.8, 6.0) / CLASSES, rtol=1e-9)


@pytest.mark.parametrize("rate", [2.0, 10.0, 50.0])
def test_rain_dims_light_as_measured(rate):
    """b = .312 R^.67 per km (Halder et al. 2019)."""
    assert extinction(Rain(rate=rate)) * 1000 == pytest.approx(0.312 * rate**0.67, rel=0.15)


def test_speeds_and_sizes():
    assert speed(RAIN, 2.0) == pytest.approx(200 * math.sqrt(0.001))
    assert 0.8 < speed(SNOW, 0.5) < speed(SNOW, 3.0) < 1.6
    assert sizes(SNOW).slope == pytest.approx(2.55 * 2**-0.48)


@pytest.mark.slow
def test_pictures_follow_from_seed_and_moment_alone():
    assert (picture(RAIN) == picture(RAIN)).all()
    assert (picture(RAIN) != picture(RAIN, seconds=0.04)).any()
    assert (picture(RAIN) != picture(RAIN.model_copy(update={"seed": 4}))).any()


@pytest.mark.parametrize("falling", [RAIN, pytest.param(SNOW, marks=pytest.mark.slow)])
def test_nothing_is_seen_in_front_of_what_is_nearer(falling):
    assert picture(falling).any()
    assert not picture(falling, nearest=1 / 0.3).any()
    assert picture(falling, nearest=1 / 3.0).sum() < picture(falling).sum()


def test_air_that_has_fallen_holds_the_same_drops():
    """What is before a camera at two moments are the same drops of the air, but for those that came in and went out."""
    velocity = np.array([0.0, 0.0, -6.0])
    first, later = (_there(RAIN, 0, 50.0, velocity * t, camera())[0] for t in (0.0, 0.05))
    same = {row.tobytes() for row in first} & {row.tobytes() for row in later}
    assert 0.6 * len(first) < len(same) < len(first)


def test_wind_carries_what_falls():
    """A camera that the wind carries along sees what one in still air sees."""
    flash = RAIN.model_copy(update={"exposure": 1e-5})
    carried = picture(flash.model_copy(update={"wind": (1.0, 0.5)}), camera(x=2.0, y=1.0), 2.0)
    still = picture(flash, camera(), 2.0)
    assert still.any() and np.abs(carried - still).max() < 0.01


def test_two_cameras_see_the_same_drops_of_the_world():
    views = camera(), camera(x=0.3)
    found = [_there(RAIN, 0, 50.0, np.zeros(3), view)[0] for view in views]
    same = {row.tobytes() for row in found[0]} & {row.tobytes() for row in found[1]}
    assert len(same) > 0.8 * min(map(len, found))


def test_streaks_are_as_long_as_their_drops_fall():
    """A longer exposure spreads the same light over more pixels."""
    short, long = (picture(Rain(rate=0.3, seed=3, exposure=t, color=(1.0, 1.0, 1.0))) for t in (0.001, 0.01))
    assert long.max() < 0.5 * short.max()


@pytest.mark.slow
def test_a_lens_that_sees_everywhere_sees_rain_everywhere():
    bent = {"model": "fisheye", "coefficients": (0.0,) * 4}
    fisheye = Intrinsics(width=96, height=64, fx=30, fy=30, cx=48, cy=32, distortion=bent)
    view = Camera(fisheye, camera().R, camera().t)
    out = np.zeros((64, 96, 4), np.float32)
    fall(out, SNOW, view, 0.0, np.zeros((64, 96), np.float32))
    assert out[..., 3].any()
