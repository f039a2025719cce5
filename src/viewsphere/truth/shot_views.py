"""The views of a shot's sensors at its instants, and the points that the sensors follow."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.appearance.repaint import textured
from viewsphere.assets.mesh import Mesh
from viewsphere.geometry.rotation import compose, inverse_pose, product
from viewsphere.model.annotations.tracks import TRACK, Tracks
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Finish, Ground, Matrix4
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.sensors.exposure import Sweep, beyond
from viewsphere.model.sensors.rig import Sensor
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Motion, Thing, TimeStep
from viewsphere.truth.lidar.sweeping import Turning
from viewsphere.truth.moving import ROOMS, Ring, shot_floor
from viewsphere.truth.raster.geometry import Geometry, without_ground
from viewsphere.truth.surface_points.draws import Drawn, points_on_model
from viewsphere.truth.surface_points.points import SurfacePoints, points_seen
from viewsphere.truth.view import View

Float = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Painted:
    """The appearance of surfaces: the things at an instant, with their meshes, and the ground (None without one).

    The meshes have the textures that the shot assigns to them.
    """

    things: Sequence[Thing]
    meshes: Sequence[Mesh]
    ground: Ground | None


NO_POINTS: Drawn = np.zeros(0, np.int64), np.zeros((0, 3))


@dataclass(frozen=True, eq=False)
class Followed:
    """Points that a sensor follows: query (N, 3) float64, the instant and the position (x, y) in pixels at which each was
    picked; object (N,) int32, the id of the object under it, 0 for none.
    """

    query: Float
    object: NDArray[np.int32]
    points: SurfacePoints

    @cached_property
    def rows(self) -> NDArray[np.void]:
        """The constant part of each point's track, (N,) of `viewsphere.model.annotations.tracks.TRACK`; the rest is 0."""
        out = np.zeros(len(self.query), TRACK)
        out["instant"], out["query"], out["object"] = self.query[:, 0], self.query[:, 1:], self.object
        return out


@dataclass(frozen=True, eq=False)
class ShotViews:
    """The views of a shot's sensors; instants count from 0 in the shot.

    `geometry_at` gives all triangles at an instant; the geometries of `truth.moving.ROOMS` instants exist at once. `mesh_of`
    gives a still thing's mesh with its full appearance, which few labels need.
    """

    shot: Shot
    geometry_at: Callable[[int], Geometry]
    mesh_of: Callable[[Thing], Mesh] | None = None
    _geometries: dict[int, tuple[Geometry, Geometry]] = field(default_factory=dict[int, "tuple[Geometry, Geometry]"])
    _views: dict[tuple[int, int], View] = field(default_factory=dict[tuple[int, int], View])
    _followed: dict[int, Followed] = field(default_factory=dict[int, Followed])
    _drawn: dict[tuple[ModelSpec, TimeStep | None, int], Drawn] = field(
        default_factory=dict[tuple[ModelSpec, "TimeStep | None", int], Drawn]
    )

    def labelled(self, instant: int) -> Geometry:
        """The triangles that labels use at an instant; a shadow catcher may be left out."""
        ground = self.shot.scene.ground
        whole = self.geometry_at(instant)
        if ground is None or ground.is_labelled:
            return whole
        known = self._geometries.pop(instant, None)
        if known is None or known[0] is not whole:
            known = whole, without_ground(whole)
        self._geometries[instant] = known
        while len(self._geometries) > ROOMS:
            del self._geometries[next(iter(self._geometries))]
        return known[1]

    def view(self, instant: int, sensor: int) -> View:
        """Return the view of a sensor at an instant; the latest views are cached."""
        geometry = self.labelled(instant)
        view = self._views.pop((instant, sensor), None)
        if view is None or view.geometry is not geometry:
            things = self.shot.things_at(instant)
            is_sky_endless, is_compared = self._is_sky_endless(instant), self._instants * self._sensors > 1
            view = View(things, geometry, self.shot.camera(instant, sensor), is_sky_endless, is_compared)
        self._views[instant, sensor] = view
        while len(self._views) > self._instants * self._sensors:
            del self._views[next(iter(self._views))]
        return view

    def keep(self, instants: Collection[int]) -> None:
        """Discard the cached views of all other instants, whose vertices take much memory."""
        for known in [known for known in self._views if known[0] not in instants]:
            del self._views[known]

    @property
    def _instants(self) -> int:
        """The number of instants whose views are cached at once; still pictures are not compared across instants."""
        return ROOMS if self.shot.sequence else 1

    @property
    def _sensors(self) -> int:
        return len(self.shot.rig.sensors)

    def _is_sky_endless(self, instant: int) -> bool:
        background = self.shot.finish(instant).background
        return background.color is None and background.image is None and not background.transparent

    def neighbours(self, instant: int, sensor: int) -> NeighbourViews:
        """The views beside that of a sensor at an instant."""
        return NeighbourViews(self, instant, sensor)

    def followed(self, sensor: int) -> Followed:
        """The points that a sensor follows through the sequence, picked once for the shot."""
        if sensor not in self._followed:
            self._followed[sensor] = self._picked(sensor)
        return self._followed[sensor]

    def surface(self, instant: int, sensor: int, count: int) -> SurfacePoints:
        """`count` points on each object that is present at an instant, drawn once for each model."""
        view = self.view(instant, sensor)
        things, drawn = list[int](), list[Drawn]()
        for i, thing in enumerate(view.things[: view.geometry.object_count]):
            key = thing.model, thing.step, count
            if thing.is_there and key not in self._drawn:
                self._drawn[key] = points_on_model(view, i, count)
            if thing.is_there:
                things.append(i)
                drawn.append(self._drawn[key])
        triangle, weights = np.concatenate([NO_POINTS[0], *(t for t, _ in drawn)]), [w for _, w in drawn]
        on = np.repeat(np.array(things, np.int32), [len(t) for t, _ in drawn])
        joined = np.concatenate([NO_POINTS[1], *weights])
        return SurfacePoints.from_weights(view, on, triangle.astype(np.int32), joined, np.zeros_like(joined))

    def _picked(self, sensor: int) -> Followed:
        tracks = self.shot.tracks
        if tracks is None:
            raise ValueError(f"shot {self.shot.key}: expected tracks, found none")
        queries, objects, points = list[Float](), list[NDArray[np.int32]](), list[SurfacePoints]()
        numbers = {instant.index: i for i, instant in enumerate(self.shot.instants)}
        for at in tracks.at:
            view = self.view(numbers[at], sensor)
            xy = self._positions(tracks, at, view, sensor)
            seen = points_seen(view, xy)
            ids = np.array([*(thing.id for thing in view.things), 0], np.int32)
            queries.append(np.column_stack((np.full(len(xy), at, np.float64), xy)))
            objects.append(ids[np.maximum(seen.thing, -1)])
            points.append(seen)
        return Followed(np.concatenate(queries), np.concatenate(objects), SurfacePoints.joined(points))

    def _positions(self, tracks: Tracks, at: int, view: View, sensor: int) -> Float:
        """Return the positions of the points that are picked in a picture, (N, 2) pixels."""
        width, height = view.camera.width, view.camera.height
        if tracks.grid is not None:
            x, y = (np.arange(tracks.grid / 2, size, tracks.grid) for size in (width, height))
            return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        if tracks.count is None:
            return np.array([(x, y) for instant, x, y in tracks.points if instant == at], np.float64).reshape(-1, 2)
        name = zlib.crc32(self.shot.rig.sensors[sensor].name.encode())
        return _drawn(view, tracks.count, tracks.on == "objects", np.random.default_rng((tracks.seed, name, at)))


def views_of(shot: Shot, mesh_of: Callable[[Thing], Mesh]) -> ShotViews:
    """The views of a shot in which no engine has a part. `mesh_of` gives the mesh of a still thing; it is the same object while
    the mesh is unchanged.
    """
    ground = shot.scene.ground is not None and shot.scene.ground.is_labelled
    ring = Ring(ground, shot.label_alpha)

    def meshes_at(instant: int) -> list[Mesh]:
        return [mesh_of(thing) for thing in shot.things_at(instant)]

    floor = shot_floor(shot, meshes_at)
    return ShotViews(shot, lambda instant: ring.geometry_at(shot.things_at(instant), meshes_at(instant), floor), mesh_of)


def _drawn(view: View, count: int, on_objects: bool, rng: np.random.Generator) -> Float:
    """Positions (n, 2) drawn uniformly over a picture, or over the pixels that show objects; empty if there are none."""
    width, height = view.camera.width, view.camera.height
    pixels = np.arange(width * height, dtype=np.intp)
    if on_objects:
        pixels = np.flatnonzero(view.visibility.instances(view.geometry).ids)
    if not len(pixels):
        return np.zeros((0, 2))
    chosen = pixels[rng.integers(len(pixels), size=count)]
    corner = np.stack((chosen % width, chosen // width), axis=1).astype(np.float64)
    return corner + (0.5 if on_objects else rng.random((count, 2)))  # a pixel's centre shows the object in the pixel's label


@dataclass(frozen=True, eq=False)
class Moment:
    """The poses and cameras at an instant.

    Its fields are the seconds of the sequence; the pose (world from object) of each of the objects 1, 2, ..., None if it is
    absent; the cameras of all sensors in the rig's order; and the number of the picture's own sensor.
    """

    seconds: float
    poses: tuple[Matrix4 | None, ...]
    cameras: tuple[Camera, ...]
    sensor: int

    @property
    def camera(self) -> Camera:
        """The camera of the picture's own sensor."""
        return self.cameras[self.sensor]


@dataclass(frozen=True, eq=False)
class NeighbourViews:
    """The views beside that of one sample: of a sensor at an instant of a shot."""

    views: ShotViews
    instant: int
    sensor_number: int

    @property
    def partner(self) -> tuple[str, float] | None:
        """The name of a sensor that is rectified with the sample's own, and the distance between them in metres; None without
        one.
        """
        return self.views.shot.rig.partner(self.sensor_number)

    def moment(self, instants: int) -> Moment | None:
        """Return the poses and cameras `instants` instants later, None if the shot does not have that instant."""
        shot, instant = self.views.shot, self.views.shot.instant_after(self.instant, instants)
        if instant is None:
            return None
        cameras = tuple(shot.camera(instant, sensor) for sensor in range(len(shot.rig.sensors)))
        poses = tuple(thing.motion.pose_at(instant) for thing in shot.objects)
        return Moment(shot.instants[instant].seconds, poses, cameras, self.sensor_number)

    def view(self, instants: int, sensor: str | None) -> View | None:
        """The view of a sensor (None for the sample's own) `instants` instants later; None if that sensor or instant does not
        exist.
        """
        instant = self.views.shot.instant_after(self.instant, instants)
        names = [one.name for one in self.views.shot.rig.sensors]
        if instant is None or (sensor is not None and sensor not in names):
            return None
        return self.views.view(instant, self.sensor_number if sensor is None else names.index(sensor))

    @property
    def shot(self) -> Shot:
        """The sample's shot."""
        return self.views.shot

    @property
    def finish(self) -> Finish:
        """The finish that turns light into the sample's picture."""
        return self.views.shot.finish(self.instant, self.sensor_number)

    @property
    def sensor(self) -> Sensor:
        """The sample's own sensor."""
        return self.views.shot.rig.sensors[self.sensor_number]

    def turning(self, seconds: float) -> Turning:
        """Return the motion of things and sensor while its columns are measured, within `seconds` seconds around the instant.

        The motion is straight between instants, as during an exposure. Before the first instant and after the last, it
        continues unchanged.
        """
        shot, width = self.views.shot, self.sensor.intrinsics.width
        moments = ((np.arange(width) + 0.5) / width - 0.5) * seconds
        rig = self._poses([now.world_from_rig for now in shot.instants], moments)
        placed = np.stack([compose(pose, self.sensor.rig_from_sensor) for pose in rig])
        rotation = np.ascontiguousarray(placed[:, :3, :3].swapaxes(1, 2))
        moved = dict[int, Float]()
        for i, thing in enumerate(shot.things):
            poses = [thing.motion.pose_at(instant) for instant in range(len(shot.instants))]
            now = poses[self.instant]
            if now is not None and any(pose not in (None, now) for pose in poses):
                back = inverse_pose(np.array(now))
                moved[i] = np.stack([compose(pose, back) for pose in self._poses(poses, moments)])
        return Turning(rotation, -product(rotation, placed[:, :3, 3:])[..., 0], moved)

    def _poses(self, poses: Sequence[Matrix4 | None], moments: Float) -> Float:
        """Poses (n, 4, 4), at moments (n,) in seconds from the instant, interpolated from these poses at the
        shot's instants.
        """
        shot, now = self.views.shot, poses[self.instant]
        assert now is not None
        known = {offset: shot.instant_after(self.instant, offset) for offset in (-1, 1)}
        around = {offset: (shot.instants[at].seconds, poses[at]) for offset, at in known.items() if at is not None}
        here = shot.instants[self.instant].seconds
        near_poses = {offset: (time - here, pose) for offset, (time, pose) in around.items() if pose is not None}
        if not near_poses:
            return np.tile(np.array(now), (len(moments), 1, 1))
        for missing in {-1, 1} - near_poses.keys():
            time, pose = near_poses[-missing]
            near_poses[missing] = -time, beyond(now, pose)
        (before, first), (after, last) = near_poses[-1], near_poses[1]
        path = Sweep(moments=(before, 0.0, after), motion=Motion(poses=(first, now, last)))
        return np.stack([np.array(path.pose(moment)) for moment in moments.tolist()])

    @property
    def painted(self) -> Painted:
        """Return the appearance of surfaces at the instant. Raises RecipeError for a picture that cannot be read."""
        shot, mesh_of = self.views.shot, self.views.mesh_of
        if mesh_of is None:
            raise ValueError(f"shot {shot.key}: expected its meshes, found none")
        things = shot.things_at(self.instant)
        rest = [mesh_of(thing.resting) if any(r.texture for r in thing.repaints) else None for thing in things]
        meshes = [textured(mesh_of(thing), thing.repaints, own) for thing, own in zip(things, rest, strict=True)]
        return Painted(things, meshes, shot.scene.ground)

    @property
    def drawn_as(self) -> tuple[str, ...]:
        """The names that, with a seed, key the randomness of the sample's labels: its subject without variation, its sensor,
        and its instant, named by its time and by the rig's place at that time.

        None of them depends on how a data set is stored, so the same frame always has the same random draws.
        """
        shot, now = self.views.shot, self.views.shot.instants[self.instant]
        return shot.subject, self.sensor.name, repr(now.seconds), repr(now.world_from_rig)

    @property
    def followed(self) -> Followed:
        """The points that the sample's sensor follows."""
        return self.views.followed(self.sensor_number)

    def surface(self, count: int) -> SurfacePoints:
        """Return `count` points on each object."""
        return self.views.surface(self.instant, self.sensor_number, count)
