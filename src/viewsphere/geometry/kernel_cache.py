"""Where compiled kernels are kept, and what they depend on. Told without numba, which takes long to load."""

from __future__ import annotations

import hashlib
import os
from functools import cache
from importlib.metadata import version
from pathlib import Path

import llvmlite.binding
import platformdirs

BUILD = (version("numba"), llvmlite.binding.get_host_cpu_name(), os.environ.get("NUMBA_BOUNDSCHECK"))
"""What turns sources into the machine's code, and for which processor."""


def kernel_folder() -> Path:
    """Where compiled kernels are kept: `$NUMBA_CACHE_DIR`, `$VIEWSPHERE_CACHE/kernels`, or in the user's cache folder."""
    if os.environ.get("NUMBA_CACHE_DIR"):
        return Path(os.environ["NUMBA_CACHE_DIR"])
    return Path(os.environ.get("VIEWSPHERE_CACHE") or platformdirs.user_cache_dir("viewsphere")) / "kernels"


@cache
def sources_digest(folder: Path) -> str:
    """A digest of all Python sources in a folder, of numba and of the processor: equal ones compile to equal kernels."""
    digest = hashlib.sha256(repr(BUILD).encode())
    for source in sorted(folder.rglob("*.py")):
        digest.update(source.relative_to(folder).as_posix().encode() + b"\0" + source.read_bytes())
    return digest.hexdigest()
