"""A numba target for the processor that kernels are compiled for, separate from numba's own target for the user's functions.

A separate target (numba.core.target_extension) has its own compiled parts, types and machine code. So it never affects a
function that the user compiles, whether before, after or at the same time.
"""

# pyright: reportAttributeAccessIssue=false, reportPrivateUsage=false, reportMissingTypeArgument=false
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false
# pyright: reportUnnecessaryComparison=false, reportIncompatibleMethodOverride=false, reportCallIssue=false
# pyright: reportIncompatibleVariableOverride=false
# numba documents targets only by an example, and its stubs omit them.

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Callable, Iterator
from typing import Any

import numba
from numba import types
from numba.core.caching import _Cache
from numba.core.codegen import JITCodeLibrary, JITCPUCodegen
from numba.core.compiler import CompileResult
from numba.core.cpu import CPUContext
from numba.core.dispatcher import Dispatcher
from numba.core.registry import CPUTarget
from numba.core.runtime.nrt import rtsys
from numba.core.serialize import dumps
from numba.core.target_extension import CPU, dispatcher_registry, jit_registry, target_override, target_registry
from numba.core.utils import threadsafe_cached_property

from viewsphere.kernels import entries
from viewsphere.kernels.build import TARGET
from viewsphere.kernels.digests import sources_digest

NAME = "viewsphere"
_ANNOTATION = 5  # its place among `CompileResult._reduce`'s values behind the library


class ViewsphereCPU(CPU):
    """The kind of target; everything that numba offers for its own CPU target also applies here."""


class _Loaded(JITCodeLibrary):
    """Machine code from the cache, without the data for linking it. Its symbols are not listed, which halves the load time."""

    @classmethod
    def _unserialize(cls, codegen: Any, state: Any) -> Any:
        name, _, (machine_code, _) = state
        self = cls(codegen, name)
        self.enable_object_caching()
        self._set_compiled_object(machine_code)
        self._finalize_final_module()
        return self

    def get_pointer_to_function(self, name: str) -> int:
        """Returns the address of the function of this name, which must be in this code."""
        return self._codegen._engine.get_function_address(name)


class _Codegen(JITCPUCodegen):
    """Machine code for `TARGET`, regardless of numba's processor settings."""

    def _get_host_cpu_name(self) -> str:
        return TARGET.cpu

    def _get_host_cpu_features(self) -> str:
        return TARGET.features

    def unserialize_library(self, serialized: Any) -> Any:
        """The code of an entry."""
        return _Loaded._unserialize(self, serialized)


class _Context(CPUContext):
    def init(self) -> None:
        """Prepare for compiling."""
        super().init()
        self._internal_codegen = _Codegen("viewsphere.exec")


class _Descriptor(CPUTarget):
    @threadsafe_cached_property
    def _toplevel_target_context(self) -> Any:
        return _Context(self.typing_context, self._target_name)


class _KernelCache(_Cache):
    """Compiled overloads of a kernel, in `entries`."""

    def __init__(self, kernel: Dispatcher) -> None:
        self._function = kernel.py_func
        self._options = sorted((name, _stable(value)) for name, value in kernel.targetoptions.items())
        self.names = list[str]()

    @property
    def cache_path(self) -> str:
        """The folder of entries."""
        return str(entries.kernel_folder())

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compiled function for these types, None if there is none. This skips numba's preparation for compiling, which
        takes a second.
        """
        name = self._name(sig)
        content = entries.load(name)
        if content is None:
            return None
        rtsys.initialize(target_context)
        try:
            loaded = CompileResult._rebuild(target_context, *pickle.loads(content))
        except (AttributeError, ImportError):  # classes that were renamed since
            return None
        self.names.append(name)
        return loaded

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store a compiled function."""
        if not data.library.has_dynamic_globals:
            self.names.append(self._name(sig))
            entries.save(self.names[-1], dumps(_slim(*data._reduce())))

    def enable(self) -> None:
        """Nothing: it is always on."""

    def disable(self) -> None:
        """Nothing: it is always on."""

    def flush(self) -> None:
        """Nothing: entries are never out of date."""

    def _name(self, sig: Any) -> str:
        code = self._function.__code__
        cells = dumps(tuple(cell.cell_contents for cell in self._function.__closure__ or ()))
        about = repr((str(sig), tuple(_fields(sig)), self._options, code.co_firstlineno, code.co_code)).encode() + cells
        module = self._function.__module__.rpartition(".")[2]
        kernel = f"{module}.{self._function.__qualname__}".replace("<locals>", "locals")
        digest = hashlib.sha256(about).hexdigest()[:16]
        return f"{sources_digest(code.co_filename)}/{kernel}-{digest}{entries.SUFFIX}"


def _fields(kinds: Any) -> Iterator[tuple[str, ...]]:
    """The field names of all named tuples among types: code depends on their order, which printed types omit."""
    for kind in kinds:
        if isinstance(kind, types.BaseNamedTuple):
            yield kind.fields
        if isinstance(kind, types.BaseTuple):
            yield from _fields(kind)


def _slim(library: Any, *rest: Any) -> tuple[Any, ...]:
    """A compiled function as numba pickles it, without bitcode and text annotations, which are three quarters of its bytes."""
    name, kind, (machine_code, _) = library
    made = list(rest)
    made[_ANNOTATION] = ""
    return ((name, kind, (machine_code, b"")), *made)


def _stable(option: Any) -> str:
    """A text of an option that is the same in every process: sets of texts have a different order in each."""
    return repr(sorted(option) if isinstance(option, set | frozenset) else option)


class KernelDispatcher(Dispatcher):
    """A function that is compiled for `TARGET`."""

    targetdescr = _Descriptor(NAME)

    def enable_caching(self) -> None:
        """Look for compiled overloads in `entries`, and keep new ones there."""
        self._cache = _KernelCache(self)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """The call template for a function being compiled. Such a call links the code of this function, which entries lack."""
        types = tuple(self._compiler.fold_argument_types(args, kws)[1])
        self.compile(types)
        loaded = self.overloads.get(types)
        if loaded is not None and isinstance(loaded.library, _Loaded):
            with target_override(NAME):
                self.overloads[types] = self._compiler.compile(types, None)
        return super().get_call_template(args, kws)

    def compile(self, sig: Any) -> Any:
        """Load or compile the overload for these types."""
        with target_override(NAME):
            return super().compile(sig)


def jit(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """`numba.jit` for the target."""
    return numba.jit(**options, _target=NAME)


target_registry[NAME] = ViewsphereCPU
dispatcher_registry[ViewsphereCPU] = KernelDispatcher
jit_registry[ViewsphereCPU] = jit
