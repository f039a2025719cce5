"""The camera: its lens (intrinsics) and, for one frame, where it stands (extrinsics)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from viewsphere.geometry.rotation import transform
from viewsphere.model.frozen import Frozen


class Distortion(Frozen):
    """Lens distortion with OpenCV's coefficients.

    `brown_conrady`: k1 k2 p1 p2 [k3 [k4 k5 k6]] (https://docs.opencv.org/4.x/d9/d0c/group__calib3d.html);
    `fisheye`: k1 k2 k3 k4 of theta_d = theta (1 + k1 theta^2 + ...) (Kannala and Brandt 2006; OpenCV's fisheye module).
    """

    IS_CHOICE = True
    model: Literal["brown_conrady", "fisheye"] = Field(description="OpenCV's standard or its fisheye model")
    coefficients: tuple[Annotated[float, Field(ge=-1e6, le=1e6)], ...] = Field(
        description="brown_conrady: 4, 5 or 8 in OpenCV's order; fisheye: 4"
    )

    @model_validator(mode="after")
    def _counted(self) -> Self:
        expected = {"brown_conrady": (4, 5, 8), "fisheye": (4,)}[self.model]
        if len(self.coefficients) not in expected:
            counts = " or ".join(map(str, expected))
            raise ValueError(f"{self.model}: expected {counts} coefficients, got {len(self.coefficients)}")
        return self


Degrees = Annotated[float, Field(ge=-90, le=90)]


class Scan(Frozen):
    """The rays of a LiDAR: every ring, a row of the picture, has one elevation, every column one azimuth.

    A direction's azimuth is counted to the right from that of the picture's middle, `turn_deg` to the right of the z axis; K
    takes it (radians) to columns, and a ring's number + 0.5 to rows. Between rings, and beyond the outermost by the step next
    to them, elevations go on evenly; a lone ring's rows are a degree apart.
    """

    IS_CHOICE = True
    model: Literal["scan"] = "scan"
    elevations_deg: tuple[Degrees, ...] = Field(min_length=1, description="elevation of each ring, highest first")
    turn_deg: float = Field(default=0.0, ge=-360, le=360, description="azimuth of the picture's middle, to the right")

    @model_validator(mode="after")
    def _falling(self) -> Self:
        for above, below in pairwise(self.elevations_deg):
            if above <= below:
                raise ValueError(f"expected elevations that fall from ring to ring; found {above:g}, then {below:g}")
        return self

    @property
    def coefficients(self) -> tuple[float, ...]:
        """`turn_deg`, then the elevations, degrees."""
        return (self.turn_deg, *self.elevations_deg)


class Intrinsics(Frozen):
    """Image size in pixels and the pinhole matrix K; pixel coordinates have their origin at the image's corner."""

    width: int = Field(gt=0)
    height: int = Field(gt=0)
    fx: float = Field(gt=0)
    fy: float = Field(gt=0)
    cx: float
    cy: float
    skew: float = 0.0
    distortion: Annotated[Distortion | Scan, Field(discriminator="model")] | None = None

    @property
    def K(self) -> NDArray[np.float64]:
        """Camera matrix, (3, 3) float64, pixels."""
        return np.array([[self.fx, self.skew, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])


@dataclass(frozen=True, eq=False)
class Camera:
    """One frame's camera: intrinsics and the world-to-camera motion x_camera = R x_world + t (OpenCV axes, metres)."""

    intrinsics: Intrinsics
    R: NDArray[np.float64]
    t: NDArray[np.float64]

    @property
    def K(self) -> NDArray[np.float64]:
        """Camera matrix, (3, 3) float64, pixels."""
        return self.intrinsics.K

    @property
    def P(self) -> NDArray[np.float64]:
        """Projection matrix K [R|t], (3, 4) float64; exact for an undistorted lens."""
        motion = np.column_stack([self.R, self.t])
        return transform(self.K, motion.T).T

    @cached_property
    def center(self) -> NDArray[np.float64]:
        """Camera centre in the world, (3,) metres; do not write to it."""
        return -transform(self.R.T, self.t)

    @property
    def width(self) -> int:
        """Image width in pixels."""
        return self.intrinsics.width

    @property
    def height(self) -> int:
        """Image height in pixels."""
        return self.intrinsics.height

    @property
    def distortion(self) -> Distortion | Scan | None:
        """Lens distortion, None for a pinhole."""
        return self.intrinsics.distortion
