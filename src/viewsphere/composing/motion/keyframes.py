"""From key to key: positions and rotations at given times."""

from __future__ import annotations

from bisect import bisect_right
from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from viewsphere.composing.motion import Move, Origin, Pose, Start
from viewsphere.geometry.rotation import matrix_from_quaternion, quaternion_about, quaternion_product, slerp
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Number
from viewsphere.plugins.motion import MotionSpec
from viewsphere.recipe.draws import Coordinate, Drawn, PointDrawn
from viewsphere.validation.errors import error_at, shown

Float = NDArray[np.float64]
Quaternion = tuple[Number, Number, Number, Number]


class Key(Frozen):
    """The values of a motion at one time. The keys before and after fill in omitted values."""

    time: Number = Field(description="seconds")
    position: PointDrawn | None = Field(default=None, description="[x, y, z]: metres, world axes")
    rotation_deg: Drawn[tuple[Coordinate, Coordinate, Coordinate]] | None = Field(
        default=None, description="[x, y, z]: degrees about the thing's own x axis first, then about the original y, then z"
    )
    quaternion: Quaternion | None = Field(default=None, description="or the rotation as [w, x, y, z]")

    @model_validator(mode="after")
    def _check(self) -> Key:
        given = [name for name in ("position", "rotation_deg", "quaternion") if getattr(self, name) is not None]
        if not given or len(given) == 3 or given == ["rotation_deg", "quaternion"]:
            raise ValueError(
                f"expected position, and rotation_deg or quaternion, or one of them; found {', '.join(given) or 'none'}"
            )
        if self.quaternion is not None and not any(self.quaternion):
            raise ValueError("expected a quaternion that is not 0; found [0, 0, 0, 0]")
        return self


class _Options(Frozen):
    """Positions and rotations at given times, with linear interpolation. The first key holds before its time, the last one
    after its time.
    """

    keys: Annotated[tuple[Key, ...], Field(min_length=1)] = Field(description="in the order of their times")
    origin: Origin = Field(
        default="placed",
        description="placed: positions and rotations are relative to its placement; world: x and y are the world's, z is "
        "the height above its placement, rotations are the world's",
    )
    ease: Literal["linear", "smooth"] = Field(
        default="linear", description="linear: evenly from key to key; smooth: slowly away from each and slowly into the next"
    )

    @model_validator(mode="after")
    def _check(self) -> _Options:
        for i, (a, b) in enumerate(pairwise(self.keys), 1):
            if b.time <= a.time:
                with error_at("keys", i, "time"):
                    raise ValueError(f"expected a time after {a.time:g}, the key's before; found {shown(b.time)}")
        return self


def _moves(options: _Options, start: Start) -> Move:
    """Positions in straight lines; rotations by slerp, the shorter way around at a constant rate (Shoemake 1985)."""
    positions = [(key.time, np.array(key.position)) for key in options.keys if key.position is not None]
    turns = [(key.time, turn) for key in options.keys if (turn := _quaternion(key)) is not None]
    is_world = options.origin == "world"

    def moved(time: float, pose: Pose) -> Pose:
        if turns:
            turn = matrix_from_quaternion(slerp(*_between(turns, time, options.ease)))
            pose = pose.facing(turn) if is_world else pose.turned(turn)
        if positions:
            a, b, share = _between(positions, time, options.ease)
            spot = a + share * (b - a)
            pose = pose.put(spot) if is_world else pose.moved(spot)
        return pose

    return moved


def _between(keys: list[tuple[float, Float]], time: float, ease: str) -> tuple[Float, Float, float]:
    """The values of the keys before and after a time, and the position between them, 0 to 1."""
    after = bisect_right(keys, time, key=lambda key: key[0])
    if after in (0, len(keys)):
        end = keys[min(after, len(keys) - 1)][1]
        return end, end, 0.0
    (begin, a), (stop, b) = keys[after - 1 : after + 1]
    u = (time - begin) / (stop - begin)
    return a, b, u * u * (3 - 2 * u) if ease == "smooth" else u


def _quaternion(key: Key) -> Float | None:
    """The key's rotation, a unit quaternion (w, x, y, z)."""
    if key.quaternion is not None:
        return np.array(key.quaternion) / np.linalg.norm(key.quaternion)
    if key.rotation_deg is None:
        return None
    x, y, z = (quaternion_about(np.radians(angle) * axis) for angle, axis in zip(key.rotation_deg, np.eye(3), strict=True))
    return quaternion_product(z, quaternion_product(y, x))


MOTION = MotionSpec(options=_Options, moves=_moves)
