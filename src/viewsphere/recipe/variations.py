"""Conditions: what changes of a recipe's light, weather and finish, so that the same shots are rendered under each."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import AfterValidator, Field, PlainSerializer, StringConstraints

from viewsphere.model.mistakes import at
from viewsphere.recipe.draws import alternatives
from viewsphere.recipe.scene import SceneEntry

CONDITIONS = ("sun", "sky", "lights", "fog", "rain", "snow", "wet", "lamps", "background", "smoother", "view", "effects")
"""Fields of a scene that no label depends on."""

Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", max_length=64)]


def _of_light_alone(entry: SceneEntry) -> SceneEntry:
    for name in entry.model_fields_set.difference(CONDITIONS):
        with at(name):
            raise ValueError(
                f"expected {', '.join(CONDITIONS[:-1])} or {CONDITIONS[-1]}, on which no label depends; found {name}: set it "
                "in scene, for all variations alike"
            )
    return entry


def _distinct(variations: dict[str, SceneEntry]) -> dict[str, SceneEntry]:
    folded: dict[str, str] = {}
    for name in variations:
        if folded.setdefault(name.casefold(), name) != name:
            raise ValueError(f"expected names that differ in more than capitals; found {folded[name.casefold()]} and {name}")
    return variations


def _as_written(entry: SceneEntry) -> dict[str, Any]:
    return entry.model_dump(mode="json", exclude_unset=True)


Change = Annotated[SceneEntry, AfterValidator(_of_light_alone), PlainSerializer(_as_written)]
VariationsField = Annotated[dict[Name, Change], Field(min_length=1), AfterValidator(_distinct)]


def varied(scene: SceneEntry, change: SceneEntry) -> SceneEntry:
    """A scene whose fields are those of a variation where it has them. Raises ValueError where they do not fit the others."""
    said: dict[str, Any] = {name: getattr(scene, name) for name in scene.model_fields_set}
    return SceneEntry.model_validate(said | {name: getattr(change, name) for name in change.model_fields_set})


def check_alike(scenes: dict[str, SceneEntry]) -> None:
    """Raise ValueError where a label would depend on which of these scenes, by their names, is rendered."""
    first, *others = scenes
    for name in others:
        one, other = scenes[first], scenes[name]
        if _is_transparent(one) != _is_transparent(other):
            with at(name, "background"):
                raise ValueError(f"expected a transparent background in all variations or in none; {first} differs from {name}")
        if "auto" in alternatives(one.ground) and one.automatic_ground != other.automatic_ground:
            with at(name, "background"):
                raise ValueError(
                    f"expected a background under which ground: auto is {one.automatic_ground}, as under {first}; found one "
                    f"under which it is {other.automatic_ground}: set scene.ground"
                )


def _is_transparent(scene: SceneEntry) -> bool:
    return any(entry.transparent for entry in scene.backgrounds)
