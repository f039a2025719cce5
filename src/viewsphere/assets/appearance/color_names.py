"""The eleven basic colour terms of English (B. Berlin and P. Kay, Basic Color Terms, 1969), and the term for a colour."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from viewsphere.codecs.srgb import linear, root

PROTOTYPES = {
    "black": ("#000000", "#262626"),
    "gray": ("#595959", "#808080", "#b0b0b0"),
    "white": ("#f0f0f0", "#ffffff"),
    "red": ("#d01818", "#8c1414", "#500810", "#f04038"),
    "orange": ("#f08018", "#ffa040"),
    "yellow": ("#f0d818", "#fff078", "#c8b400"),
    "green": ("#189030", "#104c20", "#88d060", "#607828"),
    "blue": ("#1848d0", "#102a60", "#60b0f0", "#108890"),
    "purple": ("#782898", "#421458", "#a878d8"),
    "pink": ("#f080b8", "#ffc0d0", "#e83890"),
    "brown": ("#784818", "#482810", "#b08860"),
}
"""Example sRGB colours of each term: a colour gets the name of the nearest one in OKLab."""

NAMES = tuple(PROTOTYPES)

_LMS = np.array(
    [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ]
)
_LAB = np.array(
    [
        [0.2104542553, 0.7936177850, -0.0040720468],
        [1.9779984951, -2.4285922050, 0.4505937099],
        [0.0259040371, 0.7827717662, -0.8086757660],
    ]
)
LEAST = 1e-6
"""Least cone response used for OKLab."""


def oklab(light: ArrayLike) -> NDArray[np.float64]:
    """OKLab (..., 3) of linear sRGB (..., 3) in [0, 1] (B. Ottosson, https://bottosson.github.io/posts/oklab/)."""
    cones = _product(_LMS, np.asarray(light, np.float64))
    return _product(_LAB, root(np.maximum(cones, LEAST), 3))


def _product(matrix: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """The matrix times each vector, term by term: the same to the last bit on every processor."""
    return values[..., :1] * matrix[:, 0] + values[..., 1:2] * matrix[:, 1] + values[..., 2:] * matrix[:, 2]


def nearest_names(light: ArrayLike) -> NDArray[np.int64]:
    """Indices in `NAMES` of the terms for linear sRGB colours (N, 3)."""
    squares = (oklab(np.clip(light, 0.0, 1.0))[:, None] - _PLACES) ** 2
    return _OWNERS[(squares[..., 0] + squares[..., 1] + squares[..., 2]).argmin(axis=1)]


def _rgb(text: str) -> list[float]:
    return [int(text[i : i + 2], 16) / 255 for i in (1, 3, 5)]


_PLACES = oklab(linear([_rgb(text) for texts in PROTOTYPES.values() for text in texts]))
_OWNERS = np.array([i for i, texts in enumerate(PROTOTYPES.values()) for _ in texts])
