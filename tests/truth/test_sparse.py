"""Arrays whose memory comes where they are written to."""

import mmap
from pathlib import Path

import numpy as np
import pytest

from viewsphere.truth.sparse import LEAST, sparse

RESIDENT = Path("/proc/self/statm")


def test_it_is_an_array_like_any_other():
    for count in (0, 5, LEAST // 24 + 1):
        array = sparse((count, 3), np.float64)
        array[:] = np.arange(3)
        assert array.shape == (count, 3) and array.dtype == np.float64 and array.flags.c_contiguous
        assert (array.sum(axis=0) == [0, count, 2 * count]).all()


@pytest.mark.skipif(not (RESIDENT.exists() and hasattr(mmap, "MADV_NOHUGEPAGE")), reason="needs Linux")
def test_parts_that_are_not_written_take_no_memory():
    before = resident()
    array = sparse((LEAST, 2), np.float64)  # 0.5 GB
    array[:: LEAST // 64] = 1.0
    assert resident() - before < LEAST // 4
    assert array[:: LEAST // 64].sum() == 128


def resident() -> int:
    return int(RESIDENT.read_text().split()[1]) * mmap.PAGESIZE
