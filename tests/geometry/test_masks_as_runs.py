"""Run lengths without pixels: one code for one mask, however its runs were cut."""

import numpy as np
import pytest

from viewsphere.geometry.mask import decode_rle, encode_rle, rle_of_runs, rle_runs


@pytest.mark.parametrize("seed", range(12))
def test_run_lengths_are_those_of_the_mask_however_they_are_cut(seed):
    rng = np.random.default_rng(seed)
    height, width = (int(n) for n in rng.integers(1, 12, 2))
    mask = rng.random((height, width)) < rng.choice([0.0, 0.1, 0.5, 0.9, 1.0])
    code = encode_rle(mask)
    runs = rle_runs(height, width, code)
    assert runs[1::2].sum() == mask.sum()
    assert np.array_equal(decode_rle(height, width, code), mask)
    assert rle_of_runs(height, width, runs) == code
    cut = [part for run in runs for part in (run // 2, 0, run - run // 2)]  # of no pixels between two of one kind
    assert rle_of_runs(height, width, np.array([*cut, 0, 0])) == code


@pytest.mark.parametrize("code", ["", "0", "~", "oooooooo", "1", "991"])
def test_runs_that_do_not_fill_the_picture_are_refused(code):
    with pytest.raises(ValueError, match="RLE: expected runs that fill 4 x 3 pixels"):
        rle_runs(3, 4, code)
