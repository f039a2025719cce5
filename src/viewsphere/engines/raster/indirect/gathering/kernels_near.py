"""Light of surfaces near the samples of a picture, from the patches that short rays hit: see `near_field_gather`."""

from __future__ import annotations

import numba as nb

from viewsphere.engines.raster.indirect.kernels_probes import patch_key
from viewsphere.engines.raster.lightmaps.kernels_table import found
from viewsphere.kernels.jit import njit
from viewsphere.kernels.lanes import FAST

f4 = nb.float32
U = nb.uintp


@njit(fastmath=FAST)
def gather(met, far, origins, ways, which, normals, sent, slots, near):
    """Set rows `slots` (N,) of near (S, 4): the share of rays without a hit, and the mean light of the others' hits.

    met, far (K, N), origins (N, 3): see `kernels_trace.cast`; ways (N, K, 3); which (T,): numbers, among the triangles with
    these normals, of the triangles that rays can hit; sent: see `PatchLight`. A ray that hits no known patch, or an emissive
    triangle, counts as a ray without a hit.
    """
    per, cells = f4(1) / f4(met.shape[0]), sent.frame[6]
    for i in range(U(met.shape[1])):
        free = red = green = blue = f4(0)
        for k in range(U(met.shape[0])):
            if met[k, i] < 0:
                free += per
                continue
            t, far_away = U(which[U(met[k, i])]), far[k, i]
            d = ways[i, k, U(0)], ways[i, k, U(1)], ways[i, k, U(2)]
            p = origins[i, U(0)] + far_away * d[0], origins[i, U(1)] + far_away * d[1], origins[i, U(2)] + far_away * d[2]
            x, y, z = normals[t, U(0)], normals[t, U(1)], normals[t, U(2)]
            side = f4(-1) if x * d[0] + y * d[1] + z * d[2] > f4(0) else f4(1)
            key = patch_key(p, (x * side, y * side, z * side), cells, sent.frame, nb.int64(sent.materials[U(met[k, i])]))
            own = sent.patch[found(key, sent.keys, sent.patch)]
            if own < 0 or sent.light[U(own), U(0)] < f4(0):
                free += per
                continue
            red += per * sent.light[U(own), U(0)]
            green += per * sent.light[U(own), U(1)]
            blue += per * sent.light[U(own), U(2)]
        row = near[U(slots[i])]
        row[U(0)], row[U(1)], row[U(2)], row[U(3)] = free, red, green, blue
