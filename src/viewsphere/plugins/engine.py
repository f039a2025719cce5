"""The spec of an engine: how the pictures of shots are painted."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, ClassVar, Self

from pydantic import Field, JsonValue, model_validator

from viewsphere.errors import PluginError
from viewsphere.model.channel import PICTURES
from viewsphere.model.shot import Shot
from viewsphere.plugins.registry import Kind
from viewsphere.plugins.spec import Spec

STAGE = ("at", "paint", "for_shot")
"""Methods of a stage, see `viewsphere.engines.Stage`."""


class EngineSpec(Spec):
    """Functions that paint pictures; labels never come from an engine."""

    KIND: ClassVar[Kind] = "engines"

    check: Callable[[Mapping[str, JsonValue]], None] = Field(
        description="`check(options)`: raises UserError for an unknown option or one out of range, before anything is rendered"
    )
    stage: Callable[[Shot, Callable[..., Any]], Any] = Field(
        description="`stage(shot, load)`: a `viewsphere.engines.Stage` of everything that the frames of a shot share; `load` "
        "returns a model's normalised mesh"
    )
    paints: tuple[str, ...] = Field(default=PICTURES, description="the passes that it paints")
    opens_scenes: bool = Field(default=False, description="whether it renders .blend files that are the scene (`scene.blend`)")
    catches_shadows: bool = Field(default=True, description="whether the ground may be a shadow catcher")
    parallel_rays: bool = Field(
        default=False, description="whether it paints lenses whose rays are parallel instead of passing through one centre"
    )
    rolling: bool = Field(
        default=False, description="whether it paints pictures of rolling shutters, whose rows have their own poses"
    )
    programs: tuple[Path, ...] = Field(
        default=(), description="files and folders besides its module whose sources decide what its pictures look like"
    )
    save: Callable[[Shot, Any, Any, Path, str], tuple[str, ...]] | None = Field(
        default=None, description="`save(shot, samples, load, file, data)`: writes the scene as a .blend file; returns notes"
    )
    shows_sky: Callable[[Shot, Any], bool] | None = Field(
        default=None, description="`shows_sky(shot, finish)`: whether a picture shows the sky, for engines that `save`"
    )
    indices: Callable[[Shot, int, int, Any], Any] | None = Field(
        default=None,
        description="`indices(shot, instant, sensor, load)`: ids of the objects that the engine itself sees, for "
        "`check --against-cycles`; None where it lacks the lens",
    )

    @model_validator(mode="after")
    def _check_programs(self) -> Self:
        for path in self.programs:
            if not path.exists():
                raise PluginError(f"EngineSpec.programs: expected files and folders that exist; found {path}")
        return self

    def staged(self, shot: Shot, load: Callable[..., Any]) -> Any:
        """The stage of a shot; raises PluginError for one that lacks a method."""
        made = self.stage(shot, load)
        lacking = [name for name in STAGE if not callable(getattr(made, name, None))]
        if lacking:
            raise PluginError(
                f"engine {shot.engine}: EngineSpec.stage: expected a stage with {', '.join(STAGE)}; found no {lacking[0]}"
            )
        return made
