"""Bodies for tests of what falls, and measures of whether they lie in one another, and still."""

from __future__ import annotations

import itertools

import numpy as np
from scipy.spatial import ConvexHull

from viewsphere.composing.physics import World, body_of
from viewsphere.composing.placing import Shape
from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.rotation import transform
from viewsphere.model.model_spec import ModelSpec


def spec(key):
    return ModelSpec(key=key, source="x.obj", category="thing", category_id=1)


def shape_of(points):
    return Shape(Box3d.around(points).corners, lambda: points)


def solids(count, seed=0, scale=1.0):
    """Shapes of boxes, cylinders and random polyhedra about 0.2 to 0.4 m long."""
    rng, found = np.random.default_rng(seed), []
    for i in range(count):
        corners = np.array(list(itertools.product((-1, 1), repeat=3))) * rng.uniform(0.05, 0.2, 3)
        turn = np.linspace(0, 2 * np.pi, 24, endpoint=False)
        ring = np.stack([0.1 * np.cos(turn), 0.1 * np.sin(turn)], axis=1)
        cylinder = np.concatenate([np.insert(ring, 2, z, axis=1) for z in (-0.15, 0.15)])
        cloud = rng.uniform(-1, 1, (40, 3)) * (0.2, 0.1, 0.08)
        found.append(shape_of(scale * (corners, cylinder, cloud)[i % 3]))
    return found


def placed(shapes, poses):
    """Corners of the hulls in the world."""
    return [transform(np.array(pose), shape.hull) for shape, pose in zip(shapes, poses, strict=True)]


def depth(a, b):
    """How far two convex hulls (corners) lie in one another, metres; below 0 it is the gap: the least overlap along any
    direction, from the normals of their faces, of all pairs of edges that may count, by a search around the best.
    """
    normals = np.concatenate([ConvexHull(a).equations[:, :3], -ConvexHull(b).equations[:, :3]])

    def overlap(directions):
        return (a @ directions.T).max(axis=0) - (b @ directions.T).min(axis=0)

    best, rng = normals[np.argsort(overlap(normals))[:8]], np.random.default_rng(0)
    for width in 0.2 * 0.88 ** np.arange(60):
        tried = np.concatenate([best, *(best + width * rng.normal(size=best.shape) for _ in range(12))])
        tried /= np.linalg.norm(tried, axis=1, keepdims=True)
        best = tried[np.argsort(overlap(tried))[:8]]
    return float(overlap(best).min())


def deepest(hulls):
    """The largest overlap of any two hulls, metres."""
    near = [
        (a, b)
        for a, b in itertools.combinations(hulls, 2)
        if (a.max(axis=0) > b.min(axis=0)).all() and (b.max(axis=0) > a.min(axis=0)).all()
    ]
    return max((depth(a, b) for a, b in near), default=0.0)


def one_more_second(shapes, poses, boards=(), floor=0.0):
    """What one more second of gravity does to bodies at rest, without whatever helped them: metres and degrees at most, and the
    deepest contact that MuJoCo finds, metres.
    """
    world = World([body_of([shape.hull], 300.0) for shape in shapes], poses, boards, 0.4, floor)
    before = np.array(poses)
    world.step(500)
    after = np.array(world.poses)
    way = np.linalg.norm(after[:, :3, 3] - before[:, :3, 3], axis=1).max()
    traces = np.einsum("nij,nij->n", before[:, :3, :3], after[:, :3, :3])
    return way, np.degrees(np.arccos(np.clip((traces - 1) / 2, -1, 1))).max(), world.deepest
