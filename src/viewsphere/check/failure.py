"""The message for a proof that broke off."""

from __future__ import annotations

from pydantic import ValidationError

from viewsphere.errors import ViewsphereError
from viewsphere.validation.errors import first_of

_BY_DATA = (
    *(ViewsphereError, OSError, LookupError, TypeError, ValueError, AttributeError, ArithmeticError),
    AssertionError,  # pycocotools refuses files by assertions
)
"""Exceptions that damaged data causes."""


def failure(expected: str, error: Exception) -> str:
    """The message that `expected` was not found, or, for an exception that data cannot cause, that the check is at fault."""
    found = f"{type(error).__name__}: {first_of(error) if isinstance(error, ValidationError) else error}"
    by_data = isinstance(error, _BY_DATA) or type(error) is Exception  # pycocotools raises bare ones for wrong polygons
    return f"expected {expected}, found {found}" if by_data else f"the check itself failed: {found}"
