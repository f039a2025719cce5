"""Places on the globe, as WGS 84 has them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]

AXIS, FLATTENING = 6378137.0, 1 / 298.257223563
OVAL = FLATTENING * (2 - FLATTENING)

STEPS = 8
"""Of the search for a latitude, each of which leaves less than a hundredth of the error."""


def compass(latitude: float, longitude: float) -> Float:
    """The directions east, north and up at a place (radians), the columns of (3, 3)."""
    (s, c), (sl, cl) = (math.sin(latitude), math.cos(latitude)), (math.sin(longitude), math.cos(longitude))
    return np.array([[-sl, -s * cl, c * cl], [cl, -s * sl, c * sl], [0.0, c, s]])


def earth(latitude: float, longitude: float, altitude: float) -> Float:
    """Earth-centred metres (3,) of a place (radians, metres)."""
    across = AXIS / math.sqrt(1 - OVAL * math.sin(latitude) ** 2)
    flat = (across + altitude) * math.cos(latitude)
    return np.array(
        [flat * math.cos(longitude), flat * math.sin(longitude), (across * (1 - OVAL) + altitude) * math.sin(latitude)]
    )


def globe(place: Float) -> tuple[float, float, float]:
    """Latitude, longitude (radians) and altitude (metres) of an earth-centred point."""
    x, y, z = place.tolist()
    flat = math.hypot(x, y)
    latitude = math.atan2(z, flat * (1 - OVAL))
    for _ in range(STEPS):
        across = AXIS / math.sqrt(1 - OVAL * math.sin(latitude) ** 2)
        latitude = math.atan2(z + OVAL * across * math.sin(latitude), flat)
    across = AXIS / math.sqrt(1 - OVAL * math.sin(latitude) ** 2)
    s, c = math.sin(latitude), math.cos(latitude)
    return latitude, math.atan2(y, x), flat * c + z * s - across * (1 - OVAL * s * s)
