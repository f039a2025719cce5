"""The position of the sun: NOAA's solar calculator, after Meeus, *Astronomical Algorithms* (2nd ed., chapters 25 and 28)."""

from __future__ import annotations

import math
from datetime import date

_DAY_0 = 1721424.5
"""Julian day of midnight before day 0 of Python's calendar."""


def sun_position(day: str, hours: float, latitude: float, longitude: float) -> tuple[float, float]:
    """Compass azimuth (clockwise from north) and elevation of the sun, degrees, as seen through the air.

    `day`: its date; `hours`: UTC hours of that day, below 0 or above 24 for another day; degrees north and east. Accurate to
    about 0.02 degrees from 1800 to 2100 (https://gml.noaa.gov/grad/solcalc/calcdetails.html).
    """
    century = (date.fromisoformat(day).toordinal() + _DAY_0 + hours / 24 - 2451545) / 36525
    declination, equation = _apparent_sun(century)
    angle = math.radians((hours * 60 + equation + 4 * longitude) / 4 - 180)
    north = math.radians(latitude)
    height = math.sin(north) * math.sin(declination) + math.cos(north) * math.cos(declination) * math.cos(angle)
    elevation = math.degrees(math.asin(min(max(height, -1.0), 1.0)))
    west = math.atan2(
        math.sin(angle) * math.cos(declination),
        math.cos(angle) * math.sin(north) * math.cos(declination) - math.sin(declination) * math.cos(north),
    )
    return (math.degrees(west) + 180) % 360, elevation + _refraction(elevation)


def _apparent_sun(t: float) -> tuple[float, float]:
    """Declination, radians, and the equation of time, minutes, at `t` Julian centuries after 2000."""
    longitude = math.radians((280.46646 + t * (36000.76983 + 0.0003032 * t)) % 360)
    anomaly = math.radians(357.52911 + t * (35999.05029 - 0.0001537 * t))
    eccentricity = 0.016708634 - t * (0.000042037 + 0.0000001267 * t)
    center = (
        math.sin(anomaly) * (1.914602 - t * (0.004817 + 0.000014 * t))
        + math.sin(2 * anomaly) * (0.019993 - 0.000101 * t)
        + math.sin(3 * anomaly) * 0.000289
    )
    node = math.radians(125.04 - 1934.136 * t)
    apparent = longitude + math.radians(center - 0.00569 - 0.00478 * math.sin(node))
    seconds = 21.448 - t * (46.815 + t * (0.00059 - 0.001813 * t))
    tilt = math.radians(23 + (26 + seconds / 60) / 60 + 0.00256 * math.cos(node))
    y = math.tan(tilt / 2) ** 2
    equation = (
        y * math.sin(2 * longitude)
        - 2 * eccentricity * math.sin(anomaly)
        + 4 * eccentricity * y * math.sin(anomaly) * math.cos(2 * longitude)
        - y * y * math.sin(4 * longitude) / 2
        - 1.25 * eccentricity**2 * math.sin(2 * anomaly)
    )
    return math.asin(math.sin(tilt) * math.sin(apparent)), 4 * math.degrees(equation)


def _refraction(elevation: float) -> float:
    """Return the angle by which the air raises the apparent sun, degrees."""
    if elevation > 85:
        return 0.0
    tangent = math.tan(math.radians(elevation))
    if elevation > 5:
        return (58.1 / tangent - 0.07 / tangent**3 + 0.000086 / tangent**5) / 3600
    if elevation > -0.575:
        return (1735 + elevation * (-518.2 + elevation * (103.4 + elevation * (-12.79 + elevation * 0.711)))) / 3600
    return -20.774 / tangent / 3600
