"""The lens model of a camera in a recipe: a name, and parameters that the model itself checks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, cast

from pydantic import BeforeValidator, GetJsonSchemaHandler, SerializeAsAny, ValidationError
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from viewsphere import plugins
from viewsphere.geometry.lenses import LensParameters
from viewsphere.plugins.lens import LensSpec
from viewsphere.validation.errors import error_at, explained, one_of


def _read(value: Any) -> Any:
    """The parameters as the model's class; unchanged if the value is not a mapping, or names no model."""
    entry = cast("Mapping[str, Any]", value)
    if not isinstance(value, Mapping) or not isinstance(entry.get("model"), str):
        return value
    name = entry["model"]
    if name not in plugins.names("lenses") or not _bends(plugins.load(LensSpec, name)):
        pictures = [other for other, spec in plugins.loadable(LensSpec).items() if _bends(spec)]
        with error_at("model"):
            raise ValueError(one_of(name, pictures))
    parameters = plugins.load(LensSpec, name).parameters
    try:
        return parameters.model_validate(dict(entry))
    except ValidationError as error:
        raise explained(error, tuple(parameters.model_fields)) from None


def _bends(spec: LensSpec) -> bool:
    """Return whether a lens can follow from an angle or a focal length; others have options instead."""
    return spec.has_depth and not spec.is_scan and not spec.is_parallel


class _Schema:
    """The JSON schema of all shipped lenses: their names and their parameters."""

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        pictures = {name: spec for name, spec in plugins.loadable(LensSpec).items() if _bends(spec)}
        shipped = {name: spec for name, spec in pictures.items() if not plugins.is_third_party("lenses", name)}
        named = f"{', '.join(shipped)}, or a lens of your own"
        fields: dict[str, Any] = {"model": {"type": "string", "description": named}}
        for name, spec in shipped.items():
            own = spec.parameters.model_json_schema()
            assert "$defs" not in own, f"parameters of {name}: expected plain types"
            for field, value in own["properties"].items():
                if field == "model":
                    continue
                entry = fields.setdefault(field, {"type": value["type"], "description": ""})
                entry["description"] += f"{'; ' if entry['description'] else ''}{name}: {value.get('description', '')}"
                if value["type"] == "array":
                    entry["items"] = {"type": "number"}
        return {"type": "object", "properties": fields, "required": ["model"]}


DistortionField = Annotated[SerializeAsAny[LensParameters], BeforeValidator(_read), _Schema()]
