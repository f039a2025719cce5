"""How a surface answers light: Lambert, GGX and a clear coat, lit by one light at a time and by all around.

A layered model with view-dependent weights (Turquin 2019; as Cycles' Principled BSDF): what a layer reflects of a white
surrounding is taken from the layers below it, so that a white surface in a white surrounding vanishes. Walter et al. 2007
(GGX), Heitz 2014 (height-correlated Smith), Schlick 1994 (Fresnel), Karis 2013 (split sum, lights that have a size).

Order of the stages: `weigh`, then `add_light` for every light, `ambient`, `compose`.
"""

# ruff: isort: skip_file
from __future__ import annotations

import math

import numba as nb
import numpy as np

from viewsphere.engines.raster.kernels_block import (
    ALPHA, BASE_B, BASE_G, BASE_R, BLUE, BOUNCE, COAT, COAT_ROUGH, CX, CY, CZ, DB, DG, DR, EB, EDGE_B, EDGE_G, EDGE_R, EG, ER,
    F0B, F0G, F0R, FACE_B, FACE_G, FACE_R, GREEN, GX, GY, GZ, IB, IG, IR, LOBE, LX, LY, LZ, METAL, NX, NY, NZ, OPEN, RED, RIM,
    ROUGH, SB, SG, SHARE, SR, T0, T1, T2, T3, T4, T5, T6, T7, TAKEN, THROUGH, TRANSMISSION, UNLIT, VX, VY, VZ, WIDTH,
)  # fmt: skip
from viewsphere.engines.raster.kernels_texture import FAST
from viewsphere.geometry.jit import njit
from viewsphere.imaging.view import EXPOSURE

f4 = nb.float32
i4 = nb.int32
U = nb.uintp

COAT_F0 = np.float32(0.04)
SMOOTHEST = np.float32(0.03)  # perceptual roughness: a lamp in a perfect mirror would be a point
BRIGHTEST = np.float32(60000.0)
UNEXPOSED = np.float32(1 / EXPOSURE)  # an unlit colour is meant to be seen as it is


@njit(fastmath=FAST)
def _albedo(albedo, facing, rough):
    """The two integrals of a lobe, bilinear in the square root of the cosine and in roughness."""
    last = albedo.shape[0] - 1
    x = f4(math.sqrt(min(max(facing, f4(0)), f4(1)))) * f4(last)
    y = min(max(rough, f4(0)), f4(1)) * f4(last)
    i = min(max(i4(x), i4(0)), i4(last - 1))
    j = min(max(i4(y), i4(0)), i4(last - 1))
    fx, fy = x - f4(i), y - f4(j)
    a, c = albedo[U(j)], albedo[U(j) + U(1)]
    first, second = U(i), U(i) + U(1)
    wa, wb, wc, wd = (f4(1) - fx) * (f4(1) - fy), fx * (f4(1) - fy), (f4(1) - fx) * fy, fx * fy
    lobe = a[first, 0] * wa + a[second, 0] * wb + c[first, 0] * wc + c[second, 0] * wd
    rim = a[first, 1] * wa + a[second, 1] * wb + c[first, 1] * wc + c[second, 1] * wd
    return lobe, rim


@njit(fastmath=FAST)
def _any(count, row, b):
    most = f4(0)
    for i in range(count):
        most = max(most, b[row + i])
    return most > f4(0)


@njit(fastmath=FAST)
def _channel(base, f0, metal, lobe, rim, lost, left, body):
    """Of one colour: diffuse weight, both specular weights, as `weigh` says."""
    one = f4(1)
    more, more_metal = one + f0 * lost, one + base * lost
    shine = more * (f0 * lobe + (one - f0) * rim)
    face = left * ((one - metal) * more * f0 + metal * more_metal * base)
    edge = left * ((one - metal) * more * (one - f0) + metal * more_metal * max(one - base, f4(0)))
    return body * max(one - shine, f4(0)), face, edge


@njit(fastmath=FAST)
def weigh(count, albedo, b):
    """Share out the light among a sample's layers, for any light: fills FACE_R to THROUGH, clears DR to SB.

    albedo: `Surrounding.albedo`.
    """
    zero, one = f4(0), f4(1)
    coated = _any(count, COAT, b)
    for k in range(2 if coated else 1):
        for i in range(count):
            if k == 0:
                facing = b[NX + i] * b[VX + i] + b[NY + i] * b[VY + i] + b[NZ + i] * b[VZ + i]
            else:
                facing = b[CX + i] * b[VX + i] + b[CY + i] * b[VY + i] + b[CZ + i] * b[VZ + i]
            b[T0 + i], b[T1 + i] = facing, b[ROUGH + i] if k == 0 else b[COAT_ROUGH + i]
        for i in range(count):
            lobe, rim = _albedo(albedo, b[T0 + i], b[T1 + i])
            if k == 0:
                b[LOBE + i], b[RIM + i], b[TAKEN + i] = lobe, rim, zero
            else:
                b[TAKEN + i] = b[COAT + i] * (COAT_F0 * lobe + (one - COAT_F0) * rim)
    for i in range(count):
        lobe, rim, metal = b[LOBE + i], b[RIM + i], b[METAL + i]
        left = one - b[TAKEN + i]
        lost = (one - lobe) / max(lobe, f4(0.05))  # light that bounces more than once between the facets
        through = min(max(b[TRANSMISSION + i], zero), one)
        body = (one - metal) * left
        kept = body * (one - through)
        red, green, blue = b[RED + i], b[GREEN + i], b[BLUE + i]
        share_r, b[FACE_R + i], b[EDGE_R + i] = _channel(red, b[F0R + i], metal, lobe, rim, lost, left, one)
        share_g, b[FACE_G + i], b[EDGE_G + i] = _channel(green, b[F0G + i], metal, lobe, rim, lost, left, one)
        share_b, b[FACE_B + i], b[EDGE_B + i] = _channel(blue, b[F0B + i], metal, lobe, rim, lost, left, one)
        b[BASE_R + i], b[BASE_G + i], b[BASE_B + i] = red * share_r * kept, green * share_g * kept, blue * share_b * kept
        b[THROUGH + i] = through * body * (share_r + share_g + share_b) * f4(1 / 3)
        b[DR + i], b[DG + i], b[DB + i], b[SR + i], b[SG + i], b[SB + i] = zero, zero, zero, zero, zero, zero


@njit(fastmath=FAST)
def _base_layer(count, b):
    """T3 to T6: normal and roughness below the coat."""
    for i in range(count):
        b[T3 + i], b[T4 + i], b[T5 + i], b[T6 + i] = b[NX + i], b[NY + i], b[NZ + i], b[ROUGH + i]


@njit(fastmath=FAST)
def _coat_layer(count, b):
    """T3 to T6: normal and roughness of the coat."""
    for i in range(count):
        b[T3 + i], b[T4 + i], b[T5 + i], b[T6 + i] = b[CX + i], b[CY + i], b[CZ + i], b[COAT_ROUGH + i]


@njit(fastmath=FAST)
def _lobes(count, b):
    """T0 to T2 for the layer T3 to T6: the cosine towards a light, GGX times visibility times that cosine, Schlick's power.

    The light is a ball of angular radius WIDTH: the lobe is that of its point nearest to the mirrored ray, and dimmed by as
    much as this makes it larger: by 1 + pi / 2 q + q^2 for q = WIDTH / 2 alpha.
    """
    zero, one, tiny = f4(0), f4(1), f4(1e-20)
    for i in range(count):
        vx, vy, vz, nx, ny, nz = b[VX + i], b[VY + i], b[VZ + i], b[T3 + i], b[T4 + i], b[T5 + i]
        lx, ly, lz = b[LX + i], b[LY + i], b[LZ + i]
        nv = min(max(nx * vx + ny * vy + nz * vz, f4(1e-3)), one)
        nl = min(max(nx * lx + ny * ly + nz * lz, zero), one)
        a = min(max(b[T6 + i], SMOOTHEST), one)
        a = a * a
        aa = a * a
        rx, ry, rz = (nv + nv) * nx - vx, (nv + nv) * ny - vy, (nv + nv) * nz - vz
        along = rx * lx + ry * ly + rz * lz
        w = min(max(b[WIDTH + i], zero), one)
        sine, cosine = w * (one - w * w * f4(1 / 6)), one - w * w * f4(0.5) * (one - w * w * f4(1 / 12))
        tx, ty, tz = rx - along * lx, ry - along * ly, rz - along * lz
        s = sine / np.sqrt(tx * tx + ty * ty + tz * tz + tiny)
        within = along >= cosine
        hx = vx + (rx if within else lx * cosine + tx * s)
        hy = vy + (ry if within else ly * cosine + ty * s)
        hz = vz + (rz if within else lz * cosine + tz * s)
        s = one / np.sqrt(hx * hx + hy * hy + hz * hz + tiny)
        hx, hy, hz = hx * s, hy * s, hz * s
        qx, qy, qz = ny * hz - nz * hy, nz * hx - nx * hz, nx * hy - ny * hx
        off = qx * qx + qy * qy + qz * qz
        d = off + aa * (one - off)
        spread = aa / (aa + w * (a * f4(math.pi / 4) + w * f4(0.25)))
        smith = nl * np.sqrt(nv * nv * (one - aa) + aa) + nv * np.sqrt(nl * nl * (one - aa) + aa)
        om = one - min(max(vx * hx + vy * hy + vz * hz, zero), one)
        power = om * om
        b[T0 + i] = nl
        b[T1 + i] = aa * spread * nl * f4(0.5 / math.pi) / (d * d * max(smith, f4(1e-6)))
        b[T2 + i] = power * power * om


@njit(fastmath=FAST)
def add_light(count, b):
    """One light, rows LX to WIDTH: its diffuse reflection is added to DR, DG, DB, its mirrored image to SR, SG, SB."""
    _base_layer(count, b)
    _lobes(count, b)
    for i in range(count):
        share = b[SHARE + i]
        red, green, blue = b[IR + i] * share, b[IG + i] * share, b[IB + i] * share
        lambert, lobe, power = b[T0 + i] * f4(1 / math.pi), b[T1 + i], b[T2 + i]
        b[DR + i] += b[BASE_R + i] * lambert * red
        b[DG + i] += b[BASE_G + i] * lambert * green
        b[DB + i] += b[BASE_B + i] * lambert * blue
        b[SR + i] += min((b[FACE_R + i] + b[EDGE_R + i] * power) * lobe * red, BRIGHTEST)
        b[SG + i] += min((b[FACE_G + i] + b[EDGE_G + i] * power) * lobe * green, BRIGHTEST)
        b[SB + i] += min((b[FACE_B + i] + b[EDGE_B + i] * power) * lobe * blue, BRIGHTEST)
    if _any(count, COAT, b):
        _coat_layer(count, b)
        _lobes(count, b)
        for i in range(count):
            lobe = b[SHARE + i] * b[COAT + i] * (COAT_F0 + (f4(1) - COAT_F0) * b[T2 + i]) * b[T1 + i]
            b[SR + i] += min(lobe * b[IR + i], BRIGHTEST)
            b[SG + i] += min(lobe * b[IG + i], BRIGHTEST)
            b[SB + i] += min(lobe * b[IB + i], BRIGHTEST)


@njit(fastmath=FAST)
def _texel(maps, level, i, b, coordinates):
    """Four numbers of a map at (T0, T1) in -1..1: bilinear, the maps have a border."""
    start, size = maps[level, U(0)], maps[level, U(1)]
    half = f4(size) * f4(0.5)
    x, y = (b[T0 + i] + f4(1)) * half + f4(0.5), (b[T1 + i] + f4(1)) * half + f4(0.5)
    column, row = min(max(i4(x), i4(0)), size), min(max(i4(y), i4(0)), size)
    fx, fy = x - f4(column), y - f4(row)
    first = U(start + row * (size + i4(2)) + column)
    p, q = coordinates[first], coordinates[first + U(1)]
    below = first + U(size + i4(2))
    r, s = coordinates[below], coordinates[below + U(1)]
    wp, wq, wr, ws = (f4(1) - fx) * (f4(1) - fy), fx * (f4(1) - fy), (f4(1) - fx) * fy, fx * fy
    return (
        p[0] * wp + q[0] * wq + r[0] * wr + s[0] * ws,
        p[1] * wp + q[1] * wq + r[1] * wr + s[1] * ws,
        p[2] * wp + q[2] * wq + r[2] * wr + s[2] * ws,
        p[3] * wp + q[3] * wq + r[3] * wr + s[3] * ws,
    )


@njit(fastmath=FAST)
def _place(count, turn, b):
    """Octahedral coordinates T0, T1 of the directions T0, T1, T2, any length."""
    zero, one, tiny = f4(0), f4(1), f4(1e-20)
    cosine, sine = turn[0], turn[1]
    for i in range(count):
        east, north, z = b[T0 + i], b[T1 + i], b[T2 + i]
        x, y = cosine * east + sine * north, cosine * north - sine * east
        s = one / (abs(x) + abs(y) + abs(z) + tiny)
        x, y = x * s, y * s
        u, v = one - abs(y), one - abs(x)
        u, v = u if x >= zero else -u, v if y >= zero else -v
        b[T0 + i] = u if z < zero else x
        b[T1 + i] = v if z < zero else y


@njit(fastmath=FAST)
def _mirrored(count, texels, levels, b):
    """T3 to T6: what the lobe of roughness T6 around (T0, T1) sees, and how much of it lies below; of -1, a matt surface."""
    last = levels.shape[0] - 2
    for i in range(count):
        rough = b[T6 + i]
        lod = min(rough, f4(1)) * f4(last)
        level = min(max(i4(lod), i4(0)), i4(last - 1)) if rough >= f4(0) else i4(-1)
        weight = lod - f4(level) if rough >= f4(0) else f4(0)
        p = _texel(levels, U(level + 1), i, b, texels)
        if weight > f4(0):
            q = _texel(levels, U(level + 2), i, b, texels)
            p = (
                p[0] + (q[0] - p[0]) * weight,
                p[1] + (q[1] - p[1]) * weight,
                p[2] + (q[2] - p[2]) * weight,
                p[3] + (q[3] - p[3]) * weight,
            )
        b[T3 + i], b[T4 + i], b[T5 + i], b[T6 + i] = p


@njit(fastmath=FAST)
def _light(count, surrounding, is_matte, b):
    """T3, T4, T5: radiance around the direction T0, T1, T2 over roughness T6 (-1: of a white matt surface that faces it).

    The map's, the even light from above, the ground's as far as it reaches the sample. Lamps light the ground close by: a
    mirrored ray that goes down but little sees none of it.
    """
    zero, one = f4(0), f4(1)
    lamp_r, lamp_g, lamp_b = surrounding.lamps[0], surrounding.lamps[1], surrounding.lamps[2]
    _place(count, surrounding.turn, b)
    _mirrored(count, surrounding.texels, surrounding.levels, b)
    scale, above, below = surrounding.scale, surrounding.above, surrounding.below
    scale_r, scale_g, scale_b = scale[0], scale[1], scale[2]
    above_r, above_g, above_b = above[0], above[1], above[2]
    below_r, below_g, below_b = below[0], below[1], below[2]
    for i in range(count):
        share = b[T6 + i]
        sky, ground = one - share, share * b[BOUNCE + i]
        down = one if is_matte else min(max(f4(-1.6) * b[T2 + i], zero), one)
        near = ground * down * down
        b[T3 + i] = max(b[T3 + i] * scale_r + sky * above_r + ground * below_r + near * lamp_r, zero)
        b[T4 + i] = max(b[T4 + i] * scale_g + sky * above_g + ground * below_g + near * lamp_g, zero)
        b[T5 + i] = max(b[T5 + i] * scale_b + sky * above_b + ground * below_b + near * lamp_b, zero)


@njit(fastmath=FAST)
def _reflect(count, b):
    """T0, T1, T2: the middle of the lobe of the layer T3 to T6; T7: how much of it gets out of the surface and its crevice."""
    zero, one = f4(0), f4(1)
    for i in range(count):
        vx, vy, vz, nx, ny, nz = b[VX + i], b[VY + i], b[VZ + i], b[T3 + i], b[T4 + i], b[T5 + i]
        nv = min(max(nx * vx + ny * vy + nz * vz, zero), one)
        r = min(max(b[T6 + i], zero), one)
        rx, ry, rz = (nv + nv) * nx - vx, (nv + nv) * ny - vy, (nv + nv) * nz - vz
        # The shading normal may send the ray into the surface; cf. Lagarde and de Rousiers 2014 for both terms.
        out = max(one + min(rx * b[GX + i] + ry * b[GY + i] + rz * b[GZ + i], zero), zero)
        open_, smooth = b[OPEN + i], (one - r) * (one - r)
        seen = open_ + smooth * open_ * (one - open_) * (nv + nv - f4(1.1))
        b[T7 + i] = min(max(seen, zero), one) * out * out
        a = r * r * r * r
        b[T0 + i], b[T1 + i], b[T2 + i] = rx + (nx - rx) * a, ry + (ny - ry) * a, rz + (nz - rz) * a
        b[T6 + i] = r


@njit(fastmath=FAST)
def ambient(count, surrounding, b):
    """The light of the surroundings, once the block is weighed: added to DR to SB. Reads OPEN and BOUNCE."""
    coated = _any(count, COAT, b)
    for k in range(3 if coated else 2):
        if k == 0:
            for i in range(count):
                b[T0 + i], b[T1 + i], b[T2 + i], b[T6 + i] = b[NX + i], b[NY + i], b[NZ + i], f4(-1)
        else:
            if k == 1:
                _base_layer(count, b)
            else:
                _coat_layer(count, b)
            _reflect(count, b)
        _light(count, surrounding, k == 0, b)
        if k == 0:
            for i in range(count):
                open_ = b[OPEN + i]
                b[DR + i] += b[BASE_R + i] * b[T3 + i] * open_
                b[DG + i] += b[BASE_G + i] * b[T4 + i] * open_
                b[DB + i] += b[BASE_B + i] * b[T5 + i] * open_
        elif k == 1:
            for i in range(count):
                lobe, rim, seen = b[LOBE + i], b[RIM + i], b[T7 + i]
                b[SR + i] += (b[FACE_R + i] * lobe + b[EDGE_R + i] * rim) * b[T3 + i] * seen
                b[SG + i] += (b[FACE_G + i] * lobe + b[EDGE_G + i] * rim) * b[T4 + i] * seen
                b[SB + i] += (b[FACE_B + i] * lobe + b[EDGE_B + i] * rim) * b[T5 + i] * seen
        else:
            for i in range(count):
                seen = b[TAKEN + i] * b[T7 + i]
                b[SR + i] += seen * b[T3 + i]
                b[SG + i] += seen * b[T4 + i]
                b[SB + i] += seen * b[T5 + i]


@njit(fastmath=FAST)
def _sent(body, shine, base, alpha, shown, unlit):
    value = body * alpha + shine * shown
    value = value + unlit * (base * alpha * UNEXPOSED - value)
    return min(value, BRIGHTEST) if value > f4(0) else f4(0)


@njit(fastmath=FAST)
def compose(count, surrounding, b):
    """What the sample sends to the viewer, in place of the base colour: RED, GREEN, BLUE premultiplied, ALPHA its opacity.

    Thin glass lets through what is behind it by the least of its three tints; what the other two let through more, T0 to T2,
    is taken from the surroundings in the line of sight, T3 to T5: `lay` puts what is known to be behind in their place. The
    rougher, the more of it comes from the surroundings. A mirrored image does not become transparent with the surface (glass
    made by alpha), except where that is all but clear.
    """
    zero, one = f4(0), f4(1)
    if _any(count, THROUGH, b):
        for i in range(count):
            b[T0 + i], b[T1 + i], b[T2 + i], b[T6 + i] = -b[VX + i], -b[VY + i], -b[VZ + i], b[ROUGH + i]
        _light(count, surrounding, False, b)
        for i in range(count):
            through, open_, rough = b[THROUGH + i], b[OPEN + i], b[ROUGH + i]
            least = min(max(min(b[RED + i], b[GREEN + i], b[BLUE + i]), zero), one)
            clear = through * least * (one - rough * rough)
            clear = clear if clear > zero else zero
            b[T7 + i] = clear
            b[T3 + i], b[T4 + i], b[T5 + i] = b[T3 + i] * open_, b[T4 + i] * open_, b[T5 + i] * open_
            b[DR + i] += max(through * b[RED + i] - clear, zero) * b[T3 + i]
            b[DG + i] += max(through * b[GREEN + i] - clear, zero) * b[T4 + i]
            b[DB + i] += max(through * b[BLUE + i] - clear, zero) * b[T5 + i]
            sharp = through * (one - rough * rough) * min(max(b[ALPHA + i], zero), one) * (one - b[UNLIT + i])
            sharp = sharp if sharp > zero else zero
            b[T0 + i], b[T1 + i] = sharp * max(b[RED + i] - least, zero), sharp * max(b[GREEN + i] - least, zero)
            b[T2 + i] = sharp * max(b[BLUE + i] - least, zero)
    else:
        for i in range(count):
            b[T7 + i], b[T0 + i], b[T1 + i], b[T2 + i] = zero, zero, zero, zero
            b[T3 + i], b[T4 + i], b[T5 + i] = zero, zero, zero
    for i in range(count):
        alpha, unlit = min(max(b[ALPHA + i], zero), one), b[UNLIT + i]
        shown = min(alpha * f4(8), one)
        b[RED + i] = _sent(b[DR + i], b[SR + i] + b[ER + i], b[RED + i], alpha, shown, unlit)
        b[GREEN + i] = _sent(b[DG + i], b[SG + i] + b[EG + i], b[GREEN + i], alpha, shown, unlit)
        b[BLUE + i] = _sent(b[DB + i], b[SB + i] + b[EB + i], b[BLUE + i], alpha, shown, unlit)
        b[ALPHA + i] = alpha * (one - b[T7 + i] * (one - unlit))


@njit(fastmath=FAST)
def lay(pixel, i, b):
    """Put a composed sample over what a pixel (4,) shows so far, premultiplied; coloured glass tints that."""
    under, behind = f4(1) - b[ALPHA + i], pixel[3]
    pixel[0] = max(pixel[0] * (under + b[T0 + i]) + b[RED + i] - behind * b[T0 + i] * b[T3 + i], f4(0))
    pixel[1] = max(pixel[1] * (under + b[T1 + i]) + b[GREEN + i] - behind * b[T1 + i] * b[T4 + i], f4(0))
    pixel[2] = max(pixel[2] * (under + b[T2 + i]) + b[BLUE + i] - behind * b[T2 + i] * b[T5 + i], f4(0))
    pixel[3] = behind * under + b[ALPHA + i]


@njit(fastmath=FAST)
def add_light_matte(count, b):
    """`add_light` for what only scatters, as plain ground; BASE_R, BASE_G, BASE_B are its colour."""
    for i in range(count):
        nl = b[NX + i] * b[LX + i] + b[NY + i] * b[LY + i] + b[NZ + i] * b[LZ + i]
        lambert = max(nl, f4(0)) * f4(1 / math.pi) * b[SHARE + i]
        b[DR + i] += b[BASE_R + i] * lambert * b[IR + i]
        b[DG + i] += b[BASE_G + i] * lambert * b[IG + i]
        b[DB + i] += b[BASE_B + i] * lambert * b[IB + i]


@njit(fastmath=FAST)
def ambient_matte(count, surrounding, b):
    """`ambient` for level ground that only scatters."""
    red, green, blue = surrounding.up[0], surrounding.up[1], surrounding.up[2]
    for i in range(count):
        open_ = b[OPEN + i]
        b[DR + i] += b[BASE_R + i] * red * open_
        b[DG + i] += b[BASE_G + i] * green * open_
        b[DB + i] += b[BASE_B + i] * blue * open_
