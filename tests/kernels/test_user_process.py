"""What numba is for the user's own functions stays as it was, whatever viewsphere compiles beside them."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

THEIRS = """
import numba

@numba.njit(cache=True)
def tripled(x):
    return 3 * x
"""

USE = """
import numba
import numpy as np
from viewsphere.geometry.lenses.shared.kernels_lens import radial_fisheye
assert radial_fisheye(np.zeros(4), 0.5)[0] == 0.5
from theirs import tripled
assert tripled(2) == 6
print(numba.config.CACHE_DIR, tripled.stats.cache_path, sep="|")
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("said", "stock"),
    [("", "0"), ("elsewhere", "1"), ("", "1"), ("elsewhere", "0")],
)
def test_own_functions_are_cached_where_they_were(tmp_path, stock, said):
    (tmp_path / "theirs.py").write_text(THEIRS)
    ours, own = tmp_path / "ours", str(tmp_path / said) if said else ""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])])}
    environment |= {"VIEWSPHERE_CACHE": str(ours), "VIEWSPHERE_STOCK_NUMBA": stock, "NUMBA_CACHE_DIR": own}
    answer = subprocess.run([sys.executable, "-c", USE], env=environment, capture_output=True, text=True, check=True).stdout
    setting, folder = answer.strip().split("|")
    assert setting == own
    if said:
        assert folder.startswith(own)
    else:
        assert folder == str(tmp_path / "__pycache__")
        assert [file.name.split(".")[1].split("-")[0] for file in ours.rglob("*.kernel")] == ["radial_fisheye"]


TARGETS = """
import threading
import numba
import numpy as np
from numba.core.registry import cpu_target
from viewsphere.kernels.build import TARGET
from viewsphere.kernels.jit import njit

HOST = (cpu_target.target_context.codegen()._get_host_cpu_name(), cpu_target.target_context.codegen()._tm_features)
settings = {name: value for name, value in vars(numba.config).items() if name.isupper()}

def of(library):
    return library._codegen._get_host_cpu_name(), library._codegen._tm_features

def made(function):
    function(np.arange(4.0))
    (compiled,) = function.overloads.values()
    is_ours = type(function).__name__ == "KernelDispatcher"
    assert type(compiled.target_context).__name__ == ("_Context" if is_ours else "CPUContext")
    return of(compiled.library)

def theirs_meanwhile():
    for _ in range(5):
        seen.append(made(numba.njit(lambda x: min(x[0], x[2]) + np.sum(x))))

seen = []
before = made(numba.njit(lambda x: min(x[0], x[1]) + np.sum(x)))
thread = threading.Thread(target=theirs_meanwhile)
thread.start()
ours = [made(njit(lambda x: min(x[0], x[1]) + np.sum(x), _nrt=True)) for _ in range(5)]
thread.join()
after = made(numba.njit(lambda x: max(x[0], x[1]) + np.sum(x)))
assert {before, *seen, after} == {HOST}, (before, seen, after)
assert set(ours) == {(TARGET.cpu, TARGET.features)}, ours
assert settings == {name: value for name, value in vars(numba.config).items() if name.isupper()}
"""


@pytest.mark.slow
@pytest.mark.parametrize("stock", ["0", "1"])
def test_own_functions_are_compiled_for_their_processor(tmp_path, stock):
    """Those that were compiled before ours, those after, and those of another thread at the same time."""
    environment = {**os.environ, "VIEWSPHERE_CACHE": str(tmp_path), "VIEWSPHERE_STOCK_NUMBA": stock}
    (tmp_path / "script.py").write_text(TARGETS)
    subprocess.run([sys.executable, str(tmp_path / "script.py")], env=environment, check=True)
