import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from pycocotools import mask as coco

from viewsphere.geometry.mask import decode_rle, encode_rle, mask_box, mask_polygons, rle_of_part


def rasterised(polygons, shape):
    if not polygons:
        return np.zeros(shape, bool)
    return coco.decode(coco.merge(coco.frPyObjects(polygons, *shape))).astype(bool)


def shoelace(polygon):
    x, y = np.reshape(polygon, (-1, 2)).T
    return 0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)


def components(mask):
    """Number of 4-connected components, by flooding."""
    left, count = {(int(y), int(x)) for y, x in np.argwhere(mask)}, 0
    while left:
        count, stack = count + 1, [left.pop()]
        while stack:
            y, x = stack.pop()
            for near in ((y + 1, x), (y - 1, x), (y, x + 1), (y, x - 1)):
                if near in left:
                    left.remove(near)
                    stack.append(near)
    return count


def assert_exact(mask):
    polygons = mask_polygons(mask)
    np.testing.assert_array_equal(rasterised(polygons, mask.shape), mask)
    assert sum(shoelace(p) for p in polygons) == mask.sum()
    assert len(polygons) == components(mask)
    for polygon in polygons:
        assert len(polygon) >= 8
        corners = np.reshape(polygon, (-1, 2))
        step, before = np.roll(corners, -1, 0) - corners, corners - np.roll(corners, 1, 0)
        assert np.all((step != 0).sum(axis=1) == 1), "axis-parallel edges that are not empty"
        straight = (step * before).sum(axis=1) > 0
        assert not straight.any(), "collinear corners"


def rings(size):
    y, x = np.indices((size, size))
    return np.maximum(np.abs(y - size // 2), np.abs(x - size // 2)) % 2 == 0


def diagonal_touches():
    mask = np.zeros((6, 6), bool)
    mask[:3, :3] = mask[3:, 3:] = True
    mask[1, 1] = mask[4, 4] = False
    return mask


def holes_in_a_row():
    mask = np.ones((40, 5), bool)
    mask[2:38:2, 2] = False
    return mask


def hole_touching_the_outside_at_a_corner():
    mask = np.ones((5, 5), bool)
    mask[0, 0] = mask[1, 1] = mask[2, 2] = mask[4, 4] = False
    return mask


NASTY = {
    "checkerboard": np.indices((20, 31)).sum(0) % 2 == 0,
    "single pixel": np.eye(1, dtype=bool),
    "corner pixels": np.array([[1, 0, 1], [0, 0, 0], [1, 0, 1]], bool),
    "diagonal line": np.eye(12, dtype=bool),
    "diagonal touches": diagonal_touches(),
    "islands in holes": rings(25),
    "full image": np.ones((13, 7), bool),
    "empty image": np.zeros((13, 7), bool),
    "frame": np.pad(np.zeros((8, 9), bool), 1, constant_values=True),
    "one row": np.ones((1, 9), bool),
    "one column": np.ones((9, 1), bool),
    "holes in a row": holes_in_a_row(),
    "lattice": ~((np.indices((15, 15)) % 3 == 1).all(0)),
    "hole at a corner": hole_touching_the_outside_at_a_corner(),
}


@pytest.mark.parametrize("name", NASTY)
def test_polygons_of_nasty_masks(name):
    assert_exact(NASTY[name])


@pytest.mark.slow
def test_polygons_of_all_masks_of_3_by_4():
    for bits in itertools.product((False, True), repeat=12):
        mask = np.array(bits).reshape(3, 4)
        np.testing.assert_array_equal(rasterised(mask_polygons(mask), mask.shape), mask)


@pytest.mark.slow
def test_polygons_of_200_random_masks_with_holes():
    rng = np.random.default_rng(7)
    holes = 0
    for _ in range(200):
        height, width = rng.integers(3, 40, 2)
        mask = rng.random((height, width)) < rng.uniform(0.3, 0.97)
        assert_exact(mask)
        holes += components(~np.pad(mask, 1)) - 1
    assert holes > 1000


@given(arrays(np.bool_, array_shapes(min_dims=2, max_dims=2, max_side=12)))
def test_polygons_of_any_mask(mask):
    assert_exact(mask)


def test_a_rectangle_is_its_four_corners():
    mask = np.zeros((30, 40), bool)
    mask[5:15, 8:28] = True
    assert mask_polygons(mask) == [[8, 5, 28, 5, 28, 15, 8, 15]]
    assert mask_box(mask) == (8, 5, 28, 15)


def test_a_hole_is_joined_from_above():
    mask = np.ones((3, 3), bool)
    mask[1, 1] = False
    assert len(mask_polygons(mask)) == 1
    assert shoelace(mask_polygons(mask)[0]) == 8


def test_a_large_round_mask():
    y, x = np.mgrid[:480, :640]
    mask = ((x - 320) / 310) ** 2 + ((y - 240) / 235) ** 2 < 1
    mask &= (x - 300) ** 2 + (y - 200) ** 2 > 90**2
    polygons = mask_polygons(mask)
    np.testing.assert_array_equal(rasterised(polygons, mask.shape), mask)
    assert len(polygons) == 1
    assert shoelace(polygons[0]) == mask.sum()


@given(arrays(np.bool_, array_shapes(min_dims=2, max_dims=2, max_side=9)))
def test_run_lengths_are_pycocotools_own(mask):
    code = encode_rle(mask)
    np.testing.assert_array_equal(decode_rle(*mask.shape, code), mask)
    x0, y0, x1, y1 = box = mask_box(mask) or (0, 0, 0, 0)
    assert rle_of_part(*mask.shape, mask[y0:y1, x0:x1], x0, y0) == code
    assert rle_of_part(*mask.shape, mask, 0, 0) == code
    if mask.any():
        rows, columns = np.nonzero(mask)
        assert box == (columns.min(), rows.min(), columns.max() + 1, rows.max() + 1)


@pytest.mark.parametrize("code", ["", "0", "abc", "zzzzzz", "PPPPPPPPPPPP1", "?!", "é", encode_rle(np.ones((4, 6), bool))])
def test_run_lengths_that_do_not_fill_the_image_are_refused(code):
    with pytest.raises(ValueError, match="expected runs that fill 5 x 4 pixels"):
        decode_rle(4, 5, code)


@given(st.integers(1, 300), st.integers(1, 300), st.floats(0, 1), st.integers(0, 2**32))
def test_decoding_is_pycocotools_own(height, width, share, seed):
    mask = np.random.default_rng(seed).random((height, width)) < share
    mask[: height // 2] = mask[0, 0]
    code = coco.encode(np.asfortranarray(mask, np.uint8))
    np.testing.assert_array_equal(decode_rle(height, width, code["counts"].decode()), coco.decode(code))
