"""Kernels that find the texels that triangles cover."""

import math

from viewsphere.kernels.jit import inner, njit


@njit
def add_triangles(steps, corners):
    """Add triangles (T, 3, 2), in texels, to `steps` (H, W + 1): the running sums along a row count how often each texel is
    covered.

    A texel is covered when its centre lies in a triangle or a triangle's centre in it. The picture repeats;
    triangles start in its first copy and are at most as wide and as high.
    """
    for triangle in corners:
        x = (triangle[0, 0] + triangle[1, 0] + triangle[2, 0]) / 3
        y = (triangle[0, 1] + triangle[1, 1] + triangle[2, 1]) / 3
        _add_span(steps, math.floor(y), math.floor(x), math.floor(x) + 1)
        low = min(triangle[0, 1], triangle[1, 1], triangle[2, 1])
        high = max(triangle[0, 1], triangle[1, 1], triangle[2, 1])
        for row in range(math.ceil(low - 0.5), math.ceil(high - 0.5)):
            left, right = _crossing(triangle, row + 0.5)
            _add_span(steps, row, math.ceil(left - 0.5), math.ceil(right - 0.5))


@inner
def _crossing(triangle, y):
    """Return the x at which a horizontal line enters a triangle that it meets, and the x at which it leaves."""
    left, right = math.inf, -math.inf
    for i in range(3):
        ax, ay = triangle[i]
        bx, by = triangle[(i + 1) % 3]
        if (ay <= y) != (by <= y):
            x = ax + (y - ay) * (bx - ax) / (by - ay)
            left, right = min(left, x), max(right, x)
    return left, right


@inner
def _add_span(steps, row, first, end):
    """Add texels from `first` to before `end` of a row."""
    height, width = steps.shape[0], steps.shape[1] - 1
    row %= height
    shift = first // width * width
    first, end = first - shift, end - shift
    steps[row, first] += 1
    steps[row, min(end, width)] -= 1
    if end > width:
        steps[row, 0] += 1
        steps[row, end - width] -= 1
