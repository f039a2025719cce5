"""The channels computed from the visibility buffer, one kernel each.

For a pinhole, a sample's ray is p = (x + .5, y + .5, 1) against vertices in homogeneous pixels; `rays` is then (0, 0, 3). For a
distorted lens, it is the sample's row of a ray table, against vertices in camera axes. The kernels are exact (no fastmath).
"""

from __future__ import annotations

import math

import numpy as np

from viewsphere.kernels.jit import inner, njit
from viewsphere.kernels.prefetching import prefetch

ONE = np.float32(1)
NONE = -2  # means no triangle yet; the background is -1
SOON = np.uintp(8)  # pixels to the right, whose triangle is prefetched
AHEAD = 64  # pixels that are compared at once: enough for compilers to emit vectors instead of unrolling


@njit
def depths(inverse, rays, out):
    """Depth along z: s times the ray's z; infinite if no triangle is visible."""
    height, width = inverse.shape
    table = rays.shape[0] > 0
    for y in range(height):
        for x in range(width):
            out[y, x] = ONE / inverse[y, x]
            if table and inverse[y, x] > 0:
                out[y, x] = out[y, x] * rays[y, x, 2]


@njit
def positions(inverse, rays, world_from_ray, center, out):
    """center + world_from_ray ray / inverse, the visible point in world axes; NaN if no triangle is visible."""
    height, width = inverse.shape
    table = rays.shape[0] > 0
    m = world_from_ray
    for y in range(height):
        for x in range(width):
            if not inverse[y, x] > 0:
                out[y, x, 0], out[y, x, 1], out[y, x, 2] = np.nan, np.nan, np.nan
                continue
            s = 1.0 / np.float64(inverse[y, x])
            px, py, pz = (rays[y, x, 0], rays[y, x, 1], rays[y, x, 2]) if table else (x + 0.5, y + 0.5, 1.0)
            for k in range(3):
                out[y, x, k] = center[k] + s * (m[k, 0] * px + m[k, 1] * py + m[k, 2] * pz)


@njit
def labels(seen, table, empty, out):
    """table[triangle] for each pixel, 0 beyond the table's end, or `empty` if no triangle is visible."""
    height, width = seen.shape
    for y in range(height):
        for x in range(width):
            t = seen[y, x]
            out[y, x] = empty if t < 0 else table[np.uintp(t)] if t < table.shape[0] else 0


@njit
def instances(seen, objects, ids, area, box):
    """The ids of the visible objects. Adds to each id's pixel count (count + 1,), and grows its tight half-open box (count + 1,
    4).
    """
    height, width = np.uintp(seen.shape[0]), np.uintp(seen.shape[1])
    for y in range(height):
        for x in range(width):
            t = seen[y, x]
            ids[y, x] = objects[np.uintp(t)] if t >= 0 else np.int32(0)
        x = np.uintp(0)
        while x < width:
            own, first = ids[y, x], x
            x += np.uintp(1)
            while x + np.uintp(AHEAD) <= width and _goes_on(ids, y, x, own):
                x += np.uintp(AHEAD)
            while x < width and ids[y, x] == own:
                x += np.uintp(1)
            if own > 0:
                i, left, top, right = np.uintp(own), np.intp(first), np.intp(y), np.intp(x)
                area[i] += right - left
                box[i, np.uintp(0)], box[i, np.uintp(1)] = min(box[i, np.uintp(0)], left), min(box[i, np.uintp(1)], top)
                box[i, np.uintp(2)], box[i, np.uintp(3)] = max(box[i, np.uintp(2)], right), top + 1


@inner
def _goes_on(ids, y, x, own):
    """Return whether the next AHEAD pixels of row y, from x on, also show object `own`."""
    different = np.int32(0)
    for k in range(np.uintp(AHEAD)):
        different |= ids[y, x + k] ^ own
    return different == 0


@inner
def _edges(q, i0, i1, i2, px, py, pz):
    """det[p, q_j, q_k] of the three edges. Subtracting p's share from each corner first keeps them exact for tiny triangles."""
    a, b, c = np.uintp(0), np.uintp(1), np.uintp(2)
    if pz == 1.0:
        w0, w1, w2 = q[i0, c], q[i1, c], q[i2, c]
        x0, x1, x2 = q[i0, a] - px * w0, q[i1, a] - px * w1, q[i2, a] - px * w2
        y0, y1, y2 = q[i0, b] - py * w0, q[i1, b] - py * w1, q[i2, b] - py * w2
        return x1 * y2 - y1 * x2, x2 * y0 - y2 * x0, x0 * y1 - y0 * x1
    s = px * px + py * py + pz * pz
    s0 = (q[i0, a] * px + q[i0, b] * py + q[i0, c] * pz) / s
    s1 = (q[i1, a] * px + q[i1, b] * py + q[i1, c] * pz) / s
    s2 = (q[i2, a] * px + q[i2, b] * py + q[i2, c] * pz) / s
    x0, y0, z0 = q[i0, a] - s0 * px, q[i0, b] - s0 * py, q[i0, c] - s0 * pz
    x1, y1, z1 = q[i1, a] - s1 * px, q[i1, b] - s1 * py, q[i1, c] - s1 * pz
    x2, y2, z2 = q[i2, a] - s2 * px, q[i2, b] - s2 * py, q[i2, c] - s2 * pz
    e0 = px * (y1 * z2 - z1 * y2) + py * (z1 * x2 - x1 * z2) + pz * (x1 * y2 - y1 * x2)
    e1 = px * (y2 * z0 - z2 * y0) + py * (z2 * x0 - x2 * z0) + pz * (x2 * y0 - y2 * x0)
    e2 = px * (y0 * z1 - z0 * y1) + py * (z0 * x1 - x0 * z1) + pz * (x0 * y1 - y0 * x1)
    return e0, e1, e2


@inner
def weights_at(q, i0, i1, i2, px, py, pz):
    """Barycentrics of the ray in the triangle."""
    e0, e1, e2 = _edges(q, i0, i1, i2, px, py, pz)
    total = e0 + e1 + e2
    if total == 0.0:
        return 1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0
    inverse = 1.0 / total
    return e0 * inverse, e1 * inverse, e2 * inverse


@njit
def barycentrics(seen, triangles, q, rays, out):
    """The weights of the visible triangle's corners; 0 if no triangle is visible."""
    height, width = seen.shape
    table = rays.shape[0] > 0
    for y in range(height):
        for x in range(width):
            t = seen[y, x]
            if t < 0:
                out[y, x] = 0
                continue
            px, py, pz = (rays[y, x, 0], rays[y, x, 1], rays[y, x, 2]) if table else (x + 0.5, y + 0.5, 1.0)
            i0, i1, i2 = np.uintp(triangles[t, 0]), np.uintp(triangles[t, 1]), np.uintp(triangles[t, 2])
            out[y, x, 0], out[y, x, 1], out[y, x, 2] = weights_at(q, i0, i1, i2, px, py, pz)


@njit
def coordinates(seen, triangles, objects, q, rays, values, out):
    """Vertex values (V, 3) interpolated on visible objects; NaN elsewhere."""
    height, width = seen.shape
    table = rays.shape[0] > 0
    for y in range(height):
        for x in range(width):
            t = seen[y, x]
            if t < 0 or objects[t] == 0:
                out[y, x] = np.nan
                continue
            px, py, pz = (rays[y, x, 0], rays[y, x, 1], rays[y, x, 2]) if table else (x + 0.5, y + 0.5, 1.0)
            i0, i1, i2 = np.uintp(triangles[t, 0]), np.uintp(triangles[t, 1]), np.uintp(triangles[t, 2])
            b0, b1, b2 = weights_at(q, i0, i1, i2, px, py, pz)
            for k in range(3):
                out[y, x, k] = b0 * values[i0, k] + b1 * values[i1, k] + b2 * values[i2, k]


@njit
def own_boxes(values, is_used, vertex_start, area, boxes):
    """The lowest and the highest coordinates of the used vertices of each visible object i (area[i] pixels), in boxes (count +
    1, 2, 3).
    """
    for i in range(1, boxes.shape[0]):
        if area[i] == 0:
            continue
        left, front, bottom = np.float32(np.inf), np.float32(np.inf), np.float32(np.inf)
        right, back, top = -left, -front, -bottom
        for v in range(np.uintp(vertex_start[i - 1]), np.uintp(vertex_start[i])):
            if is_used[v]:
                x, y, z = values[v, np.uintp(0)], values[v, np.uintp(1)], values[v, np.uintp(2)]
                left, front, bottom = min(left, x), min(front, y), min(bottom, z)
                right, back, top = max(right, x), max(back, y), max(top, z)
        boxes[i, 0, 0], boxes[i, 0, 1], boxes[i, 0, 2] = left, front, bottom
        boxes[i, 1, 0], boxes[i, 1, 1], boxes[i, 1, 2] = right, back, top


@njit
def nocs(seen, triangles, objects, q, rays, values, middle, diagonal, out):
    """`coordinates` relative to the middle (N + 1, 3) of each object's box, over its diagonal (N + 1,), plus a half; NaN
    elsewhere.
    """
    height, width = seen.shape
    table = rays.shape[0] > 0
    for y in range(height):
        for x in range(width):
            t = seen[y, x]
            if t < 0 or objects[t] == 0:
                out[y, x, 0], out[y, x, 1], out[y, x, 2] = np.nan, np.nan, np.nan
                continue
            i = np.uintp(objects[t])
            px, py, pz = (rays[y, x, 0], rays[y, x, 1], rays[y, x, 2]) if table else (x + 0.5, y + 0.5, 1.0)
            i0, i1, i2 = np.uintp(triangles[t, 0]), np.uintp(triangles[t, 1]), np.uintp(triangles[t, 2])
            b0, b1, b2 = weights_at(q, i0, i1, i2, px, py, pz)
            for k in range(3):
                value = b0 * values[i0, k] + b1 * values[i1, k] + b2 * values[i2, k]
                out[y, x, k] = 0.5 + (value - middle[i, k]) / diagonal[i]


@njit
def normals_geometric(seen, triangle_normals, rays, camera_from_p, rotation, out):
    """The triangle's normal in camera axes, towards the camera; 0 if no triangle is visible or the triangle is degenerate."""
    height, width = seen.shape
    table = rays.shape[0] > 0
    m = camera_from_p
    last, nx, ny, nz = -1, 0.0, 0.0, 0.0
    for y in range(height):
        for x in range(width):
            t = seen[y, x]
            if t != last:  # the camera is on one side of the triangle's plane: the sign holds for all pixels of the triangle
                last, nx, ny, nz = t, 0.0, 0.0, 0.0
                if t >= 0:
                    px, py, pz = (rays[y, x, 0], rays[y, x, 1], rays[y, x, 2]) if table else (x + 0.5, y + 0.5, 1.0)
                    dx = m[0, 0] * px + m[0, 1] * py + m[0, 2] * pz
                    dy = m[1, 0] * px + m[1, 1] * py + m[1, 2] * pz
                    dz = m[2, 0] * px + m[2, 1] * py + m[2, 2] * pz
                    nx, ny, nz = _towards(triangle_normals[t], rotation, dx, dy, dz)
            out[y, x, 0], out[y, x, 1], out[y, x, 2] = nx, ny, nz


@inner
def _rotated(r, x, y, z):
    return (
        r[0, 0] * x + r[0, 1] * y + r[0, 2] * z,
        r[1, 0] * x + r[1, 1] * y + r[1, 2] * z,
        r[2, 0] * x + r[2, 1] * y + r[2, 2] * z,
    )


@njit
def normals_shading(seen, triangles, q, rays, values, side, triangle_normals, camera_from_p, rotation, out):
    """Interpolated vertex normals (`values`, world) in camera axes, on the triangle's visible side, never away from the ray.

    `side` is 1 if a triangle's vertex normals agree with its winding, -1 if they oppose it. It is 2 or -2 if, in addition, all
    three vertex normals equal the triangle's own.
    """
    height, width = seen.shape
    table = rays.shape[0] > 0
    m = camera_from_p
    a, b, c, three, four = np.uintp(0), np.uintp(1), np.uintp(2), np.uintp(3), np.uintp(4)
    last, nx, ny, nz = NONE, 0.0, 0.0, 0.0
    for y in range(height):
        uy = np.uintp(y)
        for x in range(width):
            ux = np.uintp(x)
            t = seen[uy, ux]
            if t == last:
                out[uy, ux, a], out[uy, ux, b], out[uy, ux, c] = nx, ny, nz
                continue
            if t < 0:
                last, nx, ny, nz = -1, 0.0, 0.0, 0.0
                out[uy, ux, a], out[uy, ux, b], out[uy, ux, c] = nx, ny, nz
                continue
            soon = np.uintp(max(seen[uy, min(ux + SOON, np.uintp(width) - b)], np.int32(0)))
            for k in (a, b, c):
                prefetch(q, four * np.uintp(triangles[soon, k]))
                prefetch(values, three * np.uintp(triangles[soon, k]))
            ut = np.uintp(t)
            px, py, pz = (rays[uy, ux, a], rays[uy, ux, b], rays[uy, ux, c]) if table else (x + 0.5, y + 0.5, 1.0)
            i0, i1, i2 = np.uintp(triangles[ut, a]), np.uintp(triangles[ut, b]), np.uintp(triangles[ut, c])
            e0, e1, e2 = _edges(q, i0, i1, i2, px, py, pz)
            # The e_i have the sign of g . ray, g being the normal by winding: the sum turns with the visible side.
            sign = -np.float64(side[ut])
            wx = sign * (e0 * values[i0, a] + e1 * values[i1, a] + e2 * values[i2, a])
            wy = sign * (e0 * values[i0, b] + e1 * values[i1, b] + e2 * values[i2, b])
            wz = sign * (e0 * values[i0, c] + e1 * values[i1, c] + e2 * values[i2, c])
            nx, ny, nz = _rotated(rotation, wx, wy, wz)
            dx = m[0, 0] * px + m[0, 1] * py + m[0, 2] * pz
            dy = m[1, 0] * px + m[1, 1] * py + m[1, 2] * pz
            dz = m[2, 0] * px + m[2, 1] * py + m[2, 2] * pz
            away = nx * dx + ny * dy + nz * dz
            if away > 0.0:
                away /= dx * dx + dy * dy + dz * dz
                nx, ny, nz = nx - away * dx, ny - away * dy, nz - away * dz
            square, total = nx * nx + ny * ny + nz * nz, e0 + e1 + e2
            if not square > 1e-12 * total * total:
                nx, ny, nz = _towards(triangle_normals[ut], rotation, dx, dy, dz)
                square = nx * nx + ny * ny + nz * nz
            s = 1.0 / math.sqrt(square) if square > 0.0 else 0.0
            nx, ny, nz = nx * s, ny * s, nz * s
            out[uy, ux, a], out[uy, ux, b], out[uy, ux, c] = nx, ny, nz
            last = t if side[ut] == 2 or side[ut] == -2 else NONE


@inner
def _towards(normal, r, dx, dy, dz):
    """The world normal in camera axes, turned towards the camera along ray d."""
    x, y, z = _rotated(r, np.float64(normal[0]), np.float64(normal[1]), np.float64(normal[2]))
    return (-x, -y, -z) if x * dx + y * dy + z * dz > 0.0 else (x, y, z)
