"""voxels: the content of each cell of a grid in front of the camera, seen or not."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import xxhash
from numpy.typing import NDArray

from viewsphere.geometry import voxels
from viewsphere.geometry.camera import pixel_rays, project
from viewsphere.geometry.rotation import transform
from viewsphere.labels.shared.class_maps import KEY, with_classes
from viewsphere.labels.shared.drawing.voxel_view import drawn
from viewsphere.labels.shared.ids import in_column
from viewsphere.labels.shared.point_checks import ROUNDING, exact_depth, largest
from viewsphere.labels.shared.spec import Array, ChannelLabel, Drawing, Models, channel_of, rendered
from viewsphere.model.annotations.classes import FIRST_THING, SKY, thing_class
from viewsphere.model.annotations.voxels import (
    EMPTY,
    FREE,
    INSIDE,
    OCCLUDED,
    OUTSIDE,
    RUN,
    SURFACE,
    TOUCHED,
    Grid,
    VoxelGrid,
    Voxels,
)
from viewsphere.model.sample import Sample
from viewsphere.model.sensors.camera import Camera
from viewsphere.truth.raster.alpha_masks import NEVER

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import LabelContext

Float = NDArray[np.float64]
Rows = NDArray[np.int64]

BORDER = 1e-3
"""Distance, in cells, by which rounding may move an object's box."""

SLAB = 1 << 16
"""Number of cells whose centres are projected at once."""

MESHES = 256
"""Number of meshes in the cache of `_known`."""


def _compute(context: LabelContext) -> NDArray[np.void]:
    """The cells of the grid, its first axis slowest, as runs of equal ones, (N,) of `viewsphere.model.annotations.voxels.RUN`.

    A cell belongs to an object if part of a triangle is in it or, for closed pieces of objects, if its centre is inside. It
    belongs to scenery or the ground if part of a triangle is in it. Of several things in a cell the first counts: objects by
    their ids, then scenery, then the ground. If only part of a triangle is surface, the whole triangle counts.
    """
    from viewsphere.geometry.voxels import kernels_voxels as kernels

    grid = Grid.for_camera(context.options_of("voxels", Voxels), context.camera)
    owner, filled = np.full(grid.size, -1, np.int32), np.zeros(grid.size, np.uint8)
    points = grid.cells(context.geometry.vertices)
    _occupy(context, points, owner, filled)
    indoors = _indoors(context, points, grid)
    state = _state(context, grid)
    cells, pixels = _seen_cells(context, grid)
    triangles = context.visibility.triangle[pixels]
    state.reshape(-1)[cells] = SURFACE
    missed = owner.reshape(-1)[cells] < 0  # a triangle's point on a cell's border, which rounding puts into the next cell
    owner.reshape(-1)[cells[missed]], filled.reshape(-1)[cells[missed]] = triangles[missed], TOUCHED
    table = np.column_stack((context.geometry.triangle_class, context.geometry.triangle_object))
    flat = [array.reshape(-1) for array in (owner, filled, state, indoors)]
    first = np.empty(1 << 18, np.int64)
    while (count := int(kernels.starts(flat[0], table, *flat[1:], first))) > len(first):
        first = np.empty(count, np.int64)
    return _runs(first[:count], table, *flat)


def _runs(first: Rows, table: Array, owner: Array, filled: Array, state: Array, indoors: Array) -> NDArray[np.void]:
    out, owners = np.empty(len(first), RUN), owner[first]
    out["length"] = np.diff(first, append=len(owner))
    out["class"] = np.where(owners < 0, 0, table[owners, 0])
    out["instance"] = np.where(owners < 0, 0, table[owners, 1])
    out["filled"], out["state"], out["indoors"] = filled[first], state[first], indoors[first]
    return out


def _occupy(context: LabelContext, points: Float, owner: NDArray[np.int32], filled: NDArray[np.uint8]) -> None:
    g = context.geometry
    for i in range(g.object_count):
        rows = _shown(context, np.arange(g.triangle_start[i], g.triangle_start[i + 1]))
        if len(rows):
            voxels.touch(points, g.triangles, rows, owner, filled, TOUCHED)
            voxels.fill(points, g.triangles, rows[_closed(context, i, rows)], owner, filled, INSIDE)
    voxels.touch(points, g.triangles, _scenery(context), owner, filled, TOUCHED)
    layer = -1 if g.ground_z is None else math.floor(points[g.vertex_start[-1], 1])
    if 0 <= layer < owner.shape[1]:
        free = owner[:, layer] < 0
        owner[:, layer][free], filled[:, layer][free] = g.triangle_start[-1], TOUCHED


def _shown(context: LabelContext, rows: Rows) -> Rows:
    """Return the rows of triangles that may be visible."""
    return rows[context.geometry.triangle_cutout[rows] != NEVER]


def _scenery(context: LabelContext) -> Rows:
    """The triangles of scenery, without the ground."""
    start = context.geometry.triangle_start
    return _shown(context, np.arange(start[context.geometry.object_count], start[-1]))


def _closed(context: LabelContext, i: int, rows: Rows) -> NDArray[np.bool_]:
    """Return a mask of these triangles of thing i: True for triangles of pieces that are closed by themselves."""
    g = context.geometry
    vertices = g.coordinates[g.vertex_start[i] : g.vertex_start[i + 1]]
    triangles = g.triangles[rows] - np.int32(g.vertex_start[i])
    key, known = xxhash.xxh3_128(vertices.tobytes() + triangles.tobytes()).digest(), _known()
    if key not in known:
        if len(known) >= MESHES:
            known.clear()
        known[key] = voxels.closed(vertices, triangles)
    return known[key]


@cache
def _known() -> dict[bytes, NDArray[np.bool_]]:
    """The results of `_closed` for meshes, by their digests."""
    return {}


def _indoors(context: LabelContext, points: Float, grid: Grid) -> NDArray[np.bool_]:
    """Return a mask of the cells that have scenery above their centres, and scenery or ground below."""
    g, (x, y, z) = context.geometry, grid.size
    if not g.has_scenery:
        return np.zeros(grid.size, np.bool_)
    low, high = voxels.heights(points, g.triangles, _scenery(context), (x, z))
    if g.ground_z is not None:
        low = np.minimum(low, points[g.vertex_start[-1], 1])
    height = np.arange(y)[:, None] + 0.5
    return (low[:, None] < height) & (height < high[:, None])


def _state(context: LabelContext, grid: Grid) -> NDArray[np.uint8]:
    """Return the visibility state of each cell's centre."""
    from viewsphere.geometry.voxels import kernels_voxels as kernels

    codes, (ahead, up, right) = np.array([OUTSIDE, FREE, OCCLUDED], np.uint8), grid.size
    out = np.empty((ahead, up * right), np.uint8)
    for part, centers in _slabs(context.camera, grid):
        pixels, _ = project(context.camera.intrinsics, centers)
        own = np.empty(len(centers), np.uint8)
        kernels.seen(pixels, _along(context.camera, centers), context.visibility.inverse_depth, codes, own)
        out[part] = own.reshape(out[part].shape)
    return out.reshape(grid.size)


def _slabs(camera: Camera, grid: Grid) -> Iterator[tuple[tuple[slice, slice], Float]]:
    """Parts of the grid, at most `SLAB` cells each: steps ahead, cells of each step, and the cells' centres in the camera's
    axes, (N, 3).
    """
    ahead, up, right = grid.size
    step = transform(camera.R, grid.world_from_grid[:3, 0] * grid.cell)
    for left in range(0, up * right, SLAB):
        numbers = np.arange(left, min(left + SLAB, up * right))
        cells = np.column_stack((np.zeros_like(numbers), *np.divmod(numbers, right))) + 0.5
        first, count = transform(camera.R, grid.points(cells)) + camera.t, SLAB // len(cells)
        for begin in range(0, ahead, count):
            steps = np.arange(begin, min(begin + count, ahead))
            part = slice(begin, begin + count), slice(left, left + SLAB)
            yield part, (first + steps[:, None, None] * step).reshape(-1, 3)


def _along(camera: Camera, points: Float) -> Float:
    """Return the lengths whose inverse is the 1/s of `truth.raster.visibility`."""
    x, y, z = points.T
    return np.sqrt(x * x + y * y + z * z) if camera.lens.has_unit_rays else np.ascontiguousarray(z)


def _seen_cells(context: LabelContext, grid: Grid) -> tuple[Rows, tuple[Rows, Rows]]:
    """The cells of the points at pixels, as indices into flat arrays, and these pixels; without points outside the grid."""
    where = np.nonzero(context.visibility.inverse_depth > 0)
    rays, begin = pixel_rays(context.camera.intrinsics)[where], context.camera.lens.origins()[where]
    depth = 1.0 / context.visibility.inverse_depth[where].astype(np.float64)
    cells = np.floor(_lifted(context.camera, grid, begin + rays * depth[:, None]))
    inside = ((cells >= 0) & (cells < grid.size)).all(axis=1)
    i, j, k = cells[inside].astype(np.int64).T
    return (i * grid.size[1] + j) * grid.size[2] + k, (where[0][inside], where[1][inside])


def _lifted(camera: Camera, grid: Grid, points: Float) -> Float:
    """Points (N, 3) in a camera's axes, converted to units of cells."""
    return grid.cells(transform(camera.R.T, points - camera.t))


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """Runs fill the grid, classes match their objects, objects are inside their boxes, and depth agrees with surface cells."""
    runs = channel_of(sample, "voxels")
    if runs is None or sample.known_camera is None:
        return
    grid = Grid.for_camera(Voxels.model_validate(sample.options.get("voxels", {})), sample.camera)
    try:
        cells = VoxelGrid.from_runs(runs, grid)
    except ValueError as error:
        yield str(error).removeprefix("voxels: ")
        return
    rest = [name for name in RUN.names or () if name != "length"]
    if (runs["length"] == 0).any() or (runs[rest][1:] == runs[rest][:-1]).any():
        yield "expected runs that are as long as they can be; found shorter ones"
    yield from _wrong_codes(sample, runs)
    for o in rendered(sample):
        own = np.argwhere(cells.instances == o.id)
        if len(own) and o.is_placed:
            box = grid.cells(o.box3d)
            off = ((own + 1 < box.min(axis=0) - BORDER) | (own > box.max(axis=0) + BORDER)).any(axis=1).sum()
            if off:
                yield f"object {o.id}: expected cells in its box, found {off} outside"
    yield from _wrong_surface(sample, cells)


def _wrong_codes(sample: Sample, runs: Array) -> Iterator[str]:
    filled, classes, instances = runs["filled"], runs["class"], runs["instance"]
    if (filled > INSIDE).any() or (runs["state"] > OCCLUDED).any() or (runs["indoors"] > 1).any():
        yield f"expected codes of 0 to {INSIDE} (filled), {OCCLUDED} (state) and 1 (indoors); found others"
    if ((filled == EMPTY) != (classes == 0)).any():
        yield "expected class 0 where a cell is empty, and nowhere else; found otherwise"
    if ((filled == INSIDE) & (instances == 0)).any():
        yield "expected insides of objects alone; found others"
    if ((filled == EMPTY) & ((runs["state"] == SURFACE) | (instances != 0))).any():
        yield "expected no object and no surface in empty cells; found some"
    known = {o.id: thing_class(o.category_id) for o in sample.objects}
    wrong = [i for i in np.unique(instances[instances != 0]).tolist() if i not in known]
    wrong += [i for i in known if (classes[instances == i] != known[i]).any()]
    if wrong:
        yield f"object {wrong[0]}: expected an object of the sample and the class of its category; found others"
    stuff = classes[(instances == 0) & (filled != EMPTY)]
    if ((stuff <= SKY) | (stuff >= FIRST_THING)).any():
        yield "expected stuff, but no sky, where a cell has something that is no object; found other classes"


def _wrong_surface(sample: Sample, cells: VoxelGrid) -> Iterator[str]:
    """Yield the places where cells and depth disagree about a seen surface, in either direction."""
    depth, grid = exact_depth(sample), cells.grid
    if depth is None:
        return
    rays = pixel_rays(sample.camera.intrinsics)
    seen = np.logical_and(np.isfinite(depth), rays[..., 2] != 0)
    lifted = rays[seen] * (depth[seen].astype(np.float64) / rays[seen][:, 2])[:, None] + sample.camera.lens.origins()[seen]
    points = _lifted(sample.camera, grid, lifted)
    slack = (ROUNDING * (largest(lifted) + np.abs(sample.camera.center).max()) / grid.cell)[:, None]
    sure = (np.abs(points - np.rint(points)) > slack).all(axis=1)
    missing = (cells.state[_inside(grid, points[sure])] != SURFACE).sum()
    if missing:
        yield f"expected seen surface in the cells of what depth shows; found {missing} pixels in others"
    extra = cells.state == SURFACE
    for corner in np.argwhere(np.ones((2, 2, 2))) * 2 - 1:
        extra[_inside(grid, points + corner * slack)] = False
    if extra.any() and (seen == np.isfinite(depth)).all():
        yield f"expected seen surface only where depth shows some; found {extra.sum()} other cells"


def _inside(grid: Grid, points: Float) -> tuple[Rows, ...]:
    """The cells of the points inside the grid; points are in units of cells."""
    cells = np.floor(points)
    i, j, k = cells[((cells >= 0) & (cells < grid.size)).all(axis=1)].astype(np.int64).T
    return i, j, k


LABEL = ChannelLabel(
    name="voxels",
    one_pose=True,
    meaning="cells of a grid before the camera, in runs, a row each: how many, class as in `semantic` (0: empty), object, "
    "surface or inside, seen or not, indoors or not; `sample.voxel_grid` has them as arrays",
    axes="ahead, up, right",
    options=Voxels,
    dtype=RUN,
    components=0,
    unit="cells",
    empty=0,
    encoding="npz",
    compute=_compute,
    prove=_prove,
    ids={"category": in_column("class", with_classes), "object": in_column("instance")},
    drawing=Drawing("voxels", beside=drawn, key=(("voxels from behind the camera; pale: not in its view", None), *KEY)),
)
