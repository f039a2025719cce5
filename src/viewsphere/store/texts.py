"""Parsing of untrusted JSON."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from typing import Any

import numpy as np

MOST_NESTED = 200
"""Largest nesting of lists and objects: more would exceed the recursion limit, and no data set has a tenth of it."""

_HALF = re.compile(r"\\u[dD][89a-fA-F]")
"""Start of the escape of an unpaired UTF-16 surrogate, which is not a character."""


def parsed(text: str | bytes, parse_constant: Callable[[str], Any] | None = None) -> Any:
    """The value of a JSON text; bytes are read as UTF-8. Raises ValueError for invalid or too deeply nested JSON, and for
    unpaired surrogates, which no other file could hold. `parse_constant` as for `json.loads`.
    """
    if isinstance(text, bytes):
        text = text.decode("utf-8-sig")
    if _nesting(text) > MOST_NESTED:
        raise ValueError(f"lists or objects nested too deeply, more than {MOST_NESTED} times")
    try:
        value = json.loads(text, parse_constant=parse_constant)
        if _HALF.search(text):
            json.dumps(value, ensure_ascii=False).encode()
    except UnicodeEncodeError as error:
        characters = ascii(error.object[error.start : error.end])
        raise ValueError(f"half of a UTF-16 pair, {characters:.40}, where a character is expected") from None
    return value


def _nesting(text: str) -> int:
    """Return the depth of nested brackets outside of quotes; texts with too few brackets are not counted and return 0."""
    if text.count("[") + text.count("{") <= MOST_NESTED:
        return 0
    outside = text.replace("\\\\", "").replace('\\"', "").split('"')[::2]
    brackets = "".join(outside).encode(errors="replace").translate(None, _NO_BRACKETS)
    steps = np.where(np.frombuffer(brackets, np.uint8) & 4, -1, 1)  # by which "]" and "}" differ from "[" and "{"
    return int(np.cumsum(steps, dtype=np.int32).max(initial=0))


_NO_BRACKETS = bytes(set(range(256)) - set(b"[]{}"))
