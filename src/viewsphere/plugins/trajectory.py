"""The spec of a trajectory: where the rig is at each instant of a sequence."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar, Self

from pydantic import Field, model_validator

from viewsphere.model.fields.frozen import Frozen
from viewsphere.plugins.registry import Kind
from viewsphere.plugins.spec import Spec


class TrajectorySpec(Spec):
    """One kind of `viewpoints` along which the camera moves, with its options in recipes."""

    KIND: ClassVar[Kind] = "trajectories"

    options: type[Frozen] = Field(
        description="the class of the options, upon `viewsphere.recipe.cameras.trajectories.Moving`; its field `kind` has the "
        "trajectory's name as its only value"
    )
    trajectory: Callable[[Any, Path], Any] = Field(
        description="`trajectory(options, folder)`: a `viewsphere.composing.trajectories.Trajectory`; paths in the options "
        "start from `folder`, the recipe's. Raises RecipeError for an impossible motion, naming `viewpoints` and the option"
    )

    @model_validator(mode="after")
    def _check_fields(self) -> Self:
        return self.with_fields_of("options", ("kind", "bins", "shake"))
