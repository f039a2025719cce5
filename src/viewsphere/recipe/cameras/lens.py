"""The lens model of a camera in a recipe: a name, and parameters that the model itself checks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, cast

from pydantic import BeforeValidator, SerializeAsAny, ValidationError, WithJsonSchema

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
    if name not in plugins.names("lenses") or plugins.load(LensSpec, name).is_scan:
        pictures = [other for other, spec in plugins.loadable(LensSpec).items() if not spec.is_scan]
        with error_at("model"):
            raise ValueError(one_of(name, pictures))
    parameters = plugins.load(LensSpec, name).parameters
    try:
        return parameters.model_validate(dict(entry))
    except ValidationError as error:
        raise explained(error, tuple(parameters.model_fields)) from None


DistortionField = Annotated[
    SerializeAsAny[LensParameters],
    BeforeValidator(_read),
    WithJsonSchema(
        {
            "type": "object",
            "properties": {
                "model": {"type": "string", "description": "brown_conrady, fisheye, pinhole, or a lens of your own"},
                "coefficients": {
                    "type": "array",
                    "items": {"type": "number"},
                    "description": "in OpenCV's order: 4, 5 or 8 of brown_conrady, 4 of fisheye",
                },
            },
            "required": ["model"],
        }
    ),
]
