"""Motions: where a thing is at a time, and what of its file it shows. One module a kind, named as its file; none imports
another.

What a kind needs stands here: what it is asked (`Start`, `Pose`), where it may go (`Lane`, `curve_through`), and how it
turns on its way (`headed`). What a recipe says becomes a thing's motion by `mover`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from viewsphere.model.frozen import Frozen
from viewsphere.model.numbers import Strength
from viewsphere.recipe.draws import Drawn
from viewsphere.sampling.motion._heading import Heading, headed, to_the_right
from viewsphere.sampling.motion._made import Mover, check_motion, check_motions, mover
from viewsphere.sampling.motion._start import Origin, Pose, Start
from viewsphere.sampling.motion._way import curve_through
from viewsphere.zoo.places import Lane

__all__ = [
    "Amplitude",
    "Heading",
    "Lane",
    "Move",
    "Movement",
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
"""How far to either side, along or about x, y and z; 0 or more."""

Move = Callable[[float, Pose], Pose | None]
"""The pose at a time, seconds from the sequence's first instant, of a thing that is at a pose without this motion; None where
it is not there. Called for any times in any order.
"""


class Movement(Protocol):
    """A module that is one kind of motion. `Options` is what a recipe says of it, beside `kind`, `enter` and `leave`; its
    fields may be distributions (`viewsphere.recipe.draws.Drawn`).
    """

    Options: type[Frozen]

    def moves(self, options: Any, start: Start) -> Move:
        """The motion that these options (an `Options`, everything drawn) mean for one thing.

        All randomness comes from `start.rng`. Raises RecipeError where that cannot be, which names the field: `start.field`,
        a dot and the option.
        """
        ...
