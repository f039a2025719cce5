"""normals and normals_geometric: the direction that the seen surface faces, as shaded and from its triangle."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from viewsphere.labels.shared.spec import Array, ChannelLabel, Drawing, Models, Picture, channel_of
from viewsphere.model.sample import Sample

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import LabelContext

TOLERANCE = 1e-5
"""Tolerated difference of a stored float32 direction's length from 1; rounding alone gives about 1e-7."""


def _shading_normals(context: LabelContext) -> NDArray[np.float32]:
    """Interpolated vertex normals (H, W, 3) on the visible side of their triangle, bent to at most perpendicular to the ray
    where interpolation turns them away.
    """
    from viewsphere.truth.raster import kernels_channels as kernels

    out, shown = context.empty(np.float32, 3), context.shown
    g, rotation = context.geometry, shown.rotation(context.camera)
    normals, own = shown.directions_of_vertices(g.normals), shown.directions_of_triangles(g.triangle_normals)
    kernels.normals_shading(
        shown.seen, shown.triangles, shown.corners, context.rays, normals, shown.of_triangles(g.triangle_side), own,
        context.camera_from_ray, rotation, out,
    )  # fmt: skip
    return out


def _triangle_normals(context: LabelContext) -> NDArray[np.float32]:
    """The triangle's normal (H, W, 3) in camera axes, towards the camera; 0 where nothing is seen."""
    from viewsphere.truth.raster import kernels_channels as kernels

    out, shown = context.empty(np.float32, 3), context.shown
    own, rotation = shown.directions_of_triangles(context.geometry.triangle_normals), shown.rotation(context.camera)
    kernels.normals_geometric(shown.seen, own, context.rays, context.camera_from_ray, rotation, out)
    return out


def _prove(sample: Sample, name: str) -> Iterator[str]:
    """Directions are unit vectors, or 0 where nothing is seen."""
    array = channel_of(sample, name)
    if array is None:
        return
    square = np.einsum("...k,...k", array, array)
    wrong = ~((np.abs(square - 1) < 2 * TOLERANCE) | (square == 0))
    if wrong.any():
        yield f"expected directions of length 1, or 0 where there is none; found others at {wrong.sum()} pixels"


def _picture(normals: Array) -> Picture:
    """Normals as a picture (H, W, 3) uint8, as in normal maps: red to the right, green up, blue towards the camera."""
    right, down, away = np.moveaxis(normals.astype(np.float64), -1, 0)
    shares = (np.stack([right, -down, -away], axis=-1) + 1) / 2
    is_seen = (right != 0) | (down != 0) | (away != 0)
    return np.where(is_seen[..., None], shares * 255, 0).round().astype(np.uint8)


def _label(name: str, compute: Callable[[LabelContext], Array], what: str) -> ChannelLabel:
    """A channel of directions."""

    def prove(sample: Sample, models: Models) -> Iterator[str]:
        return _prove(sample, name)

    return ChannelLabel(
        name=name,
        meaning=f"{what} normal, camera axes, towards the camera",
        axes="camera",
        dtype=np.float32,
        components=3,
        compute=compute,
        prove=prove,
        drawing=Drawing(
            name,
            beside=lambda sample: _picture(sample.channels[name]),
            key=((f"{name}: red to the right, green up, blue towards the camera", None),),
        ),
    )


LABELS = (
    _label("normals", _shading_normals, "shading"),
    _label("normals_geometric", _triangle_normals, "triangle's"),
)
