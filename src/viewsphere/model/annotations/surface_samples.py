"""Samples of objects' surfaces: one sample's rows of them."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Count

MOST = 100_000
"""Points on one object."""


class SurfaceSamples(Frozen):
    """Options of the label surface_samples."""

    count: Annotated[Count, Field(le=MOST)] = Field(default=1024, description="points on each object")


SURFACE_SAMPLE = np.dtype(
    [
        ("object", "<i4"),
        ("triangle", "<i4"),
        ("point_object", "<f8", (3,)),
        ("normal_object", "<f4", (3,)),
        ("point", "<f8", (3,)),
        ("normal", "<f4", (3,)),
        ("pixel", "<f8", (2,)),
        ("state", "u1"),
    ]
)
"""One point in one sample: the id of the object that it lies on, and the triangle of its model; the point, metres, and the
triangle's normal, outwards by its winding, in the object's axes and in the world's; where the point is in the picture, pixels,
NaN behind the camera; and its state there: 0 visible, 1 occluded, 2 outside, 3 behind.
"""
