"""Compile kernels once, whatever the number of processes: numba with a cache that is never stale.

numba's own cache misses changes in functions that a kernel calls from another file, so each kernel is cached in a
folder keyed by a digest of its source file, of the files of all kernels it can call and of the constants they use, of
numba's version and of the processor's name.
"""

from __future__ import annotations

import hashlib
import os
import re
import sys
import tempfile
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any

import numba
from numba.core import config

from viewsphere.kernels import compiler
from viewsphere.kernels.kernel_cache import BUILD, kernel_folder

_IMPORT = re.compile(r"^from (viewsphere[\w.]*) import", re.MULTILINE)
_COMPILER = tuple(str(Path(__file__).with_name(f"{name}.py")) for name in ("jit", "compiler", "lowering"))


def njit(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """`numba.njit` as every kernel uses it: no GIL, cached, numpy's division, exact unless `fastmath` is given.

    Kernels that allocate arrays need `_nrt`: to count what refers to arrays takes long to compile.
    """
    if function is None:
        return partial(njit, **options)
    if not os.environ.get("NUMBA_CACHE_DIR"):
        folder = _cache_folder(_sources(function.__code__.co_filename))
        setattr(config, "CACHE_DIR", folder)  # noqa: B010, not in its stubs
    whole: dict[str, Any] = {"no_cfunc_wrapper": True, "pipeline_class": compiler.Kernel, "_nrt": False}
    made = numba.njit(nogil=True, error_model="numpy", **{**whole, **options})(function)
    setattr(made, "_cache", compiler.KernelCache(function))  # noqa: B010, not in its stubs
    return made


def inner(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """`njit` for what only kernels call: a part of each of them, neither optimized nor cached by itself.

    That takes most of the time. Python cannot call it, and it allocates no arrays unless `_nrt`.
    """
    if function is None:
        return partial(inner, **options)
    part: dict[str, Any] = {**compiler.PART, "_nrt": False, **options}
    return numba.njit(nogil=True, error_model="numpy", **part)(function)


@cache
def _sources(file: str) -> frozenset[str]:
    """A kernel's file, the kernels' files within its reach, and the files that those import from here for their constants."""
    found, waiting = {file}, [file]
    while waiting:
        for name in _IMPORT.findall(Path(waiting.pop()).read_text(encoding="utf-8")):
            source = getattr(sys.modules.get(name), "__file__", None)
            if source is not None and source not in found:
                found.add(source)
                if name.rpartition(".")[2].startswith("kernels"):
                    waiting.append(source)
    return frozenset(found)


@cache
def _cache_folder(sources: frozenset[str]) -> str:
    """A writable folder for these sources: in the user's cache, else in the temporary folder."""
    digest = hashlib.sha256(repr(BUILD).encode())
    for source in (*_COMPILER, *sorted(sources)):
        digest.update(Path(source).read_bytes())
    for root in (kernel_folder(), Path(tempfile.gettempdir()) / f"viewsphere-{Path.home().name}" / "kernels"):
        folder = root / digest.hexdigest()[:16]
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder, os.W_OK):
            return str(folder)
    return tempfile.mkdtemp(prefix="viewsphere-kernels-")
