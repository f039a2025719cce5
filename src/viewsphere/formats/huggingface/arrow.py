"""pyarrow, from the extra `huggingface`."""

from __future__ import annotations

from typing import Any

from viewsphere.errors import MissingExtraError


def arrow() -> Any:
    """The package, with `parquet`; raises MissingExtraError if it is missing."""
    try:
        import pyarrow.parquet  # pyright: ignore[reportUnusedImport]  # it becomes an attribute
    except ImportError:
        raise MissingExtraError(
            "format huggingface: expected pyarrow, found none: pip install 'viewsphere[huggingface]'"
        ) from None
    return pyarrow
