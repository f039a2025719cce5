"""The sky in daylight: Preetham et al. 1999 (*A Practical Analytic Model for Daylight*), and CIE's overcast sky."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from viewsphere.model.scene import Daylight, Sun

Float = NDArray[np.float64]

_WHITE = 33.3
"""Luminance in kcd/m2 of a radiance of 1: the sun's default strength, 3, is then 100 klx, as through clear air (IES RP-21)."""
_CLEAR = 1.8
"""Factor by which Preetham's sky is too bright. At turbidity 3 and with the sun at 45 degrees, it gives 29 klx on level ground;
clear skies give 14 klx (IES RP-21: 0.8 + 15.5 sine^0.5 klx). Zotti et al. 2007 find the same.
"""
_BALANCED = np.array([0.92, 1.02, 1.09])
"""Factors of the sky's red, green and blue: they balance the picture for the sun. Sunlight at noon is yellower than sRGB's
white, while the sun's default colour is nearly white.
"""
_PALE, _PALER = 0.3, 0.1
"""Share by which Preetham's horizon is too dark compared to the CIE's clear sky (S 011, type 12), and the sine of the elevation
over which this share fades.
"""
_EXPOSED = 4.2
"""Light on an exposure meter at which the exposure is unchanged. Clear noon has a quarter of that, so the aperture opens by one
and a half stops. Asphalt and grass then look as in street photographs, and sunlit white walls are just below white.
"""
_OPENED = 0.75  # share of the missing stops by which the aperture opens
_LOWEST = 0.01  # sine of the lowest elevation whose colour is computed; below, the sky has this colour down to the horizon
_GROUND_FADE = 0.09  # sine of the depression below the horizon at which the sky begins to fade into ground
_GROUND_HAZE = 0.12  # sine of the further depression over which it fades
_WAVELENGTHS = np.array([0.61, 0.55, 0.465])  # of red, green and blue, micrometres
_OZONE = np.array([0.122, 0.084, 0.009]) * 0.35  # absorption of 0.35 cm of ozone
_RGB_FROM_XYZ = np.array(
    [[3.2404542, -1.5371385, -0.4985314], [-0.969266, 1.8760108, 0.041556], [0.0556434, -0.2040259, 1.0572252]]
)

# Perez' five coefficients of Y, x and y: the factor of turbidity, and the constant.
_PEREZ = np.array(
    [
        [[0.1787, -1.4630], [-0.3554, 0.4275], [-0.0227, 5.3251], [0.1206, -2.5771], [-0.0670, 0.3703]],
        [[-0.0193, -0.2592], [-0.0665, 0.0008], [-0.0004, 0.2125], [-0.0641, -0.8989], [-0.0033, 0.0452]],
        [[-0.0167, -0.2608], [-0.0950, 0.0092], [-0.0079, 0.2102], [-0.0441, -1.6537], [-0.0109, 0.0529]],
    ]
)
# x and y at the zenith: powers of turbidity 2, 1, 0 by powers of the sun's zenith angle 3, 2, 1, 0.
_ZENITH = np.array(
    [
        [[0.00166, -0.00375, 0.00209, 0.0], [-0.02903, 0.06377, -0.03202, 0.00394], [0.11693, -0.21196, 0.06052, 0.25886]],
        [[0.00275, -0.00610, 0.00317, 0.0], [-0.04214, 0.08970, -0.04153, 0.00516], [0.15346, -0.26756, 0.06670, 0.26688]],
    ]
)


def opening(elevation_deg: float, daylight: Daylight) -> float:
    """Factor for all daylight, sun and sky alike: the aperture that a photographer would choose to make evenings and clouds
    visible.

    The light is measured over a hemisphere, as by an exposure meter, and three quarters of the missing stops are compensated.
    `strength` is not included, so that a sky made brighter by the user stays brighter.
    """
    return (_EXPOSED / _measured(elevation_deg, daylight)) ** _OPENED


def _measured(elevation_deg: float, daylight: Daylight) -> float:
    rows = 16
    row = (0.5 - (np.arange(rows) + 0.5) / rows) * np.pi
    sky = daylight_picture(elevation_deg, daylight, rows).mean(axis=(1, 2))
    level = 2 * math.pi / rows * float((sky * np.maximum(np.sin(row), 0) * np.cos(row)).sum())
    through = float(air(elevation_deg, daylight).mean())
    return level + Sun().strength / math.pi * through * (1 + math.sin(math.radians(elevation_deg))) / 2


def air(elevation_deg: float, daylight: Daylight) -> Float:
    """Share of the sun's red, green and blue that passes through the air, (3,): about 1 at 60 degrees in ordinary air, 0 in
    cloud.
    """
    through = _transmittance(elevation_deg, daylight.turbidity) / _transmittance(60.0, 3.0)
    return through * (1 - daylight.clouds)


def _transmittance(elevation_deg: float, turbidity: float) -> Float:
    """Preetham et al. 1999, appendix A.1: transmittance by Rayleigh scattering, haze and ozone; Kasten's relative air mass."""
    elevation = max(elevation_deg, 0.0)
    mass = 1 / (math.sin(math.radians(elevation)) + 0.15 * (3.885 + elevation) ** -1.253)
    haze = 0.04608365822050 * turbidity - 0.04586025928522
    return np.exp(-mass * (0.008735 * _WAVELENGTHS**-4.08 + haze * _WAVELENGTHS**-1.3 + _OZONE))


def daylight_picture(elevation_deg: float, daylight: Daylight, height: int) -> NDArray[np.float32]:
    """The sky at strength 1, (height, 2 * height, 3): equirectangular, z up, the sun in the middle column.

    Below the horizon its light fades to half as much, with less colour.
    """
    row = (0.5 - (np.arange(height) + 0.5) / height) * np.pi
    column = (np.arange(2 * height) + 0.5) / (2 * height) * 2 * np.pi - np.pi
    sine = np.maximum(np.sin(row), _LOWEST)[:, None]
    sun = math.radians(elevation_deg)
    toward = np.sqrt(1 - sine**2) * np.cos(column) * math.cos(sun) + sine * math.sin(sun)
    clear = _clear(sine, np.clip(toward, -1, 1), sun, daylight.turbidity) * _BALANCED / (_WHITE * _CLEAR)
    clear *= 1 + _PALE * np.exp(-sine / _PALER)[..., None]
    overcast = (0.123 + 8.6 * math.sin(sun)) * (1 + 2 * sine) / (3 * _WHITE)  # Krochmann 1970; CIE S 011
    picture = (1 - daylight.clouds) * clear + daylight.clouds * overcast[..., None]
    below = np.clip((-np.sin(row) - _GROUND_FADE) / _GROUND_HAZE, 0, 1)[:, None, None]
    level = picture[height // 2].mean(axis=0)
    level = (level + level.mean()) / 2
    return (picture + below**2 * (3 - 2 * below) * (0.5 * level - picture)).astype(np.float32)


def _clear(sine: Float, toward: Float, sun: float, turbidity: float) -> Float:
    """Linear red, green, blue in kcd/m2 of a cloudless sky."""
    perez = _PEREZ @ [turbidity, 1.0]
    theta = math.pi / 2 - sun
    chi = (4 / 9 - turbidity / 120) * (math.pi - 2 * theta)
    zenith = [(4.0453 * turbidity - 4.9710) * math.tan(chi) - 0.2155 * turbidity + 2.4192]
    zenith += [float(np.array([turbidity**2, turbidity, 1]) @ z @ [theta**3, theta**2, theta, 1]) for z in _ZENITH]
    apart = np.arccos(toward)
    bright, x, y = (
        value * _perez(coefficients, sine, toward, apart) / _perez(coefficients, np.ones(1), np.sin(sun), theta)
        for value, coefficients in zip(zenith, perez, strict=True)
    )
    y = np.maximum(y, _daylight_locus(x))
    xyz = np.stack([bright * x / y, bright, bright * np.maximum(1 - x - y, 0) / y], axis=-1)
    return np.maximum(xyz @ _RGB_FROM_XYZ.T, 0)


def _daylight_locus(x: Float) -> Float:
    """The least y of daylight with this x. It limits Perez' fit, which turns purple far from the sun, unlike any real sky.

    The curve through all measured daylight of Judd et al. 1964, in the form of CIE 15; constant where it would bend down.
    """
    x = np.clip(x, 0.25, 2.87 / 6)
    return -3 * x * x + 2.87 * x - 0.275


def _perez(c: Float, sine: Float, toward: Float | float, apart: Float | float) -> Float:
    return (1 + c[0] * np.exp(c[1] / sine)) * (1 + c[2] * np.exp(c[3] * apart) + c[4] * np.asarray(toward) ** 2)
