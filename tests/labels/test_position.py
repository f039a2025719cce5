"""position against closed forms and Embree's rays, by every lens; its proof notices other places."""

import numpy as np
import pytest

from label_scenes import changed, embree, proof, random_sample
from proven import told
from truth_scenes import EVERY, lens, orbit_camera, placed, sphere
from viewsphere.geometry.camera import pixel_rays
from viewsphere.labels import observe
from viewsphere.labels.position import LABEL, striped
from viewsphere.model.sensors.camera import Camera
from viewsphere.truth.raster.visibility import rasterize

NAMES = ("depth", "instances", "coordinates", "position")


@pytest.mark.parametrize("name", EVERY)
def test_the_ground_is_where_rays_meet_its_plane_and_the_sky_is_nowhere(name):
    geometry = placed(sphere(2, 0.2), ground=True)
    camera = orbit_camera(lens(96, 72, 1.1, EVERY[name]), 0.4, 0.3, 4.0, tilt=0.2)
    visibility = rasterize(geometry, camera)
    found = observe(geometry, camera, visibility, ["position"])["position"]
    ground = visibility.triangle >= geometry.triangle_start[-1]
    directions = pixel_rays(camera.intrinsics)[ground] @ camera.R
    begin = camera.center + camera.lens.origins()[ground] @ camera.R
    expected = begin + directions * ((geometry.ground_z - begin[:, 2]) / directions[:, 2])[:, None]
    away = np.linalg.norm(expected - camera.center, axis=1)
    assert ground.sum() > 1000 and (away.max() > 50 or camera.lens.is_parallel)
    assert (np.abs(found[ground] - expected).max(axis=1) < 2e-7 * away + 1e-7).all()
    assert np.isnan(found[visibility.triangle < 0]).all() and (visibility.triangle < 0).any()


@pytest.mark.parametrize("name", EVERY)
def test_a_sphere_s_points_are_as_far_from_its_centre_as_its_facets(name):
    geometry = placed(sphere(5, 1.0))
    camera = orbit_camera(lens(96, 72, 1.1, EVERY[name]), 0.4, 0.5, 4.0)
    found = observe(geometry, camera, rasterize(geometry, camera), ["position"])["position"]
    radius = np.linalg.norm(found[np.isfinite(found).all(axis=-1)], axis=1)
    assert len(radius) > 100 and radius.max() < 1 + 1e-6 and radius.min() > 1 - 2e-3


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize("seed", range(3))
def test_embree_meets_the_same_points(name, seed):
    pytest.importorskip("embreex")
    sample, geometry, visibility = random_sample(seed, name, NAMES, ground=False)
    triangle, points = embree(geometry, sample.camera)
    same = (triangle == visibility.triangle) & (triangle >= 0)
    assert same.sum() > 0.98 * (visibility.triangle >= 0).sum() > 500
    assert len(set(geometry.triangle_object[triangle[same]])) >= 3
    away = np.linalg.norm(points - sample.camera.center, axis=-1)
    assert (np.abs(sample.position - points).max(axis=-1) < 2e-5 * away)[same].all()
    told("position", "Embree's rays", np.abs(sample.position - points)[same], "m")


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize("seed", range(3))
def test_its_proof_notices_other_places(name, seed):
    sample, *_ = random_sample(seed, name, NAMES)
    assert proof(LABEL, sample) == []
    seen = np.argwhere(sample.instances > 0)[7]
    for change in (
        lambda a: a + np.float32(0.001),
        lambda a: a[..., ::-1].copy(),
        lambda a: a.__setitem__(tuple(seen), np.nan),
        lambda a: a.__setitem__((*seen, 1), np.nan),
        lambda a: a.__setitem__((*seen, 1), a[(*seen, 1)] + np.float32(3e-5)),
        np.zeros_like,
    ):
        assert proof(LABEL, changed(sample, "position", change))


def test_its_proof_notices_another_depth_another_pose_and_a_point_farther_along_its_ray():
    sample, *_ = random_sample(4, "barrel", NAMES)
    farther = sample.camera.center + (sample.position - sample.camera.center) * 1.0001
    found = proof(LABEL, changed(sample, "position", lambda a: farther.astype(np.float32)))
    assert any("at their depth" in line for line in found) and any("its coordinates, moved" in line for line in found)
    assert proof(LABEL, changed(sample, "depth", lambda a: a * np.float32(1.0001)))
    assert proof(LABEL, changed(sample, "coordinates", lambda a: a + np.float32(0.0001)))


def test_it_is_exact_far_from_the_origin():
    """There the world's numbers are coarse, but points are not farther from the ray than they round."""
    camera = orbit_camera(lens(96, 72, 1.1), 0.4, 0.5, 4.0, target=(4096, -300, 0))
    geometry = placed(sphere(3, 1.0), moves=[[[1, 0, 0, 4096], [0, 1, 0, -300], [0, 0, 1, 0], [0, 0, 0, 1]]])
    observed = observe(geometry, camera, rasterize(geometry, camera), ["position", "coordinates"])
    seen = np.isfinite(observed["position"]).all(axis=-1)
    off = observed["position"][seen] - np.array([4096, -300, 0]) - observed["coordinates"][seen]
    assert np.abs(off).max() < 4096 * 2**-24 + 1e-5


def test_its_picture_repeats_each_metre():
    points = np.array([[[0, 0.25, 0.5], [1, 1.25, -0.5], [np.nan] * 3]], np.float32)
    found = striped(points)
    assert (found[0, 0] == found[0, 1]).all() and (found[0, 2] == 0).all() and len(set(found[0, 0].tolist())) == 3


def test_cameras_that_are_rotations_to_a_few_digits_only():
    geometry, camera = placed(sphere(3, 1.0)), orbit_camera(lens(96, 72, 1.1), 0.4, 0.5, 4.0)
    rough = Camera(camera.intrinsics, camera.R.round(3), camera.t)
    observed = observe(geometry, rough, rasterize(geometry, rough), ["position", "coordinates"])
    seen = np.isfinite(observed["position"]).all(axis=-1)
    np.testing.assert_allclose(observed["position"][seen], observed["coordinates"][seen], atol=2e-6)
