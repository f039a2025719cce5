"""Where compiled kernels are kept, and what they depend on; found without importing numba, which takes long to load."""

from __future__ import annotations

import hashlib
import os
import sys
from functools import cache
from importlib.metadata import version
from pathlib import Path

import llvmlite.binding

from viewsphere.caches import cache_of
from viewsphere.files import read_bytes

QUICKER = ("0.66", "0.67", "0.68")
"""numba's minor versions whose internals are as `compiler` and `lowering` expect; with other versions `stock` compiles."""

NUMBA = version("numba")
IS_STOCK = os.environ.get("VIEWSPHERE_STOCK_NUMBA", "0") != "0" or ".".join(NUMBA.split(".")[:2]) not in QUICKER
"""Whether numba compiles kernels in its own way, as `VIEWSPHERE_STOCK_NUMBA=1` asks."""

BUILD = (NUMBA, IS_STOCK, llvmlite.binding.get_host_cpu_name(), os.environ.get("NUMBA_BOUNDSCHECK"))
"""The versions that turn sources into machine code, and the processor that the code is for."""

PAINTER = f"{BUILD[2]}, numba {NUMBA}{' stock' if IS_STOCK else ''}"
"""The processor type and the kernel build: where both are equal, pictures are equal to the last bit."""


def kernel_folder() -> Path:
    """Where compiled kernels are kept: `$NUMBA_CACHE_DIR`, `$VIEWSPHERE_CACHE/kernels`, or in the user's cache folder."""
    if os.environ.get("NUMBA_CACHE_DIR"):
        return Path(os.environ["NUMBA_CACHE_DIR"])
    return cache_of("kernels")


@cache
def sources_digest(folder: Path) -> str:
    """A digest of everything on which compiled kernels depend: place and time of every Python source in a folder, as numba
    checks them too; Python, numba and the processor.
    """
    digest = hashlib.sha256(repr((BUILD, sys.implementation.cache_tag)).encode())
    for source in sorted(folder.rglob("*.py")):
        about = source.stat()
        digest.update(repr((str(source), about.st_mtime_ns, about.st_size)).encode() + read_bytes(source))
    return digest.hexdigest()
