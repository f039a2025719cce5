"""Light that still things throw at one another, and that of the sky as far as they let it in, baked once a stage.

A grid of probes around all of them casts rays; patches of what these hit exchange light with the probes until nothing changes.
Light of lamps and sun reaches patches along rays of their own: nothing depends on what moves, or on any camera.
"""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.raster import kernels_probes as kernels
from viewsphere.engines.raster.environment import Surrounding, sky_along
from viewsphere.engines.raster.gathering import Gathering, Look, look
from viewsphere.engines.raster.kernels_bounce import COLUMNS, terms
from viewsphere.engines.raster.kernels_environment import LAMPS
from viewsphere.engines.raster.kernels_lanterns import shine_at, shine_at_probes, shine_near
from viewsphere.engines.raster.kernels_views import FOLD, NODES, send_views, spread_views
from viewsphere.engines.raster.lanterns import Lanterns, lanterns_of
from viewsphere.engines.raster.lightmaps import has_planes
from viewsphere.engines.raster.lights import Lights
from viewsphere.engines.raster.patch_rays import RAYS as PATCH_RAYS
from viewsphere.engines.raster.patch_rays import WAYS, PatchRays, rays_of
from viewsphere.engines.raster.patches import Patches, Rays, patches_of
from viewsphere.engines.raster.records import NO_BOUNCES, NO_LIGHTMAP, Bounces, Float32, Int32, Surfaces, Textures
from viewsphere.engines.raster.tracing import Tree, cast, tree_of, unblocked

Float = NDArray[np.float64]

CELL = 0.2
"""Metres between probes, at most, unless there would be more than `MOST`."""

ALONG, MOST = 24, 40_000
"""Probes along the longest side, at least, and of a volume, at most."""

WIDEST, DEPTH, HEIGHT, FADE = 0.8, 1.0, 12.0, 6.0
"""Metres between probes at most: of a place that would have too many only the part around its origin has some, from so many
metres below to so many above, whose light fades out over so many cells.
"""

RAYS, FEW_RAYS, MANY_PROBES = 384, 256, 24_000
"""Of a probe, and of one of so many; half of them beside a lightmap."""

TURNS = 8
"""Ways to turn the rays: two neighbours never look the same way, so that a probe and those around it see as one with all of
their rays (interleaved sampling, Keller and Heidrich 2001).
"""

INSIDE_OUT = 0.5
"""Share of probes within things from which on it is the room that they are in: it is modelled inside out."""

PAD = 2
"""Cells around all things."""

PUSH = 0.3
"""Cells off its surface at which a sample reads."""

PATCHES = 2.0
"""Patches along a cell."""

MAP, MAP_RAYS, BEYOND = 96, 128, 0.9
"""Cells of the ground's map each way, rays of each, and heights of all things that it reaches beyond them."""

SHADOWS = 2e-3
"""Cells off a surface at which shadows begin."""

UNCHANGED, ROUNDS = 0.004, 48
"""The share of all light below which another bounce is not seen, and how many there are at most."""

TERMS = np.array([1 / 4, *[1 / 2] * 3, *[15 / 16] * 2, 5 / 64, 15 / 16, 15 / 64], np.float32) / np.float32(math.pi)
"""Factors of the terms of irradiance / pi: the constants of spherical harmonics, squared, times the share of each degree that
irradiance keeps (1, 2/3, 1/4).
"""


@dataclass(frozen=True)
class Hall:
    """Things that throw light at one another, between the corners low and high (3,) in the stage's units, `unit` metres.

    key: equal where all of it is, but for light; which (T,): their triangles; ground_z: the ground's height, None for none;
    floor: see `painting.Baked`; has_map: whether they stand on the ground, and nothing else does.
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


class _Seen(NamedTuple):
    """What depends on no light. own (N,): which probe each ray's origin is; opens (3, N): whether nothing lies between a probe
    and the next one along x, y and z; rank (N,): see `kernels_probes.screen`; below: rays of the ground's map;
    look, around: of the lightmap and of the patches beside it.
    """

    bounces: Bounces
    tree: Tree
    rays: Rays
    own: Int32
    opens: Float32
    rank: NDArray[np.uint8]
    patches: Patches
    below: Rays | None
    look: Look | None
    around: PatchRays | None


@dataclass(frozen=True)
class _Lighting:
    hall: Hall
    lamps: tuple[bytes, ...]
    sky: tuple[bytes, ...]
    surrounding: Surrounding = field(compare=False)
    lights: Lights = field(compare=False)


def bake_bounces(hall: Hall, surrounding: Surrounding, lights: Lights) -> Bounces:
    """The light that a hall's things throw at one another. The last hall's rays are kept, and the last light."""
    if not len(hall.which) or not (hall.high - hall.low).max() > 0:
        return NO_BOUNCES
    # Shadows are cast here; and what lamps give the ground near the targets comes from the ground itself.
    lights = lights._replace(first=np.zeros_like(lights.first))
    light = surrounding.light.copy()
    light[LAMPS] = 0
    surrounding = surrounding._replace(light=light)
    lamps = tuple(values.tobytes() for values in lights if isinstance(values, np.ndarray))
    sky = tuple(values.tobytes() for values in (surrounding.texels, surrounding.light, surrounding.up))
    lighting = _Lighting(hall, lamps, sky, surrounding, lights)
    bounces = _bake.__wrapped__(lighting) if hall.key is None else _bake(lighting)
    if not len(bounces.lightmap.chart):
        return bounces
    chart = np.full(len(hall.surfaces.triangles), -1, np.int32)
    chart[hall.which] = bounces.lightmap.chart
    return bounces._replace(lightmap=bounces.lightmap._replace(chart=chart))


@lru_cache(maxsize=1)
def _bake(lighting: _Lighting) -> Bounces:
    hall, surrounding = lighting.hall, lighting.surrounding
    seen = _look.__wrapped__(hall) if hall.key is None else _look(hall)
    bounces, patches, rays = seen.bounces, seen.patches, seen.rays
    light, views = np.zeros_like(bounces.light), np.zeros((len(bounces.light), NODES, 4), np.float32)
    bounces = bounces._replace(light=light, views=views.reshape(-1, 4), floor=np.zeros_like(bounces.floor))
    off = SHADOWS / float(bounces.frame[3])
    lit = patches.lit(hall.which, hall.surfaces, hall.textures, hall.floor, surrounding.albedo, seen.tree, lighting.lights, off)
    sky = sky_along(surrounding, rays.directions)
    weights = irradiance_weights(rays.directions)
    lanterns = lanterns_of(hall.which, hall.surfaces, patches, lit.emitted, TURNS)
    shining, near = _shining(seen, lanterns, lit.emitted, weights, off)
    own = lit.emitted * (lanterns.froms == 0)[:, None] + lit.reflectance * lit.arrived / np.float32(math.pi)
    places, normals, sent = patches.places, patches.normals, own
    glow, inside = np.empty_like(own), np.empty(len(own), np.float32)
    gathering = _gathering(seen, surrounding, lanterns, lit.emitted, off)
    if gathering is not None:
        bounces = bounces._replace(lightmap=gathering.lightmap)
    sources = patches.ids[0], rays.turn, seen.own
    facing = (1 + normals[:, 2:]) / 2
    elsewhere = facing * surrounding.up + (1 - facing) * surrounding.below
    buried = seen.rank == 0
    for _ in range(ROUNDS):
        kernels.send(*sources, weights, sky, surrounding.below, sent, bounces.light)
        bounces.light[:] += shining
        bounces.light[buried] = 0
        if gathering is not None:
            gathering.receive(sent)
        kernels.look_up(bounces, places, normals, patches.triangles, glow, inside)
        if gathering is not None:
            gathering.look_around(sent, glow, inside)
        before = sent
        sent = own + lit.reflectance * (glow + (1 - inside[:, None]) * elsewhere)
        if np.abs(sent - before).sum(dtype=np.float64) <= UNCHANGED * sent.sum(dtype=np.float64):
            break
    kernels.send(*sources, weights, sky, surrounding.below, sent, bounces.light)
    bounces.light[:] += shining
    bounces.light[buried] = 0
    if gathering is not None:
        gathering.finish(sent)
    send_views(*sources, rays.directions, patches.is_ground, sent, FOLD, views)
    views += near
    spread_views(rays.turn, seen.own, rays.directions, FOLD, views)
    views[buried] = 0
    for known in (bounces.light, views.reshape(len(views), -1)):
        _smooth(known, seen.opens, bounces.grid)
    chosen = np.empty(len(views), np.int32)
    kernels.choose(seen.rank, bounces.grid, bounces.light, chosen)
    for known in (bounces.light, views):
        known[buried] = known[chosen[buried]]
    if seen.below is not None:
        bounces.floor[:] = _on_ground(seen, seen.below, sent, lanterns, lit.emitted, off).reshape(bounces.floor.shape)
    return bounces


def _gathering(seen: _Seen, surrounding: Surrounding, lanterns: Lanterns, emitted: Float32, off: float) -> Gathering | None:
    """How light is gathered on flat surfaces and beside them, None where there are none."""
    if seen.look is None or seen.around is None:
        return None
    return Gathering.of(seen.look, seen.around, seen.patches, surrounding, seen.tree, lanterns, TURNS, emitted, off)


def _on_ground(
    seen: _Seen, below: Rays, sent: Float32, lanterns: Lanterns, emitted: Float32, off: float
) -> NDArray[np.float32]:
    """The ground's map, of MAP * MAP rows: see `Bounces.floor`."""
    floor, ids = np.empty((MAP * MAP, 4), np.float32), seen.patches.ids[1]
    kernels.send_down(ids, sent, floor)
    up = np.tile(np.array([0, 0, 1], np.float32), (len(floor), 1))
    near = ids, below.far, lanterns.froms, emitted, np.float32(off)
    shine_at(seen.tree, below.origins, up, TURNS, np.float32(1), lanterns.points, *near, floor)
    return floor * _window(MAP).reshape(-1, 1).astype(np.float32)


def _shining(seen: _Seen, lanterns: Lanterns, emitted: Float32, weights: Float32, off: float) -> tuple[Float32, Float32]:
    """What arrives at the probes from what shines by itself: irradiance, as `Bounces.light`, and sums of what rays see."""
    light, rays = np.zeros_like(seen.bounces.light), seen.rays
    views = np.zeros((len(light), NODES, 4), np.float32)
    if len(lanterns.points):
        own = rays.turn, seen.own
        points = lanterns.points, TERMS, np.float32(off), np.float32(4 * math.pi / rays.directions.shape[1])
        shine_at_probes(seen.tree, rays.origins, *own, TURNS, *points, FOLD, light, views)
        near = lanterns.froms, emitted, FOLD
        shine_near(seen.patches.ids[0], rays.far, *own, weights, rays.directions, *near, light, views)
    return light, views


def _smooth(light: Float32, opens: Float32, shape: NDArray[np.int64]) -> None:
    """Mix what neighbours that see each other know: by all three axes each way to turn the rays counts an eighth."""
    other = np.empty_like(light)
    for axis, step in enumerate((1, int(shape[2]), int(shape[1] * shape[2]))):
        kernels.blur(light, opens[axis], step, other)
        light[:] = other


@lru_cache(maxsize=1)
def _look(hall: Hall) -> _Seen:
    """Cast all rays."""
    corners = hall.surfaces.vertices[hall.surfaces.triangles[hall.which], 11:14]
    tree = tree_of(corners)
    corner, cells, shape, fade = _grid(hall)
    points, turn, own = _points(corner, cells, shape)
    normals = hall.surfaces.normals[hall.which]
    has_charts = fade == 1 and has_planes(corners, hall.unit)
    directions = _turned(_sphere((FEW_RAYS if len(points) > MANY_PROBES else RAYS) // (2 if has_charts else 1)))
    met, far = cast(tree, points, directions, turn, np.inf)
    screens = np.empty((len(points), 72), np.float32)
    buried = np.empty(len(points), np.uint8)
    kernels.bury(met, far, directions, turn, own, normals, np.float32(cells), buried)
    is_inside_out = bool((buried > 0).mean() > INSIDE_OUT)
    if is_inside_out:
        buried[buried == 1] = 0
    rank = np.zeros_like(buried)
    kernels.screen(met, far, directions, turn, own, normals, np.float32(cells), shape, buried, screens, rank)
    # What a buried probe sees counts for nothing: the inner sides of things need no patches.
    met[:, buried[own] > 0] = -1
    rays = Rays(points, directions, turn, met, far)
    bundles, below, floor, floor_frame = [rays], None, NO_BOUNCES.floor, NO_BOUNCES.floor_frame
    if hall.has_map and hall.ground_z is not None:
        places, floor_frame = _map(hall, hall.ground_z)
        floor, up, same = np.zeros((MAP, MAP, 4), np.float32), _dome(MAP_RAYS)[None], np.zeros(len(places), np.int32)
        met, far = cast(tree, places, up, same, np.inf)
        below = Rays(places, up, same, met, far)
        bundles.append(below)
    made = hall.surfaces.vertices, hall.surfaces.triangles[hall.which]
    looked = look(tree, *made, normals, hall.unit, is_inside_out) if has_charts else None
    if looked is not None:
        bundles.extend(looked.rays)
    last = corner + (shape[::-1] - 1) / cells
    made_of = (
        normals,
        hall.surfaces.material[hall.which],
        np.array([*corner, *last], np.float32),
        cells * PATCHES,
        _ground(hall),
    )
    patches, around = patches_of(bundles, *made_of), None
    if looked is not None:
        around = rays_of(patches, looked.alone(patches), _dome(PATCH_RAYS * WAYS), tree, SHADOWS / cells)
        patches = patches_of([*bundles, around.rays], *made_of)
    frame = np.array([*corner, cells, PUSH, hall.ground_z is not None, 1 / fade], np.float32)
    light = np.zeros((len(points), COLUMNS), np.float32)
    return _Seen(
        Bounces(light, NO_BOUNCES.views, screens, shape, frame, floor, floor_frame, NO_LIGHTMAP),
        tree,
        rays,
        own,
        _opens(tree, points, own, buried, cells, shape),
        rank,
        patches,
        below,
        looked,
        around,
    )


def _grid(hall: Hall) -> tuple[Float, float, NDArray[np.int64], float]:
    """Where the first probe is, cells per length, layers, rows and columns (3,), and within how many cells light from elsewhere
    fades in at the border.
    """
    low, high, cells = hall.low, hall.high, max(hall.unit / CELL, ALONG / float((hall.high - hall.low).max()))
    fade = 1.0
    if np.prod(_shape((high - low) * hall.unit / WIDEST)) > MOST:
        low, high, fade = *_part(hall), FADE
    size = high - low
    while np.prod(_shape(size * cells)) > MOST:
        cells *= 0.97
    shape = _shape(size * cells)
    spare = (shape - 1) / cells - size
    return low - spare / 2, cells, shape[::-1].copy(), fade


def _shape(size: Float) -> NDArray[np.int64]:
    """Columns, rows and layers (3,) around a box of this size in cells; walls of even sizes do not run along probes."""
    return (np.ceil(size + 0.5) + 2 * PAD + 1).astype(np.int64)


def _part(hall: Hall) -> tuple[Float, Float]:
    """The part of a wide place around its origin, where targets stand, or around its middle, that may have enough probes."""
    middle = np.zeros(3) if ((hall.low < 0) & (hall.high > 0)).all() else (hall.low + hall.high) / 2
    below, above, side = DEPTH / hall.unit, HEIGHT / hall.unit, math.sqrt(MOST * WIDEST**3 / (DEPTH + HEIGHT)) / hall.unit
    low, high = np.array([-side / 2, -side / 2, -below]), np.array([side / 2, side / 2, above])
    return np.maximum(middle + low, hall.low), np.minimum(middle + high, hall.high)


def _points(corner: Float, cells: float, shape: NDArray[np.int64]) -> tuple[Float32, Int32, Int32]:
    """All probes (N, 3), those of one turn together; each one's turn, of which any two by two by two have all, and its place in
    the volume.
    """
    at = np.indices(tuple(shape.tolist())).reshape(3, -1).T[:, ::-1]
    turn = at % 2 @ [1, 2, 4]
    own = np.argsort(turn, kind="stable")
    return (corner + at[own] / cells).astype(np.float32), turn[own].astype(np.int32), own.astype(np.int32)


def _opens(
    tree: Tree, points: Float32, own: Int32, buried: NDArray[np.uint8], cells: float, shape: NDArray[np.int64]
) -> Float32:
    """Whether nothing lies between each probe and the next along x, y and z, and neither is buried: (3, N), by place."""
    at = np.indices(tuple(shape.tolist())).reshape(3, -1)[::-1]
    opens = np.empty((3, len(points)), np.float32)
    for axis in range(3):
        way = np.zeros_like(points)
        way[:, axis] = 1 / cells
        ahead, back = unblocked(tree, points, way), unblocked(tree, points + way, -way)
        opens[axis, own] = np.minimum(ahead, back)
        is_last = at[axis] == shape[2 - axis] - 1
        opens[axis, is_last] = 0
        step = int(np.prod(shape[3 - axis :]))
        opens[axis][~is_last] *= (buried[~is_last] == 0) & (buried[np.flatnonzero(~is_last) + step] == 0)
    return opens


def _ground(hall: Hall) -> Float32:
    """The ground's height, the box in which it has patches, and whether there is one, for `kernels_probes.patch`."""
    if hall.ground_z is None:
        return np.zeros(6, np.float32)
    beyond = 2 * float(hall.high[2] - hall.ground_z)
    (left, front), (right, back) = hall.low[:2] - beyond, hall.high[:2] + beyond
    return np.array([hall.ground_z, left, right, front, back, 1], np.float32)


def _map(hall: Hall, z: float) -> tuple[Float32, Float32]:
    """The places of the ground's map, (MAP * MAP, 3), and its `Bounces.floor_frame`."""
    size = hall.high - hall.low
    half = float(max(size[:2].max() / 2, 1e-3) + BEYOND * (hall.high[2] - z))
    left, front = ((hall.low + hall.high) / 2 - half)[:2].tolist()
    cells = MAP / (2 * half)
    x, y = np.meshgrid(left + (np.arange(MAP) + 0.5) / cells, front + (np.arange(MAP) + 0.5) / cells)
    places = np.stack([x, y, np.full_like(x, z)], axis=-1).reshape(-1, 3)
    return places.astype(np.float32), np.array([cells, left, front, 1], np.float32)


def _sphere(count: int) -> Float32:
    """Directions that share the sphere evenly, (count, 3): a Fibonacci spiral. None lies along an axis."""
    z = 1 - (2 * np.arange(count) + 1) / count
    return _around(z, np.arange(count))


def _turned(directions: Float32) -> Float32:
    """The same (K, 3) turned in `TURNS` ways, (TURNS, K, 3), which share all rotations about evenly (Shoemake 1992)."""
    i = np.arange(1, TURNS + 1)
    u, v, w = ((i * step) % 1.0 for step in (0.8191725134, 0.6710436067, 0.5497004779))  # Roberts' sequence in three dimensions
    a, b = np.sqrt(1 - u), np.sqrt(u)
    x, y, z, r = a * np.sin(2 * np.pi * v), a * np.cos(2 * np.pi * v), b * np.sin(2 * np.pi * w), b * np.cos(2 * np.pi * w)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * r), 2 * (x * z + y * r)],
        [2 * (x * y + z * r), 1 - 2 * (x * x + z * z), 2 * (y * z - x * r)],
        [2 * (x * z - y * r), 2 * (y * z + x * r), 1 - 2 * (x * x + y * y)],
    ]
    turned = np.einsum("ijw,kj->wki", np.array(rows), directions.astype(np.float64))
    return np.ascontiguousarray(turned, np.float32)


def _dome(count: int) -> Float32:
    """Directions up, as dense as their cosine, (count, 3)."""
    return _around(np.sqrt(1 - (np.arange(count) + 0.5) / count), np.arange(count))


def _around(z: Float, turn: NDArray[np.int_]) -> Float32:
    angle, radius = (turn + 0.5) * math.pi * (3 - math.sqrt(5)), np.sqrt(1 - z * z)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1).astype(np.float32)


def irradiance_weights(directions: Float32) -> Float32:
    """Of light from each of K directions (..., K, 3) that share the sphere evenly, in the terms of irradiance / pi: (..., K, 9)
    (Ramamoorthi and Hanrahan 2001).
    """
    x, y, z = np.moveaxis(directions.astype(np.float64), -1, 0)
    values = np.stack([np.ones_like(x), *terms(x, y, z)], axis=-1)
    return (values * TERMS * 4 * math.pi / directions.shape[-2]).astype(np.float32)


def _window(size: int) -> Float:
    """1 within the ground's map, falling to 0 at its border."""
    inward = np.minimum(np.arange(size) + 0.5, size - np.arange(size) - 0.5) / (0.15 * size)
    return np.clip(np.minimum(inward[:, None], inward), 0, 1)
