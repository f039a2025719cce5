"""Views of things, and brute force in float64 for what one view shows of another."""

from __future__ import annotations

import numpy as np

from truth_scenes import begins, cast, least_weight
from viewsphere.geometry.camera import pixel_rays, project
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Floor
from viewsphere.model.thing import Motion, Thing, TimeStep
from viewsphere.truth.correspondences.correspondence import Match
from viewsphere.truth.raster.geometry import build_geometry, present
from viewsphere.truth.surface_points.raster import BEHIND, OCCLUDED, OUTSIDE, VISIBLE
from viewsphere.truth.view import View

SURE = 1e-9


def pose(*position, turn=None):
    """A pose as a tuple of rows."""
    out = np.eye(4)
    out[:3, :3] = np.eye(3) if turn is None else turn
    out[:3, 3] = position
    return tuple(map(tuple, out.tolist()))


def thing(i, where, step=None, key=None):
    spec = ModelSpec(key=key or f"m{i}", source="m", category="thing", category_id=i + 1)
    steps = (None if step is None else TimeStep(frame=step),)
    return Thing(id=i + 1, model=spec, motion=Motion(poses=(where,), steps=steps))


def view(meshes, poses, camera, ground=False, sky=True, steps=None, floor=None):
    """A view of these meshes in these poses, None for what is not there; `steps` are the frames of their files."""
    steps = steps or [None] * len(poses)
    under = None if floor is None else Floor(height=floor)
    things = [thing(i, where, step) for i, (where, step) in enumerate(zip(poses, steps, strict=True))]
    return View(things, build_geometry(things, present(things, meshes), ground, 0.01, under), camera, sky)


def matched(here, there):
    return Match(here, here.visibility, there)


def centers(camera):
    x, y = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    return np.stack((x, y), axis=-1)


def brute_points(here, there):
    """What every pixel of a view shows, by brute force: triangle (H, W), -1 for none, and where these points are in the world
    when the other view is taken, (H, W, 3), NaN for none; and pixels that are no toss-up.

    Both views have the same triangles; the ground's points stay.
    """
    triangle, s, margin, gap = cast(here.geometry, here.camera)
    rays = pixel_rays(here.camera.intrinsics)
    there_s = np.where(triangle < 0, 1.0, s)[..., None]
    world = here.camera.center + (here.camera.lens.origins() + there_s * np.nan_to_num(rays)) @ here.camera.R
    seen = (triangle >= 0) & (triangle < here.geometry.triangle_start[-1])
    corners = here.geometry.vertices[here.geometry.triangles[triangle[seen]]]
    moved = there.geometry.vertices[there.geometry.triangles[triangle[seen]]]
    sides = np.stack((corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=-1)
    away = (world[seen] - corners[:, 0])[..., None]
    uv = np.linalg.solve(sides.transpose(0, 2, 1) @ sides, sides.transpose(0, 2, 1) @ away)[..., 0]
    weights = np.column_stack((1 - uv.sum(axis=1), uv))
    world[seen] = (weights[..., None] * moved).sum(axis=1)
    world[triangle < 0] = np.nan
    return triangle, world, (margin > 1e-9) & (gap > 1e-6)


def brute_xy(there, world):
    return project(there.camera.intrinsics, world @ there.camera.R.T + there.camera.t)[0]


def expected_states(there, world, own):
    """Of points (N, 3) by brute force, and which of them are no toss-up."""
    camera = there.camera
    xy, _ = project(camera.intrinsics, world @ camera.R.T + camera.t)
    hidden, doubt = brute_hidden(there, world, own)
    state = np.where(hidden, OCCLUDED, VISIBLE)
    with np.errstate(invalid="ignore"):
        edge = np.abs(np.concatenate([xy, xy - (camera.width, camera.height)], axis=1)).min(axis=1)
        state[~((xy >= 0) & (xy < (camera.width, camera.height))).all(axis=1)] = OUTSIDE
    state[np.isnan(xy[:, 0])] = BEHIND
    return state, (doubt > SURE) & ~(edge < 1e-9)


def brute_hidden(there, world, own, chunk=512):
    """Return whether each point (N, 3) is hidden in a view, and the least of |weights| and of |gap - 1e-6| over all triangles:
    where this is tiny, rounding decides. `own` (N,): the triangle left out; of the ground both of its halves are.
    """
    geometry = there.geometry
    begin = begins(there.camera, world)
    corner, b, c = (geometry.vertices[geometry.triangles[:, k]] for k in range(3))
    e1, e2 = b - corner, c - corner
    number = np.minimum(np.arange(len(corner)), geometry.triangle_start[-1])
    hidden, doubt = np.zeros(len(world), bool), np.full(len(world), np.inf)
    with np.errstate(all="ignore"):
        for i in range(0, len(world), chunk):
            center = begin[i : i + chunk]
            d, a = (world[i : i + chunk] - center)[:, None], corner - center[:, None]
            p = np.cross(d, e2)
            det = (p * e1).sum(-1)
            u = -(p * a).sum(-1) / det
            q = np.cross(-a, e1)
            v = (q * d).sum(-1) / det
            s = (q * e2).sum(-1) / det
            other = (number != own[i : i + chunk, None]) & (geometry.triangle_cutout != -2)
            least = np.where(other, least_weight(geometry, u, v), -np.inf)
            hidden[i : i + chunk] = ((least >= 0) & (s > 0) & (s < 1 / (1 + 1e-6))).any(axis=1)
            unsure = np.where((s > 0) & (s < 1), np.abs(least), np.inf)
            unsure = np.minimum(unsure, np.where(least >= 0, np.abs(s - 1 / (1 + 1e-6)), np.inf))
            doubt[i : i + chunk] = np.where(np.isnan(unsure), np.inf, unsure).min(axis=1)
    return hidden, doubt
