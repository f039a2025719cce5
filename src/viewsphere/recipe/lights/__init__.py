"""Lamps of a recipe's scene: one file a kind, named as in recipes. The names below are those that your own kinds need."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, cast

from pydantic import BeforeValidator, GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from viewsphere import plugins
from viewsphere.model.validation_errors import at, one_of, shown
from viewsphere.plugins.light import LightSpec
from viewsphere.recipe.lights.shared.lamps import Aimed, At, Lamp, Placed, place_of

__all__ = ["Aimed", "At", "Lamp", "LightsField", "Placed", "place_of", "spec_of"]

DEFAULT = "point"


def spec_of(lamp: Lamp) -> LightSpec:
    """The spec of a lamp's kind."""
    return plugins.load(LightSpec, cast(Any, lamp).kind)


def _lamp(value: Any, info: ValidationInfo) -> Lamp:
    """A mapping as the options of its kind."""
    if isinstance(value, Lamp):
        return value
    if not isinstance(value, Mapping):
        raise ValueError(f"expected a mapping; found {shown(value)}")
    fields = cast(Mapping[Any, Any], value)
    kind, known = fields.get("kind", DEFAULT), plugins.names("lights")
    if kind not in known:
        with at("kind"):
            raise ValueError(one_of(kind, known))
    return cast(Lamp, plugins.load(LightSpec, kind).options.model_validate(fields, context=info.context))


class _ByKind:
    """Reads a lamp as the options of its kind; the schema lists the kinds that come with viewsphere."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_plain_validator_function(_lamp, serialization=handler(source).get("serialization"))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        kinds = [name for name in plugins.names("lights") if not plugins.is_third_party("lights", name)]
        options = [plugins.load(LightSpec, name).options for name in kinds]
        for one in options:
            one.model_rebuild()
        return {"oneOf": [handler(one.__pydantic_core_schema__) for one in options]}


def _lights(value: Any) -> Any:
    return [value] if isinstance(value, (Mapping, Lamp)) else value


LightsField = Annotated[tuple[Annotated[Lamp, _ByKind()], ...], BeforeValidator(_lights)]
