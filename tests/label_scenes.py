"""Samples of random scenes with every label of pixels asked for, and Embree's rays through their pixels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from shots import still_shot
from truth_scenes import EVERY, cube, lens, mesh_of, random_soup, sphere
from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.camera import orbit_center, orbit_rotation, pixel_rays
from viewsphere.geometry.rotation import random_rotation, rigid
from viewsphere.labels import annotated, context_of, observe
from viewsphere.model.instant import Viewpoint
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.sample import Sample
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.thing import Motion, Thing
from viewsphere.truth.raster.geometry import build_geometry
from viewsphere.truth.raster.visibility import rasterize

SIZE = (96, 72)


def rows_of(matrix):
    return tuple(map(tuple, np.asarray(matrix, float).tolist()))


def random_camera(rng, lens_name, distance=5.0):
    """A camera that looks at the origin from anywhere."""
    azimuth, elevation, tilt = rng.uniform(-3, 3), rng.uniform(0.15, 1.3), rng.uniform(-3, 3)
    rotation = orbit_rotation(azimuth, elevation, tilt)
    intrinsics = lens(*SIZE, 1.1, EVERY[lens_name], skew=0.0 if EVERY[lens_name] else 1.5)
    return Camera(intrinsics, rotation, -rotation @ orbit_center(azimuth, elevation, distance))


def random_things(rng, scenery=1):
    """Four things that are turned at random, of three models; the last so many are scenery."""
    flat = mesh_of([[-3, -3, -1], [3, -3, -1], [3, 3, -1.3]], [[0, 1, 2]])
    meshes = [cube(0.6), random_soup(rng, 40), sphere(3, 0.7), cube(0.6), flat]
    moves = [rigid(random_rotation(rng), rng.uniform(-1.5, 1.5, 3)) for _ in meshes[:-1]] + [np.eye(4)]
    names = ["m0", "m1", "m2", "m0", "m4"]
    things = tuple(
        Thing(
            id=i + 1 if i < len(meshes) - scenery else 0,
            model=ModelSpec(key=name, source=name, category=name, category_id=int(name[1]) + 3),
            motion=Motion.still(rows_of(move)),
        )
        for i, (name, move) in enumerate(zip(names, moves, strict=True))
    )
    return things, meshes


def pictured(things, meshes, camera, names, ground=True, around=None):
    """A sample of these still things with these labels of pixels; its geometry and visibility."""
    geometry = build_geometry(things, meshes, ground, 0.01)
    visibility = rasterize(geometry, camera)
    channels = observe(geometry, camera, visibility, names, around)
    objects = [thing for thing in things if thing.id]
    boxes = [Box3d.between(*mesh.bounds).corners for mesh in meshes[: len(objects)]]
    pose = Viewpoint(index=0, azimuth_deg=0, elevation_deg=0, distance=4)
    shot = still_shot(things, camera.intrinsics, [pose])
    files = [f"store/models/{thing.model.key}.obj" for thing in objects]
    told = annotated(context_of(shot, 0, camera, geometry, visibility, boxes, files))
    return Sample(0, "train", camera, None, told, channels, {}), geometry, visibility


def random_sample(seed, lens_name, names, **changes):
    rng = np.random.default_rng(seed)
    things, meshes = random_things(rng)
    return pictured(things, meshes, random_camera(rng, lens_name), names, **changes)


def changed(sample, name, change):
    """The sample with another array, which `change` gives or writes into a copy."""
    array = sample.channels[name].copy()
    made = change(array)
    return replace(sample, channels={**sample.channels, name: array if made is None else made})


def proof(label, sample):
    return list(label.prove(sample, {}))


def embree(geometry, camera):
    """By Embree's rays through all pixels, without the ground: the triangle that each meets first (H, W), -1 for none, and
    the point where it does, (H, W, 3) world metres.
    """
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    scene, last = EmbreeScene(robust=True), geometry.triangle_start[-1]
    TriangleMesh(scene, geometry.vertices.astype(np.float32), geometry.triangles[:last])
    rays = pixel_rays(camera.intrinsics).reshape(-1, 3)
    known = np.isfinite(rays).all(axis=1)
    directions = np.where(known[:, None], rays, (0, 0, 1)) @ camera.R
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    origins = camera.center + camera.lens.origins().reshape(-1, 3) @ camera.R
    hit = scene.run(origins.astype(np.float32), directions.astype(np.float32), output=True)
    shape = (camera.height, camera.width)
    triangle = np.where(known, np.asarray(hit["primID"], np.int64), -1)
    points = origins + np.asarray(hit["tfar"], np.float64)[:, None] * directions
    return triangle.reshape(shape), points.reshape(*shape, 3)
