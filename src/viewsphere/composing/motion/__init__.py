"""Motions: the pose and the time step of a thing at a time. A kind is one module with a `MotionSpec`; none imports another.

Kinds import from here: their inputs (`Start`, `Pose`), paths (`Lane`, `curve_through`), and turning along a path (`headed`).
`mover` turns a recipe's motions into the motion of a thing.
"""

from __future__ import annotations

from viewsphere.composing.motion.shared.made import Mover, check_motion, check_motions, mover
from viewsphere.composing.motion.shared.start import Heading, Move, Origin, Pose, Start, curve_through, headed, to_the_right
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
