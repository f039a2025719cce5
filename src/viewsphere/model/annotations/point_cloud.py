"""Point clouds: the surfaces in the pixels of a sample, as points with colours and labels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import StoreError, UserError
from viewsphere.geometry.camera import pixel_rays
from viewsphere.geometry.rotation import transform
from viewsphere.model.channel import picture_of
from viewsphere.model.sample import Sample
from viewsphere.validation.errors import one_of

Float = NDArray[np.float64]
Axes = Literal["camera", "world"]
Surface = Literal["visible", "complete"]

VISIBLE = 0
"""The state of visible `surface_samples`."""


@dataclass(frozen=True, eq=False)
class PointCloud:
    """Points of surfaces. Optional arrays are None if the sample lacks the channels that they come from.

    Attributes:
        axes: `camera` or `world`, the axes of points and normals.
        points: (N, 3) float64, metres.
        visible: (N,) bool, whether the camera sees the point.
        colors: (N, 3) uint8 sRGB.
        normals: (N, 3) float32, unit length, towards the camera.
        instances: (N,) int32, id of the object; 0 for none.
        categories: (N,) int32, number of the category; 0 for none.
    """

    axes: Axes
    points: Float
    visible: NDArray[np.bool_]
    colors: NDArray[np.uint8] | None = None
    normals: NDArray[np.float32] | None = None
    instances: NDArray[np.int32] | None = None
    categories: NDArray[np.int32] | None = None

    def __len__(self) -> int:
        return len(self.points)

    @classmethod
    def of(cls, sample: Sample, axes: Axes = "camera", surface: Surface = "visible") -> PointCloud:
        """Return the points of a sample; see `Sample.point_cloud`."""
        for name, value, known in (("axes", axes, get_args(Axes)), ("surface", surface, get_args(Surface))):
            if value not in known:
                raise UserError(f"point_cloud: {name}: {one_of(value, known)}")
        cloud = _complete(sample) if surface == "complete" else _visible(sample)
        return cloud.moved(sample) if axes == "world" else cloud

    def moved(self, sample: Sample) -> PointCloud:
        """The point cloud in the world's axes, converted from the axes of the sample's camera."""
        camera = sample.camera
        normals = None if self.normals is None else transform(camera.R.T, self.normals).astype(np.float32)
        points = transform(camera.R.T, self.points - camera.t)
        return PointCloud("world", points, self.visible, self.colors, normals, self.instances, self.categories)


def _visible(sample: Sample) -> PointCloud:
    """A point for each pixel that shows a surface, row by row."""
    rays = pixel_rays(sample.camera.intrinsics)
    if "depth_ray" in sample.channels:
        lengths = _needed(sample, "depth_ray").astype(np.float64)
        if not sample.camera.lens.has_unit_rays:
            lengths = lengths / np.sqrt((rays * rays).sum(axis=-1))
    else:
        with np.errstate(divide="ignore"):
            lengths = _needed(sample, "depth").astype(np.float64) / rays[..., 2]
    seen = np.isfinite(lengths) & np.isfinite(rays).all(axis=-1)
    picture = picture_of(sample.channels)
    return PointCloud(
        "camera",
        rays[seen] * lengths[seen][:, None],
        np.ones(int(seen.sum()), np.bool_),
        sample.picture[seen][:, :3] if picture else None,
        _taken(sample, "normals", seen),
        *_labels(sample, _taken(sample, "instances", seen)),
    )


def _complete(sample: Sample) -> PointCloud:
    """The points of `surface_samples`, visible or not; hidden points have no colours."""
    rows, camera = _needed(sample, "surface_samples"), sample.camera
    points, normals = transform(camera.R, rows["point"]) + camera.t, transform(camera.R, rows["normal"])
    ids = np.ascontiguousarray(rows["object"])
    return PointCloud("camera", points, rows["state"] == VISIBLE, None, normals.astype(np.float32), *_labels(sample, ids))


def _labels(sample: Sample, instances: NDArray[Any] | None) -> tuple[NDArray[np.int32], NDArray[np.int32]] | tuple[None, None]:
    """The object and the category of each point."""
    if instances is None:
        return None, None
    table = np.zeros(max([int(instances.max(initial=0)), *(o.id for o in sample.objects)], default=0) + 1, np.int32)
    for o in sample.objects:
        table[o.id] = o.category_id
    return instances.astype(np.int32), table[instances]


def _taken(sample: Sample, name: str, seen: NDArray[np.bool_]) -> NDArray[Any] | None:
    return sample.channels[name][seen] if name in sample.channels else None


def _needed(sample: Sample, name: str) -> NDArray[Any]:
    if name not in sample.channels:
        raise StoreError(f"frame {sample.index}: expected the channel {name}, found none: add it to the recipe's channels")
    return sample.channels[name]
