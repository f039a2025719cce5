"""The safeguarded inverse: of positions up to the very limit none is wrong or missing, and none beyond is answered."""

import math

import numpy as np
import pytest

from viewsphere.geometry.lenses import fisheye624, lens_parameters, thin_prism, thin_prism_fisheye
from viewsphere.geometry.lenses.shared.fisheye_plane import WIDEST
from viewsphere.geometry.lenses.shared.warp import FARTHEST, warp_of
from viewsphere.model.sensors.camera import Intrinsics

SIZES = {
    thin_prism_fisheye: (0.05, 0.02, 0.02, 0.02, 0.01, 0.003, 0.02, 0.02),
    fisheye624: (0.05, 0.02, 0.01, 0.003, 0.001, 0.0003, 0.02, 0.02, 0.01, 0.003, 0.01, 0.003),
    thin_prism: (0.3, 0.1, 0.01, 0.01, 0.01, 0.3, 0.1, 0.01, 0.02, 0.01, 0.02, 0.01),
}
CASES = [(module, factor, seed) for module in SIZES for factor in (0.3, 1, 3) for seed in range(4)]
COUNT = 20_000


@pytest.mark.parametrize(("module", "factor", "seed"), CASES, ids=lambda value: getattr(value, "__name__", value))
def test_it_finds_each_position_once(module, factor, seed):
    rng = np.random.default_rng(seed)
    own = tuple((rng.normal(size=len(SIZES[module])) * SIZES[module] * factor).tolist())
    warp = warp_of(module._bend, own, FARTHEST if module is thin_prism else WIDEST)
    near = 1 - 10 ** rng.uniform(-11, -1, COUNT // 2)
    r = min(warp.limit, 50.0) * np.concatenate((np.sqrt(rng.random(COUNT - len(near))), near))
    turn = rng.uniform(0, 2 * math.pi, COUNT)
    x, y = r * np.cos(turn), r * np.sin(turn)
    u, v = warp.forward(x, y)
    found = np.stack(warp.inverse(u, v))
    again = np.stack(warp.forward(*found))
    assert not np.isnan(found).any()
    assert (np.hypot(*(again - (u, v))) <= 1e-13 * (1 + np.hypot(u, v))).all()
    assert (np.hypot(*(found - (x, y))) <= 1e-6 * (1 + r)).all()


@pytest.mark.parametrize(("module", "factor", "seed"), CASES, ids=lambda value: getattr(value, "__name__", value))
def test_the_limit_is_one_to_one_and_positions_beyond_its_image_have_no_answer(module, factor, seed):
    """The image of the limit's circle is a closed curve that turns once. Positions outside of the curve have no answer."""
    rng = np.random.default_rng(seed)
    own = tuple((rng.normal(size=len(SIZES[module])) * SIZES[module] * factor).tolist())
    warp = warp_of(module._bend, own, FARTHEST if module is thin_prism else WIDEST)
    if warp.limit > 50:
        return
    turn = np.linspace(0, 2 * math.pi, 4000, endpoint=False)
    rim = np.stack(warp.forward(warp.limit * np.cos(turn), warp.limit * np.sin(turn)))
    angles = np.unwrap(np.arctan2(rim[1], rim[0]))
    assert (np.diff(angles) > 0).all() and angles[-1] - angles[0] < 2 * math.pi
    outside = rim * (1 + 10 ** rng.uniform(-6, 0.5, 4000))
    assert np.isnan(np.stack(warp.inverse(*outside))).all()
    inside = rim * (1 - 10 ** rng.uniform(-6, -0.5, 4000))
    assert not np.isnan(np.stack(warp.inverse(*inside))).any()


def test_positions_that_are_no_numbers_have_no_ray():
    lens = Intrinsics(
        width=64, height=48, fx=30, fy=30, cx=32, cy=24, distortion=lens_parameters("fisheye624", coefficients=[0.01] * 12)
    ).lens
    xy = np.array([[np.nan, 1], [np.inf, 2], [1e300, 3], [32, 24]])
    assert np.isnan(lens.rays(xy).directions[:, 0]).tolist() == [True, True, True, False]
    np.testing.assert_array_equal(lens.rays(xy).directions[3], [0, 0, 1])
