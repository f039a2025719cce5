"""Kernels that fill the interleaved texels of a texture's sharpest level, and make the smaller mip levels by halving."""

from __future__ import annotations

import math

import numba as nb

from viewsphere.kernels.jit import inner, njit

f4 = nb.float32
U = nb.uintp
ZERO_NORMAL = 32768.0  # the word for 0 in a normal's component; 65,535 is 1


@njit
def fill(texels, channel, pixels, source, table, factor):
    """Put a channel of an image (H, W, 4) uint8 into uint16 texels, converted by a table of 256 words: means of `factor` x
    `factor` squares.
    """
    for y in range(texels.shape[0]):
        for x in range(texels.shape[1]):
            if factor == 1:
                texels[y, x, channel] = table[pixels[y, x, source]]
                continue
            total, count = 0, 0
            for j in range(y * factor, min(y * factor + factor, pixels.shape[0])):
                for i in range(x * factor, min(x * factor + factor, pixels.shape[1])):
                    total += table[pixels[j, i, source]]
                    count += 1
            texels[y, x, channel] = (total + count // 2) // count


@njit
def fill_normals(texels, channel, pixels, factor):
    """Put an image's unit normals into three channels, each the mean of a factor x factor square; black texels are flat."""
    for y in range(texels.shape[0]):
        for x in range(texels.shape[1]):
            if factor == 1:
                _put_normal(texels, y, x, channel, _direction(pixels[y, x, 0], pixels[y, x, 1], pixels[y, x, 2]), f4(32767))
                continue
            a, b, c, count = f4(0), f4(0), f4(0), f4(0)
            for j in range(y * factor, min(y * factor + factor, pixels.shape[0])):
                for i in range(x * factor, min(x * factor + factor, pixels.shape[1])):
                    da, db, dc = _direction(pixels[j, i, 0], pixels[j, i, 1], pixels[j, i, 2])
                    a, b, c, count = a + da, b + db, c + dc, count + f4(1)
            _put_normal(texels, y, x, channel, (a, b, c), f4(32767) / count)


@inner
def _put_normal(texels, y, x, channel, direction, scale):
    texels[y, x, channel] = nb.uint16(direction[0] * scale + f4(ZERO_NORMAL + 0.5))
    texels[y, x, channel + 1] = nb.uint16(direction[1] * scale + f4(ZERO_NORMAL + 0.5))
    texels[y, x, channel + 2] = nb.uint16(direction[2] * scale + f4(ZERO_NORMAL + 0.5))


@inner
def _direction(red, green, blue):
    """The unit vector of a normal map's texel; black, as between an atlas's islands, is flat. Both 127 and 128 mean 0."""
    a, b, c = f4(red) * f4(2 / 255) - f4(1), f4(green) * f4(2 / 255) - f4(1), max(f4(blue) * f4(2 / 255) - f4(1), f4(0))
    a = f4(0) if abs(a) < f4(0.004) else a
    b = f4(0) if abs(b) < f4(0.004) else b
    length = f4(math.sqrt(a * a + b * b + c * c))
    if length < f4(0.1) or blue < 64:
        return f4(0), f4(0), f4(1)
    return a / length, b / length, c / length


@njit
def halve(texels, source, target, channels, weighted):
    """Write a mip level of half the size: each texel is the mean of the part of the previous level that it covers.

    source, target: first word, width, height. An odd side is halved by the method of Guthe and Heckbert (Non-Power-of-Two
    Mipmapping, 2005). With `weighted`, the first three channels are weighted by the fourth, so that colours of clear texels do
    not bleed.
    """
    first, width, height = source
    start, columns, rows = target
    across, down = f4(width) / f4(columns), f4(height) / f4(rows)
    area = f4(1) / (across * down)
    is_even = columns * 2 == width and rows * 2 == height
    for y in range(rows):
        top = f4(y) * down
        covered_rows = int(top + f4(1e-3)), min(math.ceil(top + down - f4(1e-3)), height)
        for x in range(columns):
            at = U(start + (y * columns + x) * channels)
            plane = U(0)
            if is_even:
                a = U(first + (2 * y * width + 2 * x) * channels)
                b, below = a + U(channels), U(width * channels)
                plane = U(4) if weighted else U(0)
                for c in range(plane, U(channels)):
                    four = nb.uint32(texels[a + c]) + nb.uint32(texels[b + c]) + nb.uint32(texels[a + below + c])
                    four += nb.uint32(texels[b + below + c]) + nb.uint32(2)
                    texels[at + c] = nb.uint16(four >> nb.uint32(2))
                if not weighted:
                    continue
            left = f4(x) * across
            covered = int(left + f4(1e-3)), min(math.ceil(left + across - f4(1e-3)), width)
            sides = left, left + across, top, top + down, area
            for c in range(U(0), U(4) if is_even else U(channels), U(4)):
                _mean(texels, at + c, U(first) + c, U(width), U(channels), covered, covered_rows, sides, weighted and c == U(0))


@inner
def _mean(texels, at, first, width, channels, columns, rows, sides, by_alpha):
    """Write the means of four channels of one texel, which partly covers these columns and rows of the previous level."""
    left, right, top, bottom, area = sides
    r, g, b, a, weight, whole = f4(0), f4(0), f4(0), f4(0), f4(0), f4(0)
    for j in range(rows[0], rows[1]):
        h = min(f4(j + 1), bottom) - max(f4(j), top)
        for i in range(columns[0], columns[1]):
            w = h * (min(f4(i + 1), right) - max(f4(i), left)) * area
            near = first + (U(j) * width + U(i)) * channels
            alpha = f4(texels[near + U(3)])
            a += w * alpha
            whole += w
            w *= alpha + f4(1) if by_alpha else f4(1)
            weight += w
            r += w * f4(texels[near])
            g += w * f4(texels[near + U(1)])
            b += w * f4(texels[near + U(2)])
    texels[at] = nb.uint16(min(r / weight + f4(0.5), f4(65535)))
    texels[at + U(1)] = nb.uint16(min(g / weight + f4(0.5), f4(65535)))
    texels[at + U(2)] = nb.uint16(min(b / weight + f4(0.5), f4(65535)))
    texels[at + U(3)] = nb.uint16(min(a / whole + f4(0.5), f4(65535)))
