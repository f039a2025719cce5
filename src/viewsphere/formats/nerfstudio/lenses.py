"""Lenses in the words of transforms.json."""

from __future__ import annotations

from typing import Any

from viewsphere.model.camera import Distortion, Intrinsics

SYNTHETIC = "nerf-synthetic"
NAMES = {"brown_conrady": ("k1", "k2", "p1", "p2", "k3"), "fisheye": ("k1", "k2", "k3", "k4")}
MOST = {"nerfstudio": 5, "instant-ngp": 4, SYNTHETIC: 0}
"""Coefficients of a lens, by whose files they are."""


def lens_problem(lens: Intrinsics, kind: str) -> str | None:
    """Return the part of a lens that files of this kind cannot express; None for a lens that they can."""
    own = lens.distortion.coefficients if isinstance(lens.distortion, Distortion) else ()
    if own and not MOST[kind]:
        return f"expected pinhole cameras; found {len(own)} coefficients"
    if any(own[MOST[kind] :]):
        return f"expected lenses of at most {MOST[kind]} coefficients; found {len(own)}"
    if lens.skew:
        return f"expected cameras without skew; found {lens.skew:g}"
    if kind == SYNTHETIC and (lens.fx, lens.cx, lens.cy) != (lens.fy, lens.width / 2, lens.height / 2):
        found = f"fx {lens.fx:g}, fy {lens.fy:g}, cx {lens.cx:g}, cy {lens.cy:g}"
        return f"expected square pixels and a centred principal point; found {found}"
    return None


def model_of(lens: Intrinsics) -> str:
    """The name of its model."""
    fisheye = lens.distortion is not None and lens.distortion.model == "fisheye"
    return "OPENCV_FISHEYE" if fisheye else "OPENCV"


def said_of(lens: Intrinsics, kind: str) -> dict[str, Any]:
    """Its numbers by their names: sizes and K in pixels from the corner, and coefficients."""
    said: dict[str, Any] = {"w": lens.width, "h": lens.height, "fl_x": lens.fx, "fl_y": lens.fy, "cx": lens.cx, "cy": lens.cy}
    if isinstance(lens.distortion, Distortion):
        said |= dict(zip(NAMES[lens.distortion.model], lens.distortion.coefficients[: MOST[kind]], strict=False))
        if kind == "instant-ngp" and lens.distortion.model == "fisheye":
            said["is_fisheye"] = True
    return said
