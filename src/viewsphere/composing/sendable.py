"""The common base of a plan's dataclasses that travel to worker processes."""

from __future__ import annotations

from dataclasses import fields
from typing import Any, cast


class Sendable:
    """A dataclass that is sent to other processes as its fields alone: derived values are computed again there."""

    def __getstate__(self) -> dict[str, Any]:
        """The fields by name."""
        return {field.name: getattr(self, field.name) for field in fields(cast(Any, self))}
