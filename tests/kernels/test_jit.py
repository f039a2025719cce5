"""How kernels are compiled."""

from __future__ import annotations

import os
import subprocess
import sys
from collections import namedtuple

import numpy as np
import pytest

from viewsphere.kernels.jit import inner, njit


@inner
def doubled(numbers, i):
    return numbers[i] * 2.0 if i > 0 else 1.0


@inner(fastmath=True)
def total(numbers):
    found = 0.0
    for i in range(len(numbers)):
        found += doubled(numbers, i)
    return found


@njit
def both(numbers):
    return total(numbers) + doubled(numbers, 3)


def test_inner_kernels_become_parts_of_those_that_call_them():
    assert both(np.arange(10.0)) == 1 + 2 * 45 + 6
    assert both(np.arange(10)) == 1 + 2 * 45 + 6  # another type of the same


@njit
def least_first(pair):
    return pair.least - pair.most


@pytest.mark.slow
def test_tuples_whose_fields_change_places_have_entries_of_their_own(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    for fields in (("least", "most"), ("most", "least")):
        pair = namedtuple("Pair", fields)(**{"least": 1, "most": 3})
        assert least_first(pair) == -2
    assert len(set(least_first._cache.names)) == 2
    nested = namedtuple("Outer", ["pair", "number"])
    for fields in (("least", "most"), ("most", "least")):
        outer = nested(namedtuple("Pair", fields)(**{"least": 1, "most": 3}), 1.0)
        assert of_outer(outer) == -2
    assert len(set(of_outer._cache.names)) == 2


@njit
def of_outer(outer):
    return outer.pair.least - outer.pair.most


LOOK = """
import sys
import numpy as np
from viewsphere.geometry.lenses.shared.kernels_lens import radial_fisheye
assert radial_fisheye(np.zeros(4), 0.5)[0] == 0.5
print("numba.np.arraymath" in sys.modules)
"""


@pytest.mark.slow
def test_a_cached_kernel_is_not_prepared_for_compiling(tmp_path):
    """numba prepares for a second, which each of a run's processes would pay."""
    environment = {**os.environ, "VIEWSPHERE_CACHE": str(tmp_path)}
    said = [
        subprocess.run([sys.executable, "-c", LOOK], env=environment, capture_output=True, text=True, check=True).stdout
        for _ in range(2)
    ]
    assert said == ["True\n", "False\n"]


CALLEE = """
from viewsphere.kernels.jit import njit

@njit
def tripled(numbers, i):
    return 3.0 * numbers[i]
"""

CALLER = """
import numpy as np
from callee import tripled
from viewsphere.kernels.jit import njit

@njit
def sum_of_two(numbers):
    return tripled(numbers, 0) + tripled(numbers, 1)
"""


@pytest.mark.slow
def test_a_cached_kernel_can_become_part_of_one_that_is_compiled(tmp_path):
    (tmp_path / "callee.py").write_text(CALLEE)
    (tmp_path / "caller.py").write_text(CALLER)
    environment = {**os.environ, "VIEWSPHERE_CACHE": str(tmp_path), "PYTHONPATH": str(tmp_path)}
    first = "import numpy as np; from callee import tripled; print(tripled(np.arange(9.0), 5))"
    second = f"{first}; from caller import sum_of_two; print(sum_of_two(np.arange(5.0, 9.0)))"
    said = [
        subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True).stdout
        for code in (first, second)
    ]
    assert said == ["15.0\n", "15.0\n33.0\n"]
    assert {file.name.split("-")[0] for file in tmp_path.rglob("*.kernel")} == {"callee.tripled", "caller.sum_of_two"}
