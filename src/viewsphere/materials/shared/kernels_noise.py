"""Noise, cells and strokes that repeat from one edge of a square to the other, from a hash of lattice points.

It uses only operations that IEEE 754 rounds identically on every processor: no powers, no sines, no reordering.
"""

from __future__ import annotations

from numba import float32, int64, uint32

from viewsphere.kernels.jit import inner, njit


@inner
def _hash(x, y, seed):
    """32 bits that look random. Numba makes 64 bits of a product of two of 32: each is cut back."""
    h = uint32(uint32(x) * uint32(0x9E3779B1)) ^ uint32(uint32(y) * uint32(0x85EBCA77))
    h = uint32(h ^ uint32(uint32(seed) * uint32(0xC2B2AE3D)))
    h = uint32(uint32(h ^ (h >> uint32(15))) * uint32(0x2C1B3C6D))
    h = uint32(uint32(h ^ (h >> uint32(12))) * uint32(0x297A2D39))
    return uint32(h ^ (h >> uint32(15)))


@inner
def _chance(bits):
    """0 up to 1 of the upper bits."""
    return float32(uint32(bits) >> uint32(8)) * float32(1 / 16777216)


@inner
def _slope(bits, x, y):
    """The dot product of a place with one of eight directions."""
    a, b = (x, y) if bits & uint32(4) else (y, x)
    return (-a if bits & uint32(1) else a) + (-b if bits & uint32(2) else b) * float32(0.5)


@inner
def _fade(x):
    return x * x * x * (x * (x * float32(6) - float32(15)) + float32(10))


@njit
def add_noise(out, across, down, amplitude, seed):
    """Add gradient noise (Perlin, *Improving Noise*, 2002) of about -1 to 1 times `amplitude`, with so many cells a side."""
    size = out.shape[0]
    one = float32(1)
    for j in range(size):
        y = (float32(j) + float32(0.5)) * float32(down) / float32(size)
        top = int64(y)
        fy, bottom = y - float32(top), (top + 1) % down
        wy, last = _fade(fy), int64(-1)
        a = b = c = d = uint32(0)
        for i in range(size):
            x = (float32(i) + float32(0.5)) * float32(across) / float32(size)
            left = int64(x)
            if left != last:
                right, last = (left + 1) % across, left
                a, b = _hash(left, top, seed), _hash(right, top, seed)
                c, d = _hash(left, bottom, seed), _hash(right, bottom, seed)
            fx = x - float32(left)
            wx = _fade(fx)
            p, q = _slope(a, fx, fy), _slope(c, fx, fy - one)
            p += wx * (_slope(b, fx - one, fy) - p)
            q += wx * (_slope(d, fx - one, fy - one) - q)
            out[j, i] += float32(amplitude) * (p + wy * (q - p))


@njit
def find_cells(nearest, second, chance, across, down, jitter, seed):
    """Cells about one point in each square of a lattice (Worley 1996): distance to the nearest and the second nearest point, in
    squares, and a random number of the nearest.
    """
    size = nearest.shape[0]
    half, low = float32(0.5), float32(1 / 65536)
    for j in range(size):
        y = (float32(j) + half) * float32(down) / float32(size)
        row = int64(y)
        for i in range(size):
            x = (float32(i) + half) * float32(across) / float32(size)
            column = int64(x)
            first, other, own = float32(9), float32(9), uint32(0)
            for dy in range(-1, 2):
                for dx in range(-1, 2):
                    bits = _hash((column + dx) % across, (row + dy) % down, seed)
                    u = float32(column + dx) + half + float32(jitter) * (float32(bits & uint32(0xFFFF)) * low - half) - x
                    v = float32(row + dy) + half + float32(jitter) * (float32(bits >> uint32(16)) * low - half) - y
                    distance = u * u + v * v
                    if distance < first:
                        first, other, own = distance, first, bits
                    elif distance < other:
                        other = distance
            nearest[j, i], second[j, i] = first ** float32(0.5), other ** float32(0.5)
            chance[j, i] = _chance(_hash(own, own, seed))


@njit
def lay_strokes(height, tone, along, starts, steps, widths):
    """Lay strokes one over another: N of them from `starts` (N, 2) pixels, by `steps` (N, S, 2) pixels, each `widths[k]` wide.

    Where a stroke is higher than what lies there, height becomes (k + 1) / N times 0.4 to 1 from its foot to its tip, tone its
    number k, and `along` the share of the way along it, 0 to 1, negative on its shaded side.
    """
    size, count, length = height.shape[0], starts.shape[0], steps.shape[1]
    for k in range(count):
        x, y = starts[k, 0], starts[k, 1]
        top = float32(0.35) + float32(0.65) * float32(k + 1) / float32(count)
        for s in range(length):
            dx, dy = steps[k, s, 0], steps[k, s, 1]
            x += dx
            y += dy
            share = float32(s + 1) / float32(length)
            z = top * (float32(0.4) + float32(0.6) * share)
            half = int64(widths[k] * (float32(1.15) - share) * float32(0.5) + float32(0.5))
            flat = abs(dx) > abs(dy)
            for e in range(-half, half + 1):
                i = int64(x) if flat else int64(x) + e
                j = int64(y) + e if flat else int64(y)
                i, j = i % size, j % size
                if z >= height[j, i]:
                    height[j, i], tone[j, i] = z, k
                    along[j, i] = -share if e > 0 else share


@njit
def lay_colors(out, tone, stops, colors):
    """Fill out (N, N, 3) with the colours (K, 3) between whose stops (K,), ascending, a tone lies."""
    rows, columns, count = tone.shape[0], tone.shape[1], stops.shape[0]
    for j in range(rows):
        for i in range(columns):
            t, k = tone[j, i], 0
            while k < count - 2 and t > stops[k + 1]:
                k += 1
            share = min(max((t - stops[k]) / (stops[k + 1] - stops[k]), float32(0)), float32(1))
            for c in range(3):
                out[j, i, c] = colors[k, c] + share * (colors[k + 1, c] - colors[k, c])
