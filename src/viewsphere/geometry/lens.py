"""The protocols of the cameras that geometry uses: `viewsphere.model.sensors.camera` has the classes that satisfy them."""

# ruff: noqa: D102, the classes say what each name means

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from viewsphere.geometry.lenses import Lens, LensParameters

Float = NDArray[np.float64]


class Intrinsics(Protocol):
    """Image size in pixels, the camera matrix K (3, 3), its numbers, and the lens; None for `distortion` means a pinhole."""

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
    def distortion(self) -> LensParameters | None: ...
    @property
    def K(self) -> Float: ...
    @property
    def lens(self) -> Lens: ...


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
    def lens(self) -> Lens: ...
