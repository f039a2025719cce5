"""The protocols of the cameras that geometry uses: `viewsphere.model.camera` has the classes that satisfy them."""

# ruff: noqa: D102, the classes say what each name means

from __future__ import annotations

from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]


class Distortion(Protocol):
    """OpenCV's standard model (Brown and Conrady) or its fisheye model, and their coefficients in OpenCV's order; or a scan,
    whose coefficients are the azimuth of its middle and the elevations of its rings, degrees.
    """

    @property
    def model(self) -> Literal["brown_conrady", "fisheye", "scan"]: ...
    @property
    def coefficients(self) -> tuple[float, ...]: ...


class Intrinsics(Protocol):
    """Image size in pixels, the pinhole matrix K (3, 3), and its numbers; None for `distortion` means there is none."""

    @property
    def width(self) -> int: ...
    @property
    def height(self) -> int: ...
    @property
    def fx(self) -> float: ...
    @property
    def fy(self) -> float: ...
    @property
    def cx(self) -> float: ...
    @property
    def cy(self) -> float: ...
    @property
    def skew(self) -> float: ...
    @property
    def distortion(self) -> Distortion | None: ...
    @property
    def K(self) -> Float: ...


class Camera(Protocol):
    """Intrinsics and the world-to-camera motion x_camera = R x_world + t (OpenCV axes, metres); P is K [R|t], (3, 4)."""

    @property
    def intrinsics(self) -> Intrinsics: ...
    @property
    def R(self) -> Float: ...
    @property
    def t(self) -> Float: ...
    @property
    def K(self) -> Float: ...
    @property
    def P(self) -> Float: ...
    @property
    def width(self) -> int: ...
    @property
    def height(self) -> int: ...
    @property
    def distortion(self) -> Distortion | None: ...
