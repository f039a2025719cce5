"""Compile kernels once, whatever the number of processes: numba with a cache that is never stale.

numba's own cache misses changes in functions that a kernel calls from another file, so each kernel is cached in a
folder keyed by a digest of its source file, of the files of all kernels it can call and of the constants they use, of
numba's version and of the processor's name.
"""

# pyright: reportAttributeAccessIssue=false, reportPrivateUsage=false
# Only through its internals does numba let others choose what is optimized when.

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

import llvmlite.binding
import numba
import platformdirs
from numba import _dynfunc
from numba.core import config
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler

_IMPORT = re.compile(r"^from (viewsphere[\w.]*) import", re.MULTILINE)
_BUILD = (numba.__version__, llvmlite.binding.get_host_cpu_name(), os.environ.get("NUMBA_BOUNDSCHECK"))


def njit(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """`numba.njit` as every kernel uses it: no GIL, cached, numpy's division, exact unless `fastmath` is given."""
    if function is None:
        return partial(njit, **options)
    if not os.environ.get("NUMBA_CACHE_DIR"):
        folder = _cache_folder(_sources(function.__code__.co_filename))
        setattr(config, "CACHE_DIR", folder)  # noqa: B010, not in its stubs
    return numba.njit(nogil=True, cache=True, error_model="numpy", pipeline_class=_Kernel, **options)(function)


def inner(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """`njit` for what only kernels call: a part of each of them, neither optimized nor cached by itself.

    That takes most of the time. Python cannot call it.
    """
    if function is None:
        return partial(inner, **options)
    parts = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "pipeline_class": _Inner}
    return numba.njit(nogil=True, error_model="numpy", **parts, **options)(function)


class _Whole(JITCodeLibrary):
    """Code that is optimized once, with all of its parts: numba's own goes through three times."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        passes, builder = self._codegen._module_pass_manager()
        passes.run(self._final_module, builder)


class _Part(_Whole):
    """Code that is neither optimized nor translated by itself: those that call it do both with all of their parts at once."""

    def finalize(self) -> None:
        for library in dict.fromkeys(self._linking_libraries):
            self._reload_init.update(library._reload_init)
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        self._finalize_dynamic_globals()
        self._finalized = True


class _Kernel(Compiler):
    """Compiles functions as a whole."""

    def compile_extra(self, func: Callable[..., Any]) -> Any:
        self.state.library = _Whole(self.state.targetctx.codegen(), func.__qualname__)
        self.state.library.enable_object_caching()
        return super().compile_extra(func)


class _Inner(Compiler):
    """Compiles functions to parts."""

    def compile_extra(self, func: Callable[..., Any]) -> Any:
        state = self.state
        state.library = _Part(state.targetctx.codegen(), func.__qualname__)
        state.flags.no_compile = True
        made = super().compile_extra(func)
        # What numba knows an overload by; there is nothing to call.
        key = _dynfunc.make_function(made.fndesc.lookup_module(), func.__name__, "", 0, made.environment, (made.library,))
        state.targetctx.insert_user_function(key, made.fndesc, [made.library])
        return made._replace(entry_point=key)


def kernel_folder() -> Path:
    """Where compiled kernels are kept: `$VIEWSPHERE_CACHE/kernels`, else in the user's cache folder."""
    return Path(os.environ.get("VIEWSPHERE_CACHE") or platformdirs.user_cache_dir("viewsphere")) / "kernels"


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
    digest = hashlib.sha256(repr(_BUILD).encode())
    for source in sorted(sources):
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
