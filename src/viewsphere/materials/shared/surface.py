"""The appearance of a material, in physical terms: the square that repeats."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Map = NDArray[np.floating[Any]]
"""(N, N) float32, row 0 on top."""

Light = NDArray[np.floating[Any]]
"""Linear colour, (N, N, 3) float32, row 0 on top."""

Color = tuple[float, float, float]
"""Linear red, green and blue: the share of the light that a surface reflects."""

DARKEST, BRIGHTEST = 0.02, 0.8
"""Limits of the reflected share of light, except for metals and water: charcoal and fresh snow."""


@dataclass(frozen=True, eq=False)
class Surface:
    """A square of a material, N texels and `metres` a side, which repeats in both directions.

    color: linear, 0 to 1; roughness: 0 a mirror, 1 matt; height: metres; metallic: 1 is metal.
    """

    color: Light
    roughness: Map
    height: Map
    metres: float
    metallic: float = 0.0

    @property
    def normals(self) -> Light:
        """Unit normals (N, N, 3): x to the right, y up, z out of the surface."""
        texel = 2 * self.metres / len(self.height)
        x = (np.roll(self.height, 1, axis=1) - np.roll(self.height, -1, axis=1)) / np.float32(texel)
        y = (np.roll(self.height, -1, axis=0) - np.roll(self.height, 1, axis=0)) / np.float32(texel)
        z = 1 / np.sqrt(x * x + y * y + 1)
        return np.stack([x * z, y * z, z], axis=-1)
