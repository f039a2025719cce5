"""Compile kernels once, whatever the number of processes: numba with a cache that is never stale.

numba's own cache misses changes in functions that a kernel calls from another file, so each kernel is cached in a
folder keyed by a digest of its source file, of the files of all kernels it can call and of the constants they use, of
numba's version and of the processor's name.

Which compiler is used: `compiler` for versions of numba that it is tested with, else `stock`.
"""

from __future__ import annotations

import atexit
import hashlib
import os
import re
import sys
import tempfile
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from functools import cache, partial
from pathlib import Path
from threading import Lock
from typing import Any

from numba.core import config

from viewsphere.aside import STALE_S, Aside, sweep
from viewsphere.files import read_bytes, read_text
from viewsphere.kernels.kernel_cache import BUILD, IS_STOCK, kernel_folder

if IS_STOCK:
    from viewsphere.kernels import stock as compiler
else:
    from viewsphere.kernels import compiler

_IMPORT = re.compile(r"^from (viewsphere[\w.]*) import", re.MULTILINE)
_COMPILER = tuple(str(Path(__file__).with_name(f"{name}.py")) for name in ("jit", "stock", "compiler", "lowering"))
_EXACT: dict[str, Any] = {"nogil": True, "error_model": "numpy"}
_config: Any = config
_configuring = Lock()


def njit(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """`numba.njit` as every kernel uses it: no GIL, cached, numpy's division, exact unless `fastmath` is given.

    Kernels that allocate arrays need `_nrt`; others go without, since counting references to arrays takes long to compile.
    """
    if function is None:
        return partial(njit, **options)
    with _cached_in(_cache_folder(_sources(function.__code__.co_filename))):
        return compiler.whole(function, **{**_EXACT, **options})


def inner(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """`njit` for functions that only kernels call: a part of each such kernel, neither optimized nor cached by itself.

    Optimizing would take most of the time. Python cannot call a part, and it allocates no arrays unless `_nrt`.
    """
    if function is None:
        return partial(inner, **options)
    return compiler.part(function, **{**_EXACT, **options})


@contextmanager
def _cached_in(folder: str) -> Generator[None]:
    """Functions that are made and cached in this context are kept in `folder`: numba reads the setting when it makes them.

    The setting belongs to the whole process, so the user's value is restored at once.
    """
    with _configuring:
        before = _config.CACHE_DIR
        _config.CACHE_DIR = folder
        try:
            yield
        finally:
            _config.CACHE_DIR = before


@cache
def _sources(file: str) -> frozenset[str]:
    """A kernel's file, the files of the kernels it can reach, those from which these import their constants, and the `records`
    beside them: tuples that kernels are given, whose fields and names compiled code knows.
    """
    found, waiting = {file}, [file]
    while waiting:
        for name in _IMPORT.findall(read_text(Path(waiting.pop()))):
            source = getattr(sys.modules.get(name), "__file__", None)
            if source is not None and source not in found:
                found.add(source)
                if name.rpartition(".")[2].startswith("kernels"):
                    waiting.append(source)
    records = (Path(source).with_name("records.py") for source in found)
    return frozenset(found).union(str(file) for file in records if file.is_file())


@cache
def _cache_folder(sources: frozenset[str]) -> str:
    """A writable folder for these sources: in the user's cache, else in the temporary folder."""
    digest = hashlib.sha256(repr(BUILD).encode())
    for source in (*_COMPILER, *sorted(sources)):
        digest.update(read_bytes(Path(source)))
    for root in (kernel_folder(), Path(tempfile.gettempdir()) / f"viewsphere-{Path.home().name}" / "kernels"):
        folder = root / digest.hexdigest()[:16]
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder, os.W_OK):
            _sweep(folder)
            return str(folder)
    place, prefix = Path(tempfile.gettempdir()), "viewsphere-kernels-"
    sweep(place, prefix)
    made = Aside.make(place, prefix)
    atexit.register(made.remove)
    return str(made.folder)


def _sweep(folder: Path) -> None:
    """Remove what numba was writing when its process was killed, long ago: whose that was nobody knows."""
    for left in folder.glob("*.tmp.*"):
        with suppress(OSError):
            if left.stat().st_mtime < time.time() - STALE_S:
                left.unlink()
