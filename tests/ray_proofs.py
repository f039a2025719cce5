"""Labels of a scene against Embree, an independent ray caster (float32, so ties and grazed edges are set aside and counted)."""

from __future__ import annotations

import numpy as np

from proven import equal
from truth_scenes import least_weight
from viewsphere.geometry.camera import pixel_rays
from viewsphere.labels import observe
from viewsphere.truth.raster.visibility import rasterize


def embree(geometry):
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    scene = EmbreeScene(robust=True)
    TriangleMesh(scene, geometry.vertices.astype(np.float32), geometry.triangles)
    return scene


def trace(scene, camera):
    """Triangle (-1 where none) and s of Embree's first hit through each pixel's centre."""
    rays = pixel_rays(camera.intrinsics)
    directions = (rays.reshape(-1, 3) @ camera.R).astype(np.float32)
    origins = np.broadcast_to(camera.center.astype(np.float32), directions.shape).copy()
    hit = scene.run(origins, directions, output=True)
    triangle = np.asarray(hit["primID"], np.int64).reshape(rays.shape[:2])
    return triangle, np.asarray(hit["tfar"], np.float64).reshape(rays.shape[:2])


def planes(geometry, camera, triangle, rays):
    """Of each ray and the triangle named for it: s where it meets the plane, and its distance to the nearest edge in pixels."""
    x = geometry.vertices @ camera.R.T + camera.t
    corners = x[geometry.triangles[triangle]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    with np.errstate(all="ignore"):
        s = (normal * corners[:, 0]).sum(-1) / (normal * rays).sum(-1)
        distance = np.full(len(rays), np.inf)
        for i in range(3):
            side = np.cross(corners[:, i], corners[:, (i + 1) % 3])
            side /= np.linalg.norm(side, axis=1)[:, None]
            distance = np.minimum(distance, np.abs((side * rays).sum(-1)) / np.linalg.norm(rays, axis=1))
    distance = np.where(triangle < 0, np.inf, distance)
    return np.where(triangle < 0, np.inf, s), distance * camera.intrinsics.fx


def right_by_float64(geometry, camera, ray, triangle):
    """Return whether brute force in float64 finds this triangle first along the ray."""
    x = geometry.vertices @ camera.R.T + camera.t
    a, b, c = (x[geometry.triangles[:, k]] for k in range(3))
    with np.errstate(all="ignore"):
        p = np.cross(ray, c - a)
        det = (p * (b - a)).sum(-1)
        u, q = -(p * a).sum(-1) / det, np.cross(-a, b - a)
        v, s = (q @ ray) / det, (q * (c - a)).sum(-1) / det
        s = np.where((least_weight(geometry, u, v) >= 0) & (s > 0), s, np.inf)
    return triangle == (int(np.argmin(s)) if np.isfinite(s).any() else -1)


def compare(geometry, cameras):
    """Ids and depth of all cameras; returns how many pixels were a toss-up, how many Embree got wrong, and depth errors."""
    scene, toss_ups, overruled, errors = embree(geometry), 0, 0, []
    for camera in cameras:
        visibility = rasterize(geometry, camera)
        observed = observe(geometry, camera, visibility, ("instances", "parts", "triangles", "depth"))
        other, s = trace(scene, camera)
        rows, columns = np.nonzero(other != visibility.triangle)
        own, other_there = visibility.triangle[rows, columns], other[rows, columns]
        rays = pixel_rays(camera.intrinsics)[rows, columns]
        (s_own, d_own), (s_other, d_other) = (planes(geometry, camera, t, rays) for t in (own, other_there))
        with np.errstate(invalid="ignore"):
            tie = np.abs(s_own - s_other) <= 1e-6 * np.minimum(np.abs(s_own), np.abs(s_other))
        toss_up = tie | (np.minimum(d_own, d_other) < 1e-3)
        for i in np.flatnonzero(~toss_up):
            assert right_by_float64(geometry, camera, rays[i], own[i]), (rows[i], columns[i], own[i], other_there[i])
        toss_ups += int(toss_up.sum())
        beyond = (own >= geometry.triangle_start[-1]) & (other_there < 0)  # Embree's ground ends
        overruled += int((~toss_up & ~beyond).sum())
        agreed = other == visibility.triangle
        hit = agreed & (other >= 0) & (geometry.triangle_object[other] > 0)
        z = s * pixel_rays(camera.intrinsics)[..., 2]
        errors.append(np.abs(observed["depth"] - z)[hit] / np.maximum(1, z[hit] / 10))
        objects = np.where(other >= 0, geometry.triangle_object[other], 0)
        parts = np.where(other >= 0, np.append(geometry.triangle_part, 0)[np.minimum(other, len(geometry.triangle_part))], 0)
        start = np.array(geometry.triangle_start)[np.maximum(objects - 1, 0)]
        equal("instances", "Embree's rays", observed["instances"][agreed], objects[agreed])
        equal("parts", "Embree's rays", observed["parts"][agreed], parts[agreed])
        equal("triangles", "Embree's rays", observed["triangles"][agreed], np.where(objects > 0, other - start, -1)[agreed])
    return toss_ups, overruled, np.concatenate(errors)
