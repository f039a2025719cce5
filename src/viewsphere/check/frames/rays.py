"""An independent check: Embree casts rays at the exported models, read by trimesh, and at the remade scenery."""

from __future__ import annotations

from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import Mesh
from viewsphere.errors import MissingExtraError
from viewsphere.files import read_bytes
from viewsphere.geometry.camera import pixel_rays
from viewsphere.geometry.rotation import transform
from viewsphere.model.sample import Sample
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.sensors.rolling import RowPoses
from viewsphere.model.thing import Thing
from viewsphere.run.shots.composing import SceneryRecord
from viewsphere.run.shots.scenery import Scenery
from viewsphere.store import Dataset, depth_step
from viewsphere.store.samples.channel_files import MOST_STEPS
from viewsphere.truth.raster.visibility import EDGE_ON

Float = NDArray[np.float64]

PIXELS = 5000
"""Number of rays per frame at objects, spread evenly over their pixels, and also at the background."""

TOLERANCE = 1e-4
"""Share of the distance by which Embree's float32 and the stored depth may differ."""

LEVEL = 1e-5
"""Slope of a ray, and height above the ground in metres, up to which rounding decides whether ray and ground meet."""

BEYOND = 1e-6
"""Share of the distance, and of a metre, by which a ray restarts behind a back face: a few rounding errors of float32."""

OUTLIERS = 0.01
"""Share of the pixels that may differ, where a ray meets a triangle at a grazing angle or within rounding of its edge."""


@dataclass(frozen=True, eq=False)
class _Soup:
    """Triangles (T, 3, 3) of one thing, with masks (T,) bool of the opaque ones and of those that cameras see only from the
    front.
    """

    corners: Float
    opaque: NDArray[np.bool_]
    single: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class _Placed:
    """One thing: its object's id, 0 for scenery; its position in the shot; its pose (4, 4), world from thing; its triangles."""

    id: int
    position: int
    world: Float
    soup: _Soup


@dataclass(frozen=True, eq=False)
class _Target:
    """A scene of Embree, and normals (T, 3) of its single-sided triangles, 0 for the others."""

    scene: Any
    fronts: Float


@dataclass(frozen=True, eq=False)
class _Part:
    """Triangles that move together, as two scenes: of those that hide others, and of the others; and their objects' ids.

    A surface is in one of both, as a scene of all, beside that of what hides others, would take twice as long to make.
    `position` is that of a thing that moves while the rows of a rolling shutter are exposed, None for all others together.
    """

    position: int | None
    now: Float
    solid: _Target | None
    clear: _Target | None
    owners: tuple[NDArray[np.int64], NDArray[np.int64]]


@dataclass(frozen=True, eq=False)
class _Rays:
    """Rays (n,) in the world, relative to the middle: where they begin, their directions, and the rows of their pixels."""

    origins: Float
    directions: Float
    row: NDArray[np.intp]
    rows: RowPoses | None

    def further(self, away: Float) -> _Rays:
        """The rays, which begin later."""
        return replace(self, origins=self.origins + away[:, None] * self.directions)

    def at_rest(self, part: _Part, middle: Float) -> tuple[Float, Float]:
        """Origins and directions as the part sees them, which stands where it is at the instant."""
        if self.rows is None or part.position is None:
            return self.origins, self.directions
        poses = self.rows.moving[part.position][self.row]
        turned = part.now[:3, :3] @ poses[:, :3, :3].swapaxes(1, 2)
        begin = self.origins + middle - poses[:, :3, 3]
        return (turned @ begin[..., None])[..., 0] + part.now[:3, 3] - middle, (turned @ self.directions[..., None])[..., 0]


@dataclass(frozen=True, eq=False)
class _Depth:
    """The stored depth (H, W) of a frame, metres, rounded by at most `rounded`; `rays` (H, W, 3) of its pixels, and `scale`
    (H, W), the depth of the point at the end of each ray.
    """

    rays: Float
    stored: NDArray[np.float32]
    scale: Float
    rounded: float


def depth_of(channels: Container[str]) -> str | None:
    """The channel whose distances rays prove: `depth`, or `depth_ray` of lenses without it; None without either, or without
    the instances.
    """
    found = next((name for name in ("depth", "depth_ray") if name in channels), None)
    return found if "instances" in channels else None


class RayCaster:
    """Casts rays at a data set's scenes; the last one is kept, because frames of one scene follow one another.

    Background scenery is remade from its shot; if that fails, only objects are checked.
    """

    def __init__(self, dataset: Dataset, scenery: Scenery) -> None:
        if find_spec("embreex") is None or find_spec("trimesh") is None:
            raise MissingExtraError("expected embreex and trimesh, found none: pip install 'viewsphere[check]'")
        self._dataset, self._scenery = dataset, scenery
        self._files = {info.key: (dataset.path(info.glb), info.node, info.faces is not None) for info in dataset.models}
        self._known: dict[str, _Soup] = {}
        self._around: dict[str, _Soup | None] = {}
        self._key: object = None
        self._parts: tuple[_Part, ...] = ()
        self._middle = np.zeros(3)
        self._lowest = 0.0
        self._has_ground = False
        self._complete = True

    def off_surface(self, sample: Sample) -> Iterator[str]:
        """Yield the contradictions between stored depth (see `depth_of`) and instances, and the models as Embree sees them.

        Each point must be on the right object, and no opaque surface may be in front of it. A point of the background must be
        on scenery or the ground, which is at the lowest point of all (or lower, if the shot sets this). Empty pixels must show
        nothing, not even the ground.
        """
        if not sample.objects:
            return
        self._build(sample)
        name = depth_of(sample.files)
        assert name is not None
        instances, stored = sample.channels["instances"], sample.channels[name]
        rays = pixel_rays(sample.camera.intrinsics)
        scale = rays[..., 2] if name == "depth" else np.linalg.norm(rays, axis=-1)
        step = depth_step(self._dataset.read(sample.files[name])) / 2
        castable = (np.abs(scale) > 1e-3) & ((step == 0) | np.isinf(stored) | (stored < (MOST_STEPS - 0.5) * 2 * step))
        depth = _Depth(rays, stored, scale, step)
        of_objects = castable & (instances > 0) & np.isfinite(stored)
        yield from self._off(sample, depth, of_objects, "points are not on the exported model")
        if self._complete:
            rest = castable & (instances == 0)
            yield from self._off(sample, depth, rest, "points of the background are not where scenery and ground are")

    def _off(self, sample: Sample, depth: _Depth, asked: NDArray[np.bool_], what: str) -> Iterator[str]:
        """Findings at the selected pixels."""
        rows, columns = np.nonzero(asked)
        if not len(rows):
            return
        chosen = np.linspace(0, len(rows) - 1, min(PIXELS, len(rows))).astype(int)
        rows, columns = rows[chosen], columns[chosen]
        ids, scale = sample.channels["instances"][rows, columns], depth.scale[rows, columns]
        directions = _turned(sample.camera, depth.rays[rows, columns], rows)
        s = depth.stored[rows, columns] / scale
        slack = TOLERANCE * np.abs(np.where(np.isfinite(s), s, 0.0)) + depth.rounded / np.abs(scale)
        eye = self._eyes(sample)[rows, columns]
        start = np.where(np.isfinite(s), s - slack, 0.0)
        rays = _Rays(eye, directions, rows, sample.camera.rows)
        found, owner = self._nearest(rays.further(start))
        found = found + start
        first = np.min([_cast(part.solid, *rays.at_rest(part, self._middle))[0] for part in self._parts], axis=0)
        with np.errstate(invalid="ignore"):
            there = (np.abs(found - s) <= slack) & (owner == ids)
            height = (eye + s[:, None] * directions)[:, 2]
            off = np.abs(height - self._lowest)
            on_ground = np.isfinite(s) & (off <= slack * np.maximum(1.0, np.abs(directions[:, 2])))
        there |= (ids == 0) & on_ground & (not self._is_in_ground(sample.camera))
        there |= np.isinf(s) & (ids == 0) & ~self._meets_ground(eye, directions, scale > 0)
        wrong = ~there | (first < np.where(np.isfinite(s), s - slack, np.inf))
        if wrong.sum() > max(2, OUTLIERS * len(s)):
            i = int(np.flatnonzero(wrong)[0])
            nearest = min(found[i], first[i])
            yield (
                f"{wrong.sum()} of {len(s)} {what}: at pixel ({columns[i]}, {rows[i]}) object {ids[i]} is "
                f"stored at {s[i]:.6g} m along the ray, Embree finds {max(owner[i], 0)} at {nearest:.6g} m"
            )

    def _eyes(self, sample: Sample) -> Float:
        """Places (H, W, 3) where the rays of pixels begin, relative to the middle."""
        camera = sample.camera
        if camera.rows is not None:
            centers = -np.einsum("hji,hj->hi", camera.rows.rotation, camera.rows.translation)
            return np.broadcast_to((centers - self._middle)[:, None], (camera.height, camera.width, 3))
        if not camera.lens.is_parallel:
            return np.broadcast_to(camera.center - self._middle, (camera.height, camera.width, 3))
        return camera.center - self._middle + transform(camera.R.T, camera.lens.origins())

    def _nearest(self, rays: _Rays) -> tuple[Float, NDArray[np.int64]]:
        """Distance along each ray (infinite if nothing is hit) and the id of the hit object, 0 for scenery, -1 for none."""
        nearest, owner = np.full(len(rays.row), np.inf), np.full(len(rays.row), -1, np.int64)
        for part in self._parts:
            seen = rays.at_rest(part, self._middle)
            for target, owners in zip((part.solid, part.clear), part.owners, strict=True):
                distance, triangle = _cast(target, *seen)
                is_nearer = distance < nearest
                nearest[is_nearer], owner[is_nearer] = distance[is_nearer], np.append(owners, -1)[triangle[is_nearer]]
        return nearest, owner

    def _is_in_ground(self, camera: Camera) -> bool:
        """Return whether the camera is in the plane of the ground, or its parallel rays are along it: it sees no ground."""
        if camera.lens.is_parallel:
            return bool(abs(camera.R[2, 2]) <= EDGE_ON)
        height = camera.center[2] - self._middle[2] - self._lowest
        return bool(abs(height) <= EDGE_ON * (1.0 + float(np.linalg.norm(camera.center))))

    def _meets_ground(self, eye: Float, directions: Float, ahead: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return a mask of the rays that certainly meet the ground; not all files store the depth of rays that point
        backwards.
        """
        height = eye[:, 2] - self._lowest
        steep = np.abs(directions[:, 2]) > LEVEL
        return ahead & steep & (directions[:, 2] * height < 0) & (np.abs(height) > LEVEL) & self._has_ground

    def _build(self, sample: Sample) -> None:
        shot_key = self._scenery.key_of(sample.index)
        scenery, shot = self._scenery.around(shot_key), self._scenery.shot(shot_key)
        floor = None if shot is None else shot.scene.floor
        ground = None if shot is None else shot.scene.ground
        self._has_ground = ground is not None and ground.is_labelled
        instant = 0 if shot is None else self._scenery.position(sample, shot)[0]
        pieces = enumerate((piece.still_at(instant) for piece in scenery.things), 0 if shot is None else len(shot.objects))
        behind = [(i, thing) for i, thing in pieces if thing.is_there]
        rows = sample.camera.rows
        moving = frozenset[int]() if rows is None else frozenset(rows.moving)
        key = [(o.key, o.world_from_object.tobytes()) for o in sample.objects], behind, scenery, floor, moving
        if key == self._key:
            return
        self._middle = np.mean([o.box3d.mean(axis=0) for o in sample.objects] or [np.zeros(3)], axis=0)
        placed = [_Placed(o.id, o.id - 1, o.world_from_object, self._exported(o.key)) for o in sample.objects]
        remade = [(i, p.world_from_object, self._remade(scenery, p)) for i, p in behind]
        self._complete = all(soup is not None for _, _, soup in remade)
        placed += [_Placed(0, i, np.array(world), soup) for i, world, soup in remade if soup is not None]
        still = [one for one in placed if one.position not in moving]
        alone = (([one], one.position) for one in placed if one.position in moving)
        made = [self._part(group, position) for group, position in ((still, None), *alone)]
        self._parts = tuple(part for part, _ in made)
        lowest = min(height for _, height in made)
        self._lowest = lowest if floor is None else floor.under(lowest + self._middle[2]) - self._middle[2]
        self._key = key

    def _part(self, placed: Sequence[_Placed], position: int | None) -> tuple[_Part, float]:
        """Things that move together, and the height of their lowest point."""
        nothing = np.zeros((0, 3, 3))
        corners = np.concatenate([nothing, *(transform(one.world, one.soup.corners) - self._middle for one in placed)])
        opaque = np.concatenate([np.zeros(0, np.bool_), *(one.soup.opaque for one in placed)])
        single = np.concatenate([np.zeros(0, np.bool_), *(one.soup.single for one in placed)])
        counts = [len(one.soup.corners) for one in placed]
        owner = np.repeat(np.array([one.id for one in placed], np.int64), counts)
        now = np.eye(4) if position is None else placed[0].world
        targets = _target(corners, single, opaque), _target(corners, single, ~opaque)
        return _Part(position, now, *targets, (owner[opaque], owner[~opaque])), float(corners[..., 2].min(initial=np.inf))

    def _exported(self, key: str) -> _Soup:
        soup = self._known.get(key) or _read(*self._files[key])
        self._known[key] = soup
        return soup

    def _remade(self, record: SceneryRecord, thing: Thing) -> _Soup | None:
        """A piece of scenery, None if it has changed."""
        digest = record.digests[thing.key]
        if digest not in self._around:
            mesh = self._scenery.mesh(record, thing)
            self._around[digest] = mesh and _soup_of(mesh)
        return self._around[digest]


def _turned(camera: Camera, rays: Float, rows: NDArray[np.intp]) -> Float:
    """Directions (n, 3) in the world of rays in the camera's axes, through pixels in these rows."""
    if camera.rows is None:
        return rays @ camera.R
    return (rays[:, None] @ camera.rows.rotation[rows])[:, 0]


def _soup_of(mesh: Mesh) -> _Soup:
    solid = np.array([m.alpha_mode == "OPAQUE" for m in mesh.materials])
    corners = mesh.vertices[mesh.triangles].astype(np.float64)
    return _Soup(corners, solid[mesh.triangle_material], np.zeros(len(corners), np.bool_))


def _target(corners: Float, single: NDArray[np.bool_], chosen: NDArray[np.bool_]) -> _Target | None:
    """The chosen ones of triangles (T, 3, 3), None if there are none."""
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    if not chosen.any():
        return None
    scene = EmbreeScene(robust=True)
    target_corners = corners[chosen]
    TriangleMesh(scene, target_corners.astype(np.float32))
    a, b, c = (target_corners[:, i] for i in range(3))
    return _Target(scene, np.where(single[chosen, None], np.cross(b - a, c - a), 0.0))


def _cast(target: _Target | None, origins: Float, directions: Float) -> tuple[Float, NDArray[np.int64]]:
    """Distance along each ray (infinite where nothing is hit) and triangle (-1); rays pass the backs of single-sided ones."""
    distance, triangle = np.full(len(origins), np.inf), np.full(len(origins), -1, np.int64)
    if target is None:
        return distance, triangle
    left, passed = np.arange(len(origins)), np.zeros(len(origins))
    while len(left):
        start = origins[left] + passed[left, None] * directions[left]
        hit = target.scene.run(start.astype(np.float32, order="C"), directions[left].astype(np.float32), output=True)
        met = np.asarray(hit["primID"], np.int64)
        further = np.where(met < 0, np.inf, np.asarray(hit["tfar"], np.float64))
        distance[left], triangle[left] = passed[left] + further, met
        is_back = (met >= 0) & ((target.fronts[met] * directions[left]).sum(axis=1) > 0)
        left, further = left[is_back], further[is_back]
        passed[left] += further + BEYOND * (1 + np.abs(start[is_back]).max(axis=1, initial=0) + further)
    return distance, triangle


def _read(file: Path, step: str | None, fronts_only: bool) -> _Soup:
    """An exported GLB in the object's axes; of a deforming model, the mesh below a time step's node. With `fronts_only`,
    cameras do not see the backs of single-sided materials.
    """
    import trimesh

    scene: Any = trimesh.load_scene(BytesIO(read_bytes(file, "MAX_FILE_BYTES")), file_type="glb", process=False)
    corners: list[Float] = []
    opaque: list[NDArray[np.bool_]] = []
    single: list[NDArray[np.bool_]] = []
    shown = scene.graph.transforms.successors(step or scene.graph.base_frame)
    for name in filter(shown.__contains__, scene.graph.nodes_geometry):
        matrix, geometry = scene.graph.get(name, step)
        mesh = scene.geometry[geometry]
        x, y, z = (trimesh.transform_points(mesh.vertices, matrix)).T
        corners.append(np.stack([x, -z, y], axis=-1)[mesh.faces])
        material = getattr(mesh.visual, "material", None)
        opaque.append(np.full(len(mesh.faces), getattr(material, "alphaMode", None) in (None, "OPAQUE")))
        single.append(np.full(len(mesh.faces), fronts_only and not getattr(material, "doubleSided", True)))
    return _Soup(np.concatenate(corners), np.concatenate(opaque), np.concatenate(single))
