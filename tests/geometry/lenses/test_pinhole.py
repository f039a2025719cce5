"""A pinhole, also with oblique axes of its pixels, against its formula in 40 digits."""

import numpy as np
import pytest

from lens_proofs import SIZE, directions_of, formula_pixels
from published import Published
from viewsphere.model.sensors.camera import Intrinsics


def formula(x, y, z):
    return x / z, y / z


PUBLISHED = Published(
    cameras={"pinhole": {"fov_deg": 62}, "skewed pinhole": {"K": [[130.0, 9.0, 77.25], [0.0, 124.0, 62.5], [0.0, 0.0, 1.0]]}},
    project=lambda own: formula,
    ray=lambda own: lambda x, y: (x, y, 1 + 0 * x),
)


@pytest.mark.parametrize("skew", [0.0, 37.5])
def test_the_published_formula(skew):
    lens = Intrinsics(width=SIZE[0], height=SIZE[1], fx=511.3, fy=498.7, cx=317.2, cy=244.9, skew=skew)
    points = directions_of(np.random.default_rng(3), 200)
    points = points[points[:, 2] > 0.1 * np.linalg.norm(points, axis=1)]
    xy, is_shown = lens.lens.project(points)
    assert is_shown.all() and len(points) > 50
    np.testing.assert_allclose(xy, formula_pixels(lens, points, formula), rtol=0, atol=1e-9)
