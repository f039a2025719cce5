"""The one base of all plain data: immutable, strict about names, finite numbers only."""

from contextvars import ContextVar
from typing import Any, ClassVar, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    ModelWrapValidatorHandler,
    SerializationInfo,
    ValidationError,
    ValidationInfo,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from viewsphere.validation.errors import explained

_built: ContextVar[type[BaseModel] | None] = ContextVar("_built", default=None)
"""The class whose validator pydantic is building now; classes of its fields get theirs at their first use."""


def _written(value: Any, info: SerializationInfo) -> Any:
    """A field's value, serialised by its own class; values of other types, which a copy may hold, are unchanged."""
    if not isinstance(value, BaseModel):
        return value
    return value.model_dump(
        mode=info.mode,
        include=info.include,  # pyright: ignore[reportArgumentType]
        exclude=info.exclude,  # pyright: ignore[reportArgumentType]
        exclude_unset=info.exclude_unset,
        exclude_defaults=info.exclude_defaults,
        exclude_none=info.exclude_none,
    )


class Frozen(BaseModel):
    """An immutable value; unknown fields, NaN and infinity are errors, and the nearest valid field is named.

    A class's validator is built when its first instance is made, rather than together with the classes that have it as a field:
    a recipe uses 30 of 170 classes, and building the others took a tenth of a second of each start.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)

    # No `from __future__ import annotations` here: pydantic would compile this text for each of 170 subclasses, in 7 ms.
    IS_CHOICE: ClassVar[bool] = False
    """True for members of a tagged union: pydantic reads the tag's field, and builds all members together."""

    @model_validator(mode="wrap")
    @classmethod
    def _explain(cls, data: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        try:
            return handler(data)
        except ValidationError as error:
            raise explained(error, cls._known_names()) from None

    @classmethod
    def _known_names(cls) -> tuple[str, ...]:
        """The names that errors about unknown fields list."""
        return tuple(cls.model_fields)

    @classmethod
    def of_defaults(cls) -> Self:
        """The instance without arguments, made without the validator: for defaults of fields, which few recipes read."""
        return cls.model_construct()

    @classmethod
    def model_rebuild(cls, **options: Any) -> bool | None:
        """Build the validator of this class, as pydantic does when it is first used."""
        token = _built.set(cls)
        try:
            return super().model_rebuild(**options)
        finally:
            _built.reset(token)

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        if cls.IS_CHOICE or _built.get() is cls:
            return handler(source)
        return core_schema.with_info_plain_validator_function(
            cls._validated,
            ref=f"{cls.__module__}.{cls.__qualname__}:{id(cls)}",
            serialization=core_schema.plain_serializer_function_ser_schema(_written, info_arg=True),
        )

    @classmethod
    def _validated(cls, value: Any, info: ValidationInfo) -> Self:
        return cls.__pydantic_validator__.validate_python(value, context=info.context)

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        if schema["type"] == "function-plain":
            cls.model_rebuild()
            schema = cls.__pydantic_core_schema__
        return handler(schema)
