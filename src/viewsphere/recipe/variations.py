"""Conditions: changes of a recipe's light, weather and finish; the same shots are rendered under each."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, cast

from pydantic import (
    AfterValidator,
    Field,
    GetCoreSchemaHandler,
    PlainSerializer,
    SerializerFunctionWrapHandler,
    StringConstraints,
    ValidatorFunctionWrapHandler,
)
from pydantic_core import CoreSchema, core_schema

from viewsphere.recipe.draws import alternatives
from viewsphere.recipe.world.scene import SceneEntry
from viewsphere.validation.errors import error_at

CONDITIONS = ("sun", "sky", "lights", "fog", "rain", "snow", "wet", "lamps", "background", "smoother", "view", "effects")
"""Fields of a scene that no label depends on."""

PAIRED = "paired"
"""The key, next to the names of variations, for equal draws in all of them."""

Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", max_length=64)]


def _of_light_alone(entry: SceneEntry) -> SceneEntry:
    for name in entry.model_fields_set.difference(CONDITIONS):
        with error_at(name):
            raise ValueError(
                f"expected {', '.join(CONDITIONS[:-1])} or {CONDITIONS[-1]}, on which no label depends; found {name}: set it "
                "in scene, for all variations alike"
            )
    return entry


def _distinct(variations: dict[str, SceneEntry]) -> dict[str, SceneEntry]:
    folded: dict[str, str] = {}
    for name in variations:
        if folded.setdefault(name.casefold(), name) != name:
            raise ValueError(
                f"variations {folded[name.casefold()]} and {name} differ only in capitals: rename one, for file systems"
            )
    return variations


def _as_written(entry: SceneEntry) -> dict[str, Any]:
    return entry.model_dump(mode="json", exclude_unset=True)


Change = Annotated[SceneEntry, AfterValidator(_of_light_alone), PlainSerializer(_as_written)]


def _with_paired(schema: dict[str, Any]) -> None:
    """Add the key `paired`, which is not a variation, to the JSON schema of variations."""
    changes = dict(schema.pop("patternProperties"))
    schema["patternProperties"] = {pattern.replace("^", f"^(?!{PAIRED}$)", 1): change for pattern, change in changes.items()}
    description = "whether equal distributions of several variations have equal draws"
    schema["properties"] = {PAIRED: {"type": "boolean", "default": False, "description": description}}


_Changes = Annotated[dict[Name, Change], Field(min_length=1, json_schema_extra=_with_paired), AfterValidator(_distinct)]


class Variations(dict[str, SceneEntry]):
    """Named changes of a scene. Each variation draws its own fields separately; if they are `paired`, equal distributions in
    several variations have equal draws.
    """

    paired: bool = False

    def drawn_alone(self, name: str) -> frozenset[str]:
        """The fields of the scene that a variation draws separately."""
        return frozenset() if self.paired else frozenset(self[name].model_fields_set)

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """The core schema of a mapping that may also have the key `paired`."""
        changes = handler(_Changes)
        written = core_schema.wrap_serializer_function_ser_schema(_written, schema=changes)
        return core_schema.no_info_wrap_validator_function(_read, changes, serialization=written)


def _read(value: Any, handler: ValidatorFunctionWrapHandler) -> Variations:
    paired = getattr(value, PAIRED, False)
    if isinstance(value, Mapping) and PAIRED in value:
        value = dict(cast(Mapping[str, Any], value))
        paired = value.pop(PAIRED)
        if not isinstance(paired, bool):
            with error_at(PAIRED):
                raise ValueError(f"expected true or false, as no variation can have this name; found {paired!r:.40}")
    variations = Variations(handler(value))
    variations.paired = paired
    return variations


def _written(value: Variations, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
    return {**({PAIRED: True} if value.paired else {}), **handler(dict(value))}


def varied(scene: SceneEntry, change: SceneEntry) -> SceneEntry:
    """A scene with the fields of a variation in place of its own. Raises ValueError if they do not fit the other fields."""
    fields: dict[str, Any] = {name: getattr(scene, name) for name in scene.model_fields_set}
    return SceneEntry.model_validate(fields | {name: getattr(change, name) for name in change.model_fields_set})


def check_alike(scenes: dict[str, SceneEntry]) -> None:
    """Raise ValueError if labels would differ between these scenes, given by their names."""
    first, *others = scenes
    for name in others:
        one, other = scenes[first], scenes[name]
        if _is_transparent(one) != _is_transparent(other):
            with error_at(name, "background"):
                raise ValueError(f"expected a transparent background in all variations or in none; {first} differs from {name}")
        if "auto" in alternatives(one.ground) and one.automatic_ground != other.automatic_ground:
            with error_at(name, "background"):
                raise ValueError(
                    f"expected a background under which ground: auto is {one.automatic_ground}, as under {first}; found one "
                    f"under which it is {other.automatic_ground}: set scene.ground"
                )


def _is_transparent(scene: SceneEntry) -> bool:
    return any(entry.transparent for entry in scene.backgrounds)
