"""The box of a projected model against what the rasteriser sees of it."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quick import quick
from truth_scenes import EVERY, cube, lens, mesh_of, orbit_camera, placed, random_soup, silhouette, sphere
from viewsphere.geometry.box import projected_bounds
from viewsphere.geometry.lenses import lens_parameters

STRONG = {
    **EVERY,
    "folding": lens_parameters("brown_conrady", coefficients=(-0.3, 0.0, 0.0, 0.0)),
    "shifted": lens_parameters("brown_conrady", coefficients=(-0.45, 0.25, 0.01, -0.015, -0.02)),
    "equidistant": lens_parameters("fisheye", coefficients=(0.0, 0.0, 0.0, 0.0)),
    "folding fisheye": lens_parameters("fisheye", coefficients=(-0.12, 0.03, -0.02, 0.003)),
}
ROUNDING = 1e-5


def torus():
    import trimesh

    ring = trimesh.creation.torus(1.0, 0.35, 24, 12)
    return mesh_of(ring.vertices, ring.faces)


MODELS = {
    "soup": lambda rng: random_soup(rng, 12, spread=1.0),
    "triangle": lambda rng: mesh_of(rng.normal(size=(3, 3)) * 2, [[0, 1, 2]]),
    "cube": lambda rng: cube(rng.uniform(0.3, 2.0)),
    "ball": lambda rng: sphere(3, rng.uniform(0.3, 1.5)),
    "torus": lambda rng: torus(),
}


@pytest.mark.parametrize("name", quick(STRONG, *(STRONG.keys() - {"folding", "barrel", "shifted"})))
@given(seed=st.integers(0, 10**6), model=st.sampled_from(sorted(MODELS)))
@pytest.mark.slow
def test_no_pixel_of_a_model_lies_outside_its_box(name, seed, model):
    """Nor is the box larger than its pixels by more than gaps between pixel centres allow, for a ball that fills some."""
    rng = np.random.default_rng(seed)
    geometry = placed(MODELS[model](rng))
    distortion = STRONG[name]
    is_fisheye = distortion is not None and distortion.model == "fisheye"
    fov = math.radians(rng.uniform(100, 340) if is_fisheye else rng.uniform(30, 110))
    intrinsics = lens(96, 72, fov, distortion, cx=rng.uniform(30, 60), cy=rng.uniform(20, 50), skew=rng.uniform(-3, 3))
    camera = orbit_camera(intrinsics, *rng.uniform(-3, 3, 2), 10 ** rng.uniform(-1, 1), tilt=rng.uniform(-1, 1))
    window = (-96, -72, 192, 144)
    rows, columns = np.nonzero(silhouette(geometry, camera, 1, window))
    bounds, whole = projected_bounds(camera, geometry.vertices, geometry.triangles)
    if not len(rows):
        return
    assert bounds is not None
    x, y = columns + window[0] + 0.5, rows + window[1] + 0.5
    assert x.min() >= bounds[0] - ROUNDING
    assert y.min() >= bounds[1] - ROUNDING
    assert x.max() <= bounds[2] + ROUNDING
    assert y.max() <= bounds[3] + ROUNDING
    is_inside = whole and bounds[0] > -90 and bounds[1] > -70 and bounds[2] < 186 and bounds[3] < 140
    if model == "ball" and is_inside and len(rows) > 2000:
        slack = (x.min() - bounds[0], y.min() - bounds[1], bounds[2] - x.max(), bounds[3] - y.max())
        assert max(slack) < 1.5
