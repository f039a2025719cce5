"""Reproducible results that viewsphere caches: one folder with one size limit, addressed by content.

    <cache>/<kind>/<digest>.arrays    an entry of `arrays`: JSON and numpy arrays, checked by a digest, mapped into memory
    <cache>/<kind>/<digest>.file      a file of an entry of `folders`
    <cache>/<kind>/...                other files of a kind, such as compiled kernels
    <cache>/written                   how much was written since the budget was last checked, see `budget`

`budget` deletes the entries that were used longest ago. Other folders of the cache hold downloads, which stay.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

import platformdirs

KINDS: Mapping[str, str] = {
    "exports": "models as data sets have them, OBJ and GLB",
    "kernels": "compiled kernels",
    "light": "baked light",
    "models": "model files as they were read",
    "parts": "convex parts of models",
    "textures": "textures of places at all sizes",
    "zoo": "models of the zoo",
}
"""Folders of the cache and a description of their content. All of it can be recreated."""


def cache_folder() -> Path:
    """The folder of all caches: `$VIEWSPHERE_CACHE`, else viewsphere's folder in the user's cache folder. It may not exist."""
    return Path(os.environ.get("VIEWSPHERE_CACHE") or platformdirs.user_cache_dir("viewsphere"))


def cache_of(kind: str) -> Path:
    """The folder of one kind of entries. It may not exist."""
    return cache_folder() / kind
