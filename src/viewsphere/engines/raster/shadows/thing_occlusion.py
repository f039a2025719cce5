"""Ambient occlusion of a sequence: baked once for each target, for all of its places and copies, and moved along with it.

The baked data of a target depends on its mesh and, roughly, on which of its sides is up, but not on an instant or another
target. So the pictures are the same however a sequence is cut into shots.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from operator import is_

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import Mesh
from viewsphere.engines.raster.records import Float32
from viewsphere.engines.raster.shadows.kernels_occlusion import CLEAR
from viewsphere.engines.raster.shadows.occlusion import (
    NO_OCCLUSION,
    Fineness,
    Hidden,
    Occlusion,
    Quality,
    hidden_by,
    joined,
    joined_volumes,
)
from viewsphere.engines.raster.shadows.shadow_maps import Casters, Extent
from viewsphere.engines.shared.arranged import Arranged
from viewsphere.geometry.rotation import product, transform
from viewsphere.model.scene import Matrix4
from viewsphere.model.thing import Repaint

Float = NDArray[np.float64]

MOST = 64
"""Number of targets, each in some tilt, that are cached: 2 MB each."""

MOST_CELLS, ALL_CELLS = 60_000, 2_000_000
"""Maximum number of cells of a target's volume, and of the volumes of all targets."""

MAPS, ALL_TEXELS = (128, 96, 64, 48), 65_536
"""Cells of a target's map of the ground in each direction; and the maximum for all targets, unless even the smallest maps
exceed it.
"""

TILTS = 4
"""Steps to which a target's up direction is rounded, from level to vertical."""

Key = tuple[Mesh, tuple[Repaint, ...], tuple[float, float, float]]


@dataclass(frozen=True, eq=False)
class TargetShades:
    """Bakes the occlusion by each target of a sequence; the latest `MOST` are cached."""

    _known: dict[Key, Hidden] = field(default_factory=dict[Key, Hidden])
    _joined: list[tuple[tuple[Float32, ...], Float32]] = field(default_factory=list[tuple[tuple[Float32, ...], Float32]])

    def bake(self, arranged: Arranged, casters: Casters, unit: float, has_ground: bool, quality: Quality) -> Occlusion:
        """Return the occlusion by targets at their places, in a stage with the world's origin and this unit in metres.

        The light of lamps and sky is not included yet: `with_ground_light` adds it.
        """
        if quality == "off":
            return NO_OCCLUSION
        fineness = _fineness(arranged, quality)
        hidden: list[Hidden] = []
        poses = list[Float]()
        for i in _casting(arranged):
            own = self._hidden(arranged, i, casters, unit, has_ground, fineness)
            pose = _levelled(arranged.things[i].world_from_object, unit)
            height = None if arranged.has_scenery else casters.extent.ground_z
            own = own if height is None else _hovering(own, pose, height)
            hidden.append(own)
            poses.append(pose)
        return joined(hidden, poses, _reach(hidden, np.array(poses)), self._volume(hidden)) if hidden else NO_OCCLUSION

    def _volume(self, hidden: Sequence[Hidden]) -> Float32:
        """The volumes of all of them, which are the same at most instants."""
        volumes = tuple({id(each.volume): each.volume for each in hidden}.values())
        if not (self._joined and len(volumes) == len(self._joined[0][0]) and all(map(is_, volumes, self._joined[0][0]))):
            self._joined[:] = [(volumes, joined_volumes(volumes))]
        return self._joined[0][1]

    def _hidden(
        self, arranged: Arranged, i: int, casters: Casters, unit: float, has_ground: bool, fineness: Fineness
    ) -> Hidden:
        thing, mesh = arranged.things[i], arranged.known[i]
        up = _rounded_up(thing.world_from_object)
        key = mesh, thing.repaints, up
        found = self._known.pop(key, None)
        if found is None:
            stands = casters.extent.ground_z is not None
            found = hidden_by(_alone(arranged, i, casters, _leveller(up), unit, stands), has_ground, fineness)
        self._known[key] = found  # the most recently used comes last
        if len(self._known) > MOST:
            del self._known[next(iter(self._known))]
        return found


def _casting(arranged: Arranged) -> Iterator[int]:
    """Yield the indices of the targets that are present and have a size."""
    for i in range(arranged.targets):
        low, high = arranged.geometry.bounds[i]
        if arranged.things[i].is_there and (high - low).max() > 0:
            yield i


def _fineness(arranged: Arranged, quality: Quality) -> Fineness:
    """The fineness, which is the same at all instants of a sequence."""
    count, fine = max(arranged.targets, 1), "fine" if quality == "fine" else "fast"
    size = next((n for n in MAPS if count * n**2 <= ALL_TEXELS), MAPS[-1])
    return Fineness(fine, min(MOST_CELLS, ALL_CELLS // count), size, count > 1 or arranged.has_scenery)


def _rounded_up(world_from_object: Matrix4) -> tuple[float, float, float]:
    """Return the up direction in a target's own axes, rounded to one of a few unit vectors."""
    up = np.rint(np.array(world_from_object[2][:3]) * TILTS)
    x, y, z = (up / np.sqrt((up * up).sum())).tolist()
    return x, y, z


def _leveller(up: tuple[float, float, float]) -> Float:
    """The smallest rotation (3, 3) that moves a unit vector to the vertical."""
    x, y, z = up
    if z < -1 + 1e-9:
        return np.diag([1.0, -1.0, -1.0])
    k = 1 / (1 + z)
    return np.array([[1 - k * x * x, -k * x * y, -x], [-k * x * y, 1 - k * y * y, -y], [x, y, z]])


def _levelled(world_from_object: Matrix4, unit: float) -> Float:
    """Stage from the axes of baking (4, 4), in units: only a rotation, almost about the vertical, remains of a pose."""
    pose, level = np.array(world_from_object), _leveller(_rounded_up(world_from_object))
    pose[:3, :3] = transform(pose[:3, :3], level)  # of rows of the leveller, which are columns of its inverse
    pose[:3, :3] = pose[:3, :3].T
    pose[:3, 3] /= unit
    return pose


def _alone(arranged: Arranged, i: int, casters: Casters, level: Float, unit: float, stands: bool) -> Casters:
    """A target alone in the axes of baking, in units, with the surface below it at its lowest point, if there is one."""
    geometry, surfaces, mesh = arranged.geometry, casters.surfaces, arranged.known[i]
    vertices = surfaces.vertices[geometry.vertex_start[i] : geometry.vertex_start[i + 1]].copy()
    vertices[:, :3] = transform(level, np.nan_to_num(mesh.normals))
    vertices[:, 11:14] = transform(level / unit, mesh.vertices)
    rows = slice(geometry.triangle_start[i], geometry.triangle_start[i + 1])
    placed = vertices[:, 11:14][np.unique(mesh.triangles)].astype(np.float64)
    low, high = placed.min(axis=0), placed.max(axis=0)
    extent = Extent(low, high, float(low[2]) if stands else None, len(mesh.triangles), float(np.abs(placed).max()))
    triangles, normals = mesh.triangles.astype(np.uint32), surfaces.normals[rows]
    part = surfaces._replace(vertices=vertices, triangles=triangles, material=surfaces.material[rows], normals=normals)
    return Casters(part, casters.textures, extent)


def _hovering(hidden: Hidden, pose: Float, ground: float) -> Hidden:
    """The occlusion above a ground of this height: like a disc of the same size, the target hides less the higher it is."""
    _, left, _, z, height = (float(v) for v in hidden.floor_frame[:5])
    radius = len(hidden.floor) / float(hidden.floor_frame[0]) / 2 - 0.9 * height
    above = max(float(transform(pose, [left + radius, left + radius, z])[2]) - ground, 0.0)
    share = radius**2 / (radius**2 + above**2)
    return hidden._replace(floor=1 - (1 - hidden.floor) * np.float32(share))


def _reach(hidden: Sequence[Hidden], poses: Float) -> Float:
    """Lowest and highest x, y, z in the stage of the region that each of these occludes in its pose, (N, 6)."""
    which = np.indices((2, 2, 2)).reshape(3, 8).T
    corners = np.array([_span(own) for own in hidden])[:, which, np.arange(3)]
    placed = product(poses[:, :3, :3], corners.transpose(0, 2, 1)) + poses[:, :3, 3:]
    return np.stack([placed.min(axis=2), placed.max(axis=2)], axis=2).reshape(-1, 6)


def _span(hidden: Hidden) -> tuple[list[float], list[float]]:
    """Lowest and highest x, y, z of the occluded region, in the axes of baking."""
    *low, cells = (float(v) for v in hidden.frame[:4])
    high = [at + (points - 1) / cells for at, points in zip(low, hidden.volume.shape[2::-1], strict=True)]
    per, left, front, z, height, stands = (float(v) for v in hidden.floor_frame[:6])
    if stands:
        size, slack = len(hidden.floor) / per, 0.35 * height
        low = list(map(min, low, (left, front, z - slack)))
        high = list(map(max, high, (left + size, front + size, z + (CLEAR + 1) * slack)))
    return low, high
