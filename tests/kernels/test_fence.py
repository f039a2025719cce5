"""The modules that use numba's internals: `numba_target` always, `compiler` beside a numba that it is tested with."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

import viewsphere
from viewsphere.kernels.build import NUMBA, QUICKER

PACKAGE = Path(viewsphere.__file__).parent
INSIDERS = {"kernels/compiler.py", "kernels/numba_target.py"}
PUBLIC = {"numba", "numba.extending", "numba.core.config", "numba.core.cgutils"}
"""What numba documents: `config` for its settings, `cgutils` for the code of intrinsics."""

LOADED = """
import importlib.metadata, sys
numba = sys.argv[1]
found = importlib.metadata.version
importlib.metadata.version = lambda name: numba if name == "numba" else found(name)
import numpy as np
from viewsphere.geometry.lenses.shared.kernels_lens import radial_fisheye
assert radial_fisheye(np.zeros(4), 0.5)[0] == 0.5
print(*(name for name in ("compiler", "stock") if f"viewsphere.kernels.{name}" in sys.modules))
"""


def imported(file):
    """Names of the modules of numba that a file imports."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names if name.name.split(".")[0] == "numba")
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "numba":
            of_core = node.module == "numba.core"
            yield from (f"numba.core.{name.name}" if of_core else node.module for name in node.names)


@pytest.mark.slow
def test_only_the_compiler_knows_numba_from_within():
    files = {file.relative_to(PACKAGE).as_posix(): set(imported(file)) - PUBLIC for file in PACKAGE.rglob("*.py")}
    assert {file for file, names in files.items() if names} == INSIDERS


@pytest.mark.slow
@pytest.mark.parametrize(
    ("numba", "asked", "loaded"),
    [
        (f"{QUICKER[-1]}.7", "0", "compiler"),
        (f"{QUICKER[-1]}.7", "1", "stock"),
        ("0.660.1", "0", "stock"),
        ("1.0.0rc1", "0", "stock"),
    ],
)
def test_internals_are_loaded_where_they_are_known(tmp_path, numba, asked, loaded):
    environment = {**os.environ, "VIEWSPHERE_CACHE": str(tmp_path), "VIEWSPHERE_STOCK_NUMBA": asked}
    command = [sys.executable, "-c", LOADED, numba]
    assert subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout.split() == loaded.split()


def test_the_installed_numba_is_a_known_one():
    """A newer minor version: run `scripts/numba_releases` with it, name it in `build.QUICKER`."""
    assert NUMBA.rpartition(".")[0] in QUICKER
