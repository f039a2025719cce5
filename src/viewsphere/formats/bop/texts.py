"""BOP's JSON files."""

from __future__ import annotations

from pathlib import Path
from typing import Any, cast

from viewsphere.errors import StoreError
from viewsphere.files import read_bytes
from viewsphere.store.texts import parsed


def load(file: Path) -> dict[str, Any]:
    """One of BOP's JSON files, an object; an empty one where there is no such file. Raises StoreError for another."""
    if not file.is_file():
        return {}
    try:
        found = parsed(read_bytes(file, "MAX_RECORD_BYTES"))
    except (OSError, ValueError) as error:
        raise StoreError(f"{file}: expected BOP's JSON; found: {error}") from None
    if not isinstance(found, dict):
        raise StoreError(f"{file}: expected an object of images; found something else")
    return cast(dict[str, Any], found)
