"""Ways that things follow."""

from __future__ import annotations

from collections.abc import Sequence

from viewsphere.errors import RecipeError
from viewsphere.geometry.curve import Curve, spline
from viewsphere.model.scene import Vector


def curve_through(points: Sequence[Vector], closed: bool, field: str) -> Curve:
    """The smooth curve through points, metres; raises RecipeError, beginning with `field`, for too few or coinciding points."""
    try:
        return spline(points, closed)
    except ValueError as error:
        raise RecipeError(f"{field}: {error}") from None
