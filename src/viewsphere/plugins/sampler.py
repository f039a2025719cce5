"""The spec of a sampler: the shots of a recipe, and their contents."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, ClassVar

from pydantic import Field

from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.shot import Shot
from viewsphere.plugins.registry import Kind
from viewsphere.plugins.spec import SpecWithOptions

Recipe = Any
"""`viewsphere.recipe.recipe.Recipe`: values from higher layers have no type here."""

SamplingContext = Any
"""`viewsphere.planning.samplers.SamplingContext`."""

BoxOf = Callable[..., Any]
"""`viewsphere.composing.composition.BoxOf`."""


class SamplerSpec(SpecWithOptions):
    """Functions that make shots of a recipe. All randomness follows from the recipe's seed and from names
    (`viewsphere.composing.seeds`).
    """

    KIND: ClassVar[Kind] = "samplers"

    subjects: Callable[[Recipe, Sequence[ModelSpec]], tuple[str, ...]] = Field(
        description="the subjects of the frames: stable names, each once, fit for folders; they begin the keys of shots. "
        "Raises RecipeError for a recipe that the sampler cannot serve"
    )
    factors: Callable[[SamplingContext], str] = Field(description="the factors whose product is the number of frames, in words")
    blocks: Callable[[SamplingContext], tuple[Any, ...]] = Field(
        description="the poses (numbers in `context.pose_list`) of each subject, in the order of frames, as "
        "`viewsphere.store.Block`s"
    )
    most_objects: Callable[[Recipe], int] = Field(description="the most models of the recipe in one frame")
    cast: Callable[[SamplingContext, str, int | None], tuple[ModelSpec, ...]] = Field(
        description="the recipe's models in a frame of a subject; without a pose, those in all frames of the subject"
    )
    split: Callable[[SamplingContext, str, int], str] = Field(description="the split of a frame")
    standing: Callable[[SamplingContext, str, BoxOf], Iterator[Any]] = Field(
        description="the positions of a subject's objects as far as they are known before rendering, as "
        "`viewsphere.planning.samplers.Standing`: all poses once, unless positions are drawn for each pose. Raises RecipeError "
        "where there is no room"
    )
    shot: Callable[[SamplingContext, str, Sequence[int], BoxOf, str, int], Shot] = Field(
        description="a shot of a subject from some poses (of one time step where something moves; of one pose where the recipe "
        "draws its scenes for each frame), with its key and the number of its first sample. Raises RecipeError where there is "
        "no room"
    )
    of_any_size: bool = Field(default=False, description="whether shots may have lenses of several sizes")
