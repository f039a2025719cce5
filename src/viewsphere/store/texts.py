"""JSON that a stranger may have written."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from typing import Any

_HALF = re.compile(r"\\u[dD][89a-fA-F]")
"""What begins half of a pair of UTF-16, which is no character by itself."""


def parsed(text: str | bytes, parse_constant: Callable[[str], Any] | None = None) -> Any:
    """The value in a JSON text, UTF-8 where it is bytes. Raises ValueError for any other text, for one nested too deeply,
    and for one with halves of characters, which no other file could hold. `parse_constant` as for `json.loads`.
    """
    if isinstance(text, bytes):
        text = text.decode("utf-8-sig")
    try:
        value = json.loads(text, parse_constant=parse_constant)
        if _HALF.search(text):
            json.dumps(value, ensure_ascii=False).encode()
    except RecursionError:
        raise ValueError("lists or objects nested too deeply") from None
    except UnicodeEncodeError as error:
        found = ascii(error.object[error.start : error.end])
        raise ValueError(f"half of a UTF-16 pair, {found:.40}, where a character is expected") from None
    return value
