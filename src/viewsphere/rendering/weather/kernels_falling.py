"""Positions of drops and flakes, in cells of air that fall with them, and their streaks in a picture."""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from viewsphere.kernels.jit import inner, njit

f4 = nb.float32
U = nb.uintp
U64 = nb.uint64


@inner
def _mixed(x):
    """The last steps of SplitMix64 (Steele et al. 2014)."""
    x = (x ^ (x >> U64(30))) * U64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> U64(27))) * U64(0x94D049BB133111EB)
    return x ^ (x >> U64(31))


@inner
def _share(state):
    """A number in [0, 1) from a state."""
    return float(_mixed(state) >> U64(11)) * (1.0 / 9007199254740992.0)


@njit(_nrt=True)
def scatter(seed, low, high, size, mean, moved, eye, ahead, reach, cosine, most):
    """Return the drops or flakes in the cells low..high (3,) int64, of `size` metres, that hold `mean` each.

    moved (3,): the displacement of the air; a position in it plus `moved` is the position in the world. Cells farther than
    `reach` from the eye are left out. So are cells outside of a cone of this cosine around `ahead` (3,); a cosine of -1
    includes all directions. Returns positions in the air (N, 3) and three numbers in [0, 1) for each (N, 3), with N at most
    `most`.
    """
    places, shares = np.empty((most, 3), np.float64), np.empty((most, 3), np.float64)
    n, radius, sine = 0, size * math.sqrt(3) / 2, math.sqrt(max(1 - cosine * cosine, 0.0))
    step = U64(0x9E3779B97F4A7C15)
    for i in range(low[0], high[0] + 1):
        for j in range(low[1], high[1] + 1):
            for k in range(low[2], high[2] + 1):
                x = (i + 0.5) * size + moved[0] - eye[0]
                y = (j + 0.5) * size + moved[1] - eye[1]
                z = (k + 0.5) * size + moved[2] - eye[2]
                along, far = x * ahead[0] + y * ahead[1] + z * ahead[2], math.sqrt(x * x + y * y + z * z)
                if far - radius > reach:
                    continue
                across = math.sqrt(max(far * far - along * along, 0.0))
                if cosine > -1 and across * cosine - along * sine > radius:
                    continue
                state = _mixed(_mixed(_mixed(U64(seed) + step * U64(i)) + step * U64(j)) + step * U64(k))
                # The number follows a Poisson distribution, by inversion.
                share, count, chance = _share(state), 0, math.exp(-mean)
                below = chance
                while share > below and count < 1000:
                    count += 1
                    chance *= mean / count
                    below += chance
                for _ in range(count):
                    if n == most:
                        return places, shares
                    for c in range(3):
                        state += step
                        corner = i if c == 0 else j if c == 1 else k
                        places[n, c] = (corner + _share(state)) * size
                    for c in range(3):
                        state += step
                        shares[n, c] = _share(state)
                    n += 1
    return places[:n], shares[:n]


@njit
def draw(ends, width, soft, level, inverse, color, nearest, picture):
    """Lay streaks over a picture (H, W, 4), premultiplied, one after the other, where nothing is nearer.

    ends (N, 4) float64: x and y of both ends in pixels; width, soft (N,): pixels across, and over which a border fades; level
    (N,): opacity; inverse (N,): 1/depth; color (3,); nearest (H, W): 1/depth of the surfaces in the picture.
    """
    height, columns = nearest.shape
    for n in range(ends.shape[0]):
        x0, y0, x1, y1 = ends[n, 0], ends[n, 1], ends[n, 2], ends[n, 3]
        reach = 0.5 * (width[n] + soft[n])
        dx, dy = x1 - x0, y1 - y0
        square = dx * dx + dy * dy
        per = 1.0 / square if square > 1e-12 else 0.0
        top, bottom = max(int(np.floor(min(y0, y1) - reach)), 0), min(int(np.ceil(max(y0, y1) + reach)), height)
        left, right = max(int(np.floor(min(x0, x1) - reach)), 0), min(int(np.ceil(max(x0, x1) + reach)), columns)
        for row in range(top, bottom):
            for column in range(left, right):
                if nearest[row, column] > inverse[n]:
                    continue
                px, py = column + 0.5 - x0, row + 0.5 - y0
                at = min(max((px * dx + py * dy) * per, 0.0), 1.0)
                away = (px - at * dx) * (px - at * dx) + (py - at * dy) * (py - at * dy)
                if away < reach * reach:
                    share = f4(min((reach - math.sqrt(away)) / soft[n], 1.0) * level[n])
                    for c in range(3):
                        picture[row, column, c] = picture[row, column, c] * (f4(1) - share) + share * color[c]
                    picture[row, column, 3] = picture[row, column, 3] * (f4(1) - share) + share
