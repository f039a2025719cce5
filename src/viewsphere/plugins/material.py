"""The spec of a material: colour, roughness and relief that are drawn from numbers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, ClassVar

from pydantic import Field

from viewsphere.plugins.registry import Kind
from viewsphere.plugins.spec import Spec
from viewsphere.validation.specs import Takes


class MaterialSpec(Spec):
    """A square of material that repeats."""

    KIND: ClassVar[Kind] = "materials"

    word: str = Field(min_length=1, description="the word of captions for things of this material, such as wooden")
    surface: Annotated[Callable[..., Any], Takes(2)] = Field(
        description="`surface(parameters, size)`: a `viewsphere.materials.Surface` of `size` texels a side, from the "
        "parameters that `draw` returns; equal parameters give equal bytes on every processor"
    )
    draw: Callable[[Any], Any] = Field(
        description="`draw(rng)`: frozen parameters; `metres` among them is the side of the square, and all randomness is here"
    )
    grained: bool = Field(default=False, description="whether it runs along the longest side of each part")
