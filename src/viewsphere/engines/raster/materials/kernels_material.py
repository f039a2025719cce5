"""The materials of a block's samples: factors times vertex colours times textures, and normals with their normal maps.

glTF 2.0, section 3.9, and the extensions that `assets.mesh.Material` keeps.
"""

from __future__ import annotations

import numba as nb
import numpy as np

from viewsphere.engines.raster.materials.kernels_filter import (
    CHUNK,
    PLACE_ROWS,
    PLANES,
    QUAD_ROWS,
    QUADS,
    TEXEL,
    U_AT,
    UX,
    UY,
    V_AT,
    footprints,
    mix,
    place,
)  # fmt: skip
from viewsphere.engines.raster.materials.kernels_filter import ROWS as FOOTPRINT_ROWS
from viewsphere.engines.raster.materials.kernels_filter import VX as VXX
from viewsphere.engines.raster.materials.kernels_filter import VY as VYY
from viewsphere.engines.raster.shading.kernels_block import (
    ALPHA,
    AO,
    AX,
    AY,
    AZ,
    BLENDED,
    BLOCK,
    BLUE,
    BX,
    BY,
    BZ,
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
    METAL,
    NX,
    NY,
    NZ,
    PIXEL,
    RED,
    ROUGH,
    SIDE,
    T0,
    T1,
    TRANSMISSION,
    U0,
    U1,
    UA0,
    UB0,
    UNLIT,
    V0,
    VA0,
    VB0,
    VX,
    VY,
    VZ,
)  # fmt: skip
from viewsphere.kernels.jit import inner
from viewsphere.kernels.lanes import FAST, clamp, cross, dot, lanewise, least, most, root, sign, where

f4 = nb.float32
U = nb.uintp

# Columns of Surfaces.looks.
(
    L_RED, L_GREEN, L_BLUE, L_ALPHA, L_ROUGH, L_ROUGH_TEXEL, L_METAL, L_METAL_TEXEL, L_ER, L_EG, L_EB, L_F0R, L_F0G, L_F0B,
    L_SPECULAR, L_COAT, L_COAT_ROUGH, L_TRANSMISSION, L_NORMAL, L_OCCLUSION, L_UNLIT, L_GROUND, L_CATCHER, L_BLENDED,
    L_PER_LENGTH, L_SCENERY, L_CASTS_FROM, L_BENDS,
) = range(28)  # fmt: skip
LOOKS = 28
# Kinds of planes, four channels each, that a bundle of textures may have.
BASE, BUMP, ROUGHNESS, GLOW, SPECULAR_COLOR, COAT_BUMP = range(6)
# base colour and alpha | normal, occlusion | roughness, metallic, coat, transmission | emission, specular | specular colour,
# coat roughness | coat normal, unused

CONSTANT_ROWS = {
    F0R: L_F0R, F0G: L_F0G, F0B: L_F0B, ER: L_ER, EG: L_EG, EB: L_EB, COAT: L_COAT, COAT_ROUGH: L_COAT_ROUGH,
    TRANSMISSION: L_TRANSMISSION, UNLIT: L_UNLIT, GROUND: L_GROUND, CATCHER: L_CATCHER, BLENDED: L_BLENDED, T1: L_SPECULAR,
}  # fmt: skip

# Rows of a chunk: how barycentric coordinates change from pixel to pixel, and how u and v change along the edges.
G_X, H_X, G_Y, H_Y, UA, VA, UB, VB = range(FOOTPRINT_ROWS * CHUNK, (FOOTPRINT_ROWS + 8) * CHUNK, CHUNK)
CHUNK_ROWS = FOOTPRINT_ROWS + 8
SECOND_SET = U1 - U0  # from a row of the first uv set to that of the second


@inner(fastmath=FAST, _nrt=True)
def look_up(count, view, surfaces, textures, b, which):
    """The values of `material` from factors and textures. Their products may still be out of range, and normals have any
    length.
    """
    c = np.empty(CHUNK_ROWS * CHUNK, np.float32)
    q = np.empty(QUAD_ROWS * QUADS, np.float32)
    places = np.empty(PLACE_ROWS * QUADS, np.int32)
    is_lens = f4(view.rays.shape[0] > 0)
    narrows = view.lens[0, 0] < f4(0)
    begin = 0
    while begin < count:
        m = U(which[begin])
        stop = begin + 1
        while stop < count and U(which[stop]) == m:
            stop += 1
        look, bundles = surfaces.looks[m], surfaces.bundles[m]
        own = b[U(begin) :]
        _factors(stop - begin, look, own)
        if bundles[0] >= 0:
            if look[L_PER_LENGTH] > f4(0):
                _lay_ground(stop - begin, look[L_PER_LENGTH], own)
            for start in range(begin, stop, CHUNK):
                own = b[U(start) :]
                size = min(CHUNK, stop - start)
                _barycentric_motion(size, view.rotation, is_lens, own, c)
                if narrows:
                    _panorama_motion(size, view.rotation, own, c)
                for n in range(U(bundles.shape[0])):
                    if bundles[n] < 0:
                        break
                    bundle = U(bundles[n])
                    mode, levels = textures.modes[bundle], textures.levels[bundle]
                    _coordinates(size, textures.transforms[bundle], U(mode[4] * SECOND_SET), own, c)
                    footprints(size, f4(levels[0, 1]), f4(levels[0, 2]), c)
                    place(textures.texels, levels, mode, size, c, q, places)
                    for plane in range(mode[5]):
                        if plane % PLANES == 0:
                            mix(textures.texels, size, plane, mode[5], q, places, c)
                        _apply(size, plane, mode, look, c, own)
        begin = stop


@inner(fastmath=FAST, _nrt=True)
def material(count, view, surfaces, textures, b, which):
    """Fill the rows of the samples' material; smooth normals are replaced by those of the normal maps.

    `which` are the samples' materials. Reads rows V, N, PIXEL, uv, vertex colour in RED to ALPHA, and AX to SIDE if textured.
    """
    look_up(count, view, surfaces, textures, b, which)
    _finish(count, b)


@lanewise(exact=True)
def _factors(look, b):
    """Material rows of a run of samples of one material, before its textures are applied."""
    for row, column in CONSTANT_ROWS.items():
        b[row] = look.one(column)
    for row, column in ((RED, L_RED), (GREEN, L_GREEN), (BLUE, L_BLUE)):
        b[row] = b[row] * look.one(column)
    b[ALPHA] = 1 + (b[ALPHA] * look.one(L_ALPHA) - 1) * look.one(L_BLENDED)
    b[ROUGH] = look.one(L_ROUGH) + look.one(L_ROUGH_TEXEL)
    b[METAL] = look.one(L_METAL) + look.one(L_METAL_TEXEL)
    b[AO], b[T0] = 1, 0
    b.put((CX, CY, CZ), b.get(NX, NY, NZ))


@lanewise(exact=True)
def _lay_ground(per_length, b):
    """Edge rows of samples on the ground: along either edge one texture coordinate changes by 1."""
    length = 1 / per_length
    for row in (AY, AZ, BX, BZ, VA0, UB0):
        b[row] = 0
    b[AX], b[BY], b[UA0], b[VB0] = length, -length, 1, 1
    b[SIDE] = sign(b[NZ])


@lanewise
def _barycentric_motion(rotation, is_lens, b, c):
    """Write the change of the two barycentric coordinates from pixel to pixel, across (G_X, H_X) and down (G_Y, H_Y).

    It is the derivative of the place where the pixel's ray meets the triangle's plane (Igehy, Tracing Ray Differentials, 1999).
    Solved by Cramer's rule: a step on the screen equals a step along the two edges plus one along the ray.
    """
    v, first, second = b.get(VX, VY, VZ), b.get(AX, AY, AZ), b.get(BX, BY, BZ)
    g, h = cross(second, v), cross(v, first)
    volume = dot(first, g)
    scale = b[PIXEL] * volume / most(volume * volume, 1e-36)
    # Across a lens's ray, any two perpendicular directions work, because its pixels are nearly round there (Duff et al. 2017).
    x, y, z = v
    s = sign(z)
    k = -1 / (s + z)
    across = 1 + s * x * x * k, s * x * y * k, -s * x
    down = x * y * k, s + y * y * k, -y
    lens = is_lens > 0
    across = tuple(where(lens, across[n], rotation.one(n)) for n in range(3))
    down = tuple(where(lens, down[n], rotation.one(3 + n)) for n in range(3))
    c[G_X], c[H_X] = dot(across, g) * scale, dot(across, h) * scale
    c[G_Y], c[H_Y] = dot(down, g) * scale, dot(down, h) * scale


@lanewise
def _panorama_motion(rotation, b, c):
    """The same for a panorama, whose pixels are as wide as the cosine of their elevation: the length of the first product."""
    v, first, second = b.get(VX, VY, VZ), b.get(AX, AY, AZ), b.get(BX, BY, BZ)
    g, h = cross(second, v), cross(v, first)
    volume = dot(first, g)
    scale = b[PIXEL] * volume / most(volume * volume, 1e-36)
    across = cross(tuple(rotation.one(3 + n) for n in range(3)), v)
    down = cross(v, across)
    per = scale / root(most(dot(across, across), 1e-12))
    c[G_X], c[H_X] = dot(across, g) * scale, dot(across, h) * scale
    c[G_Y], c[H_Y] = dot(down, g) * per, dot(down, h) * per


@lanewise
def _coordinates(transform, uv_set, b, c):
    """A bundle's coordinates, their changes along the edges (UA to VB) and from pixel to pixel. uv_set: 0 or SECOND_SET."""
    f = [transform.one(n) for n in range(6)]
    u, v = b[U0, uv_set], b[V0, uv_set]
    c[U_AT], c[V_AT] = f[0] * u + f[1] * v + f[2], f[3] * u + f[4] * v + f[5]
    ua, va, ub, vb = b[UA0, uv_set], b[VA0, uv_set], b[UB0, uv_set], b[VB0, uv_set]
    ua, va, ub, vb = f[0] * ua + f[1] * va, f[3] * ua + f[4] * va, f[0] * ub + f[1] * vb, f[3] * ub + f[4] * vb
    c.put((UA, VA, UB, VB), (ua, va, ub, vb))
    gx, hx, gy, hy = c.get(G_X, H_X, G_Y, H_Y)
    c.put((UX, UY, VXX, VYY), (gx * ua + hx * ub, gy * ua + hy * ub, gx * va + hx * vb, gy * va + hy * vb))


@inner(fastmath=FAST)
def _apply(count, plane, mode, look, c, b):
    """Apply four channels of a bundle to the samples' rows."""
    kind, at = mode[6 + plane], U(TEXEL + plane % PLANES * 4 * CHUNK)
    one = f4(1)
    if kind == BASE:
        _multiply(count, U(RED), U(ALPHA), look[L_BLENDED], at, c, b)
    elif kind == GLOW:
        _multiply(count, U(ER), U(T1), one, at, c, b)
    elif kind == SPECULAR_COLOR:
        _multiply(count, U(F0R), U(COAT_ROUGH), one, at, c, b)
    elif kind == ROUGHNESS:
        _roughen(count, look[L_ROUGH_TEXEL], look[L_METAL_TEXEL], at, c, b)
    else:
        is_coat = kind == COAT_BUMP
        if not is_coat:
            _occlude(count, look[L_OCCLUSION], at, c, b)
        if mode[13 if is_coat else 12] != 0:
            strength = one if is_coat else look[L_NORMAL]
            _bump(count, strength, f4(0) if is_coat else strength * strength, U(CX - NX if is_coat else 0), at, c, b)


@lanewise(exact=True)
def _multiply(row, last, share, at, c, b):
    """Multiply three rows by three channels, and a fourth row by the fourth channel, weighted by `share`."""
    for k in range(3):
        b[row, k * BLOCK] = b[row, k * BLOCK] * (c[at, k * CHUNK] * (1 / 65535))
    b[last] = b[last] * (1 + (c[at, 3 * CHUNK] * (1 / 65535) - 1) * share)


@lanewise(exact=True)
def _roughen(rough, metal, at, c, b):
    """Multiply roughness, metallic, coat and transmission by a plane's channels."""
    b[ROUGH] = b[ROUGH] + rough * (c[at] * (1 / 65535) - 1)
    b[METAL] = b[METAL] + metal * (c[at, CHUNK] * (1 / 65535) - 1)
    b[COAT] = b[COAT] * (c[at, 2 * CHUNK] * (1 / 65535))
    b[TRANSMISSION] = b[TRANSMISSION] * (c[at, 3 * CHUNK] * (1 / 65535))


@lanewise(exact=True)
def _occlude(share, at, c, b):
    b[AO] = b[AO] * (1 + share * (c[at, 3 * CHUNK] * (1 / 65535) - 1))


@lanewise(exact=True)
def _bump(strength, widening, coat, at, c, b):
    """Turn the normals by a normal map: x along u, y against v (up in the image), also if the uv are mirrored. Normals are
    unchanged if the uv are degenerate. coat: CX - NX for the coat's normals, otherwise 0.

    The more normals differ, the shorter is their mean, so bumps too small to see become roughness (Toksvig 2005; here by adding
    the inverse concentrations of von Mises-Fisher lobes, Banerjee et al. 2005).
    """
    p, q, z = ((c[at, k * CHUNK] - 32768) * (1 / 32767) for k in range(3))
    squared = least(p * p + q * q + z * z, 1)
    spread = 2 * (1 - squared) / most((3 - squared) * root(squared), 1e-3)
    b[T0] = b[T0] + most(spread - 2e-4, 0) * widening
    p, q = p * strength, q * strength
    side = b[SIDE]
    normal = tuple(b[row, coat] * side for row in (NX, NY, NZ))
    first, second = b.get(AX, AY, AZ), b.get(BX, BY, BZ)
    ua, va, ub, vb = c.get(UA, VA, UB, VB)
    turn = ua * vb - ub * va
    mirror = where(turn > 0, 1, where(turn < 0, -1, 0))
    tangent = tuple((vb * first[k] - va * second[k]) * mirror for k in range(3))
    lift = dot(tangent, normal)
    tangent = tuple(tangent[k] - normal[k] * lift for k in range(3))
    squared = dot(tangent, tangent)
    usable = where(squared > 1e-30, 1, 0)
    scale = 1 / root(most(squared, 1e-30))
    tangent = tuple(t * scale for t in tangent)
    other = cross(normal, tangent)
    agree = dot(tuple(ub * first[k] - ua * second[k] for k in range(3)), other)
    q = q * sign(agree * mirror)
    p, q, z = p * side * usable, q * side * usable, (1 + (z - 1) * usable) * side
    for k, row in enumerate((NX, NY, NZ)):
        b[row, coat] = tangent[k] * p + other[k] * q + normal[k] * z


def _seen(normal, v):
    """The unit normal; a normal that faces away from the viewer, and would be black, is turned until it is edge-on."""
    scale = 1 / root(dot(normal, normal) + 1e-20)
    normal = tuple(x * scale for x in normal)
    away = most(0.01 - dot(normal, v), 0)
    normal = tuple(x + w * away for x, w in zip(normal, v, strict=True))
    scale = 1 / root(dot(normal, normal) + 1e-20)
    return tuple(x * scale for x in normal)


@lanewise
def _finish(b):
    """Unit normals that face the viewer, roughness including small bumps, reflectance and transmission of the mixture."""
    v = b.get(VX, VY, VZ)
    for rows in ((NX, NY, NZ), (CX, CY, CZ)):
        b.put(rows, _seen(b.get(*rows), v))
    rough, metal = clamp(b[ROUGH]), clamp(b[METAL])
    b[ROUGH] = least(root(root(rough * rough * rough * rough + b[T0])), 1)
    b[METAL] = metal
    for row in (F0R, F0G, F0B):
        b[row] = least(b[row], 1) * b[T1]
    b[TRANSMISSION] = b[TRANSMISSION] * (1 - metal)
