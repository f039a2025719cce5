"""A shot: one concrete world without random values, and everything that is recorded in it. Plain JSON."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator
from functools import lru_cache
from itertools import product as pairs_of
from typing import Any

import numpy as np
from pydantic import Field, JsonValue, model_validator

from viewsphere.geometry.rotation import compose, product, transform
from viewsphere.model.annotations.tracks import Tracks
from viewsphere.model.fields.files import Files
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.instant import Instant, Viewpoint, viewpoint_of
from viewsphere.model.scene import IDENTITY, Finish, Matrix4, Scene
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.model.sensors.exposure import Exposure, Sweep
from viewsphere.model.sensors.rig import Rig, Sensor
from viewsphere.model.sensors.rolling import RowPoses
from viewsphere.model.thing import Motion, Thing


class Shot(Frozen):
    """Things, a rig, instants and a scene: all an engine needs. It is the unit of work, of resuming and of distribution.

    A sample is one sensor's picture at one recorded instant. The samples of an instant are in the rig's order; `first` is the
    number of the first sample in the data set. Instants ascend by their indices.

    `shutter` is the time for which the shutter is open, centred on the instant, as a share of the time between two instants. If
    it is not 0, pictures show everything during this time. Labels show the instant itself, or the moment of their row for a
    sensor with a rolling shutter. `exposures`, one an instant, hold the motions for both.
    """

    key: str  # stable, unique, fit for a folder's name
    things: tuple[Thing, ...]  # ids 1..N in order, then those of id 0
    rig: Rig
    instants: tuple[Instant, ...]
    scene: Scene
    first: int = 0
    redraw: int = 0  # how often the scene's random values were drawn again until everything fitted
    sequence: str = ""  # of still pictures none
    variation: str = ""  # the recipe's variation under which it is rendered; it ends the sequence's name
    tracks: Tracks | None = None
    engine: str = "raster"
    engine_options: dict[str, JsonValue] = Field(default_factory=dict)
    channels: tuple[str, ...]
    annotations: tuple[str, ...] = ()  # labels of objects and of pictures that were asked for
    labels: dict[str, dict[str, JsonValue]] = Field(default_factory=dict)  # options of labels
    files: Files = Files.of_defaults()
    label_alpha: float = 0.01
    category_deg: float = Field(default=45.0, gt=0)  # angular resolution of the pose categories
    shutter: float = Field(default=0.0, ge=0, le=1)
    exposures: tuple[Exposure | None, ...] = ()  # None: nothing moves, or it is not needed
    optional: dict[str, JsonValue] = Field(default_factory=dict)  # facts by name: readers ignore names of later versions

    @model_validator(mode="after")
    def _as_many_poses_as_instants(self) -> Shot:
        for thing in self.things:
            motion = thing.motion
            if not motion.lasts(len(self.instants)):
                raise ValueError(
                    f"expected one pose and one time step of thing {thing.id}, or one an instant ({len(self.instants)}); "
                    f"found {len(motion.poses)} and {len(motion.steps)}"
                )
        return self

    @model_validator(mode="after")
    def _zooms_at_one_size(self) -> Shot:
        lens = self.rig.sensors[0].intrinsics
        for now in self.instants:
            if now.intrinsics and (now.intrinsics.width, now.intrinsics.height) != (lens.width, lens.height):
                size = f"{now.intrinsics.width} x {now.intrinsics.height}"
                raise ValueError(f"expected pictures of {lens.width} x {lens.height} at all instants; found {size}")
        return self

    @model_validator(mode="after")
    def _exposed_at_all_instants(self) -> Shot:
        allowed = {len(self.instants) if self.shutter else 0} | ({len(self.instants)} if self.rig.rolls else set[int]())
        if len(self.exposures) not in allowed:
            expected = "an exposure an instant" if self.shutter else "none without a shutter"
            raise ValueError(f"exposures: expected {expected} ({len(self.instants)}); found {len(self.exposures)}")
        if any(exposure and len(exposure.things) < len(self.things) for exposure in self.exposures):
            raise ValueError(f"exposures: expected a sweep or None for each of {len(self.things)} things")
        return self

    @property
    def subject(self) -> str:
        """The stable name of the shown model or scene, without its variation. The rest of the shot's key determines where its
        frames are stored; it depends on the parts of the data set and on the length of shots.
        """
        subject = self.key.rpartition("-")[0]
        return subject.removesuffix(f"-{self.variation}") if self.variation else subject

    @property
    def objects(self) -> tuple[Thing, ...]:
        """The labelled things, in the order of the ids."""
        return tuple(thing for thing in self.things if thing.id)

    def targets(self, together: bool) -> tuple[Thing, ...]:
        """Return the subjects of the shot's pictures: the frame's model, or `together` all models of a random scene."""
        targets = tuple(thing for thing in self.things if thing.is_target)
        return targets if together else targets[:1]

    @property
    def samples(self) -> Iterator[tuple[int, int, int]]:
        """Number in the data set, instant and sensor (both counted from 0 here) of every sample, in order."""
        recorded = (number for number, instant in enumerate(self.instants) if instant.recorded)
        for place, (instant, sensor) in enumerate(pairs_of(recorded, range(len(self.rig.sensors)))):
            yield self.first + place, instant, sensor

    def instant_after(self, instant: int, offset: int) -> int | None:
        """The instant at an `offset` from another one (earlier if negative), both counted from 0 in the shot; None if the shot
        does not have it.
        """
        wanted = self.instants[instant].index + offset
        place = bisect_left(self.instants, wanted, key=lambda one: one.index)
        return place if place < len(self.instants) and self.instants[place].index == wanted else None

    def things_at(self, instant: int) -> tuple[Thing, ...]:
        """Return the things as they are at an instant, counted from 0 in the shot: as still things, or absent."""
        return tuple(thing.still_at(instant) for thing in self.things)

    def poses_at(self, instant: int) -> tuple[Motion, ...]:
        """Return the motion of each moving thing at an instant counted from 0 in the shot: its place and its time step.

        The results are equal for instants at which the world is equal.
        """
        return tuple(thing.motion.held(instant) for thing in self.things if not thing.motion.is_still)

    def camera(self, instant: int, sensor: int = 0) -> Camera:
        """The camera of a sensor at an instant, both counted from 0 in the shot."""
        return self._camera(self.instants[instant].world_from_rig, 0.0, instant, sensor)

    def _camera(self, world_from_rig: Matrix4, moment: float, instant: int, sensor: int) -> Camera:
        """The camera of a sensor on the rig at a pose, whose middle row is exposed at a moment after an instant."""
        mounted, lens = self.rig.sensors[sensor], self._lens(instant, sensor)
        world_from_sensor = np.array(world_from_rig, np.float64)
        if mounted.rig_from_sensor != IDENTITY:
            world_from_sensor = compose(world_from_sensor, np.array(mounted.rig_from_sensor))
        rotation = np.ascontiguousarray(world_from_sensor[:3, :3].T)
        exposure = self.exposures[instant] if lens.rolling is not None and self.exposures else None
        rows = None
        if exposure is not None:
            held: Any = exposure, self.instants[instant].world_from_rig, mounted, lens  # frozen, so they have hashes
            rows = _rows(*held, moment)
        return Camera(lens, rotation, -transform(rotation, world_from_sensor[:3, 3]), rows)

    def viewpoint(self, instant: int, sensor: int = 0) -> Viewpoint | None:
        """The viewpoint of a sensor at an instant, both counted from 0. The rig's first sensor has the instant's requested
        viewpoint; for a sensor mounted elsewhere, it is computed from its pose.
        """
        now, mounted = self.instants[instant], self.rig.sensors[sensor]
        if now.viewpoint is None or mounted.rig_from_sensor == IDENTITY:
            return now.viewpoint
        pose = compose(now.world_from_rig, mounted.rig_from_sensor)
        return viewpoint_of(pose, now.focus, now.viewpoint.index, self.category_deg, now.viewpoint.time).rounded()

    def _lens(self, instant: int, sensor: int) -> Intrinsics:
        lens, zoomed = self.rig.sensors[sensor].intrinsics, self.instants[instant].intrinsics
        return zoomed if zoomed is not None and lens == self.rig.sensors[0].intrinsics else lens

    def kept_channels(self, sensor: int) -> tuple[str, ...]:
        """The channels that a sensor keeps, counted from 0 in the rig."""
        return self.rig.sensors[sensor].kept_channels(self.channels)

    def things_during(self, instant: int, moment: float) -> tuple[Thing, ...]:
        """Return the things at a moment (see `Sweep`) after an instant, while the shutter is open, as still things.

        Between two time steps, they show the nearer one.
        """
        exposure, things = self.exposures[instant], self.things_at(instant)
        return tuple(
            now if sweep is None or not now.is_there else now.model_copy(update={"motion": _held(sweep, moment)})
            for now, sweep in zip(things, exposure.things if exposure else [None] * len(things), strict=True)
        )

    def camera_during(self, instant: int, moment: float, sensor: int = 0) -> Camera:
        """The camera of a sensor at a moment after an instant, while the shutter is open."""
        exposure, now = self.exposures[instant], self.instants[instant]
        pose = exposure.rig.pose(moment) if exposure and exposure.rig else None
        return self._camera(pose or now.world_from_rig, moment, instant, sensor)

    def finish(self, instant: int, sensor: int = 0) -> Finish:
        """The finish that turns the light of a sensor into a picture at an instant, both counted from 0 in the shot.

        The rig's first sensor has the instant's noise; the name of every other sensor gives it noise of its own.
        """
        finish, mounted = self.instants[instant].finish or self.scene.finish, self.rig.sensors[sensor]
        finish = finish.with_noise_of(mounted.name) if sensor else finish
        return finish if mounted.imager is None else finish.model_copy(update={"imager": mounted.imager})

    @property
    def stage_key(self) -> str:
        """A key that is equal for shots that can share a stage: all but instants and the states of moving things."""
        things = tuple(
            thing if thing.motion.is_still else thing.model_copy(update={"motion": Motion(poses=(None,))})
            for thing in self.things
        )
        alike = {"key": "", "first": 0, "sequence": "", "tracks": None, "instants": (), "things": things, "exposures": ()}
        return self.model_copy(update=alike | {"optional": {}}).model_dump_json()


@lru_cache(maxsize=4)  # labels, pictures and proofs of a frame share them
def _rows(exposure: Exposure, world_from_rig: Matrix4, mounted: Sensor, lens: Intrinsics, moment: float) -> RowPoses:
    """The poses of a sensor's rows; the row in the middle is exposed at a moment after the instant of the exposure."""
    assert lens.rolling is not None and exposure.interval is not None
    height, moments = lens.height, lens.rolling.moments(lens.height, exposure.interval) + moment
    rig = np.tile(np.array(world_from_rig), (height, 1, 1)) if exposure.rig is None else exposure.rig.poses(moments)
    placed = rig
    if mounted.rig_from_sensor != IDENTITY:
        placed = np.stack([compose(pose, np.array(mounted.rig_from_sensor)) for pose in rig])
    rotation = np.ascontiguousarray(placed[:, :3, :3].swapaxes(1, 2))
    moving = {i: sweep.poses(moments) for i, sweep in enumerate(exposure.things) if sweep is not None}
    return RowPoses(rotation, -product(rotation, placed[:, :3, 3:])[..., 0], moving)


def _held(sweep: Sweep, moment: float) -> Motion:
    before, after, share = sweep.steps(moment)
    return Motion(poses=(sweep.pose(moment),), steps=(before if share < 0.5 else after,))
