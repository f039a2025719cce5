"""The view from a volume's probes, computed from the rays that were cast from them.

Ray hits are grouped into patches: places that are close together, have one material, and face the same way. Patches and probes
exchange light until it converges (Goral, Torrance, Greenberg and Battaile 1984; irradiance volumes as in Greger, Shirley,
Hubbard and Greenberg 1998).
"""

from __future__ import annotations

import numba as nb
import numpy as np

from viewsphere.engines.raster.indirect.kernels_bounce import BURIED, HIDDEN, OUTDOORS, SCREENS, bounced
from viewsphere.engines.raster.indirect.kernels_views import CORNERS
from viewsphere.engines.raster.lightmaps.kernels_table import found
from viewsphere.engines.raster.materials.kernels_material import material
from viewsphere.engines.raster.reflections.kernels_trace import DEEP, nearest
from viewsphere.engines.raster.shading import kernels_block as row
from viewsphere.engines.raster.shading.kernels_block import (
    BASE_R,
    BLOCK,
    ER,
    FACE_R,
    GX,
    IR,
    LOBE,
    LX,
    NX,
    PIXEL,
    PX,
    RED,
    RIM,
    ROWS,
    SHARE,
    UNLIT,
    VX,
)  # fmt: skip
from viewsphere.engines.raster.shading.kernels_gather import gather, gather_ground
from viewsphere.engines.raster.shading.kernels_light import UNEXPOSED, light_around, weigh
from viewsphere.engines.raster.shadows.kernels_direct_light import AREA, DISTANT, arrive
from viewsphere.kernels.jit import inner, njit
from viewsphere.kernels.lanes import FAST

f4 = nb.float32
U = nb.uintp
SKY, FAR_GROUND, GROUND = -1, -2, -3
NO_MATERIAL = -1
AWAY = 24  # distance outside the probes' box, in patches, from which they are twice as wide
HITS = 4  # maximum hits of a patch that are shaded
CLUSTERS = 6
ALIKE = 0.9  # cosine between normals of one screen
FEWEST = 2  # rays of a screen
SECOND = 0.12  # share of the rays towards a cell that a second screen must have
# Shares of rays above which a probe is within a thing: rays that hit the inner side of a thing of any size, or of one at most
# this many cells away; or rays that hit anything this close, as in a cupboard.
WITHIN, WITHIN_CLOSE, SHUT_IN, CLOSE = 0.95, 0.5, 0.97, 3.5
OPEN_SKY = 0.4  # share of the upward rays without a hit above which a probe counts as under the open sky


@inner
def patch_key(p, normal, cells, box, m):
    """One number for a patch: its cell, the axis along which its normal is longest, and its material. Outside the probes' box,
    the size of patches grows with the distance.
    """
    axis, out = 0, f4(0)
    for k in range(3):
        if abs(normal[k]) > abs(normal[axis]):
            axis = k
        out = max(out, box[k] - p[k], p[k] - box[k + 3])
    side, level = 2 * axis + (1 if normal[axis] > f4(0) else 0), 0
    while out * cells > f4(AWAY):
        cells *= f4(0.5)
        level += 1
    key = np.uint64((m if m >= 0 else 4095) + 64 * level) % np.uint64(4096) * np.uint64(8) + np.uint64(side)
    for k in range(3):
        at = nb.int64(np.floor((p[k] - box[k]) * cells + f4(0.25)))
        key = key * np.uint64(1 << 16) + np.uint64((at + 32768) & 65535)
    return key


@njit
def patch(met, far, origins, directions, turn, normals, materials, box, cells, ground, table, count, ids):
    """Write the patch that each ray hits into ids (K, N) int32, SKY or FAR_GROUND for none, and return the new number of
    patches. There were `count` before; the result is -1 if there is no room for more.

    met, far (K, N): triangle or -1, distance; directions, turn: see `kernels_trace.cast`; box (6,): lowest and highest x, y, z
    of the probes. Patches are counted from its lowest corner, `cells` in a length. ground (6,): its height, the box (lowest and
    highest x and y) within which it has patches, and whether there is a ground; table: see `radiosity_patches.Table`.
    """
    m_ground = nb.int64(NO_MATERIAL)
    for k in range(U(directions.shape[1])):
        for i in range(U(origins.shape[0])):
            w = U(turn[i])
            d = directions[w, k, U(0)], directions[w, k, U(1)], directions[w, k, U(2)]
            o = origins[i, U(0)], origins[i, U(1)], origins[i, U(2)]
            t, triangle, m = far[k, i], nb.int64(met[k, i]), m_ground
            normal = f4(0), f4(0), f4(1)
            if ground[5] > f4(0) and d[2] < f4(0) and o[2] > ground[0] and (ground[0] - o[2]) / d[2] < t:
                t, triangle = (ground[0] - o[2]) / d[2], nb.int64(GROUND)
            if triangle == -1:
                ids[k, i] = SKY
                continue
            p = o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]
            if triangle == GROUND:
                if not (p[0] > ground[1] and p[0] < ground[2] and p[1] > ground[3] and p[1] < ground[4]):
                    ids[k, i] = FAR_GROUND
                    continue
            else:
                m, x, y, z = nb.int64(materials[triangle]), normals[triangle, 0], normals[triangle, 1], normals[triangle, 2]
                side = f4(-1) if x * d[0] + y * d[1] + z * d[2] > f4(0) else f4(1)
                normal = x * side, y * side, z * side
            key = patch_key(p, normal, cells, box, m)
            at = found(key, table.keys, table.patch)
            if table.patch[at] < 0:
                if 2 * count >= len(table.keys):
                    return -1
                table.keys[at], table.patch[at], table.known[count] = key, count, 0
                count += 1
            own = table.patch[at]
            ids[k, i] = own
            n = table.known[own]
            if n < HITS:
                table.known[own] = n + 1
                table.triangle[own, n], table.far[own, n] = triangle, t
                for c in range(3):
                    table.place[own, n, c], table.way[own, n, c], table.normal[own, n, c] = p[c], d[c], normal[c]
    return count


@inner
def _sight(tree, lights, k, which, p, n, stack):
    """Return whether light k reaches a place: 1 or 0. which: the number of the tested part of a rectangular light, its middle
    if negative.
    """
    if lights.kind[k] == DISTANT:
        d = lights.place[k, 0], lights.place[k, 1], lights.place[k, 2]
        limit = f4(np.inf)
    else:
        u = v = f4(0)
        if lights.kind[k] == AREA and which >= 0:
            u, v = f4(2 * ((which * 0.7548776662) % 1.0) - 1), f4(2 * ((which * 0.5698402910) % 1.0) - 1)
        right, up, place = lights.right[k], lights.up[k], lights.place[k]
        d = (
            place[0] + u * right[0] + v * up[0] - p[0],
            place[1] + u * right[1] + v * up[1] - p[1],
            place[2] + u * right[2] + v * up[2] - p[2],
        )
        limit = f4(0.999)
        if lights.kind[k] != AREA:  # anything within a spherical light is its bulb
            limit = f4(1) - lights.radius[k] / np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    if d[0] * n[0] + d[1] * n[1] + d[2] * n[2] <= f4(0):
        return f4(0)
    found, _ = nearest(tree, p, d, limit, True, stack)
    return f4(1) if found < 0 else f4(0)


@inner
def _arrive(start, count, tree, lights, off, is_varied, arrived, b, stack):
    """Write irradiance of all lights at the block's samples, with cast shadows, into `arrived`."""
    for i in range(count):
        for c in range(3):
            arrived[start + i, c] = f4(0)
    for k in range(lights.kind.shape[0]):
        arrive(count, lights, k, b)
        for i in range(count):
            n = b[GX + i], b[GX + BLOCK + i], b[GX + 2 * BLOCK + i]
            cosine = f4(0)
            for c in range(3):
                cosine += n[c] * b[LX + c * BLOCK + i]
            if cosine <= f4(0) or b[SHARE + i] <= f4(0):
                continue
            p = b[PX + i] + off * n[0], b[PX + BLOCK + i] + off * n[1], b[PX + 2 * BLOCK + i] + off * n[2]
            light = _sight(tree, lights, k, start + i if is_varied else -1, p, n, stack) * cosine
            for c in range(3):
                arrived[start + i, c] += b[IR + c * BLOCK + i] * light


@inner
def _answer(count, start, answers, b):
    """Reflectance and emission of the block's samples; mirroring lobes are treated as if they scattered. Unlit surfaces send
    their colour.
    """
    for i in range(count):
        unlit = b[UNLIT + i]
        for c in range(3):
            r = c * BLOCK
            shiny = b[FACE_R + r + i] * b[LOBE + i] + b[FACE_R + 3 * BLOCK + r + i] * b[RIM + i]
            answers[start + i, c] = min(b[BASE_R + r + i] + shiny, f4(0.98)) * (f4(1) - unlit)
            answers[start + i, c + 3] = b[ER + r + i] + (b[RED + r + i] * UNEXPOSED - b[ER + r + i]) * unlit
        if answers.shape[1] > 6:
            answers[start + i, 6] = b[row.ALPHA + i]


@njit(fastmath=FAST, _nrt=True)
def shade_hits(
    view,
    surfaces,
    textures,
    floor,
    albedo,
    tree,
    lights,
    off,
    triangle,
    places,
    ways,
    pixels,
    is_ground,
    is_varied,
    answers,
    arrived,
):
    """Fill in the material and the light of the places (M, 3) that rays of directions `ways` (M, 3) hit.

    All places are on the ground, or none is; `pixels` (M,) are their widths. answers (M, 6) or (M, 7): reflectance, emitted
    light and, if there is room, opacity; arrived (M, 3): irradiance of all lights.

    off: the distance from a surface at which shadows begin. Each hit tests a rectangular light at one place. If `is_varied`,
    this place differs from hit to hit, so that means over many hits are unbiased; otherwise it is the light's middle.
    """
    b, stack = np.zeros(ROWS * BLOCK, np.float32), np.empty((DEEP, 2), np.float32)
    own, which = np.empty(BLOCK, np.int32), np.empty(BLOCK, np.int32)
    for start in range(0, places.shape[0], BLOCK):
        count = min(BLOCK, places.shape[0] - start)
        for i in range(count):
            for c in range(3):
                b[PX + c * BLOCK + i], b[VX + c * BLOCK + i] = places[start + i, c], -ways[start + i, c]
            b[PIXEL + i], own[i] = pixels[start + i], start + i
        if is_ground:
            gather_ground(view, floor, count, b, which)
        else:
            gather(surfaces, count, triangle, b, own, which)
        material(count, view, surfaces, textures, b, which)
        weigh(count, albedo, b)
        if is_ground and floor[4] == f4(1):  # ground that only scatters has its colour stored separately
            for i in range(count):
                for c in range(3):
                    b[BASE_R + c * BLOCK + i] = b[RED + c * BLOCK + i]
                    b[FACE_R + c * BLOCK + i], b[FACE_R + (c + 3) * BLOCK + i] = f4(0), f4(0)
        _answer(count, start, answers, b)
        _arrive(start, count, tree, lights, off, is_varied, arrived, b, stack)


@njit(fastmath=FAST, _nrt=True)
def sky_from(surrounding, directions, rough, light):
    """Radiance from far away in directions (K, 3), blurred as a mirror of this roughness does, into light (K, 3)."""
    b = np.zeros(ROWS * BLOCK, np.float32)
    for start in range(0, directions.shape[0], BLOCK):
        count = min(BLOCK, directions.shape[0] - start)
        for i in range(count):
            for c in range(3):
                b[row.T0 + c * BLOCK + i] = directions[start + i, c]
            b[row.T6 + i], b[row.BOUNCE + i] = rough, f4(1)
        light_around(count, surrounding, b)
        for i in range(count):
            for c in range(3):
                light[start + i, c] = b[row.T3 + c * BLOCK + i]


@njit(fastmath=FAST, _nrt=True)
def look_up(bounces, places, normals, triangles, glow, inside):
    """Write radiance of white matt surfaces at places (M, 3) on triangles (M,), negative on the ground, with these normals (M,
    3), into glow (M, 3). Write the share that comes from probes or the lightmap into inside (M,).
    """
    b, own = np.zeros(ROWS * BLOCK, np.float32), np.zeros(BLOCK, np.int32)
    for start in range(0, places.shape[0], BLOCK):
        count = min(BLOCK, places.shape[0] - start)
        for i in range(count):
            for c in range(3):
                b[PX + c * BLOCK + i] = places[start + i, c]
                b[NX + c * BLOCK + i] = b[GX + c * BLOCK + i] = normals[start + i, c]
            b[row.OPEN + i], b[row.BOUNCE + i], own[i] = f4(1), f4(1), triangles[start + i]
        bounced(count, bounces, False, own, b)
        for i in range(count):
            for c in range(3):
                glow[start + i, c] = b[row.GLOW_R + c * BLOCK + i]
            inside[start + i] = max(b[row.INSIDE + i], b[row.MAPPED + i])


@njit(fastmath=FAST)
def send(ids, turn, own, weights, sky, far_ground, sent, light):
    """Write the irradiance of probes into rows `own` (N,) of light (N, 28).

    It comes from patches that send `sent` (M, 3), the sky (W, K, 3) and the distant ground (3,). weights (W, K, 9): of each
    direction in the terms of irradiance.
    """
    light[:] = f4(0)
    for k in range(U(ids.shape[0])):
        for i in range(U(ids.shape[1])):
            met, at, which = ids[k, i], U(own[i]), U(turn[i])
            r, g, b = far_ground[0], far_ground[1], far_ground[2]
            if met >= 0:
                r, g, b = sent[U(met), U(0)], sent[U(met), U(1)], sent[U(met), U(2)]
            elif met == SKY:
                r, g, b = sky[which, k, U(0)], sky[which, k, U(1)], sky[which, k, U(2)]
            for j in range(U(9)):
                w = weights[which, k, j]
                light[at, U(3) * j] += w * r
                light[at, U(3) * j + U(1)] += w * g
                light[at, U(3) * j + U(2)] += w * b


@njit
def blur(light, opens, step, out):
    """Smooth along an axis: half of each probe's light from the probe itself, a quarter from each neighbour, `step` probes
    away, if the way is free. opens (N,) is 1 if nothing is between a probe and the next one.
    """
    quarter = f4(0.25)
    for i in range(light.shape[0]):
        before = quarter * opens[i - step] if i >= step else f4(0)
        behind = quarter * opens[i] if i + step < light.shape[0] else f4(0)
        for c in range(light.shape[1]):
            value = light[i, c] * (f4(1) - before - behind)
            if before > f4(0):
                value += light[i - step, c] * before
            if behind > f4(0):
                value += light[i + step, c] * behind
            out[i, c] = value


@njit(_nrt=True)
def choose(rank, shape, light, chosen):
    """Write the probe that lights each probe into chosen (N,) int32: the probe itself, or, for a buried one, a neighbour.

    The neighbour has the highest rank available (see `screen`), and is darker than most of that rank: leaked light is more
    visible than darkness.
    """
    layers, rows, columns = shape[0], shape[1], shape[2]
    levels, places = np.empty(27, np.float32), np.empty(27, np.int32)
    for at in range(light.shape[0]):
        chosen[at] = at
        if rank[at] > 0:
            continue
        z, y, x = at // (rows * columns), at // columns % rows, at % columns
        best, count = 1, 0
        for w in range(max(z - 1, 0), min(z + 2, layers)):
            for v in range(max(y - 1, 0), min(y + 2, rows)):
                for u in range(max(x - 1, 0), min(x + 2, columns)):
                    k = (w * rows + v) * columns + u
                    if rank[k] < best:
                        continue
                    count = count if rank[k] == best else 0
                    best = rank[k]
                    levels[count], places[count] = light[k, 0] + light[k, 1] + light[k, 2], k
                    count += 1
        if count > 0:
            for _ in range(count // 4):
                levels[np.argmin(levels[:count])] = f4(np.inf)
            chosen[at] = places[np.argmin(levels[:count])]


@inner
def _octant(d):
    """Return which of the eight cells around a probe a direction points to: bit k is set if it goes up axis k."""
    octant = 0
    for axis in range(3):
        octant += (1 << axis) if d[axis] >= f4(0) else 0
    return octant


@inner
def _add_hit(own, n, along, far):
    """Count a hit among hits with about the same normal. own (CLUSTERS, 5): sums of normals on the probe's side and of planes'
    offsets, and their number; along: cosine between ray and normal; far: in cells.
    """
    side = f4(-1) if along > f4(0) else f4(1)
    for c in range(CLUSTERS):
        size = np.sqrt(own[c, 0] ** 2 + own[c, 1] ** 2 + own[c, 2] ** 2)
        fits = (own[c, 0] * n[0] + own[c, 1] * n[1] + own[c, 2] * n[2]) * side >= f4(ALIKE) * size
        if own[c, 4] == f4(0) or fits:
            for axis in range(3):
                own[c, axis] += n[axis] * side
            own[c, 3] += along * side * far
            own[c, 4] += f4(1)
            return


@inner
def _place_screen(found, which, least, bits, cell, screens):
    """Store the plane of the most frequent normal among the hits as screen `which` of a cell's corner. It needs at least
    `least` hits, which are then removed.
    """
    best = 0
    for c in range(1, CLUSTERS):
        if found[c, 4] > found[best, 4]:
            best = c
    own = found[best]
    if own[4] < f4(least):
        return
    per = f4(1) / np.sqrt(own[0] ** 2 + own[1] ** 2 + own[2] ** 2)
    offset, first = own[3] / own[4], 4 * CORNERS * which + bits
    for axis in range(3):
        n = own[axis] * per
        screens[cell, first + CORNERS * axis] = n
        offset += n * f4(bits >> axis & 1)
    screens[cell, first + 3 * CORNERS] = -offset
    own[4] = f4(0)


@inner
def _cell_of(octant, at, rows, columns):
    """The cell in this direction from a probe, and the corner of the cell at which the probe is; no cell index is below 0."""
    bits, x, y, z = 7 - octant, at % columns, at // columns % rows, at // (columns * rows)
    u, v, w = x - (bits & 1), y - (bits >> 1 & 1), z - (bits >> 2 & 1)
    return (w * rows + v) * columns + u if u >= 0 and v >= 0 and w >= 0 else -1, bits


@njit
def bury(met, far, directions, turn, own, normals, cells, buried):
    """Mark probes within things in buried (N,) uint8: 2 within a small thing, 1 within one of any size, otherwise 0."""
    for i in range(met.shape[1]):
        inner_sides = close = shut = 0
        for k in range(directions.shape[1]):
            if met[k, i] < 0:
                continue
            d, n = directions[turn[i], k], normals[met[k, i]]
            shut += 1 if far[k, i] * cells <= f4(CLOSE) else 0
            if n[0] * d[0] + n[1] * d[1] + n[2] * d[2] > f4(0):
                inner_sides += 1
                close += 1 if far[k, i] * cells <= f4(CLOSE) else 0
        rays = directions.shape[1]
        is_small = close >= WITHIN_CLOSE * rays or shut >= SHUT_IN * rays
        buried[own[i]] = 2 if is_small else 1 if inner_sides >= WITHIN * rays else 0


@njit(_nrt=True)
def screen(met, far, directions, turn, own, normals, cells, shape, buried, screens, rank):
    """Fill Bounces.screens (N, 72): for each of the eight cells around a probe, the planes of the two most frequent normals
    among the hits inside the cell.

    own (N,): the probe of each column; shape (3,): layers, rows, columns. A buried probe sees nothing of any cell. Fill rank
    (N,) uint8: 0 for buried probes, 1 for probes under the open sky, 2 for others.
    """
    rows, columns = shape[1], shape[2]
    for k in range(screens.shape[1]):
        screens[:, k] = f4(HIDDEN) if k >= 4 * SCREENS * CORNERS else f4(1) if k // CORNERS % 4 == 3 else f4(0)
    found = np.empty((8, CLUSTERS, 5), np.float32)
    second = max(directions.shape[1] * SECOND / 8, FEWEST)
    for i in range(met.shape[1]):
        found[:] = f4(0)
        hits = up = open_ = 0
        for k in range(directions.shape[1]):
            d, t = directions[turn[i], k], far[k, i] * cells
            up += 1 if d[2] > f4(0) else 0
            open_ += 1 if d[2] > f4(0) and met[k, i] < 0 else 0
            if met[k, i] >= 0 and t * max(abs(d[0]), abs(d[1]), abs(d[2])) <= f4(1):
                n = normals[met[k, i]]
                _add_hit(found[_octant(d)], n, n[0] * d[0] + n[1] * d[1] + n[2] * d[2], t)
                hits += 1
        rank[own[i]] = 0 if buried[own[i]] else 1 if open_ > OPEN_SKY * up else 2
        least = f4(BURIED) if rank[own[i]] == 0 else f4(OUTDOORS) if rank[own[i]] == 1 else f4(HIDDEN)
        for octant in range(8 if hits > 0 or rank[own[i]] < 2 else 0):
            cell, bits = _cell_of(octant, own[i], rows, columns)
            if cell >= 0:
                screens[cell, 4 * SCREENS * CORNERS + bits] = least
            if cell >= 0 and buried[own[i]]:
                screens[cell, 3 * CORNERS + bits] = f4(-1)
            elif cell >= 0:
                _place_screen(found[octant], 0, FEWEST, bits, cell, screens)
                _place_screen(found[octant], 1, second, bits, cell, screens)


@njit(fastmath=FAST)
def see_around(ids, first, sky, below, light):
    """Add to the rows of light (N, 3) from `first` on the light that arrives along rays (K, N) from the sky, (n, K, 3) for n
    rows, and from the distant ground (3,).
    """
    per = f4(1) / f4(ids.shape[0])
    for i in range(U(sky.shape[0])):
        at = U(first) + i
        for k in range(U(ids.shape[0])):
            for c in range(U(3)):
                if ids[k, at] == SKY:
                    light[at, c] += sky[i, k, c] * per
                elif ids[k, at] < 0:
                    light[at, c] += below[c] * per


@njit(fastmath=FAST)
def send_around(ids, alone, share, far, sent, glow, inside):
    """The equivalent of `look_up` for patches `alone` (N,), each with one row per hit, weighted by `share` (N,).

    Cosine-weighted rays (K, N) from there hit patches `ids` that send `sent` (M, 3); far (N, 3) is the other light that reaches
    them.
    """
    for i in range(U(ids.shape[1])):
        inside[U(alone[i])] = f4(1)
        for c in range(U(3)):
            glow[U(alone[i]), c] = f4(0)
    for i in range(U(ids.shape[1])):
        at, per = U(alone[i]), share[i] / f4(ids.shape[0])
        for c in range(U(3)):
            value = f4(0)
            for k in range(U(ids.shape[0])):
                if ids[k, i] >= 0:
                    value += sent[U(ids[k, i]), c]
            glow[at, c] += far[i, c] * share[i] + value * per


@njit(fastmath=FAST)
def send_down(ids, sent, floor):
    """Write radiance of white matt ground lit only by things into floor (N, 4), for places from which cosine-weighted rays (K,
    N) hit patches.
    """
    floor[:] = f4(0)
    per = f4(1) / f4(ids.shape[0])
    for k in range(U(ids.shape[0])):
        for i in range(U(ids.shape[1])):
            own = ids[k, i]
            if own >= 0:
                for c in range(U(3)):
                    floor[i, c] += sent[U(own), c] * per
