"""Daylight beside published figures: illuminance of sun and sky, how the sky's light is spread, its colour, shadows."""

from __future__ import annotations

import math

import numpy as np
import pytest

from viewsphere.model.scene import Daylight, Sun
from viewsphere.rendering.sky.daylight import air, daylight_picture

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
KLX = 100 / 3
"""Illuminance of an irradiance of 1, as the sun's usual strength of 3 is 100 klx."""
HEIGHT = 90
ROW = (0.5 - (np.arange(HEIGHT) + 0.5) / HEIGHT) * math.pi


def sky_klx(elevation_deg: float, sky: Daylight) -> float:
    """Illuminance of level ground by the sky alone."""
    picture = daylight_picture(elevation_deg, sky, HEIGHT).astype(float) @ LUMINANCE
    weight = np.maximum(np.sin(ROW), 0) * np.cos(ROW) * (math.pi / HEIGHT) ** 2
    return float(weight @ picture.sum(axis=1)) * KLX


def sun_klx(elevation_deg: float, sky: Daylight) -> float:
    """Illuminance of what faces the sun."""
    return float(Sun().strength * (air(elevation_deg, sky) * Sun().color) @ LUMINANCE) * KLX


@pytest.mark.parametrize("elevation", [20, 30, 45, 60, 75])
def test_illuminance_of_a_clear_day(elevation):
    """IES RP-21: direct normal 127.5 exp(-0.21 air mass) klx, diffuse 0.8 + 15.5 sine^0.5 klx."""
    sky, sine = Daylight(turbidity=2.5), math.sin(math.radians(elevation))
    assert sun_klx(elevation, sky) == pytest.approx(127.5 * math.exp(-0.21 / sine), rel=0.15)
    assert sky_klx(elevation, sky) == pytest.approx(0.8 + 15.5 * sine**0.5, rel=0.15)


@pytest.mark.parametrize("elevation", [10, 30, 60])
def test_illuminance_of_an_overcast_day(elevation):
    """IES RP-21: 0.3 + 21 sine klx, and no sun."""
    sky = Daylight(clouds=1)
    assert sky_klx(elevation, sky) == pytest.approx(0.3 + 21 * math.sin(math.radians(elevation)), rel=0.1)
    assert sun_klx(elevation, sky) == 0


@pytest.mark.parametrize("turbidity", [2, 2.5, 3])
def test_shadows_of_a_clear_day_are_five_to_ten_times_darker_than_lit_ground(turbidity):
    sky = Daylight(turbidity=turbidity)
    for elevation in (50, 60, 75):
        shadow = sky_klx(elevation, sky)
        assert 4.9 < (sun_klx(elevation, sky) * math.sin(math.radians(elevation)) + shadow) / shadow < 10


@pytest.mark.parametrize("elevation", [35, 45, 55])
def test_clear_sky_is_as_bright_here_and_there_as_the_standard_sky(elevation):
    """CIE S 011 type 12 (clear, low turbidity), relative to the zenith; away from the sun and the horizon."""
    picture = daylight_picture(elevation, Daylight(turbidity=2.5), HEIGHT).astype(float) @ LUMINANCE
    column = (np.arange(2 * HEIGHT) + 0.5) / HEIGHT * math.pi - math.pi
    sine, sun = np.sin(ROW)[:, None], math.radians(elevation)
    apart = np.arccos(np.clip(np.cos(ROW)[:, None] * np.cos(column) * math.cos(sun) + sine * math.sin(sun), -1, 1))

    def relative(sine, apart):
        scattered = 1 + 10 * (np.exp(-3 * apart) - math.exp(-1.5 * math.pi)) + 0.45 * np.cos(apart) ** 2
        return scattered * (1 - np.exp(-0.32 / np.maximum(sine, 1e-3)))

    standard = relative(sine, apart) / relative(1.0, math.pi / 2 - sun)
    looked = (sine > math.sin(math.radians(4))) & (apart > math.radians(30))
    stops = np.abs(np.log2((picture / picture[0].mean() / standard)[looked]))
    assert stops.mean() < 0.3 and stops.max() < 0.8


def test_clear_sky_is_blue_overhead_and_pale_and_bright_at_the_horizon():
    picture = daylight_picture(45, Daylight(turbidity=2.5), HEIGHT).astype(float)
    zenith, horizon = picture[0].mean(axis=0), picture[HEIGHT // 2 - 3].mean(axis=0)
    assert zenith[2] > 1.6 * zenith[1] > 2.5 * zenith[0]
    assert np.ptp(horizon) / horizon.max() < 0.6 * np.ptp(zenith) / zenith.max()
    assert horizon @ LUMINANCE > 1.4 * zenith @ LUMINANCE
