"""Per-pixel labels of one frame, computed from the visibility buffer."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.camera import inverse_camera_matrix
from viewsphere.model.camera import Camera
from viewsphere.model.channel import CHANNELS
from viewsphere.truth.geometry import Geometry
from viewsphere.truth.visibility import Visibility, homogeneous, lens_rays

Array = NDArray[Any]


def observe(geometry: Geometry, camera: Camera, visibility: Visibility, names: Iterable[str]) -> dict[str, Array]:
    """The named channels of this view, each (H, W) or (H, W, 3) as its row of `model.channel.CHANNELS` says.

    `visibility` is `rasterize(geometry, camera)`. All channels but rgb: `depth` (z; behind a fisheye it is negative),
    `instances`, `categories`, `parts`, `triangles` (index within its object; -1 on scenery and ground), `normals`
    (interpolated, on the visible side of its triangle, and bent to at most perpendicular to the ray where interpolation turns
    it away), `normals_geometric`, `coordinates` (NaN on scenery and ground), `barycentrics`. `instances` are those that the
    visibility keeps, so not to be written to. Raises ValueError for other names.
    """
    view, names = _View(geometry, camera, visibility), tuple(names)
    unknown = [name for name in names if name not in _CHANNELS]
    if unknown:
        raise ValueError(f"channel {unknown[0]!r}: expected one of {', '.join(_CHANNELS)}")
    return {name: _CHANNELS[name](view) for name in names}


@dataclass(frozen=True, eq=False)
class _View:
    """What the channels of one frame share, computed when first asked for."""

    geometry: Geometry
    camera: Camera
    visibility: Visibility

    @cached_property
    def rays(self) -> NDArray[np.float64]:
        rays = lens_rays(self.camera)
        if rays is None:
            rays = np.empty((0, 0, 3))
            rays.setflags(write=False)  # as a lens' are: the kernels are compiled once for both
        return rays

    @cached_property
    def q(self) -> NDArray[np.float64]:
        return homogeneous(self.geometry, self.camera) if self.visibility.corners is None else self.visibility.corners

    @cached_property
    def camera_from_p(self) -> NDArray[np.float64]:
        """Camera axes of a sample's ray p: K^-1 for a pinhole, whose p is a pixel."""
        return inverse_camera_matrix(self.camera.intrinsics) if self.camera.distortion is None else np.eye(3)

    def empty(self, name: str) -> Array:
        return np.empty(CHANNELS[name].shape(*self.visibility.triangle.shape), CHANNELS[name].dtype)


def _depth(view: _View) -> Array:
    from viewsphere.truth import kernels_channels as kernels

    out = view.empty("depth")
    kernels.depths(view.visibility.inverse_depth, view.rays, out)
    return out


def _labels(view: _View, name: str, table: NDArray[np.int32]) -> Array:
    from viewsphere.truth import kernels_channels as kernels

    out = view.empty(name)
    kernels.labels(view.visibility.triangle, table, np.int32(CHANNELS[name].empty), out)
    return out


def _triangles(view: _View) -> Array:
    g = view.geometry
    index = np.full(len(g.triangles), -1, np.int32)
    for first, last in pairwise(g.triangle_start[: g.object_count + 1]):
        index[first:last] = np.arange(last - first)
    return _labels(view, "triangles", index)


def _normals(view: _View) -> Array:
    from viewsphere.truth import kernels_channels as kernels

    out, g = view.empty("normals"), view.geometry
    kernels.normals_shading(
        view.visibility.triangle, g.triangles, view.q, view.rays, g.normals, g.triangle_side, g.triangle_normals,
        view.camera_from_p, view.camera.R, out,
    )  # fmt: skip
    return out


def _normals_geometric(view: _View) -> Array:
    from viewsphere.truth import kernels_channels as kernels

    out, g = view.empty("normals_geometric"), view.geometry
    kernels.normals_geometric(view.visibility.triangle, g.triangle_normals, view.rays, view.camera_from_p, view.camera.R, out)
    return out


def _coordinates(view: _View) -> Array:
    from viewsphere.truth import kernels_channels as kernels

    out, g = view.empty("coordinates"), view.geometry
    kernels.coordinates(view.visibility.triangle, g.triangles, g.triangle_object, view.q, view.rays, g.coordinates, out)
    return out


def _barycentrics(view: _View) -> Array:
    from viewsphere.truth import kernels_channels as kernels

    out = view.empty("barycentrics")
    kernels.barycentrics(view.visibility.triangle, view.geometry.triangles, view.q, view.rays, out)
    return out


_CHANNELS: dict[str, Callable[[_View], Array]] = {
    "depth": _depth,
    "instances": lambda view: view.visibility.instances(view.geometry).ids,
    "categories": lambda view: _labels(view, "categories", view.geometry.triangle_category),
    "parts": lambda view: _labels(view, "parts", view.geometry.triangle_part),
    "normals": _normals,
    "normals_geometric": _normals_geometric,
    "coordinates": _coordinates,
    "triangles": _triangles,
    "barycentrics": _barycentrics,
}
