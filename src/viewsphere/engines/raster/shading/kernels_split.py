"""The parts of a picture's light, and its surfaces, computed sample by sample like `kernels_paint.shade`, but kept separate.

Columns of a split (S, 6) or (S, 9): albedo, emitted light, and, if there is room, diffuse light; premultiplied.
"""

from __future__ import annotations

import numba as nb
import numpy as np

from viewsphere.engines.raster.indirect.kernels_bounce import bounced, dim_by_near
from viewsphere.engines.raster.materials.kernels_material import look_up, material
from viewsphere.engines.raster.reflections.kernels_bend import bend
from viewsphere.engines.raster.shading.kernels_block import (
    ALPHA,
    BASE_R,
    BLOCK,
    BLUE,
    DR,
    EDGE_R,
    ER,
    FACE_R,
    FADE,
    GREEN,
    GX,
    GY,
    GZ,
    LOBE,
    METAL,
    NX,
    NY,
    NZ,
    PX,
    RED,
    RIM,
    ROUGH,
    ROWS,
    SR,
    T0,
    T1,
    T2,
    T3,
    TAKEN,
    UNLIT,
    VX,
    VY,
    VZ,
)  # fmt: skip
from viewsphere.engines.raster.shading.kernels_gather import gather, gather_ground, locate
from viewsphere.engines.raster.shading.kernels_light import (
    UNEXPOSED,
    add_light,
    add_light_matte,
    ambient,
    ambient_matte,
    compose,
    light_on_coat,
    weigh,
)
from viewsphere.engines.raster.shading.kernels_paint import GLINT, start_matte
from viewsphere.engines.raster.shadows.kernels_direct_light import arrive
from viewsphere.engines.raster.shadows.kernels_occlusion import occlude
from viewsphere.kernels.jit import inner, njit
from viewsphere.kernels.lanes import FAST, clamp, dot, lanewise, least

f4 = nb.float32
U = nb.uintp
ALBEDO, EMITTED, DIFFUSE = 0, 3 * BLOCK, 6 * BLOCK
COLUMNS = 9
GLOSS = 13  # columns of `gloss`


@lanewise
def _part(b, p):
    """The parts of samples that are lit but not composed yet. An unlit surface receives no light and sends its colour."""
    alpha, unlit = clamp(b[ALPHA]), b[UNLIT]
    share = alpha * (1 - unlit)
    shown = least(alpha * 8, 1) * (1 - unlit)
    for k, base in enumerate(b.get(RED, GREEN, BLUE)):
        row = k * BLOCK
        p[ALBEDO + row] = b[BASE_R + row] * share
        p[DIFFUSE + row] = b[DR + row] * share
        p[EMITTED + row] = b[ER + row] * shown + unlit * base * alpha * UNEXPOSED


@lanewise
def _part_matte(b, p):
    for row in range(0, 3 * BLOCK, BLOCK):
        p[ALBEDO + row] = b[BASE_R + row]
        p[DIFFUSE + row] = b[DR + row]
        p[EMITTED + row] = 0


@inner(fastmath=FAST)
def _lay(start, count, is_ground, slots, b, p, out):
    """Composite the parts over their background, as `kernels_light.lay` does for light. The tint of coloured glass beyond its
    grey share is not applied to the background's parts.
    """
    for i in range(U(count)):
        q = U(slots[U(start) + i])
        under = f4(0) if is_ground else f4(1) - b[U(ALPHA) + i]
        shown = f4(1) - b[U(FADE) + i] if is_ground else f4(1)
        for k in range(U(out.shape[1])):
            out[q, k] = max(out[q, k] * under + p[k * U(BLOCK) + i] * shown, f4(0))


@inner(fastmath=FAST)
def _light(start, count, slots, is_ground, is_matte, surrounding, lights, occlusion, bounces, own, b):
    """Add all light that arrives at a block of the samples in `slots`."""
    occlude(count, occlusion, b)
    for k in range(lights.kind.shape[0]):
        arrive(count, lights, k, b)
        if is_matte:
            add_light_matte(count, b)
        else:
            add_light(count, b)
    is_bounced = bounces.grid[0] > 0
    if is_bounced:
        bounced(count, bounces, is_ground, own, b)
        if bounces.near.shape[0] > 0:
            dim_by_near(start, count, slots, bounces.near, b)
    if is_matte:
        ambient_matte(count, surrounding, is_bounced, b)
    else:
        ambient(count, surrounding, bounces, b)


@njit(fastmath=FAST, _nrt=True)
def split(
    view, surfaces, textures, floor, surrounding, lights, occlusion, bounces, is_ground, slots, triangle, depth, glass, out
):
    """Composite the parts of the samples in `slots` (N,) int32 over `out` (S, 6 or 9) float32; arguments as in `shade`."""
    b, p = np.zeros(ROWS * BLOCK, np.float32), np.zeros((COLUMNS + 1) * BLOCK, np.float32)
    own, which = np.empty(BLOCK, np.int32), np.empty(BLOCK, np.int32)
    is_matte, is_lit = is_ground and floor[4] == f4(1), out.shape[1] == COLUMNS
    is_bent = glass.corners.shape[0] > 0
    for start in range(0, slots.shape[0], BLOCK):
        count = min(slots.shape[0] - start, BLOCK)
        locate(view, start, count, slots, depth, b, own)
        if is_ground:
            gather_ground(view, floor, count, b, which)
        else:
            gather(surfaces, count, triangle, b, own, which)
        if is_bent:
            bend(count, glass, surfaces.looks, b, which)
        if is_matte:
            start_matte(count, floor, b)
        else:
            material(count, view, surfaces, textures, b, which)
            weigh(count, surrounding.albedo, b)
        if is_lit:
            _light(start, count, slots, is_ground, is_matte, surrounding, lights, occlusion, bounces, own, b)
        if is_matte:
            _part_matte(count, b, p)
        else:
            _part(count, b, p)
            compose(count, b)
        _lay(start, count, is_ground, slots, b, p, out)


@njit(fastmath=FAST, _nrt=True)
def average_split(pixels, like, samples, radiance, parts, out):
    """Set each pixel to the mean of its four samples' parts. `samples` and `radiance` are their colours, as in
    `kernels_paint.average_samples`, which dims glints of light in the same way.
    """
    means = np.zeros((pixels.shape[0], out.shape[1]), np.float32)
    for i in range(pixels.shape[0]):
        least_light = f4(1e9)
        for k in range(4):
            least_light = min(least_light, _level(like[4 * i + k], samples, radiance))
        for k in range(4):
            j = like[4 * i + k]
            dimmed = min(max(least_light, f4(GLINT)) / max(_level(j, samples, radiance), f4(1e-6)), f4(1))
            own = out[U(j)] if j >= 0 else parts[U(~j)]
            for c in range(out.shape[1]):
                means[i, c] += own[c] * f4(0.25) * (dimmed if c >= 3 else f4(1))
    for i in range(pixels.shape[0]):
        for c in range(out.shape[1]):
            out[U(pixels[i]), c] = means[i, c]


@inner(fastmath=FAST)
def _level(j, samples, radiance):
    own = radiance[U(j)] if j >= 0 else samples[U(~j)]
    return max(own[0], own[1], own[2])


@lanewise
def _keep(b):
    """Roughness without the contribution of bumps too small to see, and metallic; both are 0 on unlit surfaces."""
    lit = 1 - b[UNLIT]
    b[ROUGH], b[METAL] = clamp(b[ROUGH]) * lit, clamp(b[METAL]) * lit


@njit(fastmath=FAST, _nrt=True)
def substance(view, surfaces, textures, floor, is_ground, slots, triangle, depth, out):
    """Set rows `slots` of `out` (S, 2) float32 to the roughness and metallic of the samples' surfaces."""
    b = np.zeros(ROWS * BLOCK, np.float32)
    own, which = np.empty(BLOCK, np.int32), np.empty(BLOCK, np.int32)
    for start in range(0, slots.shape[0], BLOCK):
        count = min(slots.shape[0] - start, BLOCK)
        locate(view, start, count, slots, depth, b, own)
        if is_ground:
            gather_ground(view, floor, count, b, which)
        else:
            gather(surfaces, count, triangle, b, own, which)
        look_up(count, view, surfaces, textures, b, which)
        _keep(count, b)
        for i in range(U(count)):
            q = U(slots[U(start) + i])
            out[q, U(0)], out[q, U(1)] = b[U(ROUGH) + i], b[U(METAL) + i]


@lanewise
def _cover(b):
    """The shares of light from the directions of their mirror images that base and coat mirror, into FACE_R to FACE_B; 0 for
    unlit surfaces.
    """
    lit = 1 - b[UNLIT]
    for k in range(0, 3 * BLOCK, BLOCK):
        b[FACE_R + k] = (b[FACE_R + k] * b[LOBE] + b[EDGE_R + k] * b[RIM] + b[TAKEN]) * lit
        b[SR + k] = b[SR + k] * lit


@lanewise
def _reflect(b):
    """T0 to T2: the mirrored ray; if the smooth normal directs it into the surface, the facet reflects it."""
    view, normal, facet = b.get(VX, VY, VZ), b.get(NX, NY, NZ), b.get(GX, GY, GZ)
    twice = 2 * dot(normal, view)
    ray = tuple(twice * n - v for n, v in zip(normal, view, strict=True))
    inward = 2 * least(dot(ray, facet), 0)
    b.put((T0, T1, T2), tuple(r - inward * f for r, f in zip(ray, facet, strict=True)))


@inner(fastmath=FAST)
def _weigh_in_place(count, view, surfaces, textures, surrounding, occlusion, bounces, own, which, b):
    """Fill in the values that `ambient` reads, for a block of things that has been gathered."""
    material(count, view, surfaces, textures, b, which)
    weigh(count, surrounding.albedo, b)
    occlude(count, occlusion, b)
    if bounces.grid[0] > 0:
        bounced(count, bounces, False, own, b)


@njit(fastmath=FAST, _nrt=True)
def gloss(view, surfaces, textures, floor, surrounding, occlusion, bounces, slots, triangle, depth, out):
    """Set `out` (N, GLOSS) float32 to the mirroring of the samples in `slots` (N,).

    Columns 0 to 2: the mirrored shares of red, green and blue; 3 to 5: the light that they are assumed to mirror; 6: the
    roughness; 7 to 9: their places, in the stage's lengths; 10 to 12: the mirrored ray, of length 1.
    """
    b = np.zeros(ROWS * BLOCK, np.float32)
    own, which = np.empty(BLOCK, np.int32), np.empty(BLOCK, np.int32)
    for start in range(0, slots.shape[0], BLOCK):
        count = min(slots.shape[0] - start, BLOCK)
        locate(view, start, count, slots, depth, b, own)
        gather(surfaces, count, triangle, b, own, which)
        _weigh_in_place(count, view, surfaces, textures, surrounding, occlusion, bounces, own, which, b)
        ambient(count, surrounding, bounces, b)
        _cover(count, b)
        _reflect(count, b)
        for i in range(U(count)):
            q = U(start) + i
            for c in range(U(3)):
                out[q, c], out[q, U(3) + c] = b[U(FACE_R) + c * U(BLOCK) + i], b[U(SR) + c * U(BLOCK) + i]
                out[q, U(7) + c], out[q, U(10) + c] = b[U(PX) + c * U(BLOCK) + i], b[U(T0) + c * U(BLOCK) + i]
            out[q, U(6)] = b[U(ROUGH) + i]


@njit(fastmath=FAST, _nrt=True)
def film(view, surfaces, textures, floor, surrounding, occlusion, bounces, slots, triangle, depth, out):
    """Set `out` (N, 4) float32 to the light that the clear coat of the samples in `slots` (N,) is assumed to mirror, and to the
    share of all light that it mirrors.
    """
    b = np.zeros(ROWS * BLOCK, np.float32)
    own, which = np.empty(BLOCK, np.int32), np.empty(BLOCK, np.int32)
    for start in range(0, slots.shape[0], BLOCK):
        count = min(slots.shape[0] - start, BLOCK)
        locate(view, start, count, slots, depth, b, own)
        gather(surfaces, count, triangle, b, own, which)
        _weigh_in_place(count, view, surfaces, textures, surrounding, occlusion, bounces, own, which, b)
        light_on_coat(count, surrounding, bounces, b)
        for i in range(U(count)):
            share = b[U(TAKEN) + i]
            for c in range(U(3)):
                out[U(start) + i, c] = share * b[U(T3) + c * U(BLOCK) + i]
            out[U(start) + i, U(3)] = share
