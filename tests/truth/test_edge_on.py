"""A camera that stands in the ground's plane sees the ground edge-on, that is not at all; just above it, up to the horizon."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from quick import quick
from small import small_recipe
from truth_scenes import EVERY, cube, lens, orbit_camera, placed
from viewsphere import Dataset, generate
from viewsphere.check import check
from viewsphere.check.frames.rays import RayCaster
from viewsphere.run.shots.scenery import Scenery
from viewsphere.truth.raster.visibility import is_edge_on, rasterize, with_ground

STANDING = placed(cube(), ground=True)


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize("tilt", [0.0, 0.3, math.pi / 2])
@pytest.mark.parametrize("azimuth", quick([0.0, 0.4, 2.1, 4.4], 0.4))
@pytest.mark.parametrize("roundings", [-3, 0, 3])
def test_no_pixel_sees_the_ground_from_its_own_plane(name, tilt, azimuth, roundings):
    z = STANDING.ground_z + roundings * np.spacing(1.0)
    camera = orbit_camera(lens(97, 73, 1.3, EVERY[name]), azimuth, 0.0, 3.0, (0, 0, z), tilt=tilt)
    assert is_edge_on(STANDING, camera)
    visibility = rasterize(STANDING, camera)
    ground = STANDING.triangle_start[-1]
    assert (visibility.triangle < ground).all()
    assert (visibility.triangle >= 0).any()
    assert np.array_equal(with_ground(STANDING, camera, visibility).triangle, visibility.triangle)


@pytest.mark.parametrize("height", [1e-6, -1e-6])
def test_a_thousandth_of_a_millimetre_beside_the_plane_half_of_the_picture_is_ground(height):
    camera = orbit_camera(lens(97, 73, 1.3), 0.4, 0.0, 3.0, (0, 0, STANDING.ground_z + height))
    assert not is_edge_on(STANDING, camera)
    below = slice(37, None) if height > 0 else slice(0, 36)
    assert (rasterize(STANDING, camera).triangle[below] >= STANDING.triangle_start[-1]).all()


@pytest.fixture(scope="module")
def level(tmp_path_factory):
    """A sequence, whose ground is z = 0, seen from there."""
    out = tmp_path_factory.mktemp("level") / "out"
    view = {"azimuth": [0, 33, 200], "elevation": 0, "distance": 1, "target": [0, 0, 0], "tilt": [0, 17]}
    channels = ["depth", "instances", "normals", "flow"]
    generate(small_recipe(viewpoints=view, time={"frames": 2, "fps": 10}, channels=channels, formats=[]), out)
    return Dataset(out)


@pytest.mark.slow
def test_check_finds_nothing_wrong_with_pictures_from_the_plane(level):
    pytest.importorskip("embreex")
    for sample in level:
        background = sample.channels["instances"] == 0
        assert np.isinf(sample.channels["depth"][background]).all()
        assert (~background).sum() > 50
    report = check(level, sample=None)
    assert report.ok, report.findings
    assert report.checked["surface"] == len(level)


@pytest.mark.parametrize("depth", [1e-12, 0.5])
def test_check_finds_a_ground_that_is_seen_from_its_plane(level, depth):
    pytest.importorskip("embreex")
    caster, sample = RayCaster(level, Scenery(level)), level[0]
    assert not list(caster.off_surface(sample))
    kept = {name: sample.channels[name].copy() for name in ("depth", "instances")}
    below = kept["depth"][40:]
    below[np.isinf(below)] = depth
    (found,) = caster.off_surface(replace(sample, channels=kept))
    assert "points of the background are not where scenery and ground are" in found
