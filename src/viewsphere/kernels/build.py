"""The build of kernels: the versions and the processor that turn their sources into machine code. Determined without importing
numba, which is slow to load.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import version

import llvmlite.binding

QUICKER = ("0.66", "0.67", "0.68")
"""numba's minor versions whose internals match `compiler`; with other versions, `stock` compiles."""

NUMBA, LLVMLITE = version("numba"), version("llvmlite")
IS_STOCK = os.environ.get("VIEWSPHERE_STOCK_NUMBA", "0") != "0" or ".".join(NUMBA.split(".")[:2]) not in QUICKER
"""True if numba compiles kernels in its own way, as `VIEWSPHERE_STOCK_NUMBA=1` requests."""

COMMON = "x86-64-v3"
"""The processor type that kernels are compiled for on x86-64. Intel's processors support it since 2013 (Haswell), AMD's since
2015.
"""

NEEDED = ("avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe", "popcnt", "sse4.2")
"""LLVM's names of the instructions that code for `COMMON` uses."""


@dataclass(frozen=True)
class Target:
    """The processor that kernels are compiled for, by LLVM's name; its features; and the features of `COMMON` that this machine
    lacks.
    """

    cpu: str
    features: str = ""
    lacking: tuple[str, ...] = ()

    @staticmethod
    def for_machine(triple: str, host: str, features: Mapping[str, bool], native: bool) -> Target:
        """The target on a machine: `COMMON` on x86-64, so that all such machines run the same code. Other machines, those that
        lack its instructions, and `native` ones get code for their own processor.
        """
        is_x86 = triple.startswith(("x86_64", "amd64"))
        lacking = tuple(name for name in NEEDED if not features.get(name)) if is_x86 else ()
        if is_x86 and not lacking and not native:
            return Target(COMMON)
        return Target(host, ",".join(f"{'+' if has else '-'}{name}" for name, has in sorted(features.items())), lacking)

    @property
    def note(self) -> str:
        """Return the reason why this machine's kernels differ from those of other machines; empty if they do not."""
        if not self.lacking:
            return ""
        return f"note: this processor, {self.cpu}, lacks {', '.join(self.lacking)}, so kernels are compiled for it alone"


def _features() -> Mapping[str, bool]:
    try:
        return llvmlite.binding.get_host_cpu_features()
    except RuntimeError:  # LLVM finds none on some processors
        return {}


HOST = llvmlite.binding.get_host_cpu_name()
TRIPLE = llvmlite.binding.get_process_triple()
TARGET = Target.for_machine(TRIPLE, HOST, _features(), native=os.environ.get("VIEWSPHERE_NATIVE", "0") != "0")

_PYTHON = f"{sys.implementation.cache_tag}{getattr(sys, 'abiflags', '')}"
_NUMPY = version("numpy").partition(".")[0]  # numpy's major versions type constants differently

BUILD = (NUMBA, LLVMLITE, _PYTHON, _NUMPY, TRIPLE, TARGET.cpu, TARGET.features, IS_STOCK, os.environ.get("NUMBA_BOUNDSCHECK"))
"""The versions and settings that machine code depends on in addition to the sources."""

PAINTER = f"{HOST}, kernels for {TARGET.cpu}, numba {NUMBA}{' stock' if IS_STOCK else ''}, llvmlite {LLVMLITE}"
"""The processor type and the kernel build: if both are equal, pictures are equal to the last bit."""
