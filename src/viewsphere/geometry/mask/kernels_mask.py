"""Compiled loops over masks: boundaries along pixel corners, run lengths."""

from __future__ import annotations

import numpy as np

from viewsphere.kernels.jit import inner, njit

# Headings: 0 right, 1 down, 2 left, 3 up. The foreground is to the right of the walk.
STEP_X = (1, 0, -1, 0)
STEP_Y = (0, 1, 0, -1)
# The pixels ahead of corner (x, y), as offsets of (row, column): left and right of the walk.
LEFT_ROW, LEFT_COLUMN = (-1, 0, 0, -1), (0, 0, -1, -1)
RIGHT_ROW, RIGHT_COLUMN = (0, 0, -1, -1), (0, -1, -1, 0)


@inner
def _turn(mask, x, y, heading):
    """The heading after corner (x, y) of the padded mask; at a diagonal contact, the walk stays with its current pixel."""
    if not mask[y + RIGHT_ROW[heading], x + RIGHT_COLUMN[heading]]:
        return (heading + 1) % 4
    if mask[y + LEFT_ROW[heading], x + LEFT_COLUMN[heading]]:
        return (heading + 3) % 4
    return heading


@inner
def _push(ring, start, count, x, y):
    """Append a corner to the ring that began at `start`; if the last corner is on a straight line, replace it."""
    if count - start >= 2:
        ax, ay = ring[count - 2]
        bx, by = ring[count - 1]
        if (ax == bx == x and (by - ay) * (y - by) > 0) or (ay == by == y and (bx - ax) * (x - bx) > 0):
            count -= 1
    ring[count, 0] = x
    ring[count, 1] = y
    return count + 1


@inner
def _mark_loops(mask, seen, hole_below):
    """Walk each loop once, mark its horizontal edges, and record each hole at the corner above it. Return the numbers of edges
    and rings.

    A loop's first edge in raster order has foreground below for an outer ring and above for a hole. From a hole's first corner
    the line straight up stays inside the foreground until it meets the boundary of the same component: the hole is joined
    there. `seen` is 2 where an outer ring starts.
    """
    edges, rings = 0, 0
    height, width = mask.shape
    for y in range(1, height):
        for x in range(1, width - 1):
            below, above = mask[y, x], mask[y - 1, x]
            if below == above or seen[y, x]:
                continue
            heading = 0 if below else 2
            cx, cy = (x, y) if below else (x + 1, y)
            sx, sy, first = cx, cy, heading
            while True:
                if heading == 0:
                    seen[cy, cx] = 1
                elif heading == 2:
                    seen[cy, cx - 1] = 1
                cx += STEP_X[heading]
                cy += STEP_Y[heading]
                edges += 1
                heading = _turn(mask, cx, cy, heading)
                if cx == sx and cy == sy and heading == first:
                    break
            if below:
                seen[y, x] = 2
                rings += 1
                continue
            top = y - 1
            while mask[top - 1, x - 1] and mask[top - 1, x]:
                top -= 1
            hole_below[top, x] = y
    return edges, rings


@inner
def _walk(mask, hole_below, ring, count, sx, sy, stack):
    """Append the outer ring that starts at (sx, sy) heading right, with its holes joined by vertical bridges."""
    start, depth = count, 0
    x, y, heading = sx, sy, 0
    count = _push(ring, start, count, x, y)
    while True:
        x += STEP_X[heading]
        y += STEP_Y[heading]
        turned = _turn(mask, x, y, heading)
        if depth and x == stack[depth - 1, 0] and y == stack[depth - 1, 2] and heading == 2:
            # Back at the hole's first corner: return over the bridge and resume the walk.
            depth -= 1
            count = _push(ring, start, count, x, y)
            y, heading = stack[depth, 1], stack[depth, 3]
            count = _push(ring, start, count, x, y)
            heading = _turn(mask, x, y, heading)
            continue
        elif hole_below[y, x]:
            count = _push(ring, start, count, x, y)
            stack[depth, 0], stack[depth, 1], stack[depth, 2], stack[depth, 3] = (
                x,
                y,
                hole_below[y, x],
                heading,
            )
            depth += 1
            y, heading = hole_below[y, x], 1
            count = _push(ring, start, count, x, y)
            continue
        if depth == 0 and x == sx and y == sy and turned == 0:
            return _push(ring, start, count, x, y) - 1
        if turned != heading:
            count = _push(ring, start, count, x, y)
        heading = turned


@njit(_nrt=True)
def trace_rings(mask):
    """Corners (n, 2) int32 of one ring per 4-connected component, and the rings' ends (rings,).

    `mask` (h, w) bool is padded by one pixel of background; the corners' coordinates count from this padding.
    """
    height, width = mask.shape
    seen = np.zeros((height, width), np.uint8)
    hole_below = np.zeros((height, width), np.int32)
    edges, rings = _mark_loops(mask, seen, hole_below)
    ring = np.empty((3 * edges + 8, 2), np.int32)
    ends = np.empty(rings, np.int64)
    stack = np.empty((edges // 4 + 1, 4), np.int64)
    count, found = 0, 0
    for y in range(1, height):
        for x in range(1, width - 1):
            if seen[y, x] == 2:
                count = _walk(mask, hole_below, ring, count, x, y, stack)
                ends[found] = count
                found += 1
    return ring[:count], ends


@njit(_nrt=True)
def read_runs(codes, size):
    """The run lengths encoded by a compressed code's characters, and whether the code is complete and the runs sum to `size`
    pixels.
    """
    runs = np.zeros(len(codes) + 1, np.int64)
    count, position, i = 0, 0, 0
    while i < len(codes):
        run, shift, more = np.int64(0), 0, True
        while more:
            if i == len(codes) or shift > 30 or not 48 <= codes[i] < 112:
                return runs[:count], False
            bits = np.int64(codes[i]) - 48
            run |= (bits & 31) << shift
            shift += 5
            more = bits & 32 != 0
            if not more and bits & 16:
                run |= np.int64(-1) << shift
            i += 1
        if count > 2:
            run += runs[count - 2]
        if run < 0 or position + run > size:
            return runs[:count], False
        runs[count] = run
        count += 1
        position += run
    return runs[:count], position == size


@njit(_nrt=True)
def draw_runs(runs, height, width):
    """The mask (height, width) bool of run lengths that fill it."""
    mask = np.zeros((height, width), np.bool_)
    position = 0
    for i in range(len(runs)):
        if i % 2:
            x, y = position // height, position % height
            for _ in range(runs[i]):
                mask[y, x] = True
                y += 1
                if y == height:
                    x, y = x + 1, 0
        position += runs[i]
    return mask
