"""The spec of a camera effect: a change of finished pictures, which no label shows."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar, Literal, Self, get_args

from pydantic import Field, model_validator

from viewsphere.errors import PluginError
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.scene import SEED
from viewsphere.plugins.registry import Kind
from viewsphere.plugins.spec import Spec

Stage = Literal["objects", "lens", "sensor", "computer", "file"]
STAGES: tuple[Stage, ...] = get_args(Stage)
"""The parts of a camera's light path, in its order."""

BEFORE_SENSOR: tuple[Stage, ...] = ("objects", "lens")
"""The stages whose light reaches the sensor."""

RESERVED = ("draw", SEED)
"""Names that a recipe or a shot has beside those of effects."""

RANGES = ((0, 1), (-1, 1))


class EffectSpec(Spec):
    """A camera effect, with its strength and its options in recipes.

    Effects that one function computes together are several specs with the same function and class of options; the function is
    called once for those of them that are on.
    """

    KIND: ClassVar[Kind] = "effects"

    name: str = Field(min_length=1, description="its name in recipes, and of its strength among the options")
    options: type[Frozen] = Field(
        description="the class of its fields in recipes, where each may be a distribution: a field of the effect's name, 0 by "
        "default, a `Portion` or `Signed` of `viewsphere.model.fields.numbers`, and its options. All have defaults and "
        "descriptions; no other effect has fields of these names"
    )
    strongest: str = Field(min_length=1, description="the effect at strength 1 in words, with W for the picture's width")
    stage: Stage = Field(
        description="its place in the light path: `objects`, `lens`, `sensor`, `computer` (of the camera), or `file`, whose "
        "functions change coded bytes"
    )
    order: int = Field(
        description="its place in its stage, smaller numbers first; equal ones apply in the order of their names"
    )
    apply: Callable[[Any, Any, Any], Any] = Field(
        description="`apply(picture, options, context)`: the changed picture, a new array of the same shape and type, for "
        "options without distributions and a `viewsphere.rendering.effects.EffectContext`. Pictures are display-linear float32 "
        "from 0 to 1, (H, W, 3), or (H, W, 4) premultiplied; in the stage `file` they are uint8 sRGB with straight alpha. "
        "Beside an imager, `objects` and `lens` get light of 0 and more, of which 1 saturates the sensor"
    )
    is_noisy: bool = Field(
        default=False,
        description="whether it is random: `context.seed` differs in every frame and sensor, and all randomness comes from it",
    )
    shows_motion: bool = Field(
        default=False, description="whether it blurs as motion does; recipes with an open shutter refuse it, as they blur, too"
    )
    shows_seam: bool = Field(
        default=False,
        description="whether it spreads light between pixels without regard to `context.shows_full_turn`, or grows from the "
        "picture's middle to its corners: pictures of a full turn refuse it, as it would show the seam at their sides",
    )
    needs_pinhole: bool = Field(
        default=False, description="whether it follows from a pinhole's distances; pictures with parallel rays refuse it"
    )
    in_imager: bool = Field(
        default=False, description="whether a camera's imager has it, too; recipes with an imager refuse it"
    )
    record: int | None = Field(
        default=None,
        description="for the oldest effects: the place in digests and stored shots, which have them at strength 0, too. Leave "
        "it out: then an effect changes no digest and no shot of recipes without it",
    )

    @model_validator(mode="after")
    def _check_options(self) -> Self:
        self.with_fields_of("options", [self.name])
        for name, field in self.options.model_fields.items():
            where = f"EffectSpec.options: {name}"
            if name in RESERVED:
                raise PluginError(f"{where}: expected another name than {' and '.join(RESERVED)}, which all effects share")
            if field.is_required() or not field.description:
                missing = "default" if field.is_required() else "description"
                raise PluginError(f"{where}: expected a default and a description; found no {missing}")
        strength = self.options.model_fields[self.name]
        low, high = (next((getattr(m, end) for m in strength.metadata if hasattr(m, end)), None) for end in ("ge", "le"))
        if strength.annotation is not float or strength.default != 0 or (low, high) not in RANGES:
            raise PluginError(
                f"EffectSpec.options: {self.name}: expected a strength, 0 by default: `Portion` (0 to 1) or `Signed` (-1 to 1) "
                "of viewsphere.model.fields.numbers"
            )
        return self

    @property
    def place(self) -> tuple[int, int, str]:
        """Its place in the light path, for sorting."""
        return STAGES.index(self.stage), self.order, self.name
