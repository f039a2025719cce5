"""The lights of a scene that cast shadows, baked once per stage: the light of each, and the surfaces nearest to it."""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.raster.materials.kernels_material import L_CASTS_FROM
from viewsphere.engines.raster.materials.surface import part_of
from viewsphere.engines.raster.records import Float32, Int32, Surfaces, Textures
from viewsphere.engines.raster.shadows import kernels_shadow as kernels
from viewsphere.engines.raster.shadows.kernels_direct_light import AREA, DISTANT, POINT, SPOT
from viewsphere.engines.raster.shadows.still_maps import Part, StillMaps, rounded, snapped
from viewsphere.model.scene import AnyLight, AreaLight, HemisphereLight, PointLight, SpotLight
from viewsphere.rendering.sky.sun import Distant

Float = NDArray[np.float64]

# Effects are shares of pixels that change by more than 8 of 255, of a zoo car in zoo:neighbourhood at 480 x 360 pixels, by
# day and by lamps at night, at half and twice the value unless others are given. The rest was chosen by its geometry.
_MARGIN = 8  # empty texels around a fitted map, so that filters at its border read depths of no surface. Not measured alone
_ROUND_TARGETS = 2.0  # a fitted map's width in widths of the targets: 0.2 % by day, 11 to 16 % at night
_WIDER = 8.0  # width of each wide map of a distant light, in widths of the one before: 0.7 % by day
_MOST_WIDE = 3  # wide maps: 2 and 4 give the same pictures, and a fourth map would cover 4,096 widths of the targets
_FACE = 1.15  # half width of a cube's face at distance 1, so that filters have room around _READ: 0.03 % at night (1.05, 1.4)
_READ = 1.03  # half width of the part of a face that is read
_WIDEST = 2.5  # tangent above which one perspective is too coarse: 0.01 % at night (1.5, 4)
_SHARPEST = 1.2  # minimum half width of a filter, texels: narrower ones show steps, twice the width changes 0.3 %
# Lamps that are shut in, in shades and bulbs. Chosen by sight; none of the measured pictures changes.
_TIGHT = 6.0, 8.0  # half the width of such a lamp's filter, and the factor for what the filter hides
_BULB = 0.75  # share of a lamp's view, closer than its own size, above which that surface counts as the lamp itself
_MANY = 4  # number of fitted maps above which all are half as wide, which bounds their memory: same pictures at 2 and 16


@dataclass(frozen=True, eq=False)
class Extent:
    """The targets' bounds, low and high (3,), and the z of the surface below them or None, in the units of `Surfaces`; the
    number of their triangles, which come first; half the size of everything.
    """

    low: Float
    high: Float
    ground_z: float | None
    triangles: int
    reach: float


class Views(NamedTuple):
    """The views from the lights.

    form (V, FORM) float32 and grid (V, GRID) int64: columns named in `kernels_shadow`; depth (N,) float32: all levels of all
    maps, row by row; bounds (M, 4) float32: planes in front of and behind the surfaces in the maps' cells.
    """

    form: Float32
    grid: NDArray[np.int64]
    depth: Float32
    bounds: Float32


class Lights(NamedTuple):
    """K lights. kind (K,) int32; place (K, 3): position, or the direction to a distant light; color (K, 3): irradiance facing
    it, at distance 1 from a light at a place; axis (K, 3): the direction of a spot or a rectangle; right, up (K, 3): half a
    rectangle's sides; cone (K, 2): cosine at a spot's rim, inverse width of its ramp; radius (K,): half a distant light's angle
    in radians, otherwise the light's size; first (K + 1,) int32: the range of its views.
    """

    kind: Int32
    place: Float32
    color: Float32
    axis: Float32
    right: Float32
    up: Float32
    cone: Float32
    radius: Float32
    first: Int32
    views: Views


@dataclass(frozen=True)
class _ShadowView:
    """One map to draw: the (4, 4) matrix from the world, the minimum w (or, if round, the minimum distance), texels per length
    (at distance 1), and the minimum distance from the border at which it is read.

    Also half the light's sides (2, 3) along the view's axes (per length), or the radius and zeros if it is round, as every
    distant light is; and whether wide penumbrae are filtered finely.
    """

    matrix: Float
    near: float
    texels: float
    size: int
    guard: float
    sides: Float
    is_round: bool
    is_fine: bool = True


@dataclass(frozen=True)
class Casters:
    """The surfaces that cast shadows.

    `scenery` is a key of the scenery, None if there is none. `targets` is a key of the targets and their places, None if
    unknown. Keys are equal where scenery or targets are equal. In a sequence, `maps` are those of still things, and corners
    (n, 3) those of the targets' boxes.
    """

    surfaces: Surfaces
    textures: Textures
    extent: Extent
    scenery: Hashable = None
    targets: Hashable = None
    maps: StillMaps | None = None
    corners: Float | None = None

    def alone(self, surfaces: Surfaces, maps: StillMaps | None = None) -> Casters:
        """The casters restricted to these surfaces; `maps` are the maps of those that stand still in a sequence."""
        return replace(self, surfaces=surfaces, maps=maps)


@dataclass(frozen=True)
class _Source:
    """A light in stage units; fields as in `Lights`."""

    kind: int
    place: Float
    color: Float
    radius: float
    axis: Float = field(default_factory=lambda: np.zeros(3))
    right: Float = field(default_factory=lambda: np.zeros(3))
    up: Float = field(default_factory=lambda: np.zeros(3))
    half_angle: float = math.pi
    ramp: float = 1e6  # one over the difference of cosines over which a spot fades; it begins at `rim`
    rim: float = -2.0


def bake_lights(
    distant: Sequence[Distant], lights: Sequence[AnyLight], casters: Casters, unit: float, has_ground: bool, resolution: int
) -> Lights:
    """Bake the data that depends on the lights and on the shadow casters, but not on the camera.

    `resolution` is the width of the maps around the targets, `unit` the stage's unit in metres. Dark lights, and lights that
    the ground hides completely, are left out. So are hemisphere lights, see `even_light`.
    """
    middle = (casters.extent.low + casters.extent.high) / 2
    sources = [_from_afar(d) for d in distant]
    sources += [_at_place(light, middle, unit) for light in lights if not isinstance(light, HemisphereLight)]
    floor = casters.extent.ground_z if has_ground else None
    sources = [s for s in sources if s.color.max() > 0 and not _is_buried(s, floor)]
    size = resolution if len(sources) <= _MANY else max(resolution // 2, 64)
    points = _casting_points(casters)
    parts = [_views(source, points, casters, size) for source in sources]
    return _packed(sources, [len(p.form) for p in parts], _joined([*parts, draw_views([], casters)]))


def _from_afar(light: Distant) -> _Source:
    direction = np.array(light.direction) / np.linalg.norm(light.direction)
    return _Source(DISTANT, direction, np.array(light.irradiance), math.radians(light.angle_deg) / 2)


def _at_place(light: PointLight | SpotLight | AreaLight, middle: Float, unit: float) -> _Source:
    place = middle + np.array(light.position) / unit
    color = light.strength * np.array(light.color) / unit**2
    if isinstance(light, PointLight):
        return _Source(POINT, place, color, light.radius / unit)
    axis = np.array(light.toward) - np.array(light.position)
    length = float(np.linalg.norm(axis))
    axis = axis / length if length > 0 else np.array([0.0, 0.0, -1.0])
    if isinstance(light, SpotLight):
        half = math.radians(light.angle_deg) / 2
        rim = math.cos(half)
        ramp = 1 / max(math.cos(half * (1 - light.blend)) - rim, 1e-4)
        return _Source(SPOT, place, color, light.radius / unit, axis, half_angle=half, ramp=ramp, rim=rim)
    right, up = _level_axes(axis)
    width, height = (side / unit for side in light.size)
    return _Source(
        AREA, place, color, math.sqrt(width * height / math.pi), axis, right * width / 2, up * height / 2, math.pi / 2
    )


def _is_buried(source: _Source, floor: float | None) -> bool:
    if floor is None:
        return False
    if source.kind == DISTANT:
        return bool(source.place[2] <= 0)
    return bool(source.place[2] + abs(source.right[2]) + abs(source.up[2]) <= floor)


def _level_axes(axis: Float) -> tuple[Float, Float]:
    """A horizontal direction to the right of this one, and the matching up direction."""
    right = np.array([axis[1], -axis[0], 0.0])
    length = float(np.linalg.norm(right))
    right = right / length if length > 1e-6 else np.array([1.0, 0.0, 0.0])
    return right, np.cross(right, axis)


def _casting_points(casters: Casters) -> Float:
    """Vertices of the targets' triangles that cast shadows, (n, 3); in a sequence, the corners of their boxes."""
    if casters.corners is not None:
        return casters.corners
    surfaces, stop = casters.surfaces, casters.extent.triangles
    casts = surfaces.looks[surfaces.material[:stop], L_CASTS_FROM] <= 1
    is_used = np.zeros(len(surfaces.vertices), np.bool_)
    is_used[surfaces.triangles[:stop][casts]] = True
    return surfaces.vertices[is_used, 11:14].astype(np.float64)


def _views(source: _Source, points: Float, casters: Casters, size: int) -> Views:
    """The views of a light, the narrowest first. A sample uses the first one that contains it; outside all of them, there is no
    shadow.
    """
    has_scenery = casters.scenery is not None
    if source.kind == DISTANT:
        narrow = draw_views([_fitted_from_afar(source, points, casters, size)] if len(points) else [], casters)
        return _joined([narrow, _wide_from_afar(_backdrop(source, casters, size))]) if has_scenery else narrow
    fitted = _fitted_from_place(source, points, casters, size) if len(points) else None
    views = [] if fitted is None else [fitted]
    if has_scenery or (fitted is None and len(points)):
        views += _all_round(source, max(size // 2, 64))
    drawn = draw_views(views, casters)
    if source.kind != AREA and source.radius > 0 and fitted is None and _is_in_bulb(views, drawn, source.radius):
        views = [replace(view, near=source.radius) for view in views]
        drawn = draw_views(views, casters)
    if fitted is None and not has_scenery and _is_shut_in(views, drawn, casters.extent.ground_z is not None):
        # Beyond a wall, the filter would find the lit floor in front of it.
        drawn.form[:, (kernels.SHARPEST, kernels.DARKER)] = _TIGHT
    return drawn


def _is_in_bulb(views: Sequence[_ShadowView], drawn: Views, radius: float) -> bool:
    """Return whether most of the surfaces in these views are inside the emitting ball: a bulb, which would hide all of its
    light. A table top that cuts through the ball hides at most half of it.
    """
    within, count = 0, 0
    for i, view in enumerate(views):
        place = ((np.arange(view.size) + 0.5 - view.size / 2) / view.texels) ** 2
        is_close = _level(drawn, i, view.size)[:, : view.size] * -radius > np.sqrt(1 + place + place[:, None])
        within, count = within + int(is_close.sum()), count + view.size**2
    return within > _BULB * count


def _is_shut_in(views: Sequence[_ShadowView], drawn: Views, has_ground: bool) -> bool:
    """Return whether all rays of these views end at a target, or on the ground."""
    for i, view in enumerate(views):
        right, up, ahead = view.matrix[0, 2] / view.texels, view.matrix[1, 2] / view.texels, view.matrix[3, 2]
        place = (np.arange(view.size) + 0.5 - view.size / 2) / view.texels
        is_down = ahead + right * place + up * place[:, None] < 0
        if not (np.isfinite(_level(drawn, i, view.size)[:, : view.size]) | (is_down & has_ground)).all():
            return False
    return len(views) > 0


@dataclass(frozen=True)
class _Backdrop:
    """Scenery under a distant light: the scenery's `key`, the `span` of the narrowest map, and the extent of the scenery."""

    key: Hashable
    direction: tuple[float, float, float]
    tangent: float
    span: float
    reach: float
    size: int
    casters: Casters = field(compare=False)


def _backdrop(source: _Source, casters: Casters, size: int) -> _Backdrop:
    x, y, z = source.place.tolist()
    low, high = casters.extent.low, casters.extent.high
    span = 2.0 ** math.ceil(math.log2(float(np.linalg.norm(high - low)) or 1.0))
    surfaces, start = casters.surfaces, casters.extent.triangles
    scenery = casters.alone(part_of(surfaces, start), casters.maps and casters.maps.backdrop)
    reach = casters.extent.reach if casters.maps is None else rounded(casters.extent.reach)
    return _Backdrop(casters.scenery, (x, y, z), math.tan(source.radius), span, reach, size, scenery)


@lru_cache(maxsize=2)
def _wide_from_afar(backdrop: _Backdrop) -> Views:
    """Views of the scenery alone around the origin; the widest one covers the whole scenery.

    The latest views are cached, because they do not change with the targets.
    """
    away = -np.array(backdrop.direction)
    span, widest = backdrop.span, 2 * backdrop.reach
    views: list[_ShadowView] = []
    while not views or (span < widest and len(views) < _MOST_WIDE):
        span = min(_WIDER * span, max(widest, backdrop.span))
        views.append(parallel_view(away, np.zeros(3), span, backdrop.tangent, backdrop.size))
    return draw_views(views, backdrop.casters)


def parallel_view(away: Float, middle: Float, span: float, tangent: float, size: int, margin: int = _MARGIN) -> _ShadowView:
    """Return the view from a distant light with this tangent of its half angle, in the direction `away`.

    The view is `span` wide around the point `middle`.
    """
    right, up = _level_axes(away)
    texels = (size - 2 * margin) / span
    matrix = np.zeros((4, 4))
    matrix[:3, :3] = np.stack([texels * right, texels * up, away])
    matrix[:2, 3] = -matrix[:2, :3] @ middle
    matrix[3, 3] = 1.0
    return _ShadowView(matrix, 0.5, texels, size, 1.0, _ball(tangent), True)


def _ball(radius: float) -> Float:
    return np.array([[radius, 0.0, 0.0], [0.0, radius, 0.0]])


def _fitted_from_afar(source: _Source, points: Float, casters: Casters, size: int) -> _ShadowView:
    """The view of a distant light around the targets and the penumbrae behind them."""
    away = -source.place
    axes = np.stack([*_level_axes(away), away])
    seen = points @ axes.T
    low, high = seen.min(axis=0), seen.max(axis=0)
    span = float((high - low)[:2].max()) or 1.0
    tangent = math.tan(source.radius)
    height = float(casters.extent.high[2] - casters.extent.low[2])
    behind = max(float(high[2] - low[2]), height / max(abs(float(away[2])), 0.05))
    span += 2 * min(tangent * behind, span / 2)
    if casters.scenery is not None:
        span *= _ROUND_TARGETS
    middle = (low + high) / 2
    if casters.maps is not None:
        span, middle[:2] = snapped(span, middle[:2])
        middle[2] = 0.0  # any axis works, but the same axis gives the same matrix
    return parallel_view(away, axes.T @ middle, span, tangent, size)


def _perspective(source: _Source, axes: Float, tangent: float, size: int, guard: float) -> _ShadowView:
    """Return the view from a light at a place along the third of these axes, up to this tangent to all sides."""
    texels = size / 2 / tangent
    matrix = np.zeros((4, 4))
    matrix[:2, :3], matrix[3, :3] = texels * axes[:2], axes[2]
    matrix[:, 3] = -matrix[:, :3] @ source.place
    matrix[2, 3] = -1.0
    near = max(1e-3, 0.02 * source.radius)
    is_round = source.kind != AREA or source.radius == 0
    sides = _ball(source.radius) if is_round else np.stack([source.right, source.up]) @ axes.T
    return _ShadowView(matrix, near, texels, size, guard, sides, is_round)


def _fitted_from_place(source: _Source, points: Float, casters: Casters, size: int) -> _ShadowView | None:
    """One perspective view of the targets, if they fit in one; it is along a rectangle's own axis if possible."""
    away = (casters.extent.low + casters.extent.high) / 2 - source.place
    distance = float(np.linalg.norm(away))
    if distance < 1e-6:
        return None
    for aim, widest in ((source.axis, _WIDEST / 2), (away / distance, _WIDEST)):
        if aim is source.axis and source.kind != AREA:
            continue
        right = source.right - aim * (aim @ source.right)
        length = float(np.linalg.norm(right))
        right = right / length if length > 1e-9 else _level_axes(aim)[0]
        axes = np.stack([right, np.cross(right, aim), aim])
        seen = (points - source.place) @ axes.T
        nearest = float(seen[:, 2].min())
        if nearest < 0.05 * distance:
            continue
        tangent = float(np.abs(seen[:, :2] / seen[:, 2:]).max())
        tangent += min(source.radius / nearest, tangent)
        if casters.scenery is not None:
            tangent *= _ROUND_TARGETS
        if tangent <= widest:
            return _perspective(source, axes, tangent * size / (size - 2 * _MARGIN), size, 1.0)
    return None


def _all_round(source: _Source, size: int) -> list[_ShadowView]:
    """Views of everything that the light may reach: its cone, or the faces of a cube."""
    axis = source.axis if source.kind != POINT else np.array([0.0, 0.0, -1.0])
    right, up = _level_axes(axis)
    if source.kind == AREA and source.radius > 0:
        right, up = source.right / np.linalg.norm(source.right), source.up / np.linalg.norm(source.up)
    if source.kind == SPOT and math.tan(source.half_angle) < _WIDEST and source.half_angle < math.pi / 2:
        return [_perspective(source, np.stack([right, up, axis]), 1.1 * math.tan(source.half_angle), size * 2, 1.0)]
    faces = [(right, up, axis), (up, axis, right), (axis, up, -right), (axis, right, up), (right, axis, -up)]
    if source.kind != AREA:
        faces.append((up, right, -axis))
    guard = (1 - _READ / _FACE) * size / 2
    return [_perspective(source, np.stack(face), _FACE, size, guard) for face in faces]


def draw_views(views: Sequence[_ShadowView], casters: Casters, opposite: bool = False) -> Views:
    """Maps of all triangles seen in these views; `opposite` adds the same number of views from the other side, after them."""
    count = len(views) * (2 if opposite else 1)
    form, grid = np.zeros((count, kernels.FORM), np.float32), np.zeros((count, kernels.GRID), np.int64)
    texels, cells = 0, 0
    for i in range(count):
        view = views[i % len(views)]
        texels, cells = _lay_out(grid[i], view.size, texels, cells)
        form[i] = _form_row(view, i >= len(views))
    result = Views(form, grid, np.empty(texels, np.float32), np.empty((cells, 4), np.float32))
    result.bounds[:] = np.inf, -np.inf, 0, 0
    for i, view in enumerate(views):
        nearest = _level(result, i, view.size)
        farthest = _level(result, i + len(views), view.size) if opposite else np.empty((0, 0), np.float32)
        farthest.fill(-np.inf)
        tilt = float(form[i, kernels.TILT]) if view.is_round else 0.0
        for part in _begin(view, tilt, casters, nearest):
            _draw(view, tilt, part(), casters.textures, nearest, farthest)
        np.negative(farthest, out=farthest)
    for i in range(count):
        _thin_out(result, i)
        form[i, kernels.NEAREST] = kernels.finish_view(grid[i], form[i], result.depth, result.bounds)
    return result


def _draw(
    view: _ShadowView, tilt: float, surfaces: Surfaces, textures: Textures, nearest: Float32, farthest: Float32 | None = None
) -> None:
    """Draw these surfaces over a map of a view, and over the map of the farthest surfaces, if given."""
    if not len(surfaces.triangles):
        return
    first, stop = int(surfaces.triangles.min()), int(surfaces.triangles.max()) + 1
    corners = np.empty((stop - first, 4))
    kernels.see_vertices(surfaces.vertices, first, view.matrix, corners)
    other = np.empty((0, 0), np.float32) if farthest is None else farthest
    kernels.draw_depth(corners, first, surfaces, textures, view.near, tilt, nearest, other)


def _begin(view: _ShadowView, tilt: float, casters: Casters, nearest: Float32) -> tuple[Part, ...]:
    """Draw the still things of a sequence into an empty map; return the parts that are still to be drawn."""
    maps, key = casters.maps, (view.matrix.tobytes(), view.near, tilt, view.size)
    kept = None if maps is None else maps.begun(key)
    nearest[:] = np.inf if kept is None else kept
    if maps is None:
        return (lambda: casters.surfaces,)
    if kept is None:
        for part in maps.still:
            _draw(view, tilt, part(), casters.textures, nearest)
        maps.keep(key, nearest)
    return maps.moving


def _joined(parts: Sequence[Views]) -> Views:
    """Return the views of all these parts, in this order."""
    if len(parts) == 2 and not len(parts[1].form):
        return parts[0]
    texels = np.cumsum([0, *(len(p.depth) for p in parts)])
    cells = np.cumsum([0, *(len(p.bounds) for p in parts)])
    grids = [p.grid.copy() for p in parts]
    for i, grid in enumerate(grids):
        grid[:, kernels.DEPTH_AT :] += texels[i]
        grid[:, kernels.BOUNDS_AT] += cells[i]
    return Views(
        np.concatenate([p.form for p in parts]),
        np.concatenate(grids),
        np.concatenate([p.depth for p in parts]),
        np.concatenate([p.bounds for p in parts]),
    )


def _thin_out(views: Views, which: int) -> None:
    """Fill the coarser levels of a drawn map: each has every second texel of the previous one in both directions."""
    size = int(views.grid[which, kernels.SIZE])
    finest = _level(views, which, size)[:, :size]
    for level in range(1, kernels.LEVELS):
        n, middle = size >> level, 1 << level - 1
        if n < kernels.COARSEST:
            break
        _level(views, which, n, level)[:, :n] = finest[middle :: 1 << level, middle :: 1 << level][:n, :n]


def _level(views: Views, which: int, size: int, level: int = 0) -> Float32:
    start, stride = int(views.grid[which, kernels.DEPTH_AT + level]), size + kernels.GAP
    return views.depth[start : start + size * stride].reshape(size, stride)


def _lay_out(row: NDArray[np.int64], size: int, texels: int, cells: int) -> tuple[int, int]:
    """Fill a view's row of `Views.grid`; return the start of the next one."""
    side = 1 << (size // kernels.STEP - 1).bit_length()
    row[kernels.SIZE], row[kernels.BOUNDS_AT], row[kernels.CELLS] = size, cells, side
    for level in range(kernels.LEVELS):
        n = size >> level
        if level and n < kernels.COARSEST:
            break
        row[kernels.DEPTH_AT + level] = texels
        texels += n * (n + kernels.GAP)
    # The finest cells are the left half of a square's rows, coarser ones follow to their right.
    cells += 2 * side * side
    return texels, cells


def _form_row(view: _ShadowView, from_behind: bool) -> Float32:
    row = np.zeros(kernels.FORM, np.float32)
    matrix = view.matrix.copy()
    if from_behind:
        matrix[2] *= -1
    row[:16] = matrix.ravel()
    row[kernels.TEXELS], row[kernels.MIDDLE], row[kernels.READ] = view.texels, view.size / 2, view.size / 2 - view.guard
    row[kernels.ROUND], row[kernels.FINE] = view.is_round, view.is_fine
    row[kernels.SHARPEST], row[kernels.DARKER] = _SHARPEST, 1
    is_far = matrix[3, 3] == 1 and not matrix[3, :3].any()
    row[kernels.BIAS_FAR if is_far else kernels.BIAS_NEAR] = 1.2 / view.texels
    row[kernels.TILT] = 0 if is_far else view.texels**-2
    sides = view.sides * [view.texels, view.texels, 1]
    row[kernels.SIDES : kernels.SIDES + 6] = sides.ravel()
    row[kernels.SPAN_U], row[kernels.SPAN_V], row[kernels.MORE] = np.abs(sides).sum(axis=0)
    if view.is_round and not is_far:
        # An ellipse's half width is a convex function: less than on the line to the border.
        slant = row[kernels.READ] / view.texels
        row[kernels.MORE] = sides[0, 0] * (math.hypot(1, slant) - 1) / row[kernels.READ]
    return row


def _packed(sources: Sequence[_Source], counts: Sequence[int], views: Views) -> Lights:
    def rows(values: Sequence[Float], width: int) -> Float32:
        return np.ascontiguousarray(np.array(values, np.float32).reshape(-1, width))

    return Lights(
        kind=np.array([s.kind for s in sources], np.int32),
        place=rows([s.place for s in sources], 3),
        color=rows([s.color for s in sources], 3),
        axis=rows([s.axis for s in sources], 3),
        right=rows([s.right for s in sources], 3),
        up=rows([s.up for s in sources], 3),
        cone=rows([np.array([s.rim, s.ramp]) for s in sources], 2),
        radius=np.array([s.radius for s in sources], np.float32),
        first=np.cumsum([0, *counts]).astype(np.int32),
        views=views,
    )
