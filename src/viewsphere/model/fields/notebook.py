"""The base class of objects that notebooks show as HTML. The package's root sets the function that makes the HTML."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar


class Shown:
    """An object that notebooks show as HTML instead of text."""

    html_of: ClassVar[Callable[[Any], str]]
    """Returns the HTML of such an object; set when the package is imported."""

    def _repr_html_(self) -> str:
        return type(self).html_of(self)
