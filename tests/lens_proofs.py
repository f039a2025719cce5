"""Proofs of a lens model. The test of a lens subclasses `LensProofs`, and compares the lens with its formula besides."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ray_proofs import compare
from small import small_recipe
from truth_scenes import orbit_camera, placed
from viewsphere import Dataset, generate
from viewsphere.check import check
from viewsphere.geometry.box import projected_bounds
from viewsphere.geometry.camera import orbit_rotation
from viewsphere.geometry.lenses import LensParameters
from viewsphere.model.sensors.camera import Camera, Intrinsics
from zoo_mesh import drawn

PROFILE = settings(
    max_examples=12,
    derandomize=True,
    deadline=None,
    database=None,
    suppress_health_check=[HealthCheck.differing_executors],  # subclasses share the tests
)
SEEDS = st.integers(0, 10**6)
SIZE = (640, 480)


def intrinsics(own: LensParameters, focal: float, size: tuple[int, int] = SIZE, **more: float) -> Intrinsics:
    """A camera matrix around this lens whose focal length is that of a picture 640 pixels wide."""
    scale = size[0] / SIZE[0]
    middle = {"cx": size[0] / 2 + 1.25 * scale, "cy": size[1] / 2 - 2.5 * scale}
    return Intrinsics(
        width=size[0],
        height=size[1],
        **({"fx": focal * scale, "fy": 1.01 * focal * scale, "skew": 0.5 * scale, **middle} | more),
        distortion=own,
    )


def directions_of(rng: np.random.Generator, count: int) -> np.ndarray:
    """Points in all directions, at distances from 1 cm to 100 m."""
    directions = rng.normal(size=(count, 3))
    return directions / np.linalg.norm(directions, axis=1)[:, None] * 10 ** rng.uniform(-2, 2, (count, 1))


def formula_pixels(lens: Intrinsics, points: np.ndarray, formula) -> np.ndarray:
    """Positions of points by `formula(x, y, z)` in numbers of 40 digits, which gives the position in focal lengths."""
    with mpmath.workdps(40):
        rows = []
        for point in points.tolist():
            x, y = formula(*(mpmath.mpf(value) for value in point))
            rows.append([float(lens.fx * x + lens.skew * y + lens.cx), float(lens.fy * y + lens.cy)])
    return np.array(rows)


def assert_formula(own: LensParameters, focal: float, formula, rng: np.random.Generator, count: int = 60) -> None:
    """The lens projects what it shows of random points to 1e-9 pixels of its published formula."""
    lens = intrinsics(own, focal)
    points = directions_of(rng, 40 * count)
    xy, is_shown = lens.lens.project(points)
    near = is_shown & (np.abs(np.nan_to_num(xy - (lens.cx, lens.cy))) < 2000).all(axis=1)
    chosen = np.flatnonzero(near)[:count]
    assert len(chosen) >= count // 2
    np.testing.assert_allclose(xy[chosen], formula_pixels(lens, points[chosen], formula), rtol=0, atol=1e-9)


class LensProofs:
    """Properties of every lens. A subclass gives random parameters, and a focal length in pixels for a picture of 640 x
    480, at which the lens shows most of the picture.
    """

    focal = 240.0
    sees_behind = True

    @staticmethod
    def parameters(rng: np.random.Generator) -> LensParameters:
        """Random parameters of the lens."""
        raise NotImplementedError

    def lens(self, rng: np.random.Generator, size: tuple[int, int] = SIZE) -> Intrinsics:
        return intrinsics(self.parameters(rng), self.focal * math.exp(rng.uniform(-0.3, 0.3)), size)

    @PROFILE
    @given(seed=SEEDS)
    def test_a_point_on_a_ray_is_shown_at_the_ray_s_position(self, seed):
        rng = np.random.default_rng(seed)
        lens = self.lens(rng).lens
        xy = np.concatenate((rng.uniform((0, 0), SIZE, (3000, 2)), rng.uniform((-2000, -1500), (2640, 1980), (3000, 2))))
        directions = lens.rays(xy).directions
        has_ray = ~np.isnan(directions).any(axis=1)
        assert has_ray[:3000].mean() > 0.4
        length = np.linalg.norm(directions[has_ray], axis=1)
        assert np.allclose(length, 1, rtol=0, atol=1e-12) if lens.has_unit_rays else (directions[has_ray, 2] == 1).all()
        shown_at, is_shown = lens.project(directions * 10 ** rng.uniform(-2, 2, (6000, 1)))
        assert is_shown[has_ray].all() and not is_shown[~has_ray].any()
        np.testing.assert_allclose(shown_at[has_ray], xy[has_ray], rtol=1e-13, atol=1e-9)

    @PROFILE
    @given(seed=SEEDS)
    def test_no_two_directions_share_a_position(self, seed):
        """The ray at the position of any shown point, also near the lens's limit and behind the camera, is the point's."""
        rng = np.random.default_rng(seed)
        lens = self.lens(rng).lens
        points = directions_of(rng, 6000)
        xy, is_shown = lens.project(points)
        points, xy = points[is_shown], xy[is_shown]
        directions = lens.rays(xy).directions
        has_ray = ~np.isnan(directions[:, 0])
        assert len(points) > 100 and (~has_ray).sum() <= 1  # a point on the very rim
        apart = np.cross(directions, points)[has_ray] / np.linalg.norm(points[has_ray], axis=1)[:, None]
        scale = np.linalg.norm(directions[has_ray], axis=1) * (1 + np.abs(xy[has_ray] / self.focal).max(axis=1))
        assert (np.linalg.norm(apart, axis=1) <= 1e-5 * scale).all()
        assert ((directions * points).sum(axis=1)[has_ray] > 0).all()

    def test_rays_of_pixels_and_plain_data(self):
        lens = self.lens(np.random.default_rng(4), (64, 48))
        centres = np.stack(np.meshgrid(np.arange(64) + 0.5, np.arange(48) + 0.5), axis=-1)
        expected, table = lens.lens.rays(centres).directions, lens.lens.directions()
        has_ray = ~np.isnan(expected[..., 0])
        np.testing.assert_array_equal(table[has_ray], expected[has_ray])
        again = Intrinsics.model_validate_json(lens.model_dump_json())
        assert again == lens and again.lens is lens.lens
        assert lens.lens.record == lens.distortion.model_dump(mode="json")

    def test_it_shows_points_behind_the_camera_if_it_is_wide(self):
        lenses = [self.lens(np.random.default_rng(seed)).lens for seed in range(6)]
        points = directions_of(np.random.default_rng(7), 2000)
        assert any((points[lens.project(points)[1], 2] < 0).any() for lens in lenses) == self.sees_behind

    def test_nothing_is_shown_at_the_centre(self):
        assert not self.lens(np.random.default_rng(1)).lens.project(np.zeros((1, 3)))[1].any()

    @settings(PROFILE, max_examples=6)
    @given(seed=SEEDS)
    def test_boxes_hold_the_bent_edges_and_no_more(self, seed):
        rng = np.random.default_rng(seed)
        camera = Camera(self.lens(rng), orbit_rotation(*rng.uniform(-1, 1, 3)), rng.normal(size=3))
        spread = rng.choice([0.4, 2.0])
        vertices = (rng.normal(size=(9, 3)) * spread + (0, 0, rng.uniform(0.5, 4)) - camera.t) @ camera.R
        triangles = np.arange(9, dtype=np.int32).reshape(3, 3)
        box, is_whole = projected_bounds(camera, vertices, triangles)
        corners = (vertices @ camera.R.T + camera.t)[triangles]
        share = np.linspace(0, 1, 3001)[:, None, None]
        edges = np.concatenate([(corners + share[:, None] * (np.roll(corners, -1, 1) - corners)).reshape(-1, 3)])
        xy, is_shown = camera.lens.project(edges)
        assert is_whole <= is_shown.all()
        if not is_shown.any():
            return
        low, high = xy[is_shown].min(axis=0), xy[is_shown].max(axis=0)
        scale = 1e-3 * (1 + np.abs(np.concatenate((low, high))).max() / 1000) * (1 if is_whole else 10)
        assert (np.array(box[:2]) <= low + scale).all() and (np.array(box[2:]) >= high - scale).all()
        if is_whole:
            assert (np.array(box[:2]) >= low - scale).all() and (np.array(box[2:]) <= high + scale).all()

    @pytest.mark.slow
    def test_labels_are_those_of_embree_s_rays_on_a_zoo_scene(self):
        pytest.importorskip("embreex")
        rng = np.random.default_rng(8)
        meshes = [drawn(name, 0) for name in ("car", "bicycle", "post_box")]
        moves = [np.eye(4) for _ in meshes]
        for move, (x, y) in zip(moves, ((0, 0), (1.6, -1.5), (-1.8, -1.2)), strict=True):
            move[:2, 3] = x, y
        geometry = placed(*meshes, moves=moves, ground=True)
        own = self.lens(rng, (200, 150))
        views = [orbit_camera(own, a, e, d, (0, 0, 0.5)) for a, e, d in ((0.4, 0.3, 3.0), (2.0, 0.9, 2.5))]
        toss_ups, overruled, errors = compare(geometry, views)
        assert len(errors) > 1000 and toss_ups < 2e-3 * 60000 and overruled < 1e-3 * 60000
        assert np.quantile(errors, 0.999) <= 1e-4

    @pytest.mark.slow
    def test_a_data_set_passes_check(self, tmp_path):
        own = self.parameters(np.random.default_rng(2))
        camera = {"size": [96, 72], "focal_px": self.focal * 0.15, "distortion": own.model_dump(mode="json")}
        channels = ["rgb", "depth", "depth_ray", "instances", "normals", "flow"]
        time = {"frames": 2, "fps": 10}
        generate(small_recipe(camera=camera, channels=channels, formats=["native"], time=time), tmp_path / "out", workers=0)
        report = check(Dataset(tmp_path / "out"))
        assert report.ok, report.findings
        assert report.checked["depth"] > 0
