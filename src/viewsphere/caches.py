"""Where viewsphere keeps what it can make again."""

from __future__ import annotations

import os
from pathlib import Path

import platformdirs


def cache_of(what: str) -> Path:
    """The folder for one kind of it: `$VIEWSPHERE_CACHE/<what>`, else in the user's cache folder; it need not be there."""
    return Path(os.environ.get("VIEWSPHERE_CACHE") or platformdirs.user_cache_dir("viewsphere")) / what
