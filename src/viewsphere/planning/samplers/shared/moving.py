"""A thing that moves through a sequence: its pose at an instant is computed on request."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain

from viewsphere.composing.motion import Mover
from viewsphere.model.scene import Matrix4
from viewsphere.model.thing import Motion, TimeStep
from viewsphere.recipe.cameras.sequence import TimeEntry


@dataclass(frozen=True, eq=False)
class Moving:
    """The movement of a thing at the instants of a sequence; the result does not depend on the choice of instants."""

    mover: Mover
    time: TimeEntry

    @property
    def is_still(self) -> bool:
        """Return whether the thing always has one pose, and shows no time step."""
        return not self._goes and not self._plays and self._first_step is None

    def motion_at(self, instant: int) -> Motion:
        """A still motion with the thing's pose and time step at an instant."""
        return Motion(poses=(self._pose(instant),), steps=(self._step(instant),))

    def during(self, instants: Sequence[int]) -> Motion:
        """The motion at some instants. A thing that moves in the sequence does not count as still while it rests."""
        poses = tuple(map(self._pose, instants if self._goes else (0,)))
        steps = tuple(map(self._step, instants if self._plays else (0,)))
        return Motion(poses=poses, steps=steps, moves=not self.is_still)

    def around(self, instant: int, moments: Iterable[float]) -> Motion:
        """The motion at moments around an instant, counted in instants."""
        return self.mover.motion_at([(instant + moment) / self.time.fps for moment in moments])

    @property
    def plays_file(self) -> bool:
        """Return whether the thing shows time steps of its model's file."""
        return self.mover.start.timeline is not None

    @cached_property
    def _goes(self) -> bool:
        """Return whether its pose changes."""
        return _differ(map(self._pose, _here_and_there(self.time.count)))

    @cached_property
    def _plays(self) -> bool:
        """Return whether it shows several time steps."""
        return self.plays_file and _differ(filter(None, map(self._shown, _here_and_there(self.time.count))))

    @cached_property
    def _first_step(self) -> TimeStep | None:
        """The first time step that it shows, None if it plays no animation or is always absent."""
        return next(filter(None, map(self._shown, range(self.time.count))), None) if self.plays_file else None

    def _pose(self, instant: int) -> Matrix4 | None:
        return self.mover.state(self.time.seconds_at(instant))[0]

    def _shown(self, instant: int) -> TimeStep | None:
        return self.mover.state(self.time.seconds_at(instant))[1]

    def _step(self, instant: int) -> TimeStep | None:
        """Return the time step that the thing shows.
        While the thing is absent, this is the last step it showed; before it enters, the first step it will show.
        """
        if not self.plays_file:
            return None
        return next(filter(None, map(self._shown, range(instant, -1, -1))), self._first_step)


def _differ(values: Iterator[object]) -> bool:
    first = next(values, None)
    return any(value != first for value in values)


def _here_and_there(count: int) -> Iterator[int]:
    """The numbers below `count`, alternately in ascending order and by halves, quarters, ...: this soon finds a difference that
    is early, or that lasts long.
    """
    return chain.from_iterable(zip(range(count), _halved(count), strict=True))


def _halved(count: int) -> Iterator[int]:
    yield 0
    step = 1 << (count - 1).bit_length()
    while step:
        yield from range(step, count, 2 * step)
        step //= 2
