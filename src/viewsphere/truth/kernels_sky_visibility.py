"""Any-hit ray casting against one mesh."""

from __future__ import annotations

from viewsphere.kernels.jit import njit


@njit
def hits_any(vertices, triangles, point, direction):
    """Return whether a ray from a point meets any triangle (Moller and Trumbore 1997)."""
    px, py, pz = point[0], point[1], point[2]
    dx, dy, dz = direction[0], direction[1], direction[2]
    for t in range(triangles.shape[0]):
        a, b, c = vertices[triangles[t, 0]], vertices[triangles[t, 1]], vertices[triangles[t, 2]]
        ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
        hx, hy, hz = dy * vz - dz * vy, dz * vx - dx * vz, dx * vy - dy * vx
        det = ux * hx + uy * hy + uz * hz
        if det == 0.0:
            continue
        sx, sy, sz = px - a[0], py - a[1], pz - a[2]
        g = (sx * hx + sy * hy + sz * hz) / det
        if g < 0.0 or g > 1.0:
            continue
        qx, qy, qz = sy * uz - sz * uy, sz * ux - sx * uz, sx * uy - sy * ux
        h = (dx * qx + dy * qy + dz * qz) / det
        if h >= 0.0 and g + h <= 1.0 and (vx * qx + vy * qy + vz * qz) / det > 0.0:
            return True
    return False
