"""Point clouds: the surfaces in the pixels of a sample, as points with colours and labels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import UserError
from viewsphere.geometry.camera import pixel_rays
from viewsphere.geometry.rotation import transform
from viewsphere.model.channel import PICTURES
from viewsphere.model.sensors.camera import Camera
from viewsphere.validation.errors import one_of

Float = NDArray[np.float64]
Channels = Mapping[str, NDArray[Any]]
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
    def from_channels(
        cls, channels: Channels, camera: Camera, categories: Mapping[int, int], axes: Axes, surface: Surface
    ) -> PointCloud:
        """Return the points of a camera's channels; see `Sample.point_cloud`. `categories`: of the objects, by their ids.

        Raises ValueError for a missing channel.
        """
        for name, value, known in (("axes", axes, get_args(Axes)), ("surface", surface, get_args(Surface))):
            if value not in known:
                raise UserError(f"point_cloud: {name}: {one_of(value, known)}")
        cloud = (_complete if surface == "complete" else _visible)(channels, camera, categories)
        return cloud._in_world(camera) if axes == "world" else cloud

    def _in_world(self, camera: Camera) -> PointCloud:
        """The point cloud in the world's axes, converted from the camera's."""
        normals = None if self.normals is None else transform(camera.R.T, self.normals).astype(np.float32)
        points = transform(camera.R.T, self.points - camera.t)
        return PointCloud("world", points, self.visible, self.colors, normals, self.instances, self.categories)


def _visible(channels: Channels, camera: Camera, categories: Mapping[int, int]) -> PointCloud:
    """A point for each pixel that shows a surface, row by row."""
    rays = pixel_rays(camera.intrinsics)
    if "depth_ray" in channels:
        lengths = _needed(channels, "depth_ray").astype(np.float64)
        if not camera.lens.has_unit_rays:
            lengths = lengths / np.sqrt((rays * rays).sum(axis=-1))
    else:
        with np.errstate(divide="ignore"):
            lengths = _needed(channels, "depth").astype(np.float64) / rays[..., 2]
    seen = np.isfinite(lengths) & np.isfinite(rays).all(axis=-1)
    picture = next((name for name in PICTURES if name in channels), None)
    return PointCloud(
        "camera",
        camera.lens.origins()[seen] + rays[seen] * lengths[seen][:, None],
        np.ones(int(seen.sum()), np.bool_),
        channels[picture][seen][:, :3] if picture else None,
        _taken(channels, "normals", seen),
        *_labels(categories, _taken(channels, "instances", seen)),
    )


def _complete(channels: Channels, camera: Camera, categories: Mapping[int, int]) -> PointCloud:
    """The points of `surface_samples`, visible or not; hidden points have no colours."""
    rows = _needed(channels, "surface_samples")
    points, normals = transform(camera.R, rows["point"]) + camera.t, transform(camera.R, rows["normal"])
    ids = np.ascontiguousarray(rows["object"])
    return PointCloud("camera", points, rows["state"] == VISIBLE, None, normals.astype(np.float32), *_labels(categories, ids))


def _labels(
    categories: Mapping[int, int], instances: NDArray[Any] | None
) -> tuple[NDArray[np.int32], NDArray[np.int32]] | tuple[None, None]:
    """The object and the category of each point."""
    if instances is None:
        return None, None
    table = np.zeros(max([int(instances.max(initial=0)), *categories], default=0) + 1, np.int32)
    for number, category in categories.items():
        table[number] = category
    return instances.astype(np.int32), table[instances]


def _taken(channels: Channels, name: str, seen: NDArray[np.bool_]) -> NDArray[Any] | None:
    return channels[name][seen] if name in channels else None


def _needed(channels: Channels, name: str) -> NDArray[Any]:
    if name not in channels:
        raise ValueError(f"expected the channel {name}, found none: add it to the recipe's channels")
    return channels[name]
