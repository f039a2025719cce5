"""Fields whose `kind` chooses a class: one of the recipe's own, or the options of a plug-in."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from viewsphere import plugins
from viewsphere.model.fields.frozen import Frozen
from viewsphere.plugins.spec import Spec
from viewsphere.validation.errors import error_at, one_of, shown


def _by_reference(options: type[Frozen]) -> CoreSchema:
    """A core schema whose JSON schema is a reference to the schema of a class."""
    return core_schema.no_info_plain_validator_function(
        options.model_validate,
        ref=f"{options.__module__}.{options.__qualname__}:{id(options)}",
        metadata={"pydantic_js_functions": [options.__get_pydantic_json_schema__]},
    )


class ByKind:
    """Reads a mapping as the class of its `kind`, by default `default`. Plug-ins are loaded only if a recipe names them; the
    schema lists the plug-ins of viewsphere itself.
    """

    def __init__(self, spec: type[Spec], default: str, own: Mapping[str, type[Frozen]] | None = None) -> None:
        self.spec, self.default, self.own = spec, default, own or {}

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_plain_validator_function(self._read)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        shipped = [name for name in self._names() if not plugins.is_third_party(self.spec.KIND, name)]
        choices = handler(core_schema.union_schema([_by_reference(self._class(name)) for name in shipped]))
        return {"oneOf": choices["anyOf"]}

    def _read(self, value: Any, info: ValidationInfo) -> Frozen:
        if isinstance(value, Frozen):
            kind = getattr(value, "kind", None)
            if kind in self._names() and isinstance(value, self._class(kind)):
                return value
        if not isinstance(value, Mapping):
            raise ValueError(f"expected a mapping; found {shown(value)}")
        fields = cast(Mapping[Any, Any], value)
        kind, known = fields.get("kind", self.default), self._names()
        if kind not in known:
            with error_at("kind"):
                raise ValueError(one_of(kind, known))
        return self._class(kind).model_validate(fields, context=info.context)

    def _names(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys((*self.own, *plugins.names(self.spec.KIND))))

    def _class(self, kind: str) -> type[Frozen]:
        if kind in self.own:
            return self.own[kind]
        return cast(Any, plugins.load(self.spec, kind)).options
