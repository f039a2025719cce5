"""The one base of all plain data: immutable, strict about names, finite numbers only."""

from __future__ import annotations

from typing import Any, Self

from pydantic import BaseModel, ConfigDict, ModelWrapValidatorHandler, ValidationError, model_validator

from viewsphere.model.mistakes import explained


class Frozen(BaseModel):
    """An immutable value; unknown fields, NaN and infinity are errors, and the nearest valid field is named."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @model_validator(mode="wrap")
    @classmethod
    def _explain(cls, data: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        try:
            return handler(data)
        except ValidationError as error:
            raise explained(error, tuple(cls.model_fields)) from None
