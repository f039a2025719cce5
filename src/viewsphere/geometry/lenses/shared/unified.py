"""Functions shared by lenses that project onto a sphere or an ellipsoid, then through a pinhole shifted from its centre."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]

RIM = 1 - 1e-12
"""Share of the squared radius of a picture's circle in which positions have rays. Rays of the outermost positions, which
rounding may move beyond the horizon, are left out, so that the lens shows every point on a ray.
"""


def horizon(alpha: float) -> float:
    """The w for which the model is one-to-one where z > -w d, with d the distance from the sphere's centre.

    Up to alpha 1/2, the projection's denominator alpha d + (1 - alpha) z is 0 there; beyond, the picture folds back there
    (Usenko et al. 2018, equations 16 and 22).
    """
    return alpha / (1 - alpha) if alpha <= 0.5 else (1 - alpha) / alpha


def lifted(at: Float, alpha: float, beta: float = 1.0) -> Float:
    """The points (N, 3) of the plane z = 1, scaled, whose projection is at positions (N, 2); NaN beyond the picture's circle.

    With d = sqrt(beta (x^2 + y^2) + z^2), a point is projected to (x, y) / (alpha d + (1 - alpha) z); the result is (x, y) at
    the position and z as equation 19 of Usenko et al. 2018.
    """
    square = beta * (at[:, 0] * at[:, 0] + at[:, 1] * at[:, 1])
    under = 1 - (2 * alpha - 1) * square
    under = np.where(under >= 1 - RIM, under, np.nan)
    z = (1 - alpha * alpha * square) / (alpha * np.sqrt(under) + 1 - alpha)
    return np.stack([at[:, 0], at[:, 1], z], axis=1)
