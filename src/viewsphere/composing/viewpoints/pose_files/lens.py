"""The one lens of a file of poses."""

from __future__ import annotations

from collections.abc import Iterable

from viewsphere.errors import RecipeError
from viewsphere.model.sensors.camera import Intrinsics


def one_lens(lenses: Iterable[Intrinsics | None], where: str) -> Intrinsics | None:
    """The lens that all frames share; RecipeError if there are several, None if there is none."""
    distinct = list(dict.fromkeys(lenses))
    if len(distinct) > 1:
        raise RecipeError(
            f"{where}: expected one camera for all frames, as a data set has one; found {len(distinct)}: "
            "split the file by camera"
        )
    return distinct[0] if distinct else None
