"""nerfstudio's camera models besides OpenCV's.

Source: `CameraType` and `Cameras._generate_rays_from_coords` of nerfstudio 1.1
(https://github.com/nerfstudio-project/nerfstudio/blob/main/nerfstudio/cameras/cameras.py). Its panoramas span
w / fl_x x 180 degrees across and h / fl_y x 180 degrees down; the focal lengths of its orthographic cameras are pixels a metre.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from viewsphere.geometry.lenses import Calibration, Intrinsics, lens_parameters


class _Model(NamedTuple):
    """A lens, by its name here, and nerfstudio's focal length for one of 1 px here."""

    lens: str
    focal: float = 1.0


_MODELS = {
    "EQUIRECTANGULAR": _Model("equirectangular", math.pi),
    "ORTHOPHOTO": _Model("orthographic"),
    "FISHEYE624": _Model("fisheye624"),
}
OWN = tuple(_MODELS)
"""Names of the models."""


def own_model(lens: Intrinsics) -> tuple[str, dict[str, Any]] | None:
    """The model of a lens, and its numbers by their names; None if it is not one of these."""
    name = next((name for name, model in _MODELS.items() if model.lens == lens.lens.name), None)
    if name is None:
        return None
    focal, more = _MODELS[name].focal, list(lens.lens.parameters.numbers)
    said = {"fl_x": lens.fx * focal, "fl_y": lens.fy * focal, "cx": lens.cx, "cy": lens.cy}
    return name, {**said, **({"distortion_params": more} if more else {})}


def own_lens(name: str, matrix: Sequence[float], more: Any) -> Calibration:
    """The lens of a model with fl_x, fl_y, cx, cy and these `distortion_params`. Raises ValueError for invalid values."""
    model = _MODELS[name]
    fx, fy, cx, cy = matrix
    parameters = lens_parameters(model.lens, **({"coefficients": more} if more else {}))
    return Calibration(fx / model.focal, fy / model.focal, cx, cy, parameters)
