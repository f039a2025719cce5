"""Where each sample of a block is: position, direction to the viewer, geometric and smooth normal, vertex attributes."""

from __future__ import annotations

import numba as nb
import numpy as np

from viewsphere.engines.raster.kernels_block import (
    ALPHA,
    BARY1,
    BARY2,
    BLUE,
    FADE,
    GREEN,
    GX,
    GY,
    GZ,
    NX,
    NY,
    NZ,
    PIXEL,
    PX,
    PY,
    PZ,
    RED,
    SCENERY,
    T0,
    T1,
    U0,
    U1,
    V0,
    V1,
    VX,
    VY,
    VZ,
)  # fmt: skip
from viewsphere.engines.raster.kernels_material import L_SCENERY
from viewsphere.engines.raster.kernels_texture import FAST
from viewsphere.geometry.jit import njit

f4 = nb.float32
U = nb.uintp


@njit(fastmath=FAST)
def _rays(view, start, count, slots, b):
    """Unnormalised directions in the camera's axes, into VX, VY, VZ: each ends where 1 / inverse depth says."""
    one, half = f4(1), f4(0.5)
    if view.rays.shape[0] > 0:
        for i in range(count):
            ray = view.rays[U(slots[start + i])]
            b[VX + i], b[VY + i], b[VZ + i] = ray[0], ray[1], ray[2]
        return
    if view.places.shape[0] > 0:
        for i in range(count):
            place = view.places[U(slots[start + i])]
            b[T0 + i], b[T1 + i] = place[0], place[1]
    else:
        columns, per = nb.int32(view.columns), 1.0 / view.columns
        for i in range(count):
            k = slots[start + i]
            row = nb.int32((k + 0.5) * per)  # exact in float64, and without a division
            b[T0 + i], b[T1 + i] = f4(k - row * columns) + half, f4(row) + half
    a0, a1, a2 = view.lens[0, 0], view.lens[0, 1], view.lens[0, 2]
    c0, c1, c2 = view.lens[1, 0], view.lens[1, 1], view.lens[1, 2]
    for i in range(count):
        x, y = b[T0 + i], b[T1 + i]
        b[VX + i], b[VY + i], b[VZ + i] = a0 * x + a1 * y + a2, c0 * x + c1 * y + c2, one


@njit(fastmath=FAST)
def locate(view, start, count, slots, depth, b):
    """Positions, directions and pixel sizes."""
    _rays(view, start, count, slots, b)
    ex, ey, ez = view.eye[0], view.eye[1], view.eye[2]
    scale, pixel = view.scale, view.pixel
    r = view.rotation
    r00, r01, r02, r10, r11, r12 = r[0, 0], r[0, 1], r[0, 2], r[1, 0], r[1, 1], r[1, 2]
    r20, r21, r22 = r[2, 0], r[2, 1], r[2, 2]
    for i in range(count):
        b[T0 + i] = depth[U(slots[start + i])]
    for i in range(count):
        x, y, z = b[VX + i], b[VY + i], b[VZ + i]
        dx, dy, dz = r00 * x + r10 * y + r20 * z, r01 * x + r11 * y + r21 * z, r02 * x + r12 * y + r22 * z
        s = scale / b[T0 + i]
        b[PX + i], b[PY + i], b[PZ + i] = ex + s * dx, ey + s * dy, ez + s * dz
        b[PIXEL + i] = s * pixel
        s = f4(-1) / np.sqrt(dx * dx + dy * dy + dz * dz)
        b[VX + i], b[VY + i], b[VZ + i] = dx * s, dy * s, dz * s


@njit(fastmath=FAST)
def gather(surfaces, start, count, slots, triangle, b, seen, material):
    """Vertex attributes of located samples, their triangles and materials; normals on the viewer's side."""
    zero, one, tiny = f4(0), f4(1), f4(1e-30)
    for i in range(count):
        t = U(triangle[U(slots[start + i])])
        seen[i] = t
        p0 = surfaces.vertices[U(surfaces.triangles[t, U(0)])]
        p1 = surfaces.vertices[U(surfaces.triangles[t, U(1)])]
        p2 = surfaces.vertices[U(surfaces.triangles[t, U(2)])]
        ax, ay, az = p1[11] - p0[11], p1[12] - p0[12], p1[13] - p0[13]
        cx, cy, cz = p2[11] - p0[11], p2[12] - p0[12], p2[13] - p0[13]
        qx, qy, qz = b[PX + i] - p0[11], b[PY + i] - p0[12], b[PZ + i] - p0[13]
        aa, ac, cc = ax * ax + ay * ay + az * az, ax * cx + ay * cy + az * cz, cx * cx + cy * cy + cz * cz
        qa, qc = qx * ax + qy * ay + qz * az, qx * cx + qy * cy + qz * cz
        scale = one / max(aa * cc - ac * ac, tiny)
        g = min(max((cc * qa - ac * qc) * scale, zero), one)
        h = min(max((aa * qc - ac * qa) * scale, zero), one - g)
        f = one - g - h
        b[BARY1 + i], b[BARY2 + i] = g, h
        b[NX + i] = f * p0[0] + g * p1[0] + h * p2[0]
        b[NY + i] = f * p0[1] + g * p1[1] + h * p2[1]
        b[NZ + i] = f * p0[2] + g * p1[2] + h * p2[2]
        b[U0 + i] = f * p0[3] + g * p1[3] + h * p2[3]
        b[V0 + i] = f * p0[4] + g * p1[4] + h * p2[4]
        b[U1 + i] = f * p0[5] + g * p1[5] + h * p2[5]
        b[V1 + i] = f * p0[6] + g * p1[6] + h * p2[6]
        b[RED + i] = f * p0[7] + g * p1[7] + h * p2[7]
        b[GREEN + i] = f * p0[8] + g * p1[8] + h * p2[8]
        b[BLUE + i] = f * p0[9] + g * p1[9] + h * p2[9]
        b[ALPHA + i] = f * p0[10] + g * p1[10] + h * p2[10]
        normal = surfaces.normals[t]
        b[GX + i], b[GY + i], b[GZ + i] = normal[0], normal[1], normal[2]
        material[i] = surfaces.material[t]
        b[FADE + i], b[SCENERY + i] = zero, surfaces.looks[U(material[i]), U(L_SCENERY)]
    _face_viewer(count, b)


@njit(fastmath=FAST)
def _face_viewer(count, b):
    """Both normals on the side that is seen, whatever the winding; the smooth one at least a little."""
    one, zero = f4(1), f4(0)
    for i in range(count):
        vx, vy, vz = b[VX + i], b[VY + i], b[VZ + i]
        gx, gy, gz, nx, ny, nz = b[GX + i], b[GY + i], b[GZ + i], b[NX + i], b[NY + i], b[NZ + i]
        s = one if gx * vx + gy * vy + gz * vz >= zero else -one
        gx, gy, gz = gx * s, gy * s, gz * s
        s = one if nx * gx + ny * gy + nz * gz >= zero else -one
        nx, ny, nz = nx * s + gx * f4(1e-4), ny * s + gy * f4(1e-4), nz * s + gz * f4(1e-4)
        s = one / np.sqrt(nx * nx + ny * ny + nz * nz + f4(1e-20))
        b[GX + i], b[GY + i], b[GZ + i] = gx, gy, gz
        b[NX + i], b[NY + i], b[NZ + i] = nx * s, ny * s, nz * s


@njit(fastmath=FAST)
def gather_ground(view, floor, start, count, slots, triangle, b, seen, material):
    """The same for samples of the ground: its texture repeats in the world, and it fades into the sky far behind the origin.

    floor: uv per length, u and v at the origin, its material.
    """
    zero, one = f4(0), f4(1)
    ex, ey, ez = view.eye[0], view.eye[1], view.eye[2]
    begins = np.sqrt(ex * ex + ey * ey + ez * ez) + f4(4)
    per, u0, v0, own = floor[0], floor[1], floor[2], nb.int32(floor[3])
    for i in range(count):
        seen[i] = triangle[U(slots[start + i])]
        material[i] = own
    for i in range(count):
        x, y = b[PX + i], b[PY + i]
        side = one if b[VZ + i] >= zero else -one
        b[NX + i], b[NY + i], b[NZ + i], b[GX + i], b[GY + i], b[GZ + i] = zero, zero, side, zero, zero, side
        b[U0 + i], b[V0 + i] = x * per + u0, v0 - y * per
        b[U1 + i], b[V1 + i], b[BARY1 + i], b[BARY2 + i] = zero, zero, zero, zero
        b[RED + i], b[GREEN + i], b[BLUE + i], b[ALPHA + i] = one, one, one, one
        dx, dy, dz = x - ex, y - ey, b[PZ + i] - ez
        far = min(max((np.sqrt(dx * dx + dy * dy + dz * dz) - begins) * f4(1 / 26.0), zero), one)
        far = one - (one - far) * (one - far)
        low = min(max(f4(0.09) - abs(b[VZ + i]), zero) * f4(12), one)
        b[FADE + i] = one - (one - far * far * (f4(3) - far - far)) * (one - low * low * (f4(3) - low - low))
