"""Digests of kernels' sources, by their content alone."""

from __future__ import annotations

import hashlib
import os
import re
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from viewsphere.files import read_bytes, read_text
from viewsphere.kernels.build import BUILD

_IMPORT = re.compile(r"^from (viewsphere[\w.]*) import", re.MULTILINE)
_HERE = Path(__file__).parent
_COMPILER = tuple(_HERE / f"{name}.py" for name in ("jit", "stock", "compiler", "numba_target"))


@cache
def sources_digest(file: str) -> str:
    """A digest of all sources that the code of a file's kernels depends on.

    numba's own cache misses changes in functions that a kernel calls from another file.
    """
    digest = hashlib.sha256(repr(BUILD).encode())
    for name, content in sorted(_named(source) for source in {*_COMPILER, *_sources(Path(file))}):
        digest.update(f"{len(name)} {len(content)} {name}".encode() + content)
    return digest.hexdigest()[:16]


@cache
def package_digest(folder: Path) -> str:
    """A digest of every Python source in a folder, and of the build."""
    digest = hashlib.sha256(repr(BUILD).encode())
    for name in sorted(_python_files(str(folder))):
        with open(f"{folder}{os.sep}{name}", "rb", buffering=0) as source:  # noqa: PTH123 # a thousand files: Path takes 4 times as long
            digest.update(f"{name}\0".encode() + source.read())
    return digest.hexdigest()


def _python_files(folder: str, below: str = "") -> Iterator[str]:
    """The names of all Python sources below a folder, with slashes."""
    with os.scandir(f"{folder}{os.sep}{below}") as entries:
        for entry in entries:
            if entry.name.endswith(".py"):
                yield below + entry.name
            elif entry.is_dir() and entry.name != "__pycache__":
                yield from _python_files(folder, f"{below}{entry.name}/")


def _named(source: Path) -> tuple[str, bytes]:
    package = _HERE.parent
    name = source.relative_to(package).as_posix() if source.is_relative_to(package) else source.name
    return name, read_bytes(source)


def _sources(file: Path) -> frozenset[Path]:
    """A kernel's file, the files of all kernels that it can reach, and the files from which they import constants."""
    reached, waiting = {file}, [file]
    while waiting:
        for name in _IMPORT.findall(read_text(waiting.pop())):
            source = getattr(sys.modules.get(name), "__file__", None)
            if source is not None and Path(source) not in reached:
                reached.add(Path(source))
                if name.rpartition(".")[2].startswith("kernels"):
                    waiting.append(Path(source))
    return frozenset(reached)
