"""Fill interleaved texels and halve them, level by level."""

from __future__ import annotations

import math

import numba as nb

from viewsphere.geometry.jit import inner, njit

f4 = nb.float32
U = nb.uintp
ZERO_NORMAL = 32768.0  # the word of a normal's component 0; 1 is 65,535


@njit
def fill(texels, channel, pixels, source, table, factor):
    """Put a channel of an image (H, W, 4) uint8 into texels uint16, by a table of 256 words: means of `factor` squares."""
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
    """Put an image's normals, made unit, into three channels, each the mean of a `factor` square; no direction means level."""
    for y in range(texels.shape[0]):
        for x in range(texels.shape[1]):
            a, b, c, count = f4(0), f4(0), f4(0), f4(0)
            for j in range(y * factor, min(y * factor + factor, pixels.shape[0])):
                for i in range(x * factor, min(x * factor + factor, pixels.shape[1])):
                    da, db, dc = _direction(pixels[j, i, 0], pixels[j, i, 1], pixels[j, i, 2])
                    a, b, c, count = a + da, b + db, c + dc, count + f4(1)
            scale = f4(32767) / count
            texels[y, x, channel] = nb.uint16(a * scale + f4(ZERO_NORMAL + 0.5))
            texels[y, x, channel + 1] = nb.uint16(b * scale + f4(ZERO_NORMAL + 0.5))
            texels[y, x, channel + 2] = nb.uint16(c * scale + f4(ZERO_NORMAL + 0.5))


@inner
def _direction(red, green, blue):
    """The unit vector of a normal map's texel; black, as between an atlas's islands, is level. 127 and 128 are both 0."""
    a, b, c = f4(red) * f4(2 / 255) - f4(1), f4(green) * f4(2 / 255) - f4(1), max(f4(blue) * f4(2 / 255) - f4(1), f4(0))
    a = f4(0) if abs(a) < f4(0.004) else a
    b = f4(0) if abs(b) < f4(0.004) else b
    length = f4(math.sqrt(a * a + b * b + c * c))
    if length < f4(0.1) or blue < 64:
        return f4(0), f4(0), f4(1)
    return a / length, b / length, c / length


@njit
def halve(texels, source, target, channels, weighted):
    """Write a level of half the size: each texel the mean of the part of the level before that it covers.

    source, target: first word, width, height. An odd side is halved as Guthe and Heckbert say (Non-Power-of-Two Mipmapping,
    2005). With `weighted`, the first three channels count by the fourth, so that the colours of what is clear do not bleed.
    """
    first, width, height = source
    start, columns, rows = target
    across, down = f4(width) / f4(columns), f4(height) / f4(rows)
    area = f4(1) / (across * down)
    is_even = columns * 2 == width and rows * 2 == height
    for y in range(rows):
        top = f4(y) * down
        bottom = top + down
        y0, y1 = int(top + f4(1e-3)), min(math.ceil(bottom - f4(1e-3)), height)
        for x in range(columns):
            at = U(start + (y * columns + x) * channels)
            plain = U(0)
            if is_even:
                a = U(first + (2 * y * width + 2 * x) * channels)
                b, below = a + U(channels), U(width * channels)
                for c in range(U(3) if weighted else U(0), U(channels)):
                    four = nb.uint32(texels[a + c]) + nb.uint32(texels[b + c]) + nb.uint32(texels[a + below + c])
                    four += nb.uint32(texels[b + below + c]) + nb.uint32(2)
                    texels[at + c] = nb.uint16(four >> nb.uint32(2))
                if not weighted:
                    continue
                plain = U(3)
            left = f4(x) * across
            right = left + across
            x0, x1 = int(left + f4(1e-3)), min(math.ceil(right - f4(1e-3)), width)
            for c in range(plain if is_even else U(channels)):
                by_alpha = weighted and c < U(3)
                total, weight = f4(0), f4(0)
                for j in range(y0, y1):
                    h = min(f4(j + 1), bottom) - max(f4(j), top)
                    for i in range(x0, x1):
                        w = h * (min(f4(i + 1), right) - max(f4(i), left)) * area
                        source_at = U(first + (j * width + i) * channels)
                        if by_alpha:
                            w *= f4(texels[source_at + U(3)]) + f4(1)
                        total += w * f4(texels[source_at + c])
                        weight += w
                texels[at + c] = nb.uint16(min(total / weight + f4(0.5), f4(65535)))
