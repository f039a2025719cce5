"""The rigid motions of things between two views: one matrix per thing maps pixels and 1/s of one view to pixels
of the other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.rotation import inverse, product, transform
from viewsphere.truth.kernel_constants import GONE, OTHER, RIGID, STILL
from viewsphere.truth.view import View

Float = NDArray[np.float64]
KINDS = {"moved": RIGID, "deformed": OTHER, "gone": GONE}


@dataclass(frozen=True, eq=False)
class Maps:
    """The motions of things, then of the ground and the sky, from one view to another.

    `kinds` (n + 2,) int32 as in `kernels_correspond`; a point x in this camera's axes is turn x + shift in the other's, with
    turns (n + 2, 3, 3) and shifts (n + 2, 3). The sky has no shift.
    """

    kinds: NDArray[np.int32]
    turn: Float
    shift: Float

    def matrices(self, linear: Float) -> Float:
        """Matrices (n + 2, 3, 4) of these linear parts (n + 2, 3, 3)."""
        return np.concatenate((linear, self.shift[..., None]), axis=-1)

    def projected(self, here: View, there: View) -> Float:
        """The matrices (n + 2, 3, 4) from rays and 1/s in one view to homogeneous pixels of a pinhole in the other."""
        linear = product(self.turn, here.camera_from_ray)
        projected = product(there.camera.K, self.matrices(linear))
        if here.camera.intrinsics == there.camera.intrinsics:
            projected[(self.turn == np.eye(3)).all(axis=(1, 2)), :, :3] = np.eye(3)  # K K^-1 without its rounding error
        return projected


def maps_between(here: View, there: View) -> Maps:
    """Return the motions of things from one view to another.

    Shifts are composed of differences between near places, not far ones, so they are exact at any distance from the origin.
    """
    kinds, before, after = _poses(here, there)
    world_turn = np.tile(np.eye(3), (len(before), 1, 1))
    offset = np.tile(here.center - there.center, (len(before), 1))
    moving = np.flatnonzero((before != after).any(axis=(1, 2)))
    if len(moving):
        world_turn[moving] = product(after[moving, :3, :3], inverse(before[moving, :3, :3]))
        arm = (here.center - before[moving, :3, 3])[..., None]
        offset[moving] = product(world_turn[moving], arm)[..., 0] + (after[moving, :3, 3] - there.center)
    if here.turns_like(there):
        kinds[-1] = STILL if kinds[-1] == RIGID else kinds[-1]
    if here.has_camera_of(there):
        stands = (kinds == RIGID) & (before == after).all(axis=(1, 2))
        kinds[stands] = STILL
    turn = _seen_turn(here, there, world_turn, moving)
    shift = transform(there.camera.R, offset)
    shift[-1] = 0.0
    return Maps(kinds, turn, shift)


def _seen_turn(here: View, there: View, world_turn: Float, moving: NDArray[np.intp]) -> Float:
    """The turns as cameras see them: exactly the identity if neither the thing nor the camera's orientation changed."""
    turn = product(product(there.camera.R, world_turn), here.world_from_camera)
    if np.array_equal(here.camera.R, there.camera.R):
        turn[(world_turn == np.eye(3)).all(axis=(1, 2))] = np.eye(3)
    return turn


def _poses(here: View, there: View) -> tuple[NDArray[np.int32], Float, Float]:
    """Kinds, and world from object before and after, of things, ground and sky; both poses are the identity for fixed ones."""
    count = len(here.things) + 2
    kinds = np.full(count, RIGID, np.int32)
    before = np.tile(np.eye(4), (count, 1, 1))
    after = before.copy()
    for i, thing in enumerate(here.things):
        if i < len(there.things) and thing is there.things[i]:
            continue
        kinds[i] = KINDS[here.change(i, there)]
        if kinds[i] == RIGID and thing.motion.poses != there.things[i].motion.poses:
            before[i], after[i] = thing.world_from_object, there.things[i].world_from_object
    if not here.has_ground_of(there):
        kinds[-2] = GONE
    if not here.has_sky_of(there):
        kinds[-1] = GONE
    return kinds, before, after
