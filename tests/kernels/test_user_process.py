"""What numba is for the user's own functions stays as it was, whatever viewsphere compiles beside them."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from viewsphere.kernels import jit

THEIRS = """
import numba

@numba.njit(cache=True)
def tripled(x):
    return 3 * x
"""

USE = """
import numba
import numpy as np
from viewsphere.geometry.kernels_lens import radial_fisheye
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
        assert [file.name.split(".")[1].split("-")[0] for file in ours.rglob("*.nbi")] == ["radial_fisheye"]


def test_the_setting_is_the_users_again_when_a_kernel_cannot_be_made():
    before = jit.config.CACHE_DIR
    with pytest.raises(ZeroDivisionError), jit._cached_in("elsewhere"):
        assert jit.config.CACHE_DIR == "elsewhere"
        assert 1 / 0
    assert before == jit.config.CACHE_DIR
    assert not jit._configuring.locked()
