"""A camera's view of a geometry, with values that the labels of a picture share, computed at the first access."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import PluginError
from viewsphere.geometry.box import Bounds, is_behind, projected_bounds
from viewsphere.geometry.lenses import NEAR
from viewsphere.geometry.rotation import product
from viewsphere.geometry.seam import turns
from viewsphere.labels.shared.needs import Need, OwnView, Partner
from viewsphere.labels.shared.placement import Placement
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.sensors.rolling import RowPoses
from viewsphere.truth.correspondences.correspondence import Match
from viewsphere.truth.correspondences.rolling import match_between
from viewsphere.truth.raster.geometry import Geometry
from viewsphere.truth.raster.rolling import RowRuns, centers_of, pixels_in_rows, reach_in_rows, row_runs
from viewsphere.truth.raster.visibility import (
    Instances,
    Visibility,
    direction_matrix,
    homogeneous,
    lens_rays,
    lens_rays_to,
    rasterize,
)
from viewsphere.truth.shot_views import NeighbourViews
from viewsphere.truth.view import View

NeedT = TypeVar("NeedT")
OptionsT = TypeVar("OptionsT", bound=Frozen)
Made = TypeVar("Made")

NOWHERE = (math.nan,) * 4
EVERYWHERE = (-math.inf, -math.inf, math.inf, math.inf)


def _corners(geometry: Geometry, i: int) -> NDArray[np.float64]:
    """The corners (8, 3) of the box around thing i along its own axes, metres."""
    own = slice(geometry.vertex_start[i], geometry.vertex_start[i + 1])
    used = geometry.coordinates[own][geometry.is_used[own]]
    low, high = (used.min(axis=0), used.max(axis=0)) if len(used) else np.zeros((2, 3), np.float32)
    return np.where(np.indices((2, 2, 2)).reshape(3, 8).T, high, low).astype(np.float64)


@dataclass(frozen=True, eq=False)
class IsolatedMask:
    """An object as the camera would see it alone, on a canvas of three times the image's width and height. It stores 1/s (h, w)
    float32 of `truth.raster.visibility`, 0 where a pixel does not show the object; its first pixel is at (left, top).
    """

    left: int
    top: int
    inverse_depth: NDArray[np.float32]

    def in_image(self, width: int, height: int) -> IsolatedMask:
        """The part of the mask inside the image."""
        x, y = max(-self.left, 0), max(-self.top, 0)
        return IsolatedMask(
            max(self.left, 0),
            max(self.top, 0),
            self.inverse_depth[y : max(height - self.top, 0), x : max(width - self.left, 0)],
        )

    @property
    def box(self) -> tuple[int, int, int, int]:
        """A half-open box (x0, y0, x1, y1) around the mask, not always tight."""
        rows, columns = self.inverse_depth.shape
        return self.left, self.top, self.left + columns, self.top + rows


class _Shared(Generic[Made]):
    """A property with one value for all contexts of a picture, computed at the first access."""

    def __init__(self, method: Callable[[Any], Made]) -> None:
        self._method, self.__doc__ = method, method.__doc__

    def __get__(self, context: LabelContext, owner: type[LabelContext]) -> Made:
        return context.once(f"context.{self._method.__name__}", lambda: self._method(context))


@dataclass(frozen=True, eq=False)
class ShownTriangles:
    """The triangles that pixels show, as `kernels_channels` takes them: seen (H, W), triangles (n, 3), objects (n,), and the
    `homogeneous` corners that the triangles number. Under a rolling shutter each row has triangles of its own.
    """

    seen: NDArray[np.int32]
    triangles: NDArray[np.int32]
    objects: NDArray[np.int32]
    corners: NDArray[np.float64]
    runs: RowRuns | None = None
    known: NDArray[np.int32] | None = None

    def of_vertices(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """Values of the geometry's vertices, for these corners."""
        return values if self.known is None else values[self.known]

    def of_triangles(self, values: NDArray[Any]) -> NDArray[Any]:
        """Values of the geometry's triangles, for these triangles."""
        return values if self.runs is None else values[self.runs.triangle]

    def directions_of_vertices(self, normals: NDArray[np.float32]) -> NDArray[np.float32]:
        """World directions of the geometry's vertices, for these corners, in the axes from which `rotation` leads."""
        return normals if self.runs is None else _turned(np.repeat(self.runs.turns, 3, axis=0), self.of_vertices(normals))

    def directions_of_triangles(self, normals: NDArray[np.float32]) -> NDArray[np.float32]:
        """World directions of the geometry's triangles, for these triangles, in the axes from which `rotation` leads."""
        return normals if self.runs is None else _turned(self.runs.turns, self.of_triangles(normals))

    def rotation(self, camera: Camera) -> NDArray[np.float64]:
        """The matrix (3, 3) from the axes of the directions to the camera's: those of the world or, in rows, the camera's."""
        return camera.R if self.runs is None else np.eye(3)


def _turned(matrices: NDArray[np.float64], vectors: NDArray[np.float32]) -> NDArray[np.float32]:
    """Each vector (n, 3) turned by its own matrix (n, 3, 3)."""
    return product(matrices, vectors[..., None].astype(np.float64))[..., 0].astype(np.float32)


@dataclass(frozen=True, eq=False)
class LabelContext:
    """The inputs that the labels of a picture share: a camera's view of a geometry, seen as `rasterize(geometry, camera)`.

    `placements` belong to the objects 1, 2, ...; they are None for absent objects, and labels of pixels need none. `neighbours`
    are views to compare the picture with; `requested` are names of annotations; `options` are the labels' options by name.
    `label` names the label that reads the context, which gets only the inputs in its `needs`; None: all inputs.
    """

    geometry: Geometry
    camera: Camera
    visibility: Visibility
    placements: Sequence[Placement | None] = ()
    neighbours: NeighbourViews | None = None
    requested: tuple[str, ...] = ()
    options: Mapping[str, Mapping[str, Any]] = field(default_factory=dict[str, Mapping[str, Any]])
    label: str = ""
    needs: tuple[Need[Any], ...] | None = None
    _isolated: dict[int, IsolatedMask] = field(default_factory=dict[int, "IsolatedMask"], repr=False)
    _made: dict[str, Any] = field(default_factory=dict[str, Any], repr=False)
    _matches: dict[Need[Any], Match | None] = field(default_factory=dict[Need[Any], "Match | None"], repr=False)

    def once(self, name: str, make: Callable[[], Made]) -> Made:
        """Return a label's result for all objects at once; `make` computes it for the first object."""
        if name not in self._made:
            self._made[name] = make()
        return self._made[name]

    def read_by(self, label: str, needs: tuple[Need[Any], ...]) -> LabelContext:
        """Return this context for a label with these needs; all contexts of a picture share their results."""
        return replace(self, label=label, needs=needs)

    def get(self, need: Need[NeedT]) -> NeedT | None:
        """Return the input that a need describes; None for a picture without neighbours. Raises PluginError for a need that the
        label does not list.
        """
        self._check(need)
        return need.read(self.neighbours) if self.neighbours else None

    def _check(self, need: Need[Any]) -> None:
        if self.needs is not None and need not in self.needs:
            raise PluginError(f"label {self.label}: `compute` reads {need}, which `needs` does not list. Add it there.")

    @property
    def own_view(self) -> View | None:
        """The picture's own view, to compare with points of other views; None for a picture without neighbours. Every label
        with any need has access to it.
        """
        if not self.needs:
            self._check(OwnView())
        return self.neighbours.view(0, None) if self.neighbours else None

    def match(self, need: Need[View | None]) -> Match | None:
        """Return the places of the picture's points in a neighbouring view. The result is kept, so that labels share it."""
        self._check(need)
        if need not in self._matches:
            own, other = self.own_view, self.get(need)
            self._matches[need] = match_between(own, self.visibility, other) if own and other else None
        return self._matches[need]

    def options_of(self, name: str, kind: type[OptionsT]) -> OptionsT:
        """The options of a label, parsed by their class."""
        return kind.model_validate(self.options.get(name, {}))

    @property
    def baseline(self) -> float | None:
        """Metres to the sensor that is rectified with the picture's own, None without one. Needs `Partner`."""
        self._check(Partner())
        partner = self.neighbours.partner if self.neighbours else None
        return partner and partner[1]

    @_Shared
    def rays_to(self) -> NDArray[np.float64]:
        """Rays (H, W, 3), camera axes, from the camera's centre to the seen points: `rays`, except for parallel rays."""
        rays = lens_rays_to(self.camera, self.visibility.inverse_depth.astype(np.float64))
        return self.rays if rays is None else rays

    @_Shared
    def camera_from_ray_to(self) -> NDArray[np.float64]:
        """Matrix (3, 3) from `rays_to` to camera axes."""
        return np.eye(3) if self.camera.lens.is_parallel else self.camera_from_ray

    @_Shared
    def rays(self) -> NDArray[np.float64]:
        """The ray of each pixel of a distorted lens (H, W, 3), in camera axes; (0, 0, 3) if rays are pixels (x, y, 1)."""
        rays = lens_rays(self.camera)
        if rays is None:
            rays = np.empty((0, 0, 3))
            rays.setflags(write=False)  # read-only like a lens's rays, so that kernels are compiled once for both
        return rays

    @_Shared
    def corners(self) -> NDArray[np.float64]:
        """The vertices of the scene before the perspective division, as `truth.raster.visibility.homogeneous` gives them."""
        return homogeneous(self.geometry, self.camera) if self.visibility.corners is None else self.visibility.corners

    @_Shared
    def shown(self) -> ShownTriangles:
        """The triangles that the pixels show, with the places of their corners."""
        g, seen, rows = self.geometry, self.visibility.triangle, self.camera.rows
        if rows is None:
            return ShownTriangles(seen, g.triangles, g.triangle_object, self.corners)
        runs = row_runs(g, self.camera, rows, seen)
        known = g.triangles[runs.triangle].reshape(-1)
        return ShownTriangles(runs.seen, runs.triangles, g.triangle_object[runs.triangle], runs.corners, runs, known)

    @_Shared
    def camera_from_ray(self) -> NDArray[np.float64]:
        """Matrix (3, 3) from `rays` to their directions in camera axes, see `truth.raster.visibility.direction_matrix`."""
        return direction_matrix(self.camera)

    @property
    def inverse_depth(self) -> NDArray[np.float64]:
        """1/s of the seen points, (H, W), unrounded if available; 0 where nothing is seen."""
        return self.visibility.inverse_depth.astype(np.float64) if self.visibility.exact is None else self.visibility.exact

    @property
    def instances(self) -> Instances:
        """The object at each pixel, and the area and box of each object's visible pixels."""
        return self.visibility.instances(self.geometry)

    @_Shared
    def projected(self) -> tuple[tuple[Bounds | None, bool], ...]:
        """For each object the 2D box of its projected triangles, and whether the lens shows all of them."""
        return tuple(self._projected(i) for i in range(self.geometry.object_count))

    @_Shared
    def reached(self) -> tuple[tuple[Bounds | None, bool], ...]:
        """`projected`, but under a rolling shutter the box that holds all pixels which may show the object in any row."""
        rows, g = self.camera.rows, self.geometry
        if rows is None:
            return self.projected
        boxes = [_corners(g, i) for i in range(g.object_count)]
        reached = [reach_in_rows(self.camera, rows, i, g.poses[i], box) for i, box in enumerate(boxes)]
        return tuple((EVERYWHERE if one is None else one, one is not None) for one in reached)

    def _projected(self, i: int) -> tuple[Bounds | None, bool]:
        g = self.geometry
        if self.camera.rows is not None:
            return self._projected_in_rows(i, self.camera.rows)
        (first, stop), (base, end) = g.triangle_start[i : i + 2], g.vertex_start[i : i + 2]
        if first < stop and self.camera.lens.is_straight and is_behind(self.camera, g.bounds[i]):
            return None, False
        triangles = g.triangles[first:stop]
        own = triangles - np.int32(base) if base else triangles  # saves a large array for an object alone
        return projected_bounds(self.camera, g.places(i), own, g.is_used[base:end])

    def _projected_in_rows(self, i: int, rows: RowPoses) -> tuple[Bounds | None, bool]:
        g = self.geometry
        own = slice(g.vertex_start[i], g.vertex_start[i + 1])
        points = g.coordinates[own][g.is_used[own]].astype(np.float64)
        pixels, z = pixels_in_rows(self.camera, rows, i, g.poses[i], points)
        if not len(points) or not (z > NEAR).any():
            return None, not len(points)
        if not (z > NEAR).all():
            return None, False
        (x0, y0), (x1, y1) = pixels.min(axis=0).tolist(), pixels.max(axis=0).tolist()
        return (x0, y0, x1, y1), True

    def is_unobstructed(self, i: int) -> bool:
        """Return whether nothing can hide any part of the object of id i + 1: its 2D box meets no other object's box, there
        is no scenery, and the ground cannot be in front of it.
        """
        geometry = self.geometry
        if geometry.has_scenery:
            return False  # a street's box meets all others, so testing scenery's boxes would cost more than it saves
        own = self.reached[i][0]
        if own is not None:
            (left, top, right, bottom), (x0, y0, x1, y1) = own, self._reaches.T
            beside = (top < y1) & (y0 < bottom)
            meets = np.zeros(len(beside), np.bool_)
            for turn in turns(self.camera.lens.period):
                meets |= beside & (left + turn < x1) & (x0 < right + turn)
            meets[i] = False
            if meets.any():
                return False
        if geometry.ground_z is None:
            return True
        if self.camera.lens.is_parallel:
            return float(self.camera.R[2, 2]) < 0.0
        if self.camera.rows is not None:
            return bool((centers_of(self.camera.rows)[:, 2] > geometry.ground_z).all())
        return float(self.camera.center[2]) > geometry.ground_z

    @_Shared
    def _reaches(self) -> NDArray[np.float64]:
        """For each object the 2D box, (N, 4), beyond which it hides nothing. It is unbounded if the lens does not show all of
        the object, and NaN for an object behind the camera.
        """
        boxes = (NOWHERE if box is None else box if whole else EVERYWHERE for box, whole in self.reached)
        return np.array([*boxes], np.float64).reshape(-1, 4)

    def isolated(self, i: int) -> IsolatedMask:
        """Return the camera's view of the object of id i + 1 alone; it is drawn once."""
        if i not in self._isolated:
            self._isolated[i] = self._draw_isolated(i)
        return self._isolated[i]

    def _draw_isolated(self, i: int) -> IsolatedMask:
        width, height = self.camera.width, self.camera.height
        own, whole = self.reached[i]
        x0, y0, x1, y1 = own if own and whole else EVERYWHERE
        if self.camera.lens.period is not None and x1 > width:
            x0, x1 = 0.0, float(width)  # a full turn has no canvas beside it
        left, top = math.floor(max(x0, -width)), math.floor(max(y0, -height))
        right, bottom = math.ceil(min(x1, 2 * width)), math.ceil(min(y1, 2 * height))
        if right <= left or bottom <= top:
            return IsolatedMask(0, 0, np.zeros((0, 0), np.float32))
        window = (left, top, right, bottom)
        corners = self.visibility.corners
        drawn = rasterize(self.geometry, self.camera, object_id=i + 1, window=window, corners=corners)
        return IsolatedMask(left, top, drawn.inverse_depth)

    def placement(self, i: int) -> Placement:
        """Placement of the object of id i + 1; raises ValueError for an absent object."""
        found = self.placements[i]
        if found is None:
            raise ValueError(f"object {i + 1}: expected one that is there")
        return found

    def empty(self, dtype: type[np.generic], components: int = 1) -> NDArray[Any]:
        """An uninitialised array for a channel of this picture, (H, W) or (H, W, components)."""
        shape = self.visibility.triangle.shape
        return np.empty(shape if components == 1 else (*shape, components), dtype)

    def per_triangle(self, table: NDArray[np.int32], empty: int) -> NDArray[np.int32]:
        """An int32 channel: the table's number for the seen triangle, 0 beyond the table's end, `empty` where nothing is
        seen.
        """
        from viewsphere.truth.raster import kernels_channels as kernels

        out = self.empty(np.int32)
        kernels.labels(self.visibility.triangle, table, np.int32(empty), out)
        return out
