"""Cameras whose distance, or width for parallel rays, follows from the filled share of the picture, measured on the projected
models as in labels.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, reduce

import numpy as np
from numpy.typing import NDArray

from viewsphere.composing.viewpoints.camera import looking
from viewsphere.errors import RecipeError
from viewsphere.geometry.box import projected_bounds
from viewsphere.geometry.rotation import transform
from viewsphere.geometry.seam import united
from viewsphere.model.instant import Instant, Viewpoint
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Thing, TimeStep
from viewsphere.recipe.cameras.aim import FARTHEST

Float = NDArray[np.float64]

CLOSE_ENOUGH = 1e-9
"""Tolerance of the filled share, relative to the requested one."""

MOST_STEPS = 100
"""Number of tried distances before a search ends without a result, for example if the lens cuts a model off before it fills its
share.
"""

NEAREST = 1e9
"""The least distance of the search is the model's length divided by this number."""


BEYOND = 4.0
"""Distance of cameras with parallel rays, times the larger of the models' reach and half the picture's diagonal.

From elevations above 14 degrees, all rays then begin above the ground.
"""


@dataclass(frozen=True, eq=False)
class _Shape:
    """A model: vertices (N, 3) in its axes, metres; triangles (M, 3); and which vertices (N,) are corners."""

    vertices: Float
    triangles: NDArray[np.int32]
    is_used: NDArray[np.bool_]


@lru_cache(maxsize=64)
def shape_of(shown: tuple[ModelSpec, TimeStep | None]) -> _Shape:
    """The shape of a model at a time step; the last results are cached. Raises ModelError if its file cannot be used."""
    from viewsphere.assets.cache import load_normalised  # which loads readers of models

    spec, step = shown
    mesh = load_normalised(spec, step=step)
    is_used = np.zeros(len(mesh.vertices), np.bool_)
    is_used[mesh.triangles] = True
    return _Shape(mesh.vertices.astype(np.float64), mesh.triangles, is_used)


def filled(shot: Shot, together: bool) -> Shot:
    """The shot with cameras at distances that fill the requested share of the picture of the rig's first sensor, with the
    frame's model or with all targets `together`. A viewpoint's own distance is then a factor. Where rays are parallel, pictures
    get a width that fills the share instead, and the camera is far enough to show the whole models.

    Raises RecipeError if no distance fills the share.
    """
    if all(now.viewpoint is None or now.viewpoint.fill is None for now in shot.instants):
        return shot
    instants = tuple(_filled(shot, i, together) for i in range(len(shot.instants)))
    return shot.model_copy(update={"instants": instants})


def _filled(shot: Shot, i: int, together: bool) -> Instant:
    now = shot.instants[i]
    view = now.viewpoint
    targets = [there for thing in shot.targets(together) if (there := thing.still_at(i)).is_there]
    if view is None or view.fill is None or not targets:
        return now
    placed = [_placed(thing) for thing in targets]
    reach = _reach(placed, now)
    if shot.camera(i).lens.is_parallel:
        return _widened(shot.model_copy(update={"instants": (_moved(now, view, BEYOND * reach),)}), view, placed, reach)

    def fill_at(distance: float) -> float:
        at = _moved(now, view, distance)
        return _share_filled(shot.model_copy(update={"instants": (at,)}).camera(0), placed)

    distance = distance_of(view.fill, fill_at, reach)
    if distance is None:
        raise RecipeError(
            f"viewpoints.distance: expected a share of the picture that {targets[0].key} fills from some distance; found "
            f"{view.fill:g} (pose {view.index}): look at the model (target: center), or ask for another share"
        )
    return _moved(now, view, distance * view.distance)


def _widened(seen: Shot, view: Viewpoint, placed: Sequence[_Shape], reach: float) -> Instant:
    """The instant of a shot with parallel rays at the scale that fills the viewpoint's share; shares are proportional to the
    scale. The camera of the shot shows the whole models.
    """
    camera = seen.camera(0)
    lens = camera.intrinsics
    assert view.fill is not None
    factor = view.fill / _share_filled(camera, placed)
    fx, fy, skew = (float(f"{factor * value:.12g}") for value in (lens.fx, lens.fy, lens.skew))
    half_diagonal = math.hypot(lens.width / fx, lens.height / fy) / 2
    there = _moved(seen.instants[0], view, BEYOND * max(reach, half_diagonal) * view.distance)
    return there.model_copy(update={"intrinsics": lens.model_copy(update={"fx": fx, "fy": fy, "skew": skew})})


def _moved(now: Instant, view: Viewpoint, distance: float) -> Instant:
    """The instant with its camera at another distance."""
    there = looking(view.model_copy(update={"distance": distance}), now.focus, index=now.index)
    return now.model_copy(update={"world_from_rig": there.world_from_rig, "viewpoint": there.viewpoint})


def _placed(thing: Thing) -> _Shape:
    """A thing's shape, in the world."""
    shape = shape_of((thing.model, thing.step))
    return _Shape(transform(np.array(thing.world_from_object), shape.vertices), shape.triangles, shape.is_used)


def _reach(placed: Sequence[_Shape], now: Instant) -> float:
    """Metres from the camera's target to the farthest vertex."""
    return max(float(np.linalg.norm(shape.vertices - np.array(now.focus), axis=1).max()) for shape in placed) or 1.0


def _share_filled(camera: Camera, placed: Sequence[_Shape]) -> float:
    """The larger of box width / picture width and box height / picture height, for the box around all shapes (in world axes) as
    the camera projects them, as in the label `box2d_unclipped`. Infinite if the lens does not show all of them.
    """
    boxes = [projected_bounds(camera, s.vertices, s.triangles, s.is_used) for s in placed]
    if not all(whole and bounds for bounds, whole in boxes):
        return math.inf
    x0, y0, x1, y1 = reduce(lambda a, b: united(a, b, camera.lens.period), (bounds for bounds, _ in boxes if bounds))
    return max((x1 - x0) / camera.width, (y1 - y0) / camera.height)


def distance_of(fill: float, fill_at: Callable[[float], float], reach: float) -> float | None:
    """The distance, metres, to twelve digits, at which `fill_at` is `fill`; None if there is none up to `FARTHEST`. `fill_at`
    decreases with distance. `reach`: a length of the models' order of magnitude.

    False position (the Illinois algorithm, Dowell and Jarratt 1971) between a near and a far end, in the inverse distance, to
    which shares are nearly proportional. Bisection is used while the near end is only known to be too near.
    """
    near = far = 1 / reach
    above = below = fill_at(1 / near) - fill
    while below > 0:
        far /= 2
        if far * FARTHEST < 1:
            return None
        below = fill_at(1 / far) - fill
    while above < 0:
        near *= 2
        if near * reach > NEAREST:
            return None
        above = fill_at(1 / near) - fill
    last = 0.0
    for _ in range(MOST_STEPS):
        if above == 0 or below == 0:
            return 1 / (near if above == 0 else far)
        middle = (near + far) / 2 if math.isinf(above) else (near * below - far * above) / (below - above)
        error = fill_at(1 / middle) - fill
        if abs(error) <= CLOSE_ENOUGH * fill:
            return float(f"{1 / middle:.12g}")
        if error > 0:
            near, above, below = middle, error, below / 2 if last > 0 else below
        else:
            far, below, above = middle, error, above / 2 if last < 0 else above
        last = error
    return None
