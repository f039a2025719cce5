"""A material that is drawn from a number rather than read from a file."""

from __future__ import annotations

from pydantic import Field

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Natural


class ProceduralMaterial(Frozen):
    """One piece of a material of `viewsphere.materials`: its name, the seed of its colours, sizes and grain, and the side of
    its pictures in texels.
    """

    name: str = Field(min_length=1)
    seed: Natural = 0
    size: int = Field(default=512, ge=16, le=4096)
