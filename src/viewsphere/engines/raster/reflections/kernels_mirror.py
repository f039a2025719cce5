"""The points where rays meet mirrors, the blur of mirror images, and the overlay of these images on the mirrors."""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from viewsphere.kernels.jit import njit
from viewsphere.kernels.lanes import FAST

f4 = nb.float32
U = nb.uintp
COLUMNS = 4  # columns that are blurred: light, and the known share of it


ALIKE = 0.98  # cosine between the normals of pixels that share the hits of their lobes
SHARED, REACH = 0.1, 2  # roughness above which pixels share them, and the distance in pixels


@njit(fastmath=FAST, _nrt=True)
def shared(at, normals, made_of, gloss, shown, is_known, width):
    """The mean (n, 3) of the values `shown` (n, 3), seen in the lobes of pixels `at` (n,), over nearby pixels with the same
    material (`made_of`, (n,)) and facing.

    gloss (n, 13): see `kernels_split.gloss`; `width`: pixels in a row; at: in ascending order.
    """
    first, last = at[0], at[-1]
    rows, means = np.full(last - first + 1, -1, np.int32), np.empty_like(shown)
    for i in range(at.shape[0]):
        rows[at[i] - first] = i
    for i in range(at.shape[0]):
        column, reach = at[i] % width, REACH if gloss[i, 6] > f4(SHARED) else 0
        red = green = blue = count = f4(0)
        for down in range(-reach, reach + 1):
            for across in range(max(-reach, -column), min(reach, width - 1 - column) + 1):
                p = at[i] + down * width + across
                j = rows[p - first] if first <= p <= last else np.int32(-1)
                if j < 0 or made_of[j] != made_of[i] or not is_known[j]:
                    continue
                like = normals[i, 0] * normals[j, 0] + normals[i, 1] * normals[j, 1] + normals[i, 2] * normals[j, 2]
                if like < f4(ALIKE):
                    continue
                red, green, blue, count = red + shown[j, 0], green + shown[j, 1], blue + shown[j, 2], count + f4(1)
        per = f4(1) / max(count, f4(1))
        means[i, 0], means[i, 1], means[i, 2] = red * per, green * per, blue * per
    return means


@njit
def meet(at, width, rays, camera_from_pixel, rotation, center, inverse_depth, cosine, place):
    """Fill cosine (n,) of the angle between the rays of pixels `at` (n,) and the vertical, and place (n, 3), where they end in
    the world.

    rays (H * W, 3): those of a distorted lens, in the camera's axes; empty for a pinhole, whose rays follow from
    `camera_from_pixel`. rotation, center: camera from world axes, and the camera's position.
    """
    a, b, c = U(0), U(1), U(2)
    for i in range(U(at.shape[0])):
        p = U(at[i])
        if rays.shape[0] != 0:
            x, y, z = rays[p, a], rays[p, b], rays[p, c]
        else:
            u, v, m = at[i] % width + 0.5, at[i] // width + 0.5, camera_from_pixel
            x, y, z = m[a, a] * u + m[a, b] * v + m[a, c], m[b, b] * v + m[b, c], 1.0
        far, squared, down = 1.0 / np.float64(inverse_depth[p]), 0.0, 0.0
        for k in range(U(3)):
            down = x * rotation[a, k] + y * rotation[b, k] + z * rotation[c, k]
            place[i, k] = center[k] + down * far
            squared += down * down
        cosine[i] = min(max(-down / math.sqrt(squared), 0.0), 1.0)


@njit
def spread_out(own, image, rows):
    """Put image (n, 3) into rows `own` (n,) of rows (N, COLUMNS), with 1 in the last column."""
    for i in range(U(own.shape[0])):
        p = U(own[i])
        rows[p, U(0)], rows[p, U(1)], rows[p, U(2)], rows[p, U(3)] = image[i, U(0)], image[i, U(1)], image[i, U(2)], f4(1)


@njit
def gather_means(own, rows, means):
    """The inverse of `spread_out`, after sums over neighbours: means (n, 3)."""
    for i in range(U(own.shape[0])):
        p = U(own[i])
        count = max(rows[p, U(3)], f4(1e-6))
        for c in range(U(3)):
            means[i, c] = rows[p, c] / count


@njit(_nrt=True)
def box_down(values, reach, out):
    """Sums over `reach` neighbours above and below of values (H, N) float32, into out."""
    height, across = values.shape[0], U(values.shape[1])
    total = np.zeros(across, np.float64)
    for y in range(-reach, height):
        if y + reach < height:
            for x in range(across):
                total[x] += values[U(y + reach), x]
        if y - reach > 0:
            for x in range(across):
                total[x] -= values[U(y - reach - 1), x]
        if y >= 0:
            for x in range(across):
                out[U(y), x] = total[x]


@njit
def box_across(values, reach, out):
    """Sums over `reach` neighbours on the left and on the right of values (H, W, COLUMNS) float32, into out."""
    height, width = values.shape[0], values.shape[1]
    a, b, c, d = U(0), U(1), U(2), U(3)
    for y in range(U(height)):
        p, q, r, s = 0.0, 0.0, 0.0, 0.0
        for x in range(-reach, width):
            if x + reach < width:
                i = U(x + reach)
                p, q, r, s = p + values[y, i, a], q + values[y, i, b], r + values[y, i, c], s + values[y, i, d]
            if x - reach > 0:
                i = U(x - reach - 1)
                p, q, r, s = p - values[y, i, a], q - values[y, i, b], r - values[y, i, c], s - values[y, i, d]
            if x >= 0:
                i = U(x)
                out[y, i, a], out[y, i, b], out[y, i, c], out[y, i, d] = p, q, r, s


@njit
def polish(at, gloss, near, soft, nearness, inverse_depth, sharp, matt, radiance):
    """Replace the light that pixels `at` (n,) of radiance (H * W, 4) were assumed to mirror by the mirror image.

    gloss (n, 13): see `kernels_split.gloss`; near, soft (n, 3): the mirror image of things near to and far from the mirror;
    nearness (n,): one over the depth of its things; sharp, matt: roughness up to which the image has full weight, and above
    which it has none.
    """
    for i in range(U(at.shape[0])):
        p = U(at[i])
        far = min(max(f4(1) - nearness[i] / inverse_depth[p], f4(0)), f4(1))
        blur = min(f4(2) * far, f4(1))
        share = min(max((matt - gloss[i, U(6)]) / (matt - sharp), f4(0)), f4(1))
        for c in range(U(3)):
            shown = near[i, c] + (soft[i, c] - near[i, c]) * blur
            change = gloss[i, c] * shown - gloss[i, U(3) + c]
            radiance[p, c] = max(radiance[p, c] + share * change, f4(0))
