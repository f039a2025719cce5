"""Motions: where a thing is at a time, and what of its file it shows. A kind is one module with a `MotionSpec`;
none imports another.

What a kind needs stands here: what it is asked (`Start`, `Pose`), where it may go (`Lane`, `curve_through`), and how it
turns on its way (`headed`). What a recipe says becomes a thing's motion by `mover`.
"""

from __future__ import annotations

from collections.abc import Callable

from viewsphere.composing.motion.shared.heading import Heading, headed, to_the_right
from viewsphere.composing.motion.shared.made import Mover, check_motion, check_motions, mover
from viewsphere.composing.motion.shared.start import Origin, Pose, Start
from viewsphere.composing.motion.shared.way import curve_through
from viewsphere.model.fields.numbers import Strength
from viewsphere.model.place import Lane
from viewsphere.recipe.draws import Drawn

__all__ = [
    "Amplitude",
    "Heading",
    "Lane",
    "Move",
    "Mover",
    "Origin",
    "Pose",
    "Start",
    "check_motion",
    "check_motions",
    "curve_through",
    "headed",
    "mover",
    "to_the_right",
]

Amplitude = Drawn[tuple[Drawn[Strength], Drawn[Strength], Drawn[Strength]]]
"""Amplitudes to either side, along or about x, y and z; 0 or more."""

Move = Callable[[float, Pose], Pose | None]
"""The pose at a time, seconds from the sequence's first instant, of a thing that is at a pose without this motion; None where
it is not there. Called for any times in any order.
"""
