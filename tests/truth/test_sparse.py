"""Arrays whose memory comes where they are written to."""

import mmap
from pathlib import Path

import numpy as np
import pytest

from viewsphere.truth.raster.sparse import LEAST, MOST, Spare, sparse

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


@pytest.mark.skipif(not hasattr(mmap, "MADV_NOHUGEPAGE"), reason="needs Linux")
def test_pages_are_used_again_once_nobody_holds_them():
    spare, count = Spare(), LEAST // 8

    def taken(more=0):
        return spare.array((count + more, 1), np.float64)

    first = taken()
    first[3] = 7.0
    part, other = first[2:5], taken()
    assert not np.shares_memory(first, other)
    del first
    third = taken()
    assert not np.shares_memory(part, third) and part[1] == 7.0  # a part of it is held
    place = part.ctypes.data
    del part
    again = taken()
    assert again.ctypes.data == place - 16 and again[3] == 7.0
    del again
    larger = taken(1000)
    larger[:] = 1.0
    assert len(larger) == count + 1000 and not any(np.shares_memory(larger, each) for each in (other, third))


@pytest.mark.skipif(not hasattr(mmap, "MADV_NOHUGEPAGE"), reason="needs Linux")
def test_what_was_written_long_ago_takes_no_memory():
    spare, shape = Spare(), (LEAST // 8, 1)
    for number in range(MOST + 1):
        array = spare.array(shape, np.float64)
        if number == 0:
            array[3] = 7.0
        assert array[3] == (7.0 if number < MOST else 0.0)
        del array


def resident() -> int:
    return int(RESIDENT.read_text().split()[1]) * mmap.PAGESIZE
