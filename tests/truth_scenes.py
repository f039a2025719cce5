"""Scenes and an independent float64 ray caster for the tests of truth."""

from __future__ import annotations

import math

import numpy as np

from viewsphere.assets.mesh import Mesh
from viewsphere.geometry.camera import orbit_center, orbit_rotation, pixel_rays
from viewsphere.geometry.lenses import lens_parameters
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.model.thing import Motion, Thing
from viewsphere.truth.raster.alpha_masks import ENDLESS
from viewsphere.truth.raster.geometry import Geometry, build_geometry
from viewsphere.truth.raster.visibility import rasterize

BARREL = lens_parameters("brown_conrady", coefficients=(-0.21, 0.06, 0.001, -0.002, -0.004))
RATIONAL = lens_parameters("brown_conrady", coefficients=(0.4, 0.05, -0.001, 0.0007, 0.01, 0.6, 0.12, 0.02))
FISHEYE = lens_parameters("fisheye", coefficients=(0.03, -0.004, 0.0007, -0.0001))
PARALLEL = lens_parameters("orthographic")
LENSES = {"pinhole": None, "barrel": BARREL, "rational": RATIONAL, "fisheye": FISHEYE}
EVERY = {**LENSES, "orthographic": PARALLEL}
"""All of them, and parallel rays, which begin at different places."""


def mesh_of(vertices, triangles, normals=None, parts=None, **fields) -> Mesh:
    vertices = np.asarray(vertices, np.float32)
    triangles = np.asarray(triangles, np.int32).reshape(-1, 3)
    if normals is None:
        normals = np.tile(np.float32([0, 0, 1]), (len(vertices), 1))
    part = np.zeros(len(triangles), np.int32) if parts is None else np.asarray(parts, np.int32)
    names = tuple(f"part{i}" for i in range(int(part.max(initial=0)) + 1))
    fields.setdefault("triangle_material", np.zeros(len(triangles), np.int32))
    return Mesh(vertices, triangles, np.asarray(normals, np.float32), triangle_part=part, parts=names, **fields)


def placed(*meshes: Mesh, moves=None, ground=False, label_alpha=0.01, scenery=0) -> Geometry:
    """A geometry of these meshes; the last `scenery` of them are."""
    moves = moves or [np.eye(4)] * len(meshes)
    things = [
        Thing(
            id=i + 1 if i < len(moves) - scenery else 0,
            model=ModelSpec(key=f"m{i}", source=f"m{i}", category="thing", category_id=i + 10),
            motion=Motion.still(tuple(map(tuple, np.asarray(m, float).tolist()))),
        )
        for i, m in enumerate(moves)
    ]
    return build_geometry(things, meshes, ground, label_alpha)


def lens(width=64, height=48, fov=math.radians(60), distortion=None, **fields) -> Intrinsics:
    fisheye = distortion is not None and distortion.model == "fisheye"
    focal = width / fov if fisheye else width / (2 * math.tan(fov / 2))
    if distortion is PARALLEL:
        focal /= 4.0  # a picture as wide as a pinhole's at 4 m
    values = {"fx": focal, "fy": focal, "cx": width / 2, "cy": height / 2} | fields
    return Intrinsics(width=width, height=height, distortion=distortion, **values)


def orbit_camera(intrinsics, azimuth=0.0, elevation=0.0, distance=5.0, target=(0.0, 0.0, 0.0), tilt=0.0) -> Camera:
    rotation = orbit_rotation(azimuth, elevation, tilt)
    return Camera(intrinsics, rotation, -rotation @ (np.asarray(target) + orbit_center(azimuth, elevation, distance)))


def random_soup(rng, count, spread=2.0, size=0.6) -> Mesh:
    """Unconnected triangles of very different sizes around the origin."""
    centres = rng.normal(size=(count, 1, 3)) * spread
    sizes = size * 10 ** rng.uniform(-2, 1, (count, 1, 1))
    return mesh_of((centres + rng.normal(size=(count, 3, 3)) * sizes).reshape(-1, 3), np.arange(3 * count))


def sphere(subdivisions: int, radius: float = 1.0) -> Mesh:
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions, radius)
    return mesh_of(ball.vertices, ball.faces, ball.vertices / radius)


def cube(half: float = 0.5) -> Mesh:
    """A cube with four vertices of its own and one part a face."""
    corners, triangles, normals = [], [], []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            u, v, n = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3], sign * np.eye(3)[axis]
            s = len(corners)
            corners += [half * (n + a * u * sign + b * v) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
            triangles += [[s, s + 1, s + 2], [s, s + 2, s + 3]]
            normals += [n] * 4
    return mesh_of(corners, triangles, normals, parts=np.repeat(np.arange(6), 2))


def silhouette(geometry: Geometry, camera: Camera, object_id: int, window):
    """Pixels of a window whose ray would meet an object if nothing else were there, (h, w) bool."""
    return rasterize(geometry, camera, object_id=object_id, window=window).triangle >= 0


def least_weight(geometry: Geometry, u, v):
    """The least weight (..., T) that has to be positive where a ray meets a triangle, by those of its corners 1 and 2."""
    code = geometry.triangle_cutout
    least = np.minimum(np.minimum(u, v), 1 - u - v)
    return np.where(code == ENDLESS[0], u, np.where(code == ENDLESS[1], v, least))


def begins(camera, world):
    """The origins of the rays to points (N, 3)."""
    if not camera.lens.is_parallel:
        return np.broadcast_to(camera.center, world.shape)
    return world - (world @ camera.R[2] + camera.t[2])[:, None] * camera.R[2]


def cast(geometry: Geometry, camera: Camera, chunk: int = 256):
    """Brute force: every ray against every triangle in float64 numpy (Moller and Trumbore 1997).

    Returns triangle, s (inf where none), the smallest margin of any ray to any edge of a triangle as barycentric distance, and
    the relative gap between the two nearest hits: pixels where either is tiny are a toss-up.
    """
    rays = pixel_rays(camera.intrinsics)
    shape = rays.shape[:2]
    d = rays.reshape(-1, 3)
    x = geometry.vertices @ camera.R.T + camera.t
    begin = camera.lens.origins().reshape(-1, 1, 3)
    corner, b, c = (x[geometry.triangles[:, k]] for k in range(3))
    e1, e2 = b - corner, c - corner
    best = np.full(len(d), np.inf)
    second = np.full(len(d), np.inf)
    which = np.full(len(d), -1)
    margin = np.full(len(d), np.inf)
    with np.errstate(all="ignore"):
        for i in range(0, len(d), chunk):
            r, a = d[i : i + chunk, None], corner - begin[i : i + chunk]
            p = np.cross(r, e2)
            det = (p * e1).sum(-1)
            u = -(p * a).sum(-1) / det
            q = np.cross(-a, e1)
            v = (q * r).sum(-1) / det
            s = (q * e2).sum(-1) / det
            least = least_weight(geometry, u, v)
            hit = (least >= 0) & (s > 0)
            near = np.where(s > 0, np.abs(least), np.inf)
            near = np.where(np.isfinite(near), near, np.inf)
            s = np.where(hit, s, np.inf)
            order = np.argsort(s, axis=1, kind="stable")[:, :2]
            rows = np.arange(len(s))
            best[i : i + chunk] = s[rows, order[:, 0]]
            if s.shape[1] > 1:
                second[i : i + chunk] = s[rows, order[:, 1]]
            which[i : i + chunk] = np.where(np.isfinite(best[i : i + chunk]), order[:, 0], -1)
            margin[i : i + chunk] = near.min(axis=1)
        gap = np.where(np.isfinite(best), (second - best) / best, np.inf)
    gap = np.where(np.isnan(gap), np.inf, gap)
    return which.reshape(shape), best.reshape(shape), margin.reshape(shape), gap.reshape(shape)
