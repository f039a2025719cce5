"""The movements around each instant of a sequence while the shutter is open."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from viewsphere.model.exposure import Exposure, Sweep, beyond
from viewsphere.model.scene import Matrix4
from viewsphere.model.thing import Motion
from viewsphere.planning.samplers.shared.moving import Moving
from viewsphere.planning.samplers.shared.sequence_state import SequenceState
from viewsphere.recipe.sequence import TimeEntry

NODES = 5
"""Moments of an open shutter at which a thing's pose is recorded; it goes straight on in between."""

AROUND = (-1.0, 0.0, 1.0)
"""Moments of the instants around one."""

RigAt = Callable[[int], Matrix4]
"""The rig's pose at an instant of a sequence."""


def exposures(
    state: SequenceState, instants: Sequence[int | None], time: TimeEntry, rig_at: RigAt
) -> tuple[Exposure | None, ...]:
    """Return the movements around each of these instants; empty for a shutter without duration.
    An instant has None where it is not recorded (None), and where nothing moves.
    """
    if not time.shutter:
        return ()
    return tuple(None if at is None else _exposure(state, at, time, rig_at) for at in instants)


def _exposure(state: SequenceState, at: int, time: TimeEntry, rig_at: RigAt) -> Exposure | None:
    things = tuple(None if moving is None or moving.is_still else _thing(moving, at, time) for moving in state.moving)
    rig = _rig(at, time.count, rig_at)
    return None if rig is None and not any(things) else Exposure(things=things, rig=rig)


def _thing(moving: Moving, at: int, time: TimeEntry) -> Sweep | None:
    """A thing's poses while the shutter is open; of one whose file plays, those of the instants around, as its time steps."""
    moments = AROUND if moving.plays_file else tuple(np.linspace(-0.5, 0.5, NODES) * time.shutter)
    motion = moving.around(at, moments)
    return None if motion.is_still else Sweep(moments=tuple(map(float, moments)), motion=motion)


def _rig(at: int, count: int, rig_at: RigAt) -> Sweep | None:
    """The rig's poses at the instants around one; before the first instant and after the last it goes on as it went."""
    if count == 1:
        return None
    now = rig_at(at)
    before = rig_at(at - 1) if at else beyond(now, rig_at(at + 1))
    after = rig_at(at + 1) if at < count - 1 else beyond(now, before)
    return None if before == now == after else Sweep(moments=AROUND, motion=Motion(poses=(before, now, after)))
