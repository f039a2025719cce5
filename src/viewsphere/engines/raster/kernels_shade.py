"""Shading of samples: struct-of-arrays blocks, so that the lighting loop vectorises; float32 throughout.

Microfacet reflection: Walter et al. 2007 (GGX), Schlick 1994 (Fresnel); shadows: percentage-closer filtering (Reeves
et al. 1987) with receiver-plane depth.
"""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from viewsphere.engines.raster.kernels_shadow import BLOCK as SHADOW_BLOCK
from viewsphere.engines.raster.kernels_texture import FAST, look_up
from viewsphere.geometry.jit import njit

f4 = nb.float32
U = nb.uintp
BLOCK = 128

# Where the rows of a block begin: one flat array, so that the compiler knows that rows do not overlap.
PX, PY, PZ, DX, DY, DZ, NX, NY, NZ, GX, GY, GZ = range(0, 12 * BLOCK, BLOCK)
RED, GREEN, BLUE, ALPHA, U0, V0, U1, V1, PIXEL = range(12 * BLOCK, 21 * BLOCK, BLOCK)
ROUGH, METAL, F0, COAT, COAT_ROUGH, UNLIT, GROUND, ER, EG, EB = range(21 * BLOCK, 31 * BLOCK, BLOCK)
SUNLIT, SKYLIT, BOUNCE, FADE, BLEND, SOLID = range(31 * BLOCK, 37 * BLOCK, BLOCK)
SU, SV, SW, SDU, SDV, FACING = range(37 * BLOCK, 43 * BLOCK, BLOCK)
SHINY, OM5, GRAZING, LOBE, UP, REST, COAT_SKY, COAT_LOBE = range(43 * BLOCK, 51 * BLOCK, BLOCK)
COAT_UP, COAT_REST, BELOW, SHOWN, ALBEDO, EMISSION, RESULT, COVER = range(51 * BLOCK, 59 * BLOCK, BLOCK)
FLOOR = RESULT  # which is free until then
ROWS = 59


@njit(fastmath=FAST)
def _gather(view, surfaces, start, stop, slots, where, triangle, depth, b, material):
    """Position, normals and vertex attributes of each sample."""
    zero, one, tiny = f4(0), f4(1), f4(1e-30)
    r, e, lens = view.rotation, view.eye, view.lens
    pinhole = view.rays.shape[0] == 0
    for i in range(stop - start):
        slot = U(slots[start + i])
        k = where[slot] if where.shape[0] > 0 else nb.int32(slot)
        t = U(triangle[slot])
        if pinhole:
            row = nb.uint32(k) // view.columns
            px = f4(nb.uint32(k) - row * view.columns) + f4(0.5)
            py = f4(row) + f4(0.5)
            x = lens[0, 0] * px + lens[0, 1] * py + lens[0, 2]
            y = lens[1, 0] * px + lens[1, 1] * py + lens[1, 2]
            z = one
        else:
            ray = view.rays[U(k)]
            x, y, z = ray[0], ray[1], ray[2]
        dx = r[0, 0] * x + r[1, 0] * y + r[2, 0] * z
        dy = r[0, 1] * x + r[1, 1] * y + r[2, 1] * z
        dz = r[0, 2] * x + r[1, 2] * y + r[2, 2] * z
        s = view.scale / depth[slot]
        b[DX + i], b[DY + i], b[DZ + i] = dx, dy, dz
        b[PX + i], b[PY + i], b[PZ + i] = e[0] + s * dx, e[1] + s * dy, e[2] + s * dz
        b[PIXEL + i] = s * view.pixel
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


@njit(fastmath=FAST)
def _materials(surfaces, textures, start, stop, slots, triangle, b, material):
    """Base colour, alpha, roughness, metallic, emission: factors times textures."""
    uv = np.empty(4, np.float32)
    footprint = np.empty(4, np.float32)
    for i in range(stop - start):
        m = U(material[i])
        factor = surfaces.materials[m]
        base, surface, emission = surfaces.slots[m, U(0)], surfaces.slots[m, U(1)], surfaces.slots[m, U(2)]
        b[RED + i] *= factor[0]
        b[GREEN + i] *= factor[1]
        b[BLUE + i] *= factor[2]
        b[ALPHA + i] *= factor[3]
        b[ER + i], b[EG + i], b[EB + i] = factor[6], factor[7], factor[8]
        b[ROUGH + i], b[METAL + i], b[F0 + i] = factor[4], factor[5], factor[9]
        b[COAT + i], b[COAT_ROUGH + i] = factor[10], factor[11]
        b[UNLIT + i], b[GROUND + i] = factor[12], factor[13]
        b[BLEND + i], b[SOLID + i] = factor[14], f4(1) - factor[15]
        if base < 0 and surface < 0 and emission < 0:
            continue
        t = U(triangle[U(slots[start + i])])
        uv[0], uv[1], uv[2], uv[3] = b[U0 + i], b[V0 + i], b[U1 + i], b[V1 + i]
        dx, dy, dz = b[DX + i], b[DY + i], b[DZ + i]
        facing = abs(dx * b[GX + i] + dy * b[GY + i] + dz * b[GZ + i])
        squared = b[PIXEL + i] * b[PIXEL + i] / max(facing, f4(0.02))
        for a in range(4):
            footprint[a] = surfaces.density[t, U(a)] * squared
        if base >= 0:
            c = look_up(textures, base, uv, footprint)
            b[RED + i] *= c[0]
            b[GREEN + i] *= c[1]
            b[BLUE + i] *= c[2]
            b[ALPHA + i] *= c[3]
        if surface >= 0:
            c = look_up(textures, surface, uv, footprint)
            b[ROUGH + i] *= c[1]
            b[METAL + i] *= c[2]
        if emission >= 0:
            c = look_up(textures, emission, uv, footprint)
            b[ER + i] *= c[0]
            b[EG + i] *= c[1]
            b[EB + i] *= c[2]


@njit(fastmath=FAST)
def _orient(count, light, b):
    """Unit normals on the viewer's side, places in the shadow map, cover.

    A triangle is lit on the side that is seen, whatever its winding.
    """
    zero, one, tiny = f4(0), f4(1), f4(1e-20)
    m = light.shadow_from_world
    texels = f4(math.sqrt(m[0, 0] * m[0, 0] + m[0, 1] * m[0, 1] + m[0, 2] * m[0, 2]))
    metres = one / max(texels, tiny)
    sx, sy, sz = light.sun[0], light.sun[1], light.sun[2]
    m00, m01, m02, m03 = m[0, 0], m[0, 1], m[0, 2], m[0, 3]
    m10, m11, m12, m13 = m[1, 0], m[1, 1], m[1, 2], m[1, 3]
    m20, m21, m22, m23 = m[2, 0], m[2, 1], m[2, 2], m[2, 3]
    for i in range(count):
        x, y, z = b[PX + i], b[PY + i], b[PZ + i]
        dx, dy, dz = b[DX + i], b[DY + i], b[DZ + i]
        s = one / np.sqrt(dx * dx + dy * dy + dz * dz)
        dx, dy, dz = -dx * s, -dy * s, -dz * s
        gx, gy, gz, nx, ny, nz = b[GX + i], b[GY + i], b[GZ + i], b[NX + i], b[NY + i], b[NZ + i]
        s = one if gx * dx + gy * dy + gz * dz >= zero else -one
        gx, gy, gz = gx * s, gy * s, gz * s
        s = one if nx * gx + ny * gy + nz * gz >= zero else -one
        nx, ny, nz = nx * s + gx * f4(1e-4), ny * s + gy * f4(1e-4), nz * s + gz * f4(1e-4)
        s = one / np.sqrt(nx * nx + ny * ny + nz * nz + tiny)
        nx, ny, nz = nx * s, ny * s, nz * s
        b[DX + i], b[DY + i], b[DZ + i] = dx, dy, dz
        b[NX + i], b[NY + i], b[NZ + i] = nx, ny, nz
        facing = gx * sx + gy * sy + gz * sz
        s = metres / max(facing, f4(0.15))
        du = (gx * m00 + gy * m01 + gz * m02) * s
        dv = (gx * m10 + gy * m11 + gz * m12) * s
        b[SU + i] = m00 * x + m01 * y + m02 * z + m03
        b[SV + i] = m10 * x + m11 * y + m12 * z + m13
        b[SW + i] = m20 * x + m21 * y + m22 * z + m23 - f4(1.2) - f4(0.6) * (abs(du) + abs(dv))
        b[SDU + i], b[SDV + i] = du, dv
        b[PIXEL + i] = min(max(b[PIXEL + i] * texels * f4(0.45), f4(0.8)), f4(SHADOW_BLOCK - 2))
        # Smooth normals on coarse triangles: the sun fades before the first facet turns away from it.
        turned = nx * sx + ny * sy + nz * sz
        fade = min(max(turned, zero) / (f4(3) * abs(turned - facing) + f4(1e-6)), one)
        b[FACING + i] = min(facing * f4(10), one) * fade * fade * (f4(3) - fade - fade)
        far = min(max((np.sqrt(x * x + y * y) - f4(4)) * f4(1 / 26.0), zero), one)
        far = one - (one - far) * (one - far)
        low = min(max(f4(0.09) - dz, zero) * f4(12), one)
        far = one - (one - far * far * (f4(3) - far - far)) * (one - low * low * (f4(3) - low - low))
        b[FADE + i] = far * b[GROUND + i]
        b[ALPHA + i] = (one + (b[ALPHA + i] - one) * b[BLEND + i]) * b[SOLID + i]


@njit(fastmath=FAST)
def _sun_share(shadow, shadow_low, shadow_high, u, v, w, du, dv, step):
    """Share of the sun that reaches a point: nine bilinear look-ups `step` texels apart in a shadow map and its bounds.

    (u, v) lies in the map; w is the point's depth less the bias; (du, dv) its plane's slope in depth per texel.
    """
    size = shadow.shape[0]
    reach = (abs(du) + abs(dv)) * (step + f4(1.5))
    row, column = U(nb.int32(v) // nb.int32(SHADOW_BLOCK)), U(nb.int32(u) // nb.int32(SHADOW_BLOCK))
    if w + reach <= shadow_low[row, column]:
        return f4(1)
    if w - reach > shadow_high[row, column]:
        return f4(0)
    # Where the filter's corners and middle agree there is no edge of a shadow to smooth.
    low, high = f4(0.5), f4(size) - f4(0.5)
    agree = nb.int32(0)
    for corner in range(5):
        ou = (f4(corner & 1) * f4(2) - f4(1)) * (step + f4(0.5)) if corner < 4 else f4(0)
        ov = (f4(corner >> 1) * f4(2) - f4(1)) * (step + f4(0.5)) if corner < 4 else f4(0)
        iu, iv = nb.int32(min(max(u + ou, low), high)), nb.int32(min(max(v + ov, low), high))
        near = w + du * (f4(iu) + f4(0.5) - u) + dv * (f4(iv) + f4(0.5) - v)
        agree += nb.int32(1) if shadow[U(iv), U(iu)] >= near else nb.int32(0)
    if agree == 0:
        return f4(0)
    if agree == 5:
        return f4(1)
    lit = f4(0)
    for row in range(-1, 2):
        cv = min(max(v + f4(row) * step - f4(0.5), f4(0)), f4(size - 2))
        iv = nb.int32(cv)
        fv = cv - f4(iv)
        a, c = shadow[U(iv)], shadow[U(iv) + U(1)]
        for column in range(-1, 2):
            cu = min(max(u + f4(column) * step - f4(0.5), f4(0)), f4(size - 2))
            iu = nb.int32(cu)
            fu = cu - f4(iu)
            near = w + du * (f4(iu) + f4(0.5) - u) + dv * (f4(iv) + f4(0.5) - v)
            i0, i1 = U(iu), U(iu) + U(1)
            t00 = f4(1) if a[i0] >= near else f4(0)
            t01 = f4(1) if a[i1] >= near + du else f4(0)
            t10 = f4(1) if c[i0] >= near + dv else f4(0)
            t11 = f4(1) if c[i1] >= near + du + dv else f4(0)
            lit += (t00 * (f4(1) - fu) + t01 * fu) * (f4(1) - fv) + (t10 * (f4(1) - fu) + t11 * fu) * fv
    return lit * f4(1.0 / 9.0)


@njit(fastmath=FAST)
def _is_on(u, v, size):
    """Whether a place lies on a shadow map of this size."""
    return u >= f4(1) and v >= f4(1) and u <= f4(size - 1) and v <= f4(size - 1)


@njit(fastmath=FAST)
def _wide_share(light, b, i):
    """Share of the sun that scenery leaves to a sample beyond the shadow map: by the narrowest wide map it is on."""
    x, y, z, gx, gy, gz = b[PX + i], b[PY + i], b[PZ + i], b[GX + i], b[GY + i], b[GZ + i]
    fine = light.shadow_from_world
    texels = f4(math.sqrt(fine[0, 0] * fine[0, 0] + fine[0, 1] * fine[0, 1] + fine[0, 2] * fine[0, 2]))
    facing = gx * light.sun[0] + gy * light.sun[1] + gz * light.sun[2]
    for k in range(light.wide.shape[0]):
        m = light.wide_from_world[U(k)]
        u = m[0, 0] * x + m[0, 1] * y + m[0, 2] * z + m[0, 3]
        v = m[1, 0] * x + m[1, 1] * y + m[1, 2] * z + m[1, 3]
        if _is_on(u, v, light.wide.shape[1]):
            own = f4(math.sqrt(m[0, 0] * m[0, 0] + m[0, 1] * m[0, 1] + m[0, 2] * m[0, 2]))
            slope = (f4(1) if facing > f4(0) else -f4(1)) / (own * max(abs(facing), f4(0.15)))
            du = (gx * m[0, 0] + gy * m[0, 1] + gz * m[0, 2]) * slope
            dv = (gx * m[1, 0] + gy * m[1, 1] + gz * m[1, 2]) * slope
            w = m[2, 0] * x + m[2, 1] * y + m[2, 2] * z + m[2, 3] - f4(1.2) - f4(0.6) * (abs(du) + abs(dv))
            step = max(b[PIXEL + i] * own / texels, f4(0.8))
            return _sun_share(light.wide[U(k)], light.wide_low[U(k)], light.wide_high[U(k)], u, v, w, du, dv, step)
    return f4(1)


@njit(fastmath=FAST)
def _occlusion(count, light, b):
    """How much of the sun, of the sky and of the ground's light reaches each sample; objects get the whole sky."""
    zero, one, half = f4(0), f4(1), f4(0.5)
    frame, ground = light.ground_frame, light.ground
    shadow, low, high = light.shadow, light.shadow_low, light.shadow_high
    last = f4(ground.shape[0] - 1)
    cells, corner_x, corner_y, grounded = frame[0], frame[1], frame[2], frame[5] > zero
    rise = one / (f4(0.35) * frame[4]) if grounded else zero
    for i in range(count):
        share = b[FACING + i]
        if share > zero:
            u, v = b[SU + i], b[SV + i]
            if _is_on(u, v, shadow.shape[0]):
                share *= _sun_share(shadow, low, high, u, v, b[SW + i], b[SDU + i], b[SDV + i], b[PIXEL + i])
        b[SUNLIT + i] = max(share, zero)
        sky, bounce = one, one
        if grounded:
            u, v = (b[PX + i] - corner_x) * cells - half, (b[PY + i] - corner_y) * cells - half
            if u >= zero and v >= zero and u < last and v < last:
                iu, iv = nb.int32(u), nb.int32(v)
                fu, fv = u - f4(iu), v - f4(iv)
                c, d = U(iu), U(iu) + U(1)
                above, below = ground[U(iv)], ground[U(iv) + U(1)]
                p, q, r, s = (one - fu) * (one - fv), fu * (one - fv), (one - fu) * fv, fu * fv
                sky = above[c, 0] * p + above[d, 0] * q + below[c, 0] * r + below[d, 0] * s
                bounce = above[c, 1] * p + above[d, 1] * q + below[c, 1] * r + below[d, 1] * s
            if b[GROUND + i] == zero:
                b[FLOOR + i] = sky
                sky = one
                bounce += (one - bounce) * f4(0.6) * min(max((b[PZ + i] - frame[3]) * rise, zero), one)
        b[SKYLIT + i], b[BOUNCE + i] = sky, bounce


@njit(fastmath=FAST)
def _scenery(count, surfaces, light, b, material):
    """What else there is where there is scenery: its shadows beyond the shadow map, and the targets' on what they stand on."""
    zero, one = f4(0), f4(1)
    frame = light.ground_frame
    rise = one / (f4(0.35) * frame[4]) if frame[5] > zero else zero
    for i in range(count):
        if b[SUNLIT + i] > zero and not _is_on(b[SU + i], b[SV + i], light.shadow.shape[0]):
            b[SUNLIT + i] *= _wide_share(light, b, i)
        if rise > zero and surfaces.materials[U(material[i]), U(17)] > zero:
            # It is what they stand on where it faces up about as low as they stand.
            close = max(one - abs(b[PZ + i] - frame[3]) * rise, zero)
            b[SKYLIT + i] = one + (b[FLOOR + i] - one) * close * max(b[NZ + i], zero)


@njit
def _has_scenery(surfaces):
    return surfaces.materials[:, 17].max() > f4(0)


@njit(fastmath=FAST)
def _lobes(count, light, b):
    """All that the three colour channels share: Fresnel weights, lobes of the sun, shares of the mirrored sky."""
    zero, one, half, tiny = f4(0), f4(1), f4(0.5), f4(1e-12)
    sx, sy, sz = light.sun[0], light.sun[1], light.sun[2]
    for i in range(count):
        vx, vy, vz, nx, ny, nz = b[DX + i], b[DY + i], b[DZ + i], b[NX + i], b[NY + i], b[NZ + i]
        rough = max(b[ROUGH + i], f4(0.08))
        shiny = (one - b[UNLIT + i]) * (one - b[GROUND + i])
        nv = max(nx * vx + ny * vy + nz * vz, f4(0.01))
        nl = max(nx * sx + ny * sy + nz * sz, zero)
        hx, hy, hz = vx + sx, vy + sy, vz + sz
        s = one / np.sqrt(hx * hx + hy * hy + hz * hz + tiny)
        nh = min(max((nx * hx + ny * hy + nz * hz) * s, zero), one)
        om = one - min(max((vx * hx + vy * hy + vz * hz) * s, zero), one)
        om5 = om * om
        om5 = om5 * om5 * om
        om = one - nv
        grazing = om * om
        grazing = grazing * grazing * om
        sunlit = nl * b[SUNLIT + i]
        a = rough * rough
        d = nh * nh * (a * a - one) + one
        k = a * half
        lobe = a * a * f4(0.25 / math.pi) / (d * d * (nl * (one - k) + k) * (nv * (one - k) + k))
        a = max(b[COAT_ROUGH + i], f4(0.08))
        a = a * a
        d = nh * nh * (a * a - one) + one
        k = a * half
        coat_lobe = a * a * f4(0.25 / math.pi) / (d * d * (nl * (one - k) + k) * (nv * (one - k) + k))
        coat = b[COAT + i] * shiny
        coat_sky = coat * (f4(0.04) + f4(0.96) * grazing)
        # The sky mirrored: a soft horizon and a gradient, both blurred by roughness; sharp for the coat.
        rz = (nv + nv) * nz - vz
        up = min(max(rz / (f4(0.08) + f4(0.9) * rough) * half + half, zero), one)
        sharp = min(max(rz * f4(3.125) + half, zero), one)
        rest = one - max(rz, zero)
        rest = rest * rest * rest
        b[COAT_REST + i] = one - rest
        b[REST + i] = one - rest - (half - rest) * rough * f4(0.8)
        b[UP + i] = up * up * (f4(3) - up - up)
        b[COAT_UP + i] = sharp * sharp * (f4(3) - sharp - sharp)
        b[SHINY + i], b[OM5 + i], b[GRAZING + i] = shiny, om5, grazing
        b[SUNLIT + i] = sunlit
        b[LOBE + i] = min(lobe * sunlit, f4(4)) * shiny
        b[COAT_SKY + i] = coat_sky
        b[COAT_LOBE + i] = min(coat_lobe * sunlit, f4(8)) * coat * (f4(0.04) + f4(0.96) * om5)
        b[BELOW + i] = (half - half * nz) * b[BOUNCE + i]
        b[SHOWN + i] = one - b[FADE + i]


@njit(fastmath=FAST)
def _light(count, light, knee, c, b):
    """One colour channel of what each sample sends to the camera, display-linear, in place of the albedo."""
    zero, one = f4(0), f4(1)
    sun, zenith, horizon, earth = light.sun_color[c], light.zenith[c], light.horizon[c], light.earth[c]
    k0, k1, k2, k3 = light.sky[0, c], light.sky[1, c], light.sky[2, c], light.sky[3, c]
    row = c * BLOCK
    for i in range(count):
        b[ALBEDO + i], b[EMISSION + i] = b[RED + row + i], b[ER + row + i]
    inverse_pi = f4(1 / math.pi)
    for i in range(count):
        albedo, metal, nz, shiny, shown = b[ALBEDO + i], b[METAL + i], b[NZ + i], b[SHINY + i], b[SHOWN + i]
        rough, grazing = max(b[ROUGH + i], f4(0.08)), b[GRAZING + i]
        spec = b[F0 + i] * (one - metal) + albedo * metal
        toward_sun = spec + (one - spec) * b[OM5 + i]
        toward_sky = spec + (max(one - rough, spec) - spec) * grazing
        ambient = max(k0 + nz * (k1 + nz * (k2 + nz * k3)), zero) * b[SKYLIT + i] + b[BELOW + i] * earth
        diffuse = ambient * (one - toward_sky * shiny)
        diffuse += sun * b[SUNLIT + i] * (one - toward_sun * shiny) * inverse_pi
        diffuse *= albedo * (one - metal)
        ground = earth * b[BOUNCE + i]
        glossy = toward_sun * b[LOBE + i] * sun
        glossy += toward_sky * (ground + (horizon + (zenith - horizon) * b[REST + i] - ground) * b[UP + i]) * shiny
        mirror = ground + (horizon + (zenith - horizon) * b[COAT_REST + i] - ground) * b[COAT_UP + i]
        coat = b[COAT_SKY + i]
        cover = b[ALPHA + i] * shown
        value = (diffuse * cover + glossy * shown) * (one - coat)
        value += (coat * mirror + b[COAT_LOBE + i] * sun + b[EMISSION + i]) * shown
        over = max(value - knee, zero) / (one - knee)
        value = min(value, knee) + (one - knee) * over / (one + over)
        unlit = b[UNLIT + i]
        b[RESULT + i] = (one - unlit) * value + unlit * albedo * cover
        b[COVER + i] = cover
    for i in range(count):
        b[RED + row + i] = b[RESULT + i]


@njit(fastmath=FAST)
def shade(view, surfaces, textures, light, knee, slots, where, triangle, depth, color):
    """Shade the samples in `slots` (N,) int32 over `color` (S, 3) float32, display-linear, in place.

    triangle (S,) int32 and depth (S,) float32 (inverse) are what is seen; where (S,) int32 is the sample's index in
    the view's grid, empty when that is the slot itself.
    """
    b = np.empty(ROWS * BLOCK, np.float32)
    material = np.empty(BLOCK, np.int32)
    scenery = _has_scenery(surfaces)
    for start in range(0, slots.shape[0], BLOCK):
        stop = min(start + BLOCK, slots.shape[0])
        count = stop - start
        _gather(view, surfaces, start, stop, slots, where, triangle, depth, b, material)
        _materials(surfaces, textures, start, stop, slots, triangle, b, material)
        _orient(count, light, b)
        _occlusion(count, light, b)
        if scenery:
            _scenery(count, surfaces, light, b, material)
        _lobes(count, light, b)
        for c in range(3):
            _light(count, light, knee, c, b)
        for i in range(count):
            slot = U(slots[start + i])
            under = f4(1) - b[COVER + i]
            color[slot, 0] = color[slot, 0] * under + b[RED + i]
            color[slot, 1] = color[slot, 1] * under + b[GREEN + i]
            color[slot, 2] = color[slot, 2] * under + b[BLUE + i]
