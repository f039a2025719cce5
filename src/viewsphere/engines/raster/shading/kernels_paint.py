"""Kernels from samples to radiance: they sort samples by surface, shade each visible sample once, and average edge pixels."""

from __future__ import annotations

import numba as nb
import numpy as np

from viewsphere.engines.raster.indirect.kernels_bounce import bounced, dim_by_near
from viewsphere.engines.raster.materials.kernels_material import material
from viewsphere.engines.raster.reflections.kernels_bend import bend
from viewsphere.engines.raster.shading.kernels_block import (
    ALPHA,
    AO,
    BASE_B,
    BASE_G,
    BASE_R,
    BLOCK,
    BLUE,
    DB,
    DG,
    DR,
    FADE,
    GREEN,
    GROUND,
    IB,
    IG,
    IR,
    LX,
    LY,
    LZ,
    NX,
    NY,
    NZ,
    OPEN,
    RED,
    ROWS,
    SHARE,
)  # isort: skip  # fmt: skip
from viewsphere.engines.raster.shading.kernels_gather import gather, gather_ground, locate
from viewsphere.engines.raster.shading.kernels_light import (
    add_light,
    add_light_matte,
    ambient,
    ambient_matte,
    compose,
    lay,
    weigh,
)
from viewsphere.engines.raster.shadows.kernels_direct_light import arrive
from viewsphere.engines.raster.shadows.kernels_occlusion import occlude
from viewsphere.kernels.jit import inner, njit
from viewsphere.kernels.lanes import FAST, lanewise

f4 = nb.float32
U = nb.uintp
NOTHING, SOLID, SEE_THROUGH, FLOOR = range(4)
GLINT = 1.0  # radiance up to which a sample of an edge pixel has full weight, even if its other samples are dark
BRIGHT = 1.1  # radiance up to which a centre's colour is used for samples beside it: brighter glints on a crease are narrow
# From a pixel to the centres nearest to each of its samples (`samples.OFFSETS`), three each.
STEPS_X = (0, 0, -1, 0, 1, 0, 0, 0, 1, 0, -1, 0)
STEPS_Y = (0, -1, 0, 0, 0, -1, 0, 1, 0, 0, 0, 1)


@njit
def sorted_samples(triangle, kind, material, starts, radiance, solid, ground):
    """Indices of the samples that show solid surfaces, grouped by material, and of the samples that show the ground.

    kind (T + 1,) uint8: the kind of each triangle; the last entry, for triangle -1, is NOTHING. material (T,): each triangle's
    material. starts (M + 1,): initially zeros, filled with the end of each material's samples in `solid`. radiance (S, 4) is
    set to 0 except on the ground, since ground is not composited over anything. solid, ground (S,) int32 are filled; returns
    the number of samples in each.
    """
    size, materials, grounds = U(triangle.shape[0]), U(starts.shape[0] - 1), U(0)
    i = U(0)
    while i < size:
        t, first = triangle[i], i
        while i < size and triangle[i] == t:  # large triangles make long runs
            i += U(1)
        k = kind[t]
        if k == FLOOR:
            grounds += i - first
            continue
        if k == SOLID:
            starts[U(material[t]) + U(1)] += i - first
        for j in range(first, i):
            radiance[j, U(0)], radiance[j, U(1)], radiance[j, U(2)], radiance[j, U(3)] = f4(0), f4(0), f4(0), f4(0)
    for m in range(materials):
        starts[m + U(1)] += starts[m]
    i, grounds = U(0), U(0)
    while i < size:
        t, first = triangle[i], i
        while i < size and triangle[i] == t:
            i += U(1)
        k = kind[t]
        if k == FLOOR:
            for j in range(first, i):
                ground[grounds + (j - first)] = j
            grounds += i - first
        elif k == SOLID:
            m = U(material[t])
            n = starts[m]
            for j in range(first, i):
                solid[n + (j - first)] = j
            starts[m] += i - first
    return starts[materials], grounds


@inner(fastmath=FAST)
def _start_catcher(count, b):
    """DR and DG collect the light that arrives, and the light that would arrive without any thing on the catcher."""
    for i in range(count):
        b[DR + i], b[DG + i], b[GROUND + i], b[AO + i] = f4(0), f4(0), f4(1), f4(1)


@inner(fastmath=FAST)
def _catch(count, b):
    """Add one light to the sums of a shadow catcher."""
    for i in range(count):
        nl = max(b[NX + i] * b[LX + i] + b[NY + i] * b[LY + i] + b[NZ + i] * b[LZ + i], f4(0))
        light = (b[IR + i] + b[IG + i] + b[IB + i]) * nl * f4(1 / (3 * np.pi))
        b[DG + i] += light
        b[DR + i] += light * b[SHARE + i]


@inner(fastmath=FAST)
def _finish_catcher(count, surrounding, b):
    """Make the catcher black, with the missing share of light as its opacity."""
    even = (surrounding.up[0] + surrounding.up[1] + surrounding.up[2]) * f4(1 / 3)
    for i in range(count):
        all_light = b[DG + i] + even
        left = (b[DR + i] + even * b[OPEN + i]) / max(all_light, f4(1e-9))
        b[RED + i], b[GREEN + i], b[BLUE + i] = f4(0), f4(0), f4(0)
        b[ALPHA + i] = max(f4(1) - left, f4(0)) if all_light > f4(0) else f4(0)


@lanewise
def _finish_matte(b):
    b.put((RED, GREEN, BLUE), b.get(DR, DG, DB))
    b[ALPHA] = 1


@lanewise
def start_matte(floor, b):
    """The colour of ground that only scatters, and its slabs' shade, which is the same in RED, GREEN and BLUE."""
    for k, row in enumerate((BASE_R, BASE_G, BASE_B)):
        b[row] = b[RED] * floor.one(5 + k)
    for row in (DR, DG, DB):
        b[row] = 0
    b[GROUND], b[AO] = 1, 1


@inner(fastmath=FAST)
def _take(count, is_matte, b):
    """Add one light that has arrived."""
    if is_matte:
        add_light_matte(count, b)
    else:
        add_light(count, b)


@inner(fastmath=FAST)
def _lay_all(start, count, is_ground, slots, radiance, b):
    """Composite the samples over their background; ground, which is behind everything else, is weighted by the share that has
    not faded.
    """
    if not is_ground:
        for i in range(count):
            lay(radiance[U(slots[start + i])], i, b)
        return
    for i in range(U(count)):
        p, shown = U(slots[U(start) + i]), f4(1) - b[U(FADE) + i]
        radiance[p, U(0)], radiance[p, U(1)] = b[U(RED) + i] * shown, b[U(GREEN) + i] * shown
        radiance[p, U(2)], radiance[p, U(3)] = b[U(BLUE) + i] * shown, b[U(ALPHA) + i] * shown


@njit(fastmath=FAST, _nrt=True)
def shade(
    view, surfaces, textures, floor, surrounding, lights, occlusion, bounces, is_ground, slots, triangle, depth, glass, radiance
):
    """Shade the samples in `slots` (N,) int32 over `radiance` (S, 4) float32, premultiplied, in place.

    triangle (S,) int32 and depth (S,) float32 (inverse) are those visible in each sample; all slots show the ground, or none
    does. floor: see `painting.Baked`; glass: the solid glass that refracts the light behind the samples.
    """
    b = np.zeros(ROWS * BLOCK, np.float32)
    own, which = np.empty(BLOCK, np.int32), np.empty(BLOCK, np.int32)
    is_matte = is_ground and floor[4] == f4(1)
    is_bounced, is_bent = bounces.grid[0] > 0, glass.corners.shape[0] > 0
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
        occlude(count, occlusion, b)
        for k in range(lights.kind.shape[0]):
            arrive(count, lights, k, b)
            _take(count, is_matte, b)
        if is_bounced:
            bounced(count, bounces, is_ground, own, b)
            if bounces.near.shape[0] > 0:
                dim_by_near(start, count, slots, bounces.near, b)
        if is_matte:
            ambient_matte(count, surrounding, is_bounced, b)
            _finish_matte(count, b)
        else:
            ambient(count, surrounding, bounces, b)
            compose(count, b)
        _lay_all(start, count, is_ground, slots, radiance, b)


@njit(fastmath=FAST, _nrt=True)
def catch(view, floor, surrounding, lights, occlusion, slots, triangle, depth, radiance):
    """The equivalent of `shade` for ground that is a shadow catcher."""
    b = np.zeros(ROWS * BLOCK, np.float32)
    own, which = np.empty(BLOCK, np.int32), np.empty(BLOCK, np.int32)
    for start in range(0, slots.shape[0], BLOCK):
        count = min(slots.shape[0] - start, BLOCK)
        locate(view, start, count, slots, depth, b, own)
        gather_ground(view, floor, count, b, which)
        _start_catcher(count, b)
        occlude(count, occlusion, b)
        for k in range(lights.kind.shape[0]):
            arrive(count, lights, k, b)
            _catch(count, b)
        _finish_catcher(count, surrounding, b)
        _lay_all(start, count, True, slots, radiance, b)


@inner
def _alike(t, s, depth, other, owner, normals):
    """Return whether two places look alike: same owner, planes less than 10 degrees apart, depths (1/z) less than 0.5 %
    apart.
    """
    if t == s or t < 0 or s < 0:
        return t == s
    a, b, c, t, s = U(0), U(1), U(2), U(t), U(s)
    bend = normals[t, a] * normals[s, a] + normals[t, b] * normals[s, b] + normals[t, c] * normals[s, c]
    ratio = depth / other
    return (owner[t] == owner[s]) & (abs(bend) > f4(0.985)) & (ratio > f4(0.995)) & (ratio < f4(1.005))


@njit(_nrt=True)
def shared_samples(pixels, triangle, depth, seen, inverse_depth, owner, normals, behind, radiance):
    """Return the source of each sample's colour, four samples per pixel: the centre of the nearest similar pixel, or the
    sample.

    Pixels marked in behind (H * W,), if `behind` is not empty, may have different backgrounds at their samples. So each of
    their samples has its own colour. seen, inverse_depth (H, W), radiance (H * W, 4): at the centres.

    Returns like (4N,) and rows (R,). For sample k % 4 of row k // 4, like is the centre's pixel, or ~k for a colour of its own.
    rows: the pixels (indices in `pixels`) with such samples.
    """
    height, width = seen.shape
    like, rows = np.empty(triangle.shape[0], np.int32), np.empty(pixels.shape[0], np.int32)
    count = 0
    for n in range(pixels.shape[0]):
        y, x = pixels[n] // width, pixels[n] % width
        rows[count], own = n, 0
        if behind.shape[0] != 0 and behind[U(pixels[n])] != 0:
            for i in range(4):
                like[4 * n + i] = ~(4 * count + i)
            count += 1
            continue
        for i in range(4):
            m = U(4 * n + i)
            like[m] = -1
            for k in range(3):  # the pixel's own centre, the one beyond the nearest side, and the one beyond the next nearest
                v, u = y + STEPS_Y[3 * i + k], x + STEPS_X[3 * i + k]
                if like[m] < 0 and 0 <= v < height and 0 <= u < width:
                    v, u = U(v), U(u)
                    p = v * U(width) + u
                    if triangle[m] >= 0 and max(radiance[p, 0], radiance[p, 1], radiance[p, 2]) > f4(BRIGHT):
                        continue
                    if _alike(triangle[m], seen[v, u], depth[m], inverse_depth[v, u], owner, normals):
                        like[m] = p
            for k in range(i):
                j = U(4 * n + k)
                if like[m] == -1 and like[j] < 0 and _alike(triangle[m], triangle[j], depth[m], depth[j], owner, normals):
                    like[m] = like[j]
            if like[m] == -1:
                like[m] = ~(4 * count + i)
                own = 1
        count += own
    return like, rows[:count]


@njit
def own_samples(rows, like, position, triangle, depth, places, shown, inverses, is_other):
    """Fill places (4 R, 2), shown and inverses (4 R,) with the samples of these rows of pixels, using the result of
    `shared_samples`. Samples that share another colour show nothing, -1, and are marked in is_other (4 R,).
    """
    for r in range(U(rows.shape[0])):
        for i in range(U(4)):
            k, m = U(4) * r + i, U(4) * U(rows[r]) + i
            is_other[k] = like[m] != ~np.int32(k)
            places[k, U(0)], places[k, U(1)] = position[m, U(0)], position[m, U(1)]
            shown[k], inverses[k] = np.int32(-1) if is_other[k] else triangle[m], depth[m]


@njit(fastmath=FAST, _nrt=True)
def average_samples(pixels, like, samples, radiance):
    """Set each pixel to the mean of its four samples (premultiplied), whose colours `shared_samples` found.

    A sample is limited to GLINT, or to the darkest of the four if that is brighter; otherwise glints would appear as dots on
    thin things. Returns the indices in `pixels` of pixels with a dimmed glint (G,), and their true means (G, 3).
    """
    means, whole = np.empty((pixels.shape[0], 4), np.float32), np.empty((pixels.shape[0], 3), np.float32)
    glints, count = np.empty(pixels.shape[0], np.int32), U(0)
    for i in range(pixels.shape[0]):
        least, bright = f4(1e9), f4(0)
        for k in range(4):
            j = like[4 * i + k]
            own = radiance[U(j)] if j >= 0 else samples[U(~j)]
            level = max(own[0], own[1], own[2])
            least, bright = min(least, level), max(bright, level)
        most = max(least, f4(GLINT))
        if bright > most:
            glints[count], whole[count, 0], whole[count, 1], whole[count, 2] = i, f4(0), f4(0), f4(0)
        red, green, blue, alpha = f4(0), f4(0), f4(0), f4(0)
        for k in range(4):
            j = like[4 * i + k]
            own = radiance[U(j)] if j >= 0 else samples[U(~j)]
            share = f4(0.25) * min(most / max(own[0], own[1], own[2], f4(1e-6)), f4(1))
            red, green, blue, alpha = red + own[0] * share, green + own[1] * share, blue + own[2] * share, alpha + own[3]
            if bright > most:
                for c in range(3):
                    whole[count, c] += own[c] * f4(0.25)
        means[i, 0], means[i, 1], means[i, 2], means[i, 3] = red, green, blue, alpha * f4(0.25)
        count += U(bright > most)
    for i in range(pixels.shape[0]):
        for c in range(4):
            radiance[U(pixels[i]), c] = means[i, c]
    return glints[:count], whole[:count]


@njit(_nrt=True)
def brighten_lines(pixels, means, width, radiance):
    """Brighten pixels (G,) of radiance (H * W, 4) with dimmed glints towards their true means (G, 3), up to the brightness of
    the second brightest pixel around. So a bright line keeps its brightness.
    """
    height, shares = radiance.shape[0] // width, np.empty(pixels.shape[0], np.float32)
    for i in range(U(pixels.shape[0])):
        p = U(pixels[i])
        for c in range(U(3)):  # neighbouring pixels use each other's true means
            means[i, c], radiance[p, c] = radiance[p, c], means[i, c]
    for i in range(U(pixels.shape[0])):
        y, x, first, second = pixels[i] // width, pixels[i] % width, f4(0), f4(0)
        for v in range(max(y - 1, 0), min(y + 2, height)):
            for u in range(max(x - 1, 0), min(x + 2, width)):
                if v != y or u != x:
                    level = _brightest(radiance[U(v * width + u)])
                    first, second = max(first, level), max(second, min(first, level))
        dim = _brightest(means[i])
        whole = _brightest(radiance[U(pixels[i])]) - dim
        shares[i] = min(max((second - dim) / max(whole, f4(1e-6)), f4(0)), f4(1))
    for i in range(U(pixels.shape[0])):
        p = U(pixels[i])
        for c in range(U(3)):
            radiance[p, c] = means[i, c] + (radiance[p, c] - means[i, c]) * shares[i]


@njit
def aim_rows(slots, at, row, which, turns, shifts, rays, begin):
    """Fill rays (S, 3) float32 with turns[which, row] (x, y, 1) for positions `at` (S, 2), and begin with shifts[which, row].

    Only these slots (n,) int32 are filled.

    turns (M, H, 3, 3) and shifts (M, H, 3) are float64.
    """
    for k in range(U(slots.shape[0])):
        i = U(slots[k])
        m, r, x, y = U(which[i]), U(row[i]), at[i, U(0)], at[i, U(1)]
        for c in range(U(3)):
            rays[i, c] = turns[m, r, c, U(0)] * x + turns[m, r, c, U(1)] * y + turns[m, r, c, U(2)]
            begin[i, c] = shifts[m, r, c]


@inner
def _brightest(color):
    return max(color[U(0)], color[U(1)], color[U(2)])
