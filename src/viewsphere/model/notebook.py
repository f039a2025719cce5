"""What shows itself in notebooks. How it looks, a layer above says, and the package's root tells it here."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar


class Shown:
    """Something of which notebooks show HTML instead of text."""

    html_of: ClassVar[Callable[[Any], str]]
    """Makes the HTML of any of these; set when the package is imported."""

    def _repr_html_(self) -> str:
        return type(self).html_of(self)
