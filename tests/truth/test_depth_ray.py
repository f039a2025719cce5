"""depth_ray against closed forms and Embree's rays, by every lens; its proof notices other distances."""

from dataclasses import replace

import numpy as np
import pytest

from proven import close
from truth_scenes import LENSES, lens, orbit_camera, placed, random_soup, sphere
from viewsphere.geometry.camera import pixel_rays
from viewsphere.labels import channel_labels, observe
from viewsphere.model.sample import Sample
from viewsphere.truth.raster.visibility import rasterize


def seen(geometry, lens_name, distance=4.0):
    camera = orbit_camera(lens(96, 72, 1.1, LENSES[lens_name]), 0.4, 0.5, distance, tilt=0.2)
    visibility = rasterize(geometry, camera)
    return camera, visibility, observe(geometry, camera, visibility, ("depth", "depth_ray"))


@pytest.mark.parametrize("name", LENSES)
def test_a_sphere_is_as_far_as_its_facets_and_closed_form_say(name):
    """A ball around the camera's target: the ray meets it at b - sqrt(b^2 - d^2 + r^2)."""
    camera, _, observed = seen(placed(sphere(5, 1.0)), name)
    rays = pixel_rays(camera.intrinsics)
    rays = rays / np.linalg.norm(rays, axis=-1, keepdims=True)
    middle = camera.R @ np.zeros(3) + camera.t
    b = rays @ middle
    root = b * b - middle @ middle + 1.0
    inside = (root > 0.05) & np.isfinite(observed["depth_ray"])  # not where facets are seen edge-on
    assert inside.sum() > 100
    expected = b - np.sqrt(np.where(inside, root, 0))
    assert np.abs(observed["depth_ray"] - expected)[inside].max() < 5e-3  # the facets' sagitta


@pytest.mark.parametrize("name", LENSES)
def test_the_ground_is_where_the_ray_meets_its_plane(name):
    geometry = placed(sphere(2, 0.2), ground=True)
    camera, visibility, observed = seen(geometry, name)
    ground = (visibility.triangle >= geometry.triangle_start[-1]) & (observed["depth_ray"] < 100)
    rays = pixel_rays(camera.intrinsics)[ground] @ camera.R
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    expected = (geometry.ground_z - camera.center[2]) / rays[:, 2]
    assert ground.sum() > 1000
    near = expected < 10
    close("depth_ray", "closed form, up to 10 m", observed["depth_ray"][ground][near], expected[near], "m", rtol=2e-6)
    np.testing.assert_allclose(observed["depth_ray"][ground], expected, rtol=2e-6)


@pytest.mark.parametrize("name", LENSES)
def test_embree_measures_the_same(name):
    pytest.importorskip("embreex")
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    geometry = placed(random_soup(np.random.default_rng(3), 80))
    camera, visibility, observed = seen(geometry, name)
    scene = EmbreeScene(robust=True)
    TriangleMesh(scene, geometry.vertices.astype(np.float32), geometry.triangles)
    rays = pixel_rays(camera.intrinsics)
    directions = (rays.reshape(-1, 3) @ camera.R).astype(np.float64)
    known = np.isfinite(directions).all(axis=1)
    directions = np.where(known[:, None], directions, (0, 0, 1))
    directions = (directions / np.linalg.norm(directions, axis=1, keepdims=True)).astype(np.float32)
    origins = np.broadcast_to(camera.center.astype(np.float32), directions.shape).copy()
    hit = scene.run(origins, directions, output=True)
    same = (np.asarray(hit["primID"]).reshape(72, 96) == visibility.triangle) & (visibility.triangle >= 0)
    assert same.sum() > 500
    far = np.asarray(hit["tfar"], np.float64).reshape(72, 96)
    close("depth_ray", "Embree's rays", observed["depth_ray"][same], far[same], "m", rtol=2e-5)
    assert np.isinf(observed["depth_ray"][visibility.triangle < 0]).all()


def test_its_proof_notices_other_distances():
    camera, _, observed = seen(placed(sphere(3, 1.0), ground=True), "fisheye")
    sample = Sample(0, "train", camera, None, (), observed, {})
    assert list(channel_labels()["depth_ray"].prove(sample, {})) == []
    endless = np.full_like(observed["depth_ray"], np.inf)
    for change in (endless, -observed["depth_ray"], np.nan_to_num(observed["depth_ray"], posinf=5)):
        assert list(channel_labels()["depth_ray"].prove(replace(sample, channels={**observed, "depth_ray": change}), {}))
