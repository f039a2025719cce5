"""numba's compiler with only the passes that kernels need, each done once.

Two thirds of the compile time are Python's own, not LLVM's.
"""

# pyright: reportAttributeAccessIssue=false, reportPrivateUsage=false, reportMissingTypeArgument=false
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false
# pyright: reportUnnecessaryComparison=false
# numba lets its users choose the passes and their order only through its internals.

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import ExitStack, contextmanager
from functools import cache
from typing import Any

from numba import _dynfunc
from numba.core import types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.postproc import PostProcessor, VariableLifetime
from numba.core.targetconfig import ConfigStack
from numba.core.transforms import canonicalize_cfg
from numba.core.typed_passes import (
    AnnotateTypes,
    IRLegalization,
    NativeLowering,
    NoPythonBackend,
    NopythonTypeInference,
    PreLowerStripPhis,
)
from numba.core.types.functions import BaseFunction
from numba.core.typing.templates import _OverloadFunctionTemplate
from numba.core.untyped_passes import (
    DeadBranchPrune,
    FixupArgs,
    GenericRewrites,
    IRProcessing,
    ReconstructSSA,
    RewriteSemanticConstants,
    TranslateByteCode,
)

from viewsphere.kernels.garbage import pause_collection
from viewsphere.kernels.numba_target import jit


@register_pass(mutates_CFG=True, analysis_only=False)
class Lifetimes(IRLegalization):
    """Marks the end of a variable only if that frees memory. numba marks the end of every variable, which LLVM then removes."""

    _name = "lifetimes"

    def run_pass(self, state: Any) -> Any:
        """Returns whether anything changed."""
        return state.flags.nrt and super().run_pass(state)


PASSES = (
    TranslateByteCode,
    FixupArgs,
    IRProcessing,
    RewriteSemanticConstants,
    GenericRewrites,
    ReconstructSSA,
    DeadBranchPrune,
    NopythonTypeInference,
    PreLowerStripPhis,
    Lifetimes,
    AnnotateTypes,
    NativeLowering,
    NoPythonBackend,
)
"""numba's passes except for closures, `with`, `literally`, raising computed errors, and whole-array expressions."""

_PLAIN = (types.Number, types.Boolean, types.Array, types.BaseTuple)
_resolve = BaseFunction.get_call_type


@cache
def _resolved(function: Any, context: Any, args: tuple[Any, ...], _how: tuple[Any, ...]) -> Any:
    return _resolve(function, context, args, {})


def _resolve_once(function: Any, context: Any, args: tuple[Any, ...], kws: dict[str, Any]) -> Any:
    """numba's signature of a function for these types. It is cached, since numba would otherwise try all overloads at every
    call.
    """
    if kws or not all(isinstance(arg, _PLAIN) for arg in args):
        return _resolve(function, context, args, kws)
    flags = ConfigStack().top()
    how = frozenset(flags.fastmath.flags), flags.nrt, flags.error_model, flags.boundscheck
    return _resolved(function, context, args, how)


def _as_part(**options: Any) -> Any:
    """`jit` for numba's own functions that kernels call, such as `min` or `np.empty`."""
    return jit(**{**options, **PART})


def _decorator(_: Any) -> Any:
    return _as_part


_post_process = PostProcessor.run


def _tidy(self: PostProcessor, emit_dels: bool = False, extend_lifetimes: bool = False) -> None:
    """Order the blocks, and compute variable lifetimes only on request; numba would do so after every pass."""
    if emit_dels:
        _post_process(self, emit_dels, extend_lifetimes)
    else:
        self.func_ir.blocks = canonicalize_cfg(self.func_ir.blocks)
        self.func_ir.variable_lifetime = VariableLifetime(self.func_ir.blocks)


_QUICKER = (
    (BaseFunction, "get_call_type", _resolve_once),
    (_OverloadFunctionTemplate, "_get_jit_decorator", _decorator),
    (PostProcessor, "run", _tidy),
)


@contextmanager
def _quickly() -> Generator[None]:
    """A context in which types are resolved once, numba's functions become parts like ours, and no garbage is collected."""
    with global_compiler_lock, pause_collection(), ExitStack() as then:
        for owner, name, quicker in _QUICKER:
            then.callback(setattr, owner, name, getattr(owner, name))
            setattr(owner, name, quicker)
        yield


class _Whole(JITCodeLibrary):
    """Code that is optimized once, together with all of its parts; numba would optimize it three times."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        passes, builder = self._codegen._module_pass_manager()
        passes.run(self._final_module, builder)


class _Part(_Whole):
    """Code that is neither optimized nor translated separately: its callers do both for all of their parts at once."""

    def finalize(self) -> None:
        for library in dict.fromkeys(self._linking_libraries):
            self._reload_init.update(library._reload_init)
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        self._finalize_dynamic_globals()
        self._finalized = True


class Kernel(CompilerBase):
    """Compiles functions as a whole."""

    def define_pipelines(self) -> list[PassManager]:
        """The one list of passes."""
        passes = PassManager("kernel")
        for each in PASSES:
            passes.add_pass(each, each.__name__)
        passes.finalize()
        return [passes]

    def compile_extra(self, func: Callable[..., Any]) -> Any:
        """Compiles the function; returns numba's result."""
        self.state.library = _Whole(self.state.targetctx.codegen(), func.__qualname__)
        self.state.library.enable_object_caching()
        with _quickly():
            return super().compile_extra(func)


class Part(Kernel):
    """Compiles functions to parts of kernels, which Python cannot call."""

    def compile_extra(self, func: Callable[..., Any]) -> Any:
        """Compiles the function; returns numba's result, without an address."""
        state = self.state
        state.library = _Part(state.targetctx.codegen(), func.__qualname__)
        state.flags.no_compile = True
        made = CompilerBase.compile_extra(self, func)
        # numba identifies an overload by this function object, which is never called.
        key = _dynfunc.make_function(made.fndesc.lookup_module(), func.__name__, "", 0, made.environment, (made.library,))
        state.targetctx.insert_user_function(key, made.fndesc, [made.library])
        return made._replace(entry_point=key)


PART: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "pipeline_class": Part}
"""Options of `Part`'s compilation."""


def whole(function: Callable[..., Any], **options: Any) -> Any:
    """A function compiled as a kernel and cached; it allocates no arrays unless `_nrt`."""
    how: dict[str, Any] = {"no_cfunc_wrapper": True, "pipeline_class": Kernel, "_nrt": False, **options}
    return jit(**how, cache=True)(function)


def part(function: Callable[..., Any], **options: Any) -> Any:
    """A function compiled as a part of kernels; it allocates no arrays unless `_nrt`, and Python cannot call it."""
    how: dict[str, Any] = {**PART, "_nrt": False, **options}
    return jit(**how)(function)
