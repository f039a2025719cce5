"""The lines that show what a lens sees."""

from __future__ import annotations

import numpy as np
import pytest

from viewsphere.geometry.frustum import frustum
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.recipe.recipe import Recipe
from viewsphere.run.reports.rig_view import recipe_rig


def lens(**camera):
    return (
        recipe_rig(Recipe(models=[{"source": "zoo:car"}], viewpoints={"distance": 4}, camera=camera)).sensors[0].intrinsics.lens
    )


def test_a_pinhole_s_is_a_pyramid_with_corners_at_its_length():
    shape = frustum(lens(fov_deg=60, size=[64, 48]), 2.0)
    corners = np.array([side[0] for side in shape.border])
    np.testing.assert_allclose(np.linalg.norm(corners, axis=1), 2.0)
    np.testing.assert_allclose(corners[:, 2], corners[0, 2])
    np.testing.assert_allclose(corners[1, 0] / corners[1, 2], np.tan(np.radians(30)))
    assert shape.across == () and all(
        (edge == [np.zeros(3), corner]).all() for edge, corner in zip(shape.edges, corners, strict=True)
    )


def test_parallel_rays_have_a_box_of_the_picture_s_own_width():
    shape = frustum(lens(projection="orthographic", width_m=3.2, size=[64, 48]), 5.0)
    points = np.concatenate(shape.lines)
    np.testing.assert_allclose([points.min(axis=0), points.max(axis=0)], [[-1.6, -1.2, 0], [1.6, 1.2, 5]])
    assert len(shape.edges) == 8


def test_a_panorama_is_a_sphere_with_meridians_and_parallels():
    shape = frustum(lens(projection="equirectangular", size=[128, 64]), 1.0)
    for line in (*shape.border, *shape.across):
        np.testing.assert_allclose(np.linalg.norm(line, axis=1), 1.0)
    assert len(shape.across) == 7 + 3
    equator = shape.across[8]
    np.testing.assert_allclose(equator[:, 1], 0, atol=1e-12)
    np.testing.assert_allclose(equator[0], equator[-1], atol=1e-6)
    assert len(shape.border[0]) == 1  # straight up


@pytest.mark.parametrize("turn", [90, 240, 360])
def test_a_cylindrical_picture_is_a_part_of_an_upright_cylinder(turn):
    shape = frustum(lens(projection="cylindrical", size=[120, 40], span={"horizontal": turn}), 1.0)
    points = np.concatenate([*shape.border, *shape.across])
    radius = np.hypot(points[:, 0], points[:, 2])
    np.testing.assert_allclose(radius, radius[0])
    angles = np.unwrap(np.arctan2(shape.border[0][:, 0], shape.border[0][:, 2]))
    assert np.ptp(angles) == pytest.approx(np.radians(turn))
    assert np.linalg.norm(points, axis=1).max() == pytest.approx(1)


def test_a_border_goes_around_corners_without_rays():
    fisheye = {"model": "fisheye", "coefficients": [0.0034823, 0.00071503, -0.0020532, 0.00020293]}
    own = lens(size=[512, 512], K=[[100, 0, 256], [0, 100, 256], [0, 0, 1]], distortion=fisheye)
    assert np.isnan(own.rays([[0.0, 0.0]]).directions).any()
    border = frustum(own, 1.0).border
    assert [len(side) for side in border] == [len(border[0])] * 4 and not np.isnan(np.concatenate(border)).any()
    xy, is_shown = own.project(np.concatenate(border) * (1 - 1e-9))
    far = np.hypot(*(xy[is_shown] - 256).T)
    on_side = np.isclose(np.abs(xy[is_shown] - 256).max(axis=1), 256, atol=1e-3)
    assert is_shown.mean() > 0.9 and np.ptp(far[~on_side]) < 0.01 < on_side.sum()


def test_a_bent_picture_s_border_is_that_of_its_rays():
    own = lens(size=[640, 480], focal_px=520, distortion={"model": "brown_conrady", "coefficients": [-0.3, 0.08, 0, 0]})
    shape = frustum(own, 1.0)
    top, corner = shape.border[0], shape.border[0][0]
    assert (top[len(top) // 2] / top[len(top) // 2, 2])[1] > (corner / corner[2])[1] + 0.05  # the middle is bent inwards
    xy, _ = own.project(top)
    np.testing.assert_allclose(xy[:, 1], 0, atol=1e-6)


def test_scans_have_lines():
    from viewsphere.geometry.lenses import lens_parameters

    scan = lens_parameters("scan", turn_deg=0.0, elevations_deg=(10.0, 0.0, -10.0))
    own = Intrinsics(width=360, height=3, fx=180 / np.pi, fy=1, cx=180, cy=0, distortion=scan)
    assert np.isfinite(np.concatenate(frustum(own.lens, 1.0).lines)).all()
