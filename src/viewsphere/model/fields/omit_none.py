"""Plain data that is written without its unset fields."""

from typing import Any, ClassVar

from pydantic import SerializerFunctionWrapHandler, model_serializer

from viewsphere.model.fields.frozen import Frozen


class OmitNone(Frozen):
    """Plain data that is written without the fields of `OMIT_IF_NONE` that are None."""

    OMIT_IF_NONE: ClassVar[tuple[str, ...]] = ()

    @model_serializer(mode="wrap")
    def _without_none(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        plain: dict[str, Any] = handler(self)
        for name in self.OMIT_IF_NONE:
            if getattr(self, name) is None:
                plain.pop(name, None)
        return plain
