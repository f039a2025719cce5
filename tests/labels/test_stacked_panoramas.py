"""Disparity of panoramas one above the other: closed forms of the distances along the rays, in pixels and degrees."""

from __future__ import annotations

import numpy as np
import pytest

from small import small_recipe
from viewsphere import Dataset, generate, plan, render
from viewsphere.check import check
from viewsphere.errors import RecipeError

BELOW = 0.2


def recipe_of(projection, second=(0, BELOW, 0), channels=("depth_ray", "disparity", "disparity_state", "instances"), **changes):
    camera = {"projection": projection, "size": [96, 48 if projection == "equirectangular" else 40]}
    if projection == "in part":
        camera = {"projection": "equirectangular", "size": [96, 48], "span": {"horizontal": 120}}
    rig = {"sensors": {"upper": {}, "lower": {"position": list(second)}}}
    return small_recipe(camera=camera, rig=rig, channels=list(channels), formats=[], **changes)


def expected(sample, sign):
    """Rows, and degrees, between both positions of each pixel's point: `sign` is 1 in the upper picture, -1 in the lower."""
    lens, rays = sample.camera.lens, sample.camera.lens.directions()
    points = rays * sample.depth_ray.astype(np.float64)[..., None]
    there = points - [0, sign * BELOW, 0]
    with np.errstate(invalid="ignore"):
        around = np.hypot(points[..., 0], points[..., 2])
        angle = np.abs(np.arctan2(points[..., 1], around) - np.arctan2(there[..., 1], around))
        rows = BELOW / around if lens.name == "cylindrical" else angle
    return sample.camera.intrinsics.fy * rows, np.degrees(angle)


@pytest.mark.parametrize("unit", ["pixels", "degrees"])
@pytest.mark.parametrize("projection", ["equirectangular", "in part", "cylindrical"])
def test_disparity_is_the_rows_between_both_positions(projection, unit):
    samples = list(render(recipe_of(projection, labels={"disparity": {"unit": unit}})))
    for sample in samples:
        rows, degrees = expected(sample, 1 if sample.sensor == "upper" else -1)
        seen = np.isfinite(sample.depth_ray)
        assert seen.sum() > 1000
        np.testing.assert_allclose(sample.disparity[seen], (rows if unit == "pixels" else degrees)[seen], rtol=2e-5, atol=2e-5)
        assert (sample.disparity[~seen] == 0).all()
    upper, lower = samples[:2]
    if unit == "pixels":  # what the other picture shows at the row is the same point
        rows, columns = np.nonzero((upper.disparity_state == 0) & (upper.instances > 0))
        there = np.floor(rows + 0.5 - upper.disparity[rows, columns]).astype(int)
        assert len(rows) > 10 and (lower.instances[there, columns] == upper.instances[rows, columns]).mean() > 0.9


def test_degrees_of_rectified_pinholes_are_the_angle_between_both_rays():
    recipe = small_recipe(
        rig={"kind": "stereo", "baseline": BELOW},
        channels=["depth", "disparity"],
        formats=[],
        labels={"disparity": {"unit": "degrees"}},
    )
    sample = next(iter(render(recipe)))
    here = sample.camera.lens.directions() * sample.depth.astype(np.float64)[..., None]
    there = here - [BELOW, 0, 0]
    with np.errstate(invalid="ignore"):
        cosine = (here * there).sum(axis=-1) / np.linalg.norm(here, axis=-1) / np.linalg.norm(there, axis=-1)
    seen = np.isfinite(sample.depth)
    np.testing.assert_allclose(sample.disparity[seen], np.degrees(np.arccos(cosine))[seen], rtol=1e-4)


@pytest.mark.parametrize("second", [(0.2, 0, 0), (0, 0.2, 0.001), (0, 0, 0.2)])
def test_panoramas_beside_each_other_have_none(second):
    with pytest.raises(
        RecipeError, match=r"channels: expected a rig of two equal panoramas .* one above the other, for disparity"
    ):
        plan(recipe_of("equirectangular", second))


def test_a_change_of_disparity_is_refused():
    with pytest.raises(RecipeError, match="disparity_change: expected a lens with z-depth"):
        plan(recipe_of("equirectangular", channels=["disparity_change"], time={"frames": 2}))


@pytest.mark.slow
def test_a_data_set_is_proved(tmp_path):
    generate(recipe_of("equirectangular"), tmp_path / "out", workers=0)
    dataset = Dataset(tmp_path / "out")
    assert [(left, right) for left, right, _ in plan(recipe_of("equirectangular")).rig.stacked] == [(0, 1)]
    report = check(dataset)
    assert not report.findings, report.findings
