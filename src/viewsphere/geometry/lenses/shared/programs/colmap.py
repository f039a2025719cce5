"""COLMAP's camera models: their parameters, and the lenses of those that are not OpenCV's.

Source: https://colmap.github.io/cameras.html, and the numbers of the models in COLMAP 4.2's files.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from viewsphere.geometry.lenses import Calibration, LensParameters, lens_parameters

PARAMETERS = {
    "SIMPLE_PINHOLE": (0, "f cx cy"),
    "PINHOLE": (1, "fx fy cx cy"),
    "SIMPLE_RADIAL": (2, "f cx cy k1"),
    "RADIAL": (3, "f cx cy k1 k2"),
    "OPENCV": (4, "fx fy cx cy k1 k2 p1 p2"),
    "OPENCV_FISHEYE": (5, "fx fy cx cy k1 k2 k3 k4"),
    "FULL_OPENCV": (6, "fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6"),
    "FOV": (7, "fx fy cx cy omega"),
    "SIMPLE_RADIAL_FISHEYE": (8, "f cx cy k1"),
    "RADIAL_FISHEYE": (9, "f cx cy k1 k2"),
    "THIN_PRISM_FISHEYE": (10, "fx fy cx cy k1 k2 p1 p2 k3 k4 sx1 sy1"),
    "RAD_TAN_THIN_PRISM_FISHEYE": (11, "fx fy cx cy k0 k1 k2 k3 k4 k5 p0 p1 s0 s1 s2 s3"),
    "SIMPLE_DIVISION": (12, "f cx cy k"),
    "DIVISION": (13, "fx fy cx cy k"),
    "SIMPLE_FISHEYE": (14, "f cx cy"),
    "FISHEYE": (15, "fx fy cx cy"),
    "EUCM": (16, "fx fy cx cy alpha beta"),
    "EQUIRECTANGULAR": (17, "w h"),
}
"""Number in binary files and parameters of each model."""

PANORAMA = "EQUIRECTANGULAR"
"""The model without focal lengths: it shows all directions in a picture of w x h pixels."""

NAMES = {number: name for name, (number, _) in PARAMETERS.items()}


def _with_coefficients(model: str) -> Callable[[Sequence[float]], LensParameters]:
    return lambda values: lens_parameters(model, coefficients=tuple(values))


def _equidistant(_values: Sequence[float]) -> LensParameters:
    return lens_parameters("fisheye", coefficients=(0.0,) * 4)


def _fov(values: Sequence[float]) -> LensParameters:
    return lens_parameters("fov", omega=values[0])


def _eucm(values: Sequence[float]) -> LensParameters:
    return lens_parameters("eucm", alpha=values[0], beta=values[1])


_LENSES: dict[str, Callable[[Sequence[float]], LensParameters]] = {
    "FOV": _fov,
    "THIN_PRISM_FISHEYE": _with_coefficients("thin_prism_fisheye"),
    "RAD_TAN_THIN_PRISM_FISHEYE": _with_coefficients("fisheye624"),
    "SIMPLE_DIVISION": _with_coefficients("scaramuzza"),
    "DIVISION": _with_coefficients("scaramuzza"),
    "SIMPLE_FISHEYE": _equidistant,
    "FISHEYE": _equidistant,
    "EUCM": _eucm,
}


def own_lens(model: str, values: Sequence[float]) -> Calibration | None:
    """The lens of a model that is not one of OpenCV's, from its parameters in COLMAP's order; None for other models. Raises
    ValueError for invalid values.
    """
    if model not in _LENSES and model != PANORAMA:
        return None
    if model == PANORAMA:
        width, height = values
        return Calibration(width / math.tau, height / math.pi, width / 2, height / 2, lens_parameters("equirectangular"))
    focal, *rest = values
    fx, (fy, cx, cy, *more) = focal, rest if PARAMETERS[model][1].startswith("fx") else (focal, *rest)
    return Calibration(fx, fy, cx, cy, _LENSES[model](more))
