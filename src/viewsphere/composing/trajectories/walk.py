"""A walk at eye height: straight stretches and arcs, or through points, with a gentle bob."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from viewsphere.composing.trajectories.shared.aim import aimed, focuses
from viewsphere.composing.trajectories.shared.along import level
from viewsphere.composing.trajectories.shared.world import RigPose, World
from viewsphere.geometry.curve import Curve, spline
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Length, Metres, Number, Positive
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.plugins.trajectory import TrajectorySpec
from viewsphere.recipe.cameras.trajectories import LOOK, MOST_POINTS, Look, Moving, Spot
from viewsphere.validation.errors import shown

Float = NDArray[np.float64]

MOST_TURNS = 1_000
"""Limit of turns in one path, which protects from files made by mistake."""


class Turn(Frozen):
    """A turn of a walk."""

    at: Annotated[Number, Field(ge=0)] = Field(description="start in seconds from the sequence's first instant")
    degrees: Number = Field(description="to the left; negative: to the right")


class WalkPath(Moving):
    """At eye height over the floor, straight on with turns, or through points, with a gentle bob."""

    kind: Literal["walk"] = Field(description="at eye height over the floor")
    start: Spot | None = Field(default=None, description="start [x, y] in metres")
    heading: Number = Field(default=0.0, description="initial direction in degrees: 0 walks along +Y, 90 along -X")
    turns: Annotated[tuple[Turn, ...], Field(max_length=MOST_TURNS)] = Field(
        default=(), description="a list of turns {at, degrees}"
    )
    turn_rate: Positive = Field(default=45.0, description="degrees a second during a turn")
    points: Annotated[tuple[Spot, ...], Field(min_length=2, max_length=MOST_POINTS)] | None = Field(
        default=None, description="instead of start: [x, y] in metres, two or more, to walk through"
    )
    speed: Positive = Field(default=1.4, description="metres a second; through points it stops at the last")
    eye_height: Length = Field(default=1.6, description="metres above the floor, z = 0")
    bob: Annotated[Metres, Field(ge=0, le=1)] = Field(
        default=0.02, description="vertical movement of the eyes from the middle in metres, twice a stride"
    )
    stride: Length = Field(default=1.5, description="length of two steps in metres")
    look: Look = Field(default="ahead", description=LOOK)

    @model_validator(mode="after")
    def _one_way(self) -> WalkPath:
        if (self.start is None) == (self.points is None):
            raise ValueError(f"expected start or points; found {'neither' if self.start is None else 'both'}")
        if self.points is not None and self.turns:
            raise ValueError("expected turns beside start; found them beside points")
        for i, (a, b) in enumerate(pairwise(self.points or ())):
            if a == b:
                raise ValueError(
                    f"expected points that differ from the one before; found points[{i}] and the next at {shown(a)}"
                )
        for a, b in pairwise(self.turns):
            end = a.at + abs(a.degrees) / self.turn_rate
            if b.at < end:
                raise ValueError(f"expected turns one after another, this after {end:g} s; found it at {b.at:g} s")
        return self


@dataclass(frozen=True)
class _Stretch:
    """A stretch from a time (seconds) on: its start, with a heading (radians, counter-clockwise from +Y) that changes by `rate`
    a second.
    """

    begin: float
    x: float
    y: float
    heading: float
    rate: float

    def offset_at(self, seconds: float, speed: float) -> tuple[float, float, float]:
        """Position and heading at a time: on a line, or on an arc of radius speed / rate."""
        passed = seconds - self.begin
        heading = self.heading + self.rate * passed
        if self.rate == 0:
            way = speed * passed
            return self.x - way * math.sin(heading), self.y + way * math.cos(heading), heading
        radius = speed / self.rate
        x = self.x + radius * (math.cos(heading) - math.cos(self.heading))
        return x, self.y + radius * (math.sin(heading) - math.sin(self.heading)), heading


@dataclass(frozen=True, eq=False)
class _Walk:
    """A walk whose steps move the eyes up and down, and at half the frequency to both sides."""

    entry: WalkPath
    digest: str = ""
    intrinsics: Intrinsics | None = None

    def poses(self, times: Float, world: World) -> tuple[RigPose, ...]:
        """See `Trajectory.poses`."""
        entry = self.entry
        if self._curve is None:
            places, ahead = self._freely(times)
            walked = entry.speed * times
        else:
            walked = np.minimum(entry.speed * times, self._curve.length)
            places, ahead = self._curve.points_at(walked), level(self._curve, walked)
        right = np.stack([ahead[:, 1], -ahead[:, 0], np.zeros(len(ahead))], axis=1)
        sway, rise = self._bob(walked)
        centers = places + sway[:, None] * right + np.array([0.0, 0.0, entry.eye_height])
        centers[:, 2] += rise
        return aimed(centers, ahead, focuses(entry, entry.look, times, world), world)

    @cached_property
    def _curve(self) -> Curve | None:
        return None if self.entry.points is None else spline([(x, y, 0.0) for x, y in self.entry.points])

    def _freely(self, times: Float) -> tuple[Float, Float]:
        """Positions on the floor and directions (T, 3) from the start on, turn after turn."""
        stretches = tuple(self._stretches())
        begins = np.array([stretch.begin for stretch in stretches])
        places = np.maximum(np.searchsorted(begins, times, side="right") - 1, 0)
        offsets = [stretches[i].offset_at(t, self.entry.speed) for i, t in zip(places.tolist(), times.tolist(), strict=True)]
        places = np.array([(x, y, 0.0) for x, y, _ in offsets])
        return places, np.array([(-math.sin(h), math.cos(h), 0.0) for *_, h in offsets])

    def _stretches(self) -> Iterator[_Stretch]:
        entry = self.entry
        assert entry.start is not None
        now = _Stretch(0.0, *entry.start, math.radians(entry.heading), 0.0)
        yield now
        for turn in entry.turns:
            rate = math.copysign(math.radians(entry.turn_rate), turn.degrees)
            for begin, faster in ((turn.at, rate), (turn.at + abs(turn.degrees) / entry.turn_rate, 0.0)):
                now = _Stretch(begin, *now.offset_at(begin, entry.speed), faster)
                yield now

    def _bob(self, walked: Float) -> tuple[Float, Float]:
        """Offsets to the right and up, metres, after these walked metres."""
        strides = [2 * math.pi * metres / self.entry.stride for metres in walked.tolist()]
        sway = np.array([self.entry.bob / 2 * math.sin(phase) for phase in strides])
        return sway, np.array([self.entry.bob * math.sin(2 * phase) for phase in strides])


def _trajectory(entry: WalkPath, folder: Path) -> _Walk:
    """The motion that an entry of a recipe means."""
    return _Walk(entry)


TRAJECTORY = TrajectorySpec(options=WalkPath, trajectory=_trajectory)
