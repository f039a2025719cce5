"""Plain data that is written without what it does not say."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import SerializerFunctionWrapHandler, model_serializer

from viewsphere.model.frozen import Frozen


class Brief(Frozen):
    """Is written without its fields in `UNSAID` where these are None. A field that classes get later belongs there: records and
    digests without it stay what they were.
    """

    UNSAID: ClassVar[tuple[str, ...]] = ()

    @model_serializer(mode="wrap")
    def _without_unsaid(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        found: dict[str, Any] = handler(self)
        for name in self.UNSAID:
            if getattr(self, name) is None:
                found.pop(name, None)
        return found
