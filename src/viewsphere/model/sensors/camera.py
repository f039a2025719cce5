"""The camera: its lens (intrinsics) and, for one frame, its pose (extrinsics)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, SerializeAsAny

from viewsphere.geometry.lenses import Lens, LensParameters, lens_of, read_parameters
from viewsphere.geometry.rotation import transform
from viewsphere.model.fields.omit_none import OmitNone
from viewsphere.model.sensors.rolling import Rolling, RowPoses

Distortion = Annotated[SerializeAsAny[LensParameters], BeforeValidator(read_parameters)]
"""The model of a lens and its parameters; a mapping is read as the class of its model."""


class Intrinsics(OmitNone):
    """Image size in pixels and the pinhole matrix K; pixel coordinates have their origin at the image's corner.

    `rolling` is the readout of a rolling shutter, None for a global one.
    """

    OMIT_IF_NONE = ("rolling",)

    width: int = Field(gt=0)
    height: int = Field(gt=0)
    fx: float = Field(gt=0)
    fy: float = Field(gt=0)
    cx: float
    cy: float
    skew: float = 0.0
    distortion: Distortion | None = None
    rolling: Rolling | None = None

    def narrowed(self, width: int) -> Self:
        """The same view in a picture of this width, with the height in proportion; never wider than it is."""
        k = min(1.0, width / self.width)
        sizes = {"width": max(1, round(self.width * k)), "height": max(1, round(self.height * k))}
        x, y = sizes["width"] / self.width, sizes["height"] / self.height
        across = {name: getattr(self, name) * x for name in ("fx", "cx", "skew")}
        return self.model_copy(update={**sizes, **across, "fy": self.fy * y, "cy": self.cy * y})

    @property
    def lens(self) -> Lens:
        """Rays of pixels, and pixels of points."""
        return lens_of(self)  # pyright: ignore[reportArgumentType]: it is frozen, so it has a hash

    @property
    def K(self) -> NDArray[np.float64]:
        """Camera matrix, (3, 3) float64, pixels."""
        return np.array([[self.fx, self.skew, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])


@dataclass(frozen=True, eq=False)
class Camera:
    """One frame's camera: `x_camera = R @ x_world + t`, metres, camera axes x right, y down, z forward (OpenCV).

    Attributes:
        intrinsics: Image size, camera matrix and distortion.
        R: (3, 3) float64, rotation from the world to the camera.
        t: (3,) float64, metres.
        rows: The poses of its rows under a rolling shutter, while anything moves; R and t are then those of the instant.
    """

    intrinsics: Intrinsics
    R: NDArray[np.float64]
    t: NDArray[np.float64]
    rows: RowPoses | None = None

    @property
    def K(self) -> NDArray[np.float64]:
        """Camera matrix, (3, 3) float64, pixels."""
        return self.intrinsics.K

    @property
    def P(self) -> NDArray[np.float64]:
        """Projection matrix K [R|t], (3, 4) float64; exact for an undistorted lens. For parallel rays, the last row of [R|t] is
        (0, 0, 0, 1).
        """
        motion = np.column_stack([self.R, self.t])
        if self.lens.is_parallel:
            motion[2] = 0.0, 0.0, 0.0, 1.0
        return transform(self.K, motion.T).T

    @cached_property
    def center(self) -> NDArray[np.float64]:
        """Camera centre in the world, (3,) metres; do not write to it."""
        return -transform(self.R.T, self.t)

    @property
    def shutter_record(self) -> dict[str, Any]:
        """The rolling shutter as plain data, `rolling_shutter`; empty for a global one."""
        rolling = self.intrinsics.rolling
        return {} if rolling is None else {"rolling_shutter": rolling.model_dump(mode="json")}

    @property
    def width(self) -> int:
        """Image width in pixels."""
        return self.intrinsics.width

    @property
    def height(self) -> int:
        """Image height in pixels."""
        return self.intrinsics.height

    @property
    def lens(self) -> Lens:
        """Rays of pixels, and pixels of points, in camera axes."""
        return self.intrinsics.lens

    @property
    def distortion(self) -> LensParameters | None:
        """The lens model and its parameters, None for a pinhole."""
        return self.intrinsics.distortion
