"""Panoramas, cylindrical ones too: closed forms, the seam and the poles, boxes of triangles, and options of recipes."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from formula_math import atan2, cos, sin, sqrt
from published import Published
from small import small_recipe
from viewsphere import Recipe, plan
from viewsphere.errors import RecipeError
from viewsphere.geometry.box import projected_bounds
from viewsphere.geometry.camera import orbit_rotation, pixel_rays, project
from viewsphere.model.sensors.camera import Camera
from viewsphere.recipe.world.scene import CameraEntry

NAMES = ("equirectangular", "cylindrical")

PUBLISHED = Published(
    cameras={
        "equirectangular": {"projection": "equirectangular", "size": [168, 84]},
        "equirectangular 200 degrees": {"projection": "equirectangular", "span": {"horizontal": 200}},
    },
    project=lambda own: lambda x, y, z: (atan2(x, z), atan2(y, sqrt(x * x + z * z))),
    ray=lambda own: lambda x, y: (cos(y) * sin(x), sin(y), cos(y) * cos(x)),
    highest=math.pi / 2,
)


def lens(name, size, **span):
    return CameraEntry.model_validate({"projection": name, "size": size} | ({"span": span} if span else {})).intrinsics


WHOLE = {"equirectangular": lens("equirectangular", [64, 32]), "cylindrical": lens("cylindrical", [64, 30])}


def test_an_equirectangular_picture_has_equal_steps_of_angle():
    own = lens("equirectangular", [8, 4])
    rays = pixel_rays(own)
    azimuth, elevation = np.degrees(np.arctan2(rays[..., 0], rays[..., 2])), np.degrees(np.arcsin(-rays[..., 1]))
    np.testing.assert_allclose(azimuth, np.broadcast_to(-157.5 + 45 * np.arange(8), (4, 8)), atol=1e-12)
    np.testing.assert_allclose(elevation, np.broadcast_to((67.5 - 45 * np.arange(4))[:, None], (4, 8)), atol=1e-12)


@pytest.mark.parametrize("name", NAMES)
@given(seed=st.integers(0, 10**6))
def test_rays_come_back_to_their_pixels(name, seed):
    """For random spans and sizes, at random positions, seen from any distance."""
    rng = np.random.default_rng(seed)
    width, across = int(rng.integers(2, 2000)), float(rng.choice([360.0, rng.uniform(1, 360)]))
    height = int(rng.integers(1, min(max(int(width * 179 / across), 2), 3000)))
    own = lens(name, [width, height], horizontal=across)
    xy = rng.uniform(0, 1, (200, 2)) * (width, height)
    rays = own.lens.rays(xy).directions
    np.testing.assert_allclose(np.linalg.norm(rays, axis=-1), 1, rtol=1e-14)
    pixels, shown = project(own, rays * rng.uniform(0.01, 1000, (200, 1)))
    assert shown.all()
    np.testing.assert_allclose(pixels, xy, rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_a_full_turn_has_each_direction_once(name):
    own = WHOLE[name]
    assert own.lens.period == 64 and not own.lens.has_depth
    assert lens(name, [64, 8], horizontal=359).lens.period is None
    around = pixel_rays(own, 1, (-64, 0, 128, own.height))
    assert np.isnan(around[:, :64]).all() and np.isnan(around[:, 128:]).all() and np.isfinite(around[:, 64:128]).all()
    pixels, shown = project(own, np.random.default_rng(1).normal(size=(5000, 3)))
    assert ((pixels[shown, 0] >= 0) & (pixels[shown, 0] < 64)).all()
    seam, _ = project(own, [[-1e-15, 0, -1], [1e-15, 0, -1], [0, 0, -1]])
    assert ((seam[:, 0] >= 0) & (seam[:, 0] < 64)).all()


def test_the_poles():
    pixels, shown = project(WHOLE["equirectangular"], [[0, -2, 0], [0, 2, 0], [0, 0, 0]])
    np.testing.assert_array_equal(pixels, [[32, 0], [32, 32], [np.nan, np.nan]])
    assert shown.tolist() == [True, True, False]
    assert not project(WHOLE["cylindrical"], [[0, -2, 0], [0, 2, 0], [0, 0, 0]])[1].any()


def test_a_quarter_turn_moves_columns_by_a_quarter():
    own = lens("equirectangular", [64, 32])
    rays, turn = pixel_rays(own), np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]])  # by the right, ahead
    np.testing.assert_allclose(np.roll(rays, -16, axis=1) @ turn.T, rays, atol=1e-15)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("span", [{}, {"horizontal": 200}, {"horizontal": 350}])
@given(seed=st.integers(0, 10**6))
def test_the_box_of_triangles_is_the_shortest_around_their_points(name, span, seed):
    rng = np.random.default_rng(seed)
    own = lens(name, [64, 30], **span)
    corners = rng.normal(size=(3, 3)) + rng.normal(size=3) * rng.choice([0.3, 2.0])
    camera = Camera(own, orbit_rotation(*rng.uniform(-3, 3, 3)), rng.normal(size=3) * 0.2)
    bounds, whole = projected_bounds(camera, corners, np.array([[0, 1, 2]], np.int32))
    share = np.linspace(0, 1, 801)[:, None, None]
    edges = (1 - share) * corners + share * np.roll(corners, 1, axis=0)
    points = np.concatenate([edges.reshape(-1, 3), rng.dirichlet([1, 1, 1], 2000) @ corners]) @ camera.R.T + camera.t
    pixels, shown = project(own, points)
    assert whole or name == "cylindrical"
    circle, x0, x1 = 2 * math.pi * own.fx, bounds[0], bounds[2]
    assert 0 <= x0 < 64 or own.lens.period is None
    ahead = np.mod(pixels[shown, 0] - x0 + 1e-9, circle)  # from the left end on
    assert (ahead <= x1 - x0 + 2e-9).all() or x1 - x0 >= circle - 1e-9 or own.lens.period is None
    assert (pixels[shown, 1] >= bounds[1] - 1e-9).all() and (pixels[shown, 1] <= bounds[3] + 1e-9).all()
    if own.lens.period is None:
        inside = shown & (pixels[:, 0] >= 0) & (pixels[:, 0] <= 64)
        assert ((pixels[inside, 0] >= x0 - 1e-9) & (pixels[inside, 0] <= x1 + 1e-9)).all()
    elif x1 - x0 < circle - 1:
        around = np.sort(np.mod(pixels[shown, 0], circle))
        gap = np.diff(around, append=around[0] + circle).max()
        assert x1 - x0 <= circle - gap + 1e-9 + (0 if shown.all() else circle)


def test_an_object_across_the_seam_and_one_overhead():
    camera = Camera(WHOLE["equirectangular"], np.eye(3), np.zeros(3))
    behind = np.array([[-1.0, 0, -1], [1, 0, -1], [0, 1, -2]])
    (x0, y0, x1, y1), whole = projected_bounds(camera, behind, np.array([[0, 1, 2]], np.int32))
    np.testing.assert_allclose((x0, x1, y0), (56, 72, 16), atol=1e-12)
    assert whole and y1 == pytest.approx(16 + 32 * math.atan(0.5) / math.pi)
    overhead = np.array([[-1.0, -1, -1], [1, -1, -1], [0, -1, 2]])
    (x0, y0, x1, _), _ = projected_bounds(camera, overhead, np.array([[0, 1, 2]], np.int32))
    np.testing.assert_allclose((x0, x1, y0), (0, 64, 0), atol=1e-12)
    long = np.array([[1.0, 0, 1], [1, 0, -1], [-1, 0, -1], [0, 0.1, 9]])  # ahead over the right and behind to the left
    triangles = np.array([[0, 1, 1], [1, 2, 2], [0, 3, 3]], np.int32)
    (x0, _, x1, _), _ = projected_bounds(camera, long, triangles)
    np.testing.assert_allclose((x0, x1), (32, 72), atol=1e-12)


@pytest.mark.parametrize(
    "name, given, told",
    [
        ("equirectangular", {"size": [640, 480]}, r"camera: .* vertical span of at most 180 .*270: set size: \[640, 320\]"),
        ("equirectangular", {"span": {"vertical": 400}}, "expected a vertical span of at most 180 degrees; found 400"),
        ("cylindrical", {"span": {"vertical": 400}}, "expected a vertical span of at most 179 degrees; found 400"),
        ("equirectangular", {"span": {"horizontal": 361}}, "span.horizontal: .*less than or equal to 360; found 361"),
        ("equirectangular", {"span": {"vertical": 181}}, "camera: expected a vertical span of at most 180 degrees; found 181"),
        ("equirectangular", {"span": {"vertical": 90}}, "camera: expected square pixels: a size of 640 x 160 for .* 360 x 90"),
        ("equirectangular", {"span": {"horizontal": 0}}, "span.horizontal: expected a number greater than 0; found 0"),
        ("equirectangular", {"span": {"vertical": -1}}, "span.vertical: expected a number greater than 0; found -1"),
        ("equirectangular", {"span": {"vertical": math.nan}}, "span.vertical: expected a finite number; found nan"),
        ("equirectangular", {"span": {"vertcal": 9}}, "span.vertcal: 'vertcal' is unknown"),
        ("equirectangular", {"span": 360}, "span: expected a mapping; found 360"),
        ("equirectangular", {"fov_deg": 40}, "camera.fov_deg: expected none beside projection: equirectangular"),
        ("cylindrical", {"span": {"vertical": 180}}, "camera: expected a vertical span of at most 179 degrees; found 180"),
        ("cylindrical", {"span": {"vertical": 60}}, "camera: expected square pixels: a size of 640 x 118 for .* 360 x 60"),
    ],
)
def test_mistakes_are_told_in_one_line(name, given, told):
    with pytest.raises(RecipeError, match=told) as error:
        plan(small_recipe(camera={"projection": name, "size": [640, 320]} | given, channels=["rgb"]))
    assert "\n" not in str(error.value)


def test_distances_along_rays_replace_depth_among_the_default_channels():
    said = {"models": [{"source": "zoo:mug"}], "viewpoints": {"azimuth": [0], "distance": 1}, "formats": ["native"]}
    recipe = Recipe.model_validate({**said, "camera": {"projection": "equirectangular", "size": [64, 32]}})
    assert recipe.channels == ("rgb", "depth_ray", "instances", "normals")
    assert Recipe.model_validate(recipe.model_dump(mode="json", exclude_defaults=True)).digest == recipe.digest
    assert plan(recipe).frames == 1
    with pytest.raises(
        RecipeError, match="channels: depth: expected a lens with z-depth; found equirectangular: use depth_ray"
    ):
        plan(Recipe.model_validate({**recipe.model_dump(mode="json"), "channels": ["rgb", "depth"]}))
