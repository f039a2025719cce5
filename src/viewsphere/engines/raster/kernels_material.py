"""What the samples of a block are made of: factors times vertex colours times textures, and normals with their normal maps.

glTF 2.0, section 3.9, and the extensions that `assets.mesh.Material` keeps.
"""

from __future__ import annotations

import numba as nb
import numpy as np

from viewsphere.engines.raster.kernels_block import (
    ALPHA,
    AO,
    BLENDED,
    BLOCK,
    BLUE,
    CATCHER,
    COAT,
    COAT_ROUGH,
    CX,
    CY,
    CZ,
    EB,
    EG,
    ER,
    F0B,
    F0G,
    F0R,
    GREEN,
    GROUND,
    GX,
    GY,
    GZ,
    METAL,
    NX,
    NY,
    NZ,
    PIXEL,
    RED,
    ROUGH,
    T0,
    T1,
    TRANSMISSION,
    U0,
    U1,
    UNLIT,
    VX,
    VY,
    VZ,
)  # fmt: skip
from viewsphere.engines.raster.kernels_filter import (
    CHUNK,
    PLACE_ROWS,
    QUAD_ROWS,
    QUADS,
    U_AT,
    UX,
    UY,
    V_AT,
    footprints,
    mix,
    place,
)
from viewsphere.engines.raster.kernels_filter import ROWS as FOOTPRINT_ROWS
from viewsphere.engines.raster.kernels_filter import VX as VXX
from viewsphere.engines.raster.kernels_filter import VY as VYY
from viewsphere.engines.raster.kernels_texture import FAST
from viewsphere.geometry.jit import njit

f4 = nb.float32
U = nb.uintp

# Columns of Surfaces.looks.
(
    L_RED, L_GREEN, L_BLUE, L_ALPHA, L_ROUGH, L_ROUGH_TEXEL, L_METAL, L_METAL_TEXEL, L_ER, L_EG, L_EB, L_F0R, L_F0G, L_F0B,
    L_SPECULAR, L_COAT, L_COAT_ROUGH, L_TRANSMISSION, L_NORMAL, L_OCCLUSION, L_UNLIT, L_GROUND, L_CATCHER, L_BLENDED,
    L_PER_LENGTH, L_SCENERY, L_CASTS_FROM,
) = range(27)  # fmt: skip
LOOKS = 27
# Kinds of planes, four channels each, that a bundle of textures may have.
BASE, BUMP, ROUGHNESS, GLOW, SPECULAR_COLOR, COAT_BUMP = range(6)
# base colour and alpha | normal, occlusion | roughness, metallic, coat, transmission | emission, specular | specular colour,
# coat roughness | coat normal, unused

CONSTANT_ROWS = (
    (ROUGH, L_ROUGH), (METAL, L_METAL), (F0R, L_F0R), (F0G, L_F0G), (F0B, L_F0B), (ER, L_ER), (EG, L_EG), (EB, L_EB),
    (COAT, L_COAT), (COAT_ROUGH, L_COAT_ROUGH), (TRANSMISSION, L_TRANSMISSION), (UNLIT, L_UNLIT), (GROUND, L_GROUND),
    (CATCHER, L_CATCHER), (BLENDED, L_BLENDED), (T1, L_SPECULAR),
)  # fmt: skip

# Rows of a chunk: edges, how barycentric coordinates change from pixel to pixel, how u and v change along
# the edges; a normal being turned.
AX, AY, AZ, BX, BY, BZ, SIDE, G_X, H_X, G_Y, H_Y, UA, VA, UB, VB, TX, TY, TZ = range(0, 18 * CHUNK, CHUNK)
EDGE_ROWS = 18


@njit(fastmath=FAST)
def material(count, view, surfaces, textures, b, seen, which):
    """Fill the rows that say what the samples are made of; normals become those of the normal maps.

    `seen` and `which` are the samples' triangles and materials. Rows read: V, G, N, PIXEL, uv, vertex colour in RED to ALPHA.
    """
    e = np.empty(EDGE_ROWS * CHUNK, np.float32)
    c = np.empty(FOOTPRINT_ROWS * CHUNK, np.float32)
    q = np.empty(QUAD_ROWS * QUADS, np.float32)
    places = np.empty(PLACE_ROWS * QUADS, np.int32)
    quads = np.empty(CHUNK + 1, np.uintp)
    texel = np.empty(4 * CHUNK, np.float32)
    begin = 0
    while begin < count:
        m = U(which[begin])
        stop = begin + 1
        while stop < count and U(which[stop]) == m:
            stop += 1
        _factors(begin, stop, surfaces.looks[m], b)
        if surfaces.bundles[m, U(0)] >= 0:
            for start in range(begin, stop, CHUNK):
                size = min(CHUNK, stop - start)
                _edges(size, surfaces, m, b, start, seen, e)
                _barycentric_motion(size, view, b, start, e)
                for n in range(U(surfaces.bundles.shape[1])):
                    if surfaces.bundles[m, n] < 0:
                        break
                    bundle = U(surfaces.bundles[m, n])
                    _coordinates(size, surfaces, textures, bundle, m, b, start, seen, e, c)
                    levels = textures.levels
                    footprints(size, f4(levels[bundle, U(0), U(1)]), f4(levels[bundle, U(0), U(2)]), c)
                    place(textures, bundle, size, c, q, places, quads)
                    mode = textures.modes[bundle]
                    for plane in range(U(mode[5])):
                        kind = mode[U(6) + plane]
                        mix(textures.texels, size, plane * U(4), q, places, quads, texel)
                        if kind in (BUMP, COAT_BUMP):
                            has_normals = mode[12] if kind == BUMP else mode[13]
                            _bump(size, kind, has_normals, e, surfaces.looks[m], b, start, texel)
                        else:
                            _multiply(size, kind, surfaces.looks[m], b, start, texel)
        begin = stop
    _finish(count, b)


@njit(fastmath=FAST)
def _factors(first, stop, look, b):
    """What a run of samples of one material is made of without its textures."""
    zero, one = f4(0), f4(1)
    for row, column in CONSTANT_ROWS:
        value = look[column]
        for i in range(first, stop):
            b[U(row) + U(i)] = value
    rough, metal = look[L_ROUGH_TEXEL], look[L_METAL_TEXEL]
    red, green, blue, alpha, is_blended = look[L_RED], look[L_GREEN], look[L_BLUE], look[L_ALPHA], look[L_BLENDED]
    for i in range(first, stop):
        b[RED + i] *= red
        b[GREEN + i] *= green
        b[BLUE + i] *= blue
        b[ALPHA + i] = one + (b[ALPHA + i] * alpha - one) * is_blended
        b[ROUGH + i] += rough
        b[METAL + i] += metal
        b[AO + i] = one
        b[T0 + i] = zero
        b[CX + i] = b[NX + i]
        b[CY + i] = b[NY + i]
        b[CZ + i] = b[NZ + i]


@njit(fastmath=FAST)
def _edges(count, surfaces, m, b, start, seen, e):
    """The triangles' edges from their first corners; -1 where the back of the file's normals is seen."""
    zero, one = f4(0), f4(1)
    per_length = surfaces.looks[m, U(L_PER_LENGTH)]
    if per_length > zero:
        for i in range(count):
            e[AX + i], e[AY + i], e[AZ + i] = one / per_length, zero, zero
            e[BX + i], e[BY + i], e[BZ + i] = zero, -one / per_length, zero
            e[SIDE + i] = one if b[NZ + start + i] >= zero else -one
        return
    for i in range(count):
        t, j = U(seen[start + i]), start + i
        p0 = surfaces.vertices[U(surfaces.triangles[t, U(0)])]
        p1 = surfaces.vertices[U(surfaces.triangles[t, U(1)])]
        p2 = surfaces.vertices[U(surfaces.triangles[t, U(2)])]
        e[AX + i], e[AY + i], e[AZ + i] = p1[11] - p0[11], p1[12] - p0[12], p1[13] - p0[13]
        e[BX + i], e[BY + i], e[BZ + i] = p2[11] - p0[11], p2[12] - p0[12], p2[13] - p0[13]
        side = b[NX + j] * p0[0] + b[NY + j] * p0[1] + b[NZ + j] * p0[2]
        e[SIDE + i] = one if side >= zero else -one


@njit(fastmath=FAST)
def _barycentric_motion(count, view, b, start, e):
    """How the two barycentric coordinates change from pixel to pixel, across (G_X, H_X) and down (G_Y, H_Y): the derivative of
    the place where the pixel's ray meets the triangle's plane (Igehy, Tracing Ray Differentials, 1999).
    """
    zero, one = f4(0), f4(1)
    r = view.rotation
    is_pinhole = view.rays.shape[0] == 0
    for i in range(count):
        j = start + i
        vx, vy, vz, gx, gy, gz = b[VX + j], b[VY + j], b[VZ + j], b[GX + j], b[GY + j], b[GZ + j]
        ax, ay, az, bx, by, bz = e[AX + i], e[AY + i], e[AZ + i], e[BX + i], e[BY + i], e[BZ + i]
        slant = one / max(vx * gx + vy * gy + vz * gz, f4(1e-4))
        aa, ab, bb = ax * ax + ay * ay + az * az, ax * bx + ay * by + az * bz, bx * bx + by * by + bz * bz
        scale = b[PIXEL + j] / max(aa * bb - ab * ab, f4(1e-30))
        # Across a lens's ray any two directions will do, as its pixels are about round there (Duff et al. 2017).
        s = one if vz >= zero else -one
        k = -one / (s + vz)
        x = r[0, 0] if is_pinhole else one + s * vx * vx * k
        y = r[0, 1] if is_pinhole else s * vx * vy * k
        z = r[0, 2] if is_pinhole else -s * vx
        along = (x * gx + y * gy + z * gz) * slant
        x, y, z = x - vx * along, y - vy * along, z - vz * along
        da, db = x * ax + y * ay + z * az, x * bx + y * by + z * bz
        e[G_X + i], e[H_X + i] = (bb * da - ab * db) * scale, (aa * db - ab * da) * scale
        x = r[1, 0] if is_pinhole else vx * vy * k
        y = r[1, 1] if is_pinhole else s + vy * vy * k
        z = r[1, 2] if is_pinhole else -vy
        along = (x * gx + y * gy + z * gz) * slant
        x, y, z = x - vx * along, y - vy * along, z - vz * along
        da, db = x * ax + y * ay + z * az, x * bx + y * by + z * bz
        e[G_Y + i], e[H_Y + i] = (bb * da - ab * db) * scale, (aa * db - ab * da) * scale


@njit(fastmath=FAST)
def _coordinates(count, surfaces, textures, bundle, m, b, start, seen, e, c):
    """A bundle's coordinates, their changes along the edges (UA to VB) and from pixel to pixel."""
    f = textures.transforms[bundle]
    second = textures.modes[bundle, U(4)] == 1
    row = U(U1 if second else U0)
    k = U(5) if second else U(3)
    is_ground = surfaces.looks[m, U(L_PER_LENGTH)] > f4(0)
    for i in range(count):
        e[UA + i], e[VA + i], e[UB + i], e[VB + i] = f4(1), f4(0), f4(0), f4(1)
        if not is_ground:
            t = U(seen[start + i])
            p0 = surfaces.vertices[U(surfaces.triangles[t, U(0)])]
            p1 = surfaces.vertices[U(surfaces.triangles[t, U(1)])]
            p2 = surfaces.vertices[U(surfaces.triangles[t, U(2)])]
            e[UA + i], e[VA + i] = p1[k] - p0[k], p1[k + U(1)] - p0[k + U(1)]
            e[UB + i], e[VB + i] = p2[k] - p0[k], p2[k + U(1)] - p0[k + U(1)]
    for i in range(count):
        u, v = b[row + U(start + i)], b[row + U(BLOCK + start + i)]
        ua, va, ub, vb = e[UA + i], e[VA + i], e[UB + i], e[VB + i]
        ua, va, ub, vb = f[0] * ua + f[1] * va, f[3] * ua + f[4] * va, f[0] * ub + f[1] * vb, f[3] * ub + f[4] * vb
        e[UA + i], e[VA + i], e[UB + i], e[VB + i] = ua, va, ub, vb
        c[U_AT + i], c[V_AT + i] = f[0] * u + f[1] * v + f[2], f[3] * u + f[4] * v + f[5]
        c[UX + i], c[UY + i] = e[G_X + i] * ua + e[H_X + i] * ub, e[G_Y + i] * ua + e[H_Y + i] * ub
        c[VXX + i], c[VYY + i] = e[G_X + i] * va + e[H_X + i] * vb, e[G_Y + i] * va + e[H_Y + i] * vb


@njit(fastmath=FAST)
def _multiply(count, kind, look, b, start, texel):
    """Four channels of the textures times what the samples have so far."""
    one, w = f4(1), f4(1 / 65535.0)
    if kind == ROUGHNESS:
        rough, metal = look[L_ROUGH_TEXEL] * w, look[L_METAL_TEXEL] * w
        for i in range(count):
            j = U(start + i)
            b[U(ROUGH) + j] += rough * (texel[i] - f4(65535))
            b[U(METAL) + j] += metal * (texel[CHUNK + i] - f4(65535))
            b[U(COAT) + j] *= texel[2 * CHUNK + i] * w
            b[U(TRANSMISSION) + j] *= texel[3 * CHUNK + i] * w
        return
    row, last = U(RED), U(ALPHA)
    if kind == GLOW:
        row, last = U(ER), U(T1)
    elif kind == SPECULAR_COLOR:
        row, last = U(F0R), U(COAT_ROUGH)
    share = look[L_BLENDED] if kind == BASE else one
    for c in range(U(3)):
        for i in range(count):
            b[row + c * U(BLOCK) + U(start + i)] *= texel[c * U(CHUNK) + U(i)] * w
    for i in range(count):
        b[last + U(start + i)] *= one + (texel[3 * CHUNK + i] * w - one) * share


@njit(fastmath=FAST)
def _bump(count, kind, has_normals, e, look, b, start, texel):
    """Turn the normals as a normal map says: x along u, y against v (up in the image), also where the uv are mirrored; nothing
    where they are degenerate.

    A mean of normals is the shorter the more they differ: bumps too small to see become roughness (Toksvig 2005; here as the
    concentrations of von Mises-Fisher lobes, Banerjee et al. 2005, of which the inverses add up).
    """
    zero, one, w = f4(0), f4(1), f4(1 / 32767.0)
    row, strength, widening = U(NX + start), look[L_NORMAL], look[L_NORMAL] * look[L_NORMAL]
    if kind == COAT_BUMP:
        row, strength, widening = U(CX + start), one, zero
    else:
        share = look[L_OCCLUSION] * f4(1 / 65535.0)
        for i in range(count):
            b[U(AO + start + i)] *= one + share * (texel[3 * CHUNK + i] - f4(65535))
    if has_normals == 0:
        return
    for c in range(3):
        for i in range(count):
            e[TX + c * CHUNK + i] = b[row + U(c * BLOCK + i)]
    for i in range(count):
        p, q, z = (texel[i] - f4(32768)) * w, (texel[CHUNK + i] - f4(32768)) * w, (texel[2 * CHUNK + i] - f4(32768)) * w
        squared = min(p * p + q * q + z * z, one)
        spread = f4(2) * (one - squared) / max((f4(3) - squared) * np.sqrt(squared), f4(1e-3))
        b[U(T0 + start + i)] += max(spread - f4(2e-4), zero) * widening
        texel[i], texel[CHUNK + i], texel[2 * CHUNK + i] = p * strength, q * strength, z
    for i in range(count):
        p, q, z = texel[i], texel[CHUNK + i], texel[2 * CHUNK + i]
        ax, ay, az, bx, by, bz = e[AX + i], e[AY + i], e[AZ + i], e[BX + i], e[BY + i], e[BZ + i]
        ua, va, ub, vb = e[UA + i], e[VA + i], e[UB + i], e[VB + i]
        side = e[SIDE + i]
        nx, ny, nz = e[TX + i] * side, e[TY + i] * side, e[TZ + i] * side
        turn = ua * vb - ub * va
        mirror = (one if turn > zero else zero) - (one if turn < zero else zero)
        tx, ty, tz = (vb * ax - va * bx) * mirror, (vb * ay - va * by) * mirror, (vb * az - va * bz) * mirror
        lift = tx * nx + ty * ny + tz * nz
        tx, ty, tz = tx - nx * lift, ty - ny * lift, tz - nz * lift
        squared = tx * tx + ty * ty + tz * tz
        usable = one if squared > f4(1e-30) else zero
        scale = one / np.sqrt(max(squared, f4(1e-30)))
        tx, ty, tz = tx * scale, ty * scale, tz * scale
        ox, oy, oz = ny * tz - nz * ty, nz * tx - nx * tz, nx * ty - ny * tx
        agree = (ub * ax - ua * bx) * ox + (ub * ay - ua * by) * oy + (ub * az - ua * bz) * oz
        q = q if agree * mirror >= zero else -q
        p, q, z = p * side * usable, q * side * usable, (one + (z - one) * usable) * side
        texel[i] = tx * p + ox * q + nx * z
        texel[CHUNK + i] = ty * p + oy * q + ny * z
        texel[2 * CHUNK + i] = tz * p + oz * q + nz * z
    for c in range(3):
        for i in range(count):
            b[row + U(c * BLOCK + i)] = texel[c * CHUNK + i]


@njit(fastmath=FAST)
def _seen(x, y, z, vx, vy, vz):
    """The unit vector; one that looks away, and would be black, is turned until it is seen edge on."""
    one = f4(1)
    s = one / np.sqrt(x * x + y * y + z * z + f4(1e-20))
    x, y, z = x * s, y * s, z * s
    away = max(f4(0.01) - (x * vx + y * vy + z * vz), f4(0))
    x, y, z = x + vx * away, y + vy * away, z + vz * away
    s = one / np.sqrt(x * x + y * y + z * z + f4(1e-20))
    return x * s, y * s, z * s


@njit(fastmath=FAST)
def _finish(count, b):
    """Unit normals that do not look away, roughness with what the bumps add, reflectance and transmission of the mixture."""
    zero, one = f4(0), f4(1)
    for i in range(count):
        x, y, z = _seen(b[NX + i], b[NY + i], b[NZ + i], b[VX + i], b[VY + i], b[VZ + i])
        b[NX + i], b[NY + i], b[NZ + i] = x, y, z
    for i in range(count):
        x, y, z = _seen(b[CX + i], b[CY + i], b[CZ + i], b[VX + i], b[VY + i], b[VZ + i])
        b[CX + i], b[CY + i], b[CZ + i] = x, y, z
    for i in range(count):
        rough = min(max(b[ROUGH + i], zero), one)
        b[ROUGH + i] = min(np.sqrt(np.sqrt(rough * rough * rough * rough + b[T0 + i])), one)
        b[METAL + i] = min(max(b[METAL + i], zero), one)
        b[F0R + i] = min(b[F0R + i], one) * b[T1 + i]
        b[F0G + i] = min(b[F0G + i], one) * b[T1 + i]
        b[F0B + i] = min(b[F0B + i], one) * b[T1 + i]
        b[TRANSMISSION + i] *= one - b[METAL + i]
