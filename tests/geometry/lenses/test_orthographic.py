"""An orthographic camera against its formula in 40 digits."""

import numpy as np

from lens_proofs import SIZE, directions_of, formula_pixels
from published import Published
from viewsphere.geometry.lenses import lens_parameters
from viewsphere.model.sensors.camera import Intrinsics


def formula(x, y, z):
    return x, y


PUBLISHED = Published(
    cameras={"orthographic": {"projection": "orthographic", "width_m": 5.2}},
    project=lambda own: formula,
    ray=lambda own: lambda x, y: (0 * x, 0 * x, 1 + 0 * x),
    is_parallel=True,
)


def test_the_published_formula():
    own = lens_parameters("orthographic")
    lens = Intrinsics(width=SIZE[0], height=SIZE[1], fx=51.3, fy=49.7, cx=317.2, cy=244.9, skew=3.5, distortion=own)
    points = directions_of(np.random.default_rng(3), 200)
    xy, is_shown = lens.lens.project(points)
    np.testing.assert_array_equal(is_shown, points[:, 2] > 0)
    np.testing.assert_allclose(xy[is_shown], formula_pixels(lens, points[is_shown], formula), rtol=0, atol=1e-9)
