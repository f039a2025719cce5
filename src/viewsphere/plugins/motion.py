"""The spec of a motion: where a thing is at a time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, ClassVar

from pydantic import Field

from viewsphere.model.fields.frozen import Frozen
from viewsphere.plugins.registry import Kind
from viewsphere.plugins.spec import Spec
from viewsphere.validation.specs import Takes


class MotionSpec(Spec):
    """One kind of motion, with its options in recipes besides `kind`, `enter` and `leave`."""

    KIND: ClassVar[Kind] = "motions"

    options: type[Frozen] = Field(
        description="the class of the options, whose fields may be distributions (`viewsphere.recipe.draws.Drawn`)"
    )
    moves: Annotated[Callable[..., Callable[[float, Any], Any]], Takes(2)] = Field(
        description="`moves(options, start)`: the motion of one thing, everything drawn: a function of seconds and of the pose "
        "without this motion. It returns the pose, None while the thing is not there, for any times in any order. All "
        "randomness comes from `start.rng`. Raises RecipeError for an impossible motion, naming `start.field` and the option"
    )
