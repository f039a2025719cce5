"""Named viewpoint bins: which side of an object a camera sees."""

from __future__ import annotations

import math

SIDES = ("front", "front-left", "left", "back-left", "back", "back-right", "right", "front-right")
"""Sides seen at azimuth 0, 45, 90, ...: left and right are the object's own (it faces -Y, its left is +X)."""


def pose_category(azimuth_deg: float, elevation_deg: float, resolution_deg: float = 45.0) -> str:
    """The bin of a viewpoint: `front`, `front-left`, ..., `top`.

    The bin is `top` from 60 degrees up and `bottom` from -60 down, whatever the azimuth. In between, azimuth sectors of
    `resolution_deg` start with one centred on 0. At 45 degrees they are the eight `SIDES`, at 90 every second side. Otherwise
    they are named by their centre, as in `az030` (`az022.5`). Elevations of [30, 60) add `-above`, of (-60, -30) `-below`. A
    sector includes its lower limit. Angles are rounded to 1e-6 degrees first, so that the limits do not depend on the last
    digit. Raises ValueError for a resolution that does not divide 360.
    """
    sectors = round(360 / resolution_deg) if resolution_deg > 0 else 0
    if sectors < 1 or not math.isclose(sectors * resolution_deg, 360):
        raise ValueError(f"pose_category: expected a resolution that divides 360 degrees, got {resolution_deg}")
    elevation = round(elevation_deg, 6)
    if elevation >= 60:
        return "top"
    if elevation <= -60:
        return "bottom"
    sector = math.floor(round((round(azimuth_deg, 6) + resolution_deg / 2) / resolution_deg, 9)) % sectors
    if sectors in (4, 8):
        name = SIDES[sector * (8 // sectors)]
    else:
        whole, _, fraction = f"{round(sector * 360 / sectors, 3):g}".partition(".")
        name = f"az{whole:0>3}" + (f".{fraction}" if fraction else "")
    return name + ("-above" if elevation >= 30 else "-below" if elevation < -30 else "")
