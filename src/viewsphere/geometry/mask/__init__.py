"""Masks in COCO's representations: run-length codes and polygons, both exact.

COCO's own rasteriser is the reference for both: https://github.com/cocodataset/cocoapi/blob/master/common/maskApi.c.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.bool_]
Runs = NDArray[np.int64]


def encode_rle(mask: Mask) -> str:
    """COCO's compressed run-length code (column-major) of a (H, W) bool mask."""
    from pycocotools import mask as coco

    code: Any = coco.encode(np.asfortranarray(mask, np.uint8))
    return code["counts"].decode("ascii")


def decode_rle(height: int, width: int, counts: str) -> Mask:
    """The (height, width) bool mask of a compressed run-length code; raises ValueError if the code does not fill the image."""
    from viewsphere.geometry.mask.kernels_mask import draw_runs

    return draw_runs(rle_runs(height, width, counts), height, width)


def rle_runs(height: int, width: int, counts: str) -> Runs:
    """The run lengths of a compressed code, without decoding its pixels: column-major, the first run outside the mask. Raises
    ValueError if they do not fill the image.
    """
    from viewsphere.geometry.mask.kernels_mask import read_runs

    codes = np.frombuffer(counts.encode("ascii", "replace"), np.uint8)
    runs, whole = read_runs(codes, height * width)
    if not whole:
        raise ValueError(f"RLE: expected runs that fill {width} x {height} pixels, found {counts[:40]!r}")
    return runs


def rle_of_runs(height: int, width: int, runs: Runs) -> str:
    """The canonical compressed code of run lengths that fill the image; empty runs are merged with their neighbours."""
    from pycocotools import mask as coco

    ends = np.cumsum(runs)
    turns, times = np.unique(ends[:-1], return_counts=True)
    turns = turns[times % 2 == 1]
    whole = np.diff(turns[turns < height * width], prepend=0, append=height * width)
    code: Any = coco.frPyObjects({"size": [height, width], "counts": whole.tolist()}, height, width)
    return code["counts"].decode("ascii")


def rle_of_polygons(height: int, width: int, rings: Sequence[Sequence[float]]) -> str:
    """The canonical compressed code of the union of polygons [x0, y0, x1, y1, ...], as COCO's rasteriser draws them; no mask is
    decoded. The caller must refuse corners far from the image, because pycocotools does not check its input.
    """
    from pycocotools import mask as coco

    outlines: Any = [list(ring) for ring in rings]
    code: Any = coco.merge(coco.frPyObjects(outlines, height, width))
    return rle_of_runs(height, width, rle_runs(height, width, code["counts"].decode("ascii")))


def rle_area(height: int, width: int, counts: str) -> int:
    """Number of pixels in a compressed run-length code; raises ValueError for a malformed code."""
    from pycocotools import mask as coco

    return int(coco.area(_code(height, width, counts)))


def rle_box(height: int, width: int, counts: str) -> tuple[int, int, int, int] | None:
    """`mask_box` of a compressed run-length code, without decoding its pixels; raises ValueError for a malformed code."""
    from pycocotools import mask as coco

    x, y, w, h = coco.toBbox(_code(height, width, counts)).astype(int).tolist()
    return (x, y, x + w, y + h) if w and h else None


def _code(height: int, width: int, counts: str) -> Any:
    """The code in the form that pycocotools takes. It is checked first, since pycocotools reads beyond the end of an incomplete
    code.
    """
    code = counts.encode("ascii", "replace")
    if not code or min(code) < 48 or max(code) > 111 or (code[-1] - 48) & 32:
        raise ValueError(f"RLE: expected a run-length code of {width} x {height} pixels, found {counts[:40]!r}")
    return {"size": [height, width], "counts": code}


def rle_of_part(height: int, width: int, part: Mask, x0: int, y0: int) -> str:
    """`encode_rle` of a (height, width) mask whose pixels are all inside a part of it (h, w), which begins at column x0, row
    y0.
    """
    from pycocotools import mask as coco

    ends = _ends(height, width, part, x0, y0)
    runs = np.empty(len(ends) + 1, np.int64)  # np.diff with its prepend and append takes five times as long
    runs[:-1], runs[-1] = ends, height * width
    runs[1:] -= ends
    whole: Any = {"size": [height, width], "counts": runs.tolist()}
    code: Any = coco.frPyObjects(whole, height, width)
    return code["counts"].decode("ascii")


def _ends(height: int, width: int, part: Mask, x0: int, y0: int) -> NDArray[np.intp]:
    """Indices in column-major order at which runs of the mask begin and end."""
    own, columns = part.shape
    rows = own if own == height else own + 1  # a gap between columns unless they touch
    inside = np.zeros(columns * rows + 2, np.bool_)
    inside[1:-1].reshape(columns, rows)[:, :own] = part.T
    x, y = np.divmod(np.flatnonzero(inside[1:] != inside[:-1]), max(rows, 1))
    ends = (x0 + x) * height + y0 + y
    return ends[ends < height * width]


def mask_box(mask: Mask) -> tuple[int, int, int, int] | None:
    """Tight half-open box (x0, y0, x1, y1) of a mask; None if it is empty."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not rows.size:
        return None
    return int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1


def mask_polygons(mask: Mask) -> list[list[float]]:
    """COCO polygons [x0, y0, x1, y1, ...] of a (H, W) bool mask, one for each 4-connected component.

    The rings run along pixel corners, clockwise as displayed, without collinear corners; each hole is joined to the boundary
    above it by a vertical bridge of zero width. So pycocotools' `frPyObjects` and `merge` return the identical mask, and the
    shoelace areas sum to the number of pixels. Islands in holes are components of their own. Empty for an empty mask.
    """
    from viewsphere.geometry.mask.kernels_mask import trace_rings

    box = mask_box(mask)
    if box is None:
        return []
    x0, y0, x1, y1 = box
    padded = np.zeros((y1 - y0 + 2, x1 - x0 + 2), np.bool_)
    padded[1:-1, 1:-1] = mask[y0:y1, x0:x1]
    corners, ends = trace_rings(padded)
    moved, stops = (corners + np.array([x0 - 1.0, y0 - 1.0])).ravel().tolist(), (2 * ends).tolist()
    return [moved[start:stop] for start, stop in zip((0, *stops), stops, strict=False)]
