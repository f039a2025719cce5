"""A page is shown to others: it names files, not where on somebody's machine they are."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, cast

FOLDERS = re.compile(r"(?<![\w./:~\\-])(?:/(?:[^/\s'\",:;()]+/)+|[A-Za-z]:[\\/](?:[^\\/\s'\",:;()]+[\\/])+)(?=[^/\\\s])")
"""The folders of an absolute path, as POSIX and as Windows write one, before the name of its file."""


def without_folders(value: Any) -> Any:
    """Plain data whose texts have no absolute path: of each only the last name is left."""
    if isinstance(value, str):
        return FOLDERS.sub("", value)
    if isinstance(value, Mapping):
        return {key: without_folders(one) for key, one in cast(Mapping[str, Any], value).items()}
    if isinstance(value, (list, tuple)):
        return [without_folders(one) for one in cast(list[Any], value)]
    return value
