"""Light that still things reflect onto one another, and the skylight that they let in, baked once per stage.

A grid of probes around all of them casts rays; patches at the hits exchange light with the probes until it converges. Light of
lamps and sun reaches patches along separate rays. The result depends on no moving thing and no camera.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field, fields
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.raster.indirect import kernels_probes as kernels
from viewsphere.engines.raster.indirect.directions import TURNS, dome
from viewsphere.engines.raster.indirect.emissive_triangles import EmissiveTriangles, emissive_triangles_of
from viewsphere.engines.raster.indirect.gathering.final_gather import FinalGather, Look, Round, Spots, look
from viewsphere.engines.raster.indirect.gathering.patch_rays import RAYS as PATCH_RAYS
from viewsphere.engines.raster.indirect.gathering.patch_rays import WAYS, PatchRays, rays_of
from viewsphere.engines.raster.indirect.irradiance_volumes import (
    LAST,
    Grid,
    Volume,
    grids_of,
    join,
    rays_of_probes,
    settle,
    volume_of,
)
from viewsphere.engines.raster.indirect.kernels_bounce import COLUMNS, terms
from viewsphere.engines.raster.indirect.kernels_emissive import shine_at, shine_at_probes, shine_near
from viewsphere.engines.raster.indirect.kernels_views import FOLD, NODES, send_views, spread_views
from viewsphere.engines.raster.indirect.radiosity_patches import Patches, Rays, Table, patches_of
from viewsphere.engines.raster.lightmaps.lightmaps import Charts, has_planes
from viewsphere.engines.raster.lightmaps.vertex_light import Facets, Sites
from viewsphere.engines.raster.records import (
    NO_BOUNCES,
    NO_LIGHTMAP,
    NO_NEAR,
    NO_PATCH_LIGHT,
    Bounces,
    Float32,
    Int32,
    Lightmap,
    PatchLight,
    Surfaces,
    Textures,
)
from viewsphere.engines.raster.reflections import tracing
from viewsphere.engines.raster.reflections.tracing import Tree, tree_of
from viewsphere.engines.raster.shadows.shadow_maps import Lights
from viewsphere.engines.raster.sky.environment import Surrounding, sky_along
from viewsphere.engines.raster.sky.kernels_environment import LAMPS
from viewsphere.rendering.kept_light import digest_of, kept_light

Float = NDArray[np.float64]

PUSH = 0.3
"""Offset of a sample's lookup from its surface, in cells."""

PATCHES = 2.0
"""Number of patches along a cell."""

SUDDENLY = 1e6
"""Inverse of the number of cells over which an inner volume's light ends, because it already equals that of the outer volume.
"""

MAP, MAP_RAYS, BEYOND = 96, 128, 0.9
"""Cells of the ground's map in each direction, rays of each cell, and the map's margin around all things, as a multiple of
their height.
"""

SHADOWS = 2e-3
"""Distance, in cells, from a surface at which shadow rays begin."""

UNCHANGED, ROUNDS = 0.002, 48
"""The mean share of a patch's light below which further bounces are extrapolated instead of computed, and the maximum number of
bounces.
"""

TINY = 1e-12
"""Light of a patch that counts as none."""

MOST_SENT_ON = 0.81
"""Maximum share of light that two bounces pass on, for the extrapolation."""

TERMS = np.array([1 / 4, *[1 / 2] * 3, *[15 / 16] * 2, 5 / 64, 15 / 16, 15 / 64], np.float32) / np.float32(math.pi)
"""Factors of the terms of irradiance / pi: the constants of spherical harmonics, squared, times the share of each degree that
irradiance keeps (1, 2/3, 1/4).
"""


@dataclass(frozen=True)
class BounceScene:
    """Things that reflect light onto one another, between the corners low and high (3,) in the stage's units, `unit` metres.

    key: equal for equal scenes, apart from light; which (T,): their triangles; ground_z: the ground's height, None for none;
    floor: see `painting.Baked`; has_map: whether these things, and no others, are on the ground; is_fine: whether more rays
    gather light on them.
    """

    key: Hashable
    surfaces: Surfaces = field(compare=False)
    textures: Textures = field(compare=False)
    which: Int32 = field(compare=False)
    low: Float = field(compare=False)
    high: Float = field(compare=False)
    floor: Float32 = field(compare=False)
    unit: float
    ground_z: float | None
    has_map: bool
    is_fine: bool

    @cached_property
    def digest(self) -> str:
        """The digest of the bounce scene's content, computed once because it reads all meshes and their textures."""
        return digest_of(self._content())

    def _content(self) -> Iterator[Any]:
        """The content of the bounce scene, without numbers that depend on other things of the stage."""
        (things, meshes), *others = cast("tuple[Any, ...]", self.key)
        yield from (thing.model_dump_json(exclude={"id"}) for thing in things)
        for mesh in meshes:
            yield from (getattr(mesh, field.name) for field in fields(mesh) if field.name != "images")
            yield from (image.pixels for image in mesh.images)
        yield from (others, self.low, self.high, self.is_fine, self.has_map)

    @cached_property
    def owns(self) -> NDArray[np.bool_]:
        """A mask of the surfaces' triangles, (T,), true for the bounce scene's own."""
        mask = np.zeros(len(self.surfaces.material), np.bool_)
        mask[self.which] = True
        return mask


class _Seen(NamedTuple):
    """The parts of a bake that depend on no light.

    volumes: finest first; below: rays of the ground's map; look: of the lightmap; around: of the patches beside the lightmap.
    """

    bounces: Bounces
    tree: Tree
    volumes: tuple[Volume, ...]
    patches: Patches
    below: Rays | None
    look: Look | None
    around: PatchRays | None

    def parts(self, values: Float32) -> list[tuple[Volume, Int32, Float32]]:
        """For each volume, the patches that its rays hit, and its rows of the values of all probes."""
        size = len(self.volumes[0].own)
        cut = (values[k * size : (k + 1) * size] for k in range(len(self.volumes)))
        return list(zip(self.volumes, self.patches.ids, cut, strict=False))


@dataclass(frozen=True)
class _Lighting:
    bounce_scene: BounceScene
    lamps: tuple[bytes, ...]
    sky: tuple[bytes, ...]
    surrounding: Surrounding = field(compare=False)
    lights: Lights = field(compare=False)

    @property
    def content(self) -> tuple[Any, ...]:
        """The content of the lighting for a digest."""
        return (self.bounce_scene.digest, *self.lamps, *self.surrounding)


LIGHT = (Bounces, Lightmap, PatchLight)
SEEN = (*LIGHT, _Seen, Tree, Volume, Grid, Rays, Patches, Table, Look, Charts, Spots, Round, Sites, Facets, PatchRays)
"""Types of the values in `Bounces` and `_Seen`."""


def bake_bounces(bounce_scene: BounceScene, surrounding: Surrounding, lights: Lights) -> Bounces:
    """Return the light between the things of a bounce scene. The rays and light of the latest scene are cached."""
    if not len(bounce_scene.which) or not (bounce_scene.high - bounce_scene.low).max() > 0:
        return NO_BOUNCES
    lights = without_maps(lights)
    # The light of lamps on the ground near the targets is computed for the ground itself.
    light = surrounding.light.copy()
    light[LAMPS] = 0
    surrounding = surrounding._replace(light=light)
    lamps = tuple(values.tobytes() for values in lights if isinstance(values, np.ndarray))
    sky = tuple(values.tobytes() for values in (surrounding.texels, surrounding.light, surrounding.up))
    lighting = _Lighting(bounce_scene, lamps, sky, surrounding, lights)
    bounces = _baked(lighting) if bounce_scene.key is None else _bake(lighting)
    if not len(bounces.lightmap.chart):
        return bounces
    chart = np.full(len(bounce_scene.surfaces.triangles), -1, np.int32)
    chart[bounce_scene.which] = bounces.lightmap.chart
    return bounces._replace(lightmap=bounces.lightmap._replace(chart=chart))


def without_maps(lights: Lights) -> Lights:
    """The lights without shadow maps, whose shadows are cast by rays for bounced light."""
    return lights._replace(first=np.zeros_like(lights.first))


@lru_cache(maxsize=1)
def tree_of_scene(bounce_scene: BounceScene) -> Tree:
    """Return the tree of a bounce scene's triangles, from memory after the scene's light was baked."""
    return kept_light(("tree", bounce_scene.digest), lambda: _tree_of(bounce_scene), (Tree,))


def _tree_of(bounce_scene: BounceScene) -> Tree:
    return tree_of(bounce_scene.surfaces.vertices[bounce_scene.surfaces.triangles[bounce_scene.which], 11:14])


@lru_cache(maxsize=1)
def _bake(lighting: _Lighting) -> Bounces:
    """The light of a bounce scene, from the cache if it is there."""
    return kept_light(("bounces", *lighting.content), lambda: _baked(lighting), LIGHT)


def _baked(lighting: _Lighting) -> Bounces:
    bounce_scene, surrounding = lighting.bounce_scene, lighting.surrounding
    seen = _looked(bounce_scene, _tree_of(bounce_scene)) if bounce_scene.key is None else _look(bounce_scene)
    bounces, patches = seen.bounces, seen.patches
    light, views = np.zeros_like(bounces.light), np.zeros((len(bounces.light), NODES, 4), np.float32)
    bounces = bounces._replace(light=light, views=views.reshape(-1, 4), floor=np.zeros_like(bounces.floor))
    off = SHADOWS / seen.volumes[0].grid.cells
    scene = bounce_scene.which, bounce_scene.surfaces, bounce_scene.textures, bounce_scene.floor
    lit = patches.lit(*scene, surrounding.albedo, seen.tree, lighting.lights, off)
    directions = seen.volumes[0].rays.directions
    sky, weights = sky_along(surrounding, directions), _irradiance_weights(directions)
    emissive = emissive_triangles_of(bounce_scene.which, bounce_scene.surfaces, patches, lit.emitted, TURNS)
    shining, near = _shining(seen, emissive, lit.emitted, weights, off)
    own = lit.emitted * (emissive.froms == 0)[:, None] + lit.reflectance * lit.arrived / np.float32(math.pi)
    places, normals, sent, added = patches.places, patches.normals, own, (np.zeros_like(own), np.zeros_like(own), own)
    glow, inside = np.empty_like(own), np.empty(len(own), np.float32)
    gathering = _gathering(seen, surrounding, emissive, lit.emitted, off)
    if gathering is not None:
        bounces = bounces._replace(lightmap=gathering.lightmap)
    facing = (1 + normals[:, 2:]) / 2
    elsewhere = facing * surrounding.up + (1 - facing) * surrounding.below
    buried = np.concatenate([volume.buried for volume in seen.volumes])

    def receive() -> None:
        for volume, ids, part in seen.parts(light):
            kernels.send(ids, volume.rays.turn, volume.own, weights, sky, surrounding.below, sent, part)
        light[:] += shining
        light[buried] = 0
        if gathering is not None:
            gathering.receive(sent)

    for _ in range(ROUNDS):
        receive()
        kernels.look_up(bounces, places, normals, patches.triangles, glow, inside)
        if gathering is not None:
            gathering.look_around(sent, glow, inside)
        before, sent = sent, own + lit.reflectance * (glow + (1 - inside[:, None]) * elsewhere)
        added = (*added[1:], sent - before)
        if (_further(*added) / np.maximum(sent, TINY)).mean(dtype=np.float64) <= UNCHANGED:
            break
    sent = sent + _further(*added)
    receive()
    if gathering is not None:
        gathering.finish(sent)
    for volume, ids, part in seen.parts(views):
        rays = volume.rays
        send_views(ids, rays.turn, volume.own, rays.directions, patches.is_ground, sent, FOLD, part)
    views += near
    for volume, _, part in seen.parts(views):
        spread_views(volume.rays.turn, volume.own, volume.rays.directions, FOLD, part)
    views[buried] = 0
    _settle(seen, light, views.reshape(len(views), -1))
    if seen.below is not None:
        bounces.floor[:] = _on_ground(seen, seen.below, sent, emissive, lit.emitted, off).reshape(bounces.floor.shape)
    light = np.where((emissive.froms == 0)[:, None], sent, np.float32(-1))
    known = patches.table.keys, patches.table.patch, light
    return bounces._replace(sent=PatchLight(*known, bounces.sent.frame, bounces.sent.materials))


def _further(first: Float32, second: Float32, third: Float32) -> Float32:
    """Return the light that all further bounces add to patches, (M, 3), from the light that the last three bounces added.

    Any two consecutive bounces add the same share of the two before. Single bounces do not: a sunlit wall and a shaded wall
    facing it alternate.
    """
    share = np.divide(third, first, out=np.ones_like(third), where=first > 0).clip(0, MOST_SENT_ON)
    return ((second + third) * share / (1 - share)).astype(np.float32)


def _settle(seen: _Seen, light: Float32, views: Float32) -> None:
    """Smooth the light and the views of all probes, (N, C)."""
    lights, sights = ([part for _, _, part in seen.parts(known)] for known in (light, views))
    for volume, *known in zip(seen.volumes, lights, sights, strict=True):
        settle(volume, *known)
    for inner, outer in pairwise(seen.volumes):
        join(inner, outer, ((lights[0], lights[1]), (sights[0], sights[1])))


def _gathering(
    seen: _Seen, surrounding: Surrounding, emissive: EmissiveTriangles, emitted: Float32, off: float
) -> FinalGather | None:
    """Return the gathering of light on flat surfaces and beside them, None if there are no such surfaces."""
    if seen.look is None or seen.around is None:
        return None
    return FinalGather.from_patches(seen.look, seen.around, seen.patches, surrounding, seen.tree, emissive, TURNS, emitted, off)


def _on_ground(
    seen: _Seen, below: Rays, sent: Float32, emissive: EmissiveTriangles, emitted: Float32, off: float
) -> NDArray[np.float32]:
    """The ground's map, of MAP * MAP rows: see `Bounces.floor`."""
    floor, ids = np.empty((MAP * MAP, 4), np.float32), seen.patches.ids[len(seen.volumes)]
    kernels.send_down(ids, sent, floor)
    up = np.tile(np.array([0, 0, 1], np.float32), (len(floor), 1))
    near = ids, below.far, emissive.froms, emitted, np.float32(off)
    shine_at(seen.tree, below.origins, up, TURNS, np.float32(1), emissive.points, *near, floor)
    return floor * _window(MAP).reshape(-1, 1).astype(np.float32)


def _shining(
    seen: _Seen, emissive: EmissiveTriangles, emitted: Float32, weights: Float32, off: float
) -> tuple[Float32, Float32]:
    """Return the light of emitters at the probes: irradiance, as `Bounces.light`, and sums of the light that rays see."""
    light = np.zeros_like(seen.bounces.light)
    views = np.zeros((len(light), NODES, 4), np.float32)
    if not len(emissive.points):
        return light, views
    for (volume, ids, own_light), (_, _, own_views) in zip(seen.parts(light), seen.parts(views), strict=True):
        rays, both = volume.rays, (own_light, own_views)
        points = emissive.points, TERMS, np.float32(off), np.float32(4 * math.pi / rays.directions.shape[1])
        shine_at_probes(seen.tree, rays.origins, rays.turn, volume.own, TURNS, *points, FOLD, *both)
        shine_near(ids, rays.far, rays.turn, volume.own, weights, rays.directions, emissive.froms, emitted, FOLD, *both)
    return light, views


@lru_cache(maxsize=1)
def _look(bounce_scene: BounceScene) -> _Seen:
    """Return the results that do not depend on light, from the cache if they are there."""
    return kept_light(("seen", bounce_scene.digest), lambda: _looked(bounce_scene, tree_of_scene(bounce_scene)), SEEN)


def _looked(bounce_scene: BounceScene, tree: Tree) -> _Seen:
    """Cast all rays."""
    corners = bounce_scene.surfaces.vertices[bounce_scene.surfaces.triangles[bounce_scene.which], 11:14]
    normals = bounce_scene.surfaces.normals[bounce_scene.which]
    grids = grids_of(bounce_scene.low, bounce_scene.high, bounce_scene.unit)
    has_charts = len(grids) == 1 and has_planes(corners, bounce_scene.unit)
    directions = rays_of_probes(grids, has_charts)
    volumes = tuple(volume_of(grid, tree, normals, directions, grid is grids[0]) for grid in grids)
    bundles, below, floor, floor_frame = [volume.rays for volume in volumes], None, NO_BOUNCES.floor, NO_BOUNCES.floor_frame
    if bounce_scene.has_map and bounce_scene.ground_z is not None:
        places, floor_frame = _map(bounce_scene, bounce_scene.ground_z)
        floor, up, same = np.zeros((MAP, MAP, 4), np.float32), dome(MAP_RAYS)[None], np.zeros(len(places), np.int32)
        met, far = tracing.cast(tree, places, up, same, np.inf)
        below = Rays(places, up, same, met, far)
        bundles.append(below)
    made = bounce_scene.surfaces.vertices, bounce_scene.surfaces.triangles[bounce_scene.which]
    looked = (
        look(tree, *made, normals, bounce_scene.unit, volumes[0].is_inside_out, bounce_scene.is_fine) if has_charts else None
    )
    if looked is not None:
        bundles.extend(looked.rays)
    inner, materials = grids[0], bounce_scene.surfaces.material[bounce_scene.which]
    made_of = (
        normals,
        materials,
        np.array([*inner.corner, *inner.last], np.float32),
        inner.cells * PATCHES,
        _ground(bounce_scene),
    )
    patches, around = patches_of(bundles, *made_of), None
    if looked is not None:
        around = rays_of(patches, looked.alone(patches), dome(PATCH_RAYS * WAYS), tree, SHADOWS / inner.cells)
        patches = patches_of([*bundles, around.rays], *made_of, patches)
    screens = np.concatenate([volume.screens for volume in volumes])
    light = np.zeros((len(screens), COLUMNS), np.float32)
    box = np.array([*inner.corner, *inner.last, inner.cells * PATCHES], np.float32)
    sent = NO_PATCH_LIGHT._replace(frame=box, materials=materials)
    volume = light, NO_BOUNCES.views, screens, inner.shape, _frame(grids)
    bounces = Bounces(*volume, floor, floor_frame, NO_LIGHTMAP, sent, NO_NEAR)
    return _Seen(bounces, tree, volumes, patches.trimmed(), below, looked, around)


def _frame(grids: tuple[Grid, ...]) -> Float32:
    """The value of `Bounces.frame`."""
    inner, outer = grids[0], grids[-1]
    fades, first = ((1, 1), 0) if len(grids) == 1 else ((SUDDENLY, 1 / LAST), int(np.prod(inner.shape)))
    ends = (fades[0], 0), (fades[1], first)
    return np.array(
        [[*grid.corner, grid.cells, PUSH, *end] for grid, end in zip((inner, outer), ends, strict=True)], np.float32
    )


def _ground(bounce_scene: BounceScene) -> Float32:
    """The ground's height, the box in which it has patches, and whether there is one, for `kernels_probes.patch`."""
    if bounce_scene.ground_z is None:
        return np.zeros(6, np.float32)
    beyond = 2 * float(bounce_scene.high[2] - bounce_scene.ground_z)
    (left, front), (right, back) = bounce_scene.low[:2] - beyond, bounce_scene.high[:2] + beyond
    return np.array([bounce_scene.ground_z, left, right, front, back, 1], np.float32)


def _map(bounce_scene: BounceScene, z: float) -> tuple[Float32, Float32]:
    """The places of the ground's map, (MAP * MAP, 3), and its `Bounces.floor_frame`."""
    size = bounce_scene.high - bounce_scene.low
    half = float(max(size[:2].max() / 2, 1e-3) + BEYOND * (bounce_scene.high[2] - z))
    left, front = ((bounce_scene.low + bounce_scene.high) / 2 - half)[:2].tolist()
    cells = MAP / (2 * half)
    x, y = np.meshgrid(left + (np.arange(MAP) + 0.5) / cells, front + (np.arange(MAP) + 0.5) / cells)
    places = np.stack([x, y, np.full_like(x, z)], axis=-1).reshape(-1, 3)
    return places.astype(np.float32), np.array([cells, left, front, 1], np.float32)


def _irradiance_weights(directions: Float32) -> Float32:
    """The weights of light from each of K directions (..., K, 3), which share the sphere evenly, in the terms of irradiance /
    pi: (..., K, 9) (Ramamoorthi and Hanrahan 2001).
    """
    x, y, z = np.moveaxis(directions.astype(np.float64), -1, 0)
    values = np.stack([np.ones_like(x), *terms(x, y, z)], axis=-1)
    return (values * TERMS * 4 * math.pi / directions.shape[-2]).astype(np.float32)


def _window(size: int) -> Float:
    """A window that is 1 within the ground's map and falls to 0 at its border."""
    inward = np.minimum(np.arange(size) + 0.5, size - np.arange(size) - 0.5) / (0.15 * size)
    return np.clip(np.minimum(inward[:, None], inward), 0, 1)
