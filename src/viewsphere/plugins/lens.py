"""The spec of a lens: rays of pixels, and pixels of points. Models have lenses, so the class lies below them."""

from viewsphere.geometry.lenses import (
    Calibration,
    ColmapLens,
    Lens,
    LensOptions,
    LensParameters,
    LensSpec,
    OpenCVLens,
    Rays,
    central,
)

__all__ = ["Calibration", "ColmapLens", "Lens", "LensOptions", "LensParameters", "LensSpec", "OpenCVLens", "Rays", "central"]
