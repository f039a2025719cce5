"""The nearby surfaces that probes miss: each sample of a picture gathers their light with short rays (`bounces: fine`).

The last bounce of light is traced from the picture itself (final gathering, Reichert 1992), over about the distance between
probes. So leaves shade leaves, and an awning shades the shop below it. A surface that a ray hits sends the light of its patch;
a ray without a hit receives the probes' light.
"""

from __future__ import annotations

import numpy as np

from viewsphere.engines.raster.indirect.bounces import BounceScene
from viewsphere.engines.raster.indirect.directions import domes
from viewsphere.engines.raster.indirect.gathering import kernels_near as kernels
from viewsphere.engines.raster.indirect.gathering.patch_rays import axes_along
from viewsphere.engines.raster.records import NO_NEAR, Bounces, Float32, Int32, PictureRays
from viewsphere.engines.raster.reflections.tracing import Tree, cast

REACH = 2.0
"""Length of the rays, in cells of the finest probes."""

RAYS, TILE = 32, 8
"""Number of rays of a sample; size in pixels of the tile after which their rotations repeat."""

OFF = 5e-4
"""Metres off the surface at which rays begin."""

SOME = 1 << 14
"""Number of samples processed at a time: each takes about 1,000 bytes."""


def with_near(
    bounces: Bounces, bounce_scene: BounceScene, tree: Tree, view: PictureRays, slots: Int32, triangle: Int32, depth: Float32
) -> Bounces:
    """The bounces with `Bounces.near` for the samples `slots` (N,) that show the bounce scene's triangles and have no lightmap.

    triangle, depth (S,): the data of samples, see `kernels_paint.shade`.
    """
    slots = slots[bounce_scene.owns[triangle[slots]]]
    if len(bounces.lightmap.chart):
        slots = slots[bounces.lightmap.chart[triangle[slots]] == -1]
    if not len(slots):
        return bounces._replace(near=NO_NEAR)
    near = np.zeros((len(triangle), 4), np.float32)
    near[:, 0] = 1
    turned = domes(RAYS, TILE * TILE).astype(np.float32)
    for start in range(0, len(slots), SOME):
        chunk = slots[start : start + SOME]
        places, rays = _seen_at(view, chunk, depth)
        normals = bounce_scene.surfaces.normals[triangle[chunk]]
        normals = np.where((normals * rays).sum(axis=1, keepdims=True) < 0, normals, -normals)
        ways = np.matmul(turned[_turn(view, chunk)], axes_along(normals))
        origins = (places + normals * np.float32(OFF / bounce_scene.unit)).astype(np.float32)
        each = np.arange(len(chunk), dtype=np.int32)
        met, far = cast(tree, origins, ways, each, REACH / float(bounces.frame[0, 3]))
        kernels.gather(met, far, origins, ways, bounce_scene.which, bounce_scene.surfaces.normals, bounces.sent, chunk, near)
    return bounces._replace(near=near)


def _turn(view: PictureRays, slots: Int32) -> Int32:
    """Return the rotation of each sample's rays; a tile of pixels has all rotations."""
    if len(view.places):
        return slots % (TILE * TILE)
    row, column = np.divmod(slots, np.int32(view.columns))
    return row % TILE * TILE + column % TILE


def _seen_at(view: PictureRays, slots: Int32, depth: Float32) -> tuple[Float32, Float32]:
    """Return the places (N, 3) that samples (N,) show, and their rays (N, 3), in the stage's axes.

    depth (S,): see `with_near`.
    """
    if len(view.rays):
        rays = view.rays[slots]
    else:
        row, column = np.divmod(slots, np.int32(view.columns))
        at = view.places[slots] if len(view.places) else np.stack([column, row], axis=1) + np.float32(0.5)
        rays = np.ones((len(slots), 3), np.float32)
        rays[:, :2] = at @ view.lens[:, :2].T + view.lens[:, 2]
    rays = rays @ view.rotation
    places = view.eye + rays * (view.scale / depth[slots])[:, None]
    if len(view.shifts):
        places += view.shifts[slots]
    return places.astype(np.float32), rays.astype(np.float32)
