"""The response of a surface to light: Lambert, GGX and a clear coat, lit by one light at a time and by the surroundings.

A layered model with view-dependent weights (Turquin 2019; as Cycles' Principled BSDF). The share of a white surrounding that a
layer reflects is subtracted from the layers below it. So a white surface in a white surrounding is invisible. Walter et al.
2007 (GGX), Heitz 2014 (height-correlated Smith), Schlick 1994 (Fresnel), Karis 2013 (split sum, area lights).

Order of the stages: `weigh`, then `add_light` for every light, `ambient`, `compose`.
"""

# ruff: isort: skip_file
from __future__ import annotations

import math

import numba as nb
import numpy as np

from viewsphere.engines.raster.shading.kernels_blend import blend
from viewsphere.engines.raster.shading.kernels_block import (
    ALPHA, BASE_R, BENT, BENT_X, BENT_Y, BENT_Z, BLOCK, BLUE, BOUNCE, COAT, COAT_ROUGH, CX, CY, CZ, DR, EDGE_R, ER, F0R,
    FACE_R, GLOW_R, GREEN, GX, GY, GZ, IB, IG, INSIDE, IR, LEAN_R, LOBE, LX, LY, LZ, MAPPED, METAL, NX, NY, NZ, OPEN, OPENX,
    OPENY, RED, RIM, ROUGH, SHARE, SR, STAIN_B, STAIN_G, STAIN_R, T0, T1, T2, T3, T4, T5, T6, T7, TAKEN, THROUGH, TRANSMISSION,
    UNLIT, VX, VY, VZ, WIDTH,
)  # fmt: skip
from viewsphere.engines.raster.sky.kernels_environment import ABOVE, BELOW, LAMPS, SCALE, TURN
from viewsphere.engines.raster.indirect.kernels_views import add_near_light, near_light
from viewsphere.kernels.lanes import clamp, cross, dot, lanewise, least, most, root, size, where
from viewsphere.kernels.lanes import FAST
from viewsphere.kernels.jit import inner
from viewsphere.rendering.view import EXPOSURE

f4 = nb.float32
i4 = nb.int32
U = nb.uintp

COAT_F0 = np.float32(0.04)  # glTF's clear coat, index of refraction 1.5: ((1.5 - 1) / (1.5 + 1)) squared
FULL_RIM = np.float32(50)  # one over the share mirrored at normal incidence above which a surface mirrors all light at its rim
SMOOTHEST = np.float32(0.03)  # minimum perceptual roughness: in a perfect mirror, a lamp would be a single point
VIEWED = np.float32(0.25)  # squared roughness of a mirror as blurred as the probes' view
WIDE = np.float32(0.36)  # squared roughness above which a lobe is as wide as a matt surface's
BRIGHTEST = np.float32(60000.0)  # below 65,504, the greatest half float of EXR files
UNEXPOSED = np.float32(1 / EXPOSURE)  # an unlit colour is shown unchanged by the exposure


# Scratch rows of a look-up in the maps, in the rows of a light: the maps' texels, and their weights in the second map.
FIRST, UNDER, NEXT, NEXT_UNDER, A0, A1, A2, A3 = LX, LY, LZ, IR, IG, IB, SHARE, WIDTH
LEVEL, WEIGHT = OPENX, OPENY

_blend2, _blend4 = blend(2), blend(4)


@inner(fastmath=FAST)
def _any(count, row, b):
    """Return whether a row has any value above 0. The loop counts, because the compiler vectorises a count."""
    found = 0
    for i in range(count):
        found += 1 if b[row + i] > f4(0) else 0
    return found > 0


@lanewise
def _place_in_albedo(normal, rough, size, b):
    """T0: the first of four texels of the albedo around a layer's cosine to the viewer and roughness; T1 to T4: their weights.

    The look-up is bilinear in the root of the cosine and in roughness. normal: row of the normal's x.
    """
    x, y, z = b[normal], b[normal, BLOCK], b[normal, 2 * BLOCK]
    facing = x * b[VX] + y * b[VY] + z * b[VZ]
    # NaN is taken as 0.
    u, v = least(root(most(facing, 0)), 1) * (size - 1), least(most(b[rough], 0), 1) * (size - 1)
    column, row = least(u, size - 2).whole().real(), least(v, size - 2).whole().real()
    fx, fy = u - column, v - row
    right = fx * fy
    b[T0], b[T1] = row * size + column, 1 - fx - fy + right
    b[T2], b[T3], b[T4] = fx - right, fy - right, right


@inner(fastmath=FAST)
def _integrals(count, normal, rough, albedo, b):
    """T0, T1: both integrals of a layer's lobe (`lobe_albedo`)."""
    across = U(albedo.shape[0])
    _place_in_albedo(count, U(normal), U(rough), f4(albedo.shape[0]), b)
    for i in range(count):
        first = U(i4(b[T0 + i]))
        below = first + across
        shares = b[T1 + i], b[T2 + i], b[T3 + i], b[T4 + i]
        _blend2(albedo, (first, first + U(1), below, below + U(1)), shares, b, U(T0) + U(i))


@lanewise
def _take_coat(is_coated, b):
    """TAKEN: the share of light that the coat reflects."""
    b[TAKEN] = b[COAT] * (COAT_F0 * b[T0] + (1 - COAT_F0) * b[T1]) * is_coated


@lanewise
def _share_out(b):
    lobe, rim, metal = b[T0], b[T1], b[METAL]
    b[LOBE], b[RIM] = lobe, rim
    lost = (1 - lobe) / most(lobe, 0.05)  # light that bounces more than once between the facets
    left, body, through = 1 - b[TAKEN], 1 - metal, clamp(b[TRANSMISSION])
    shares = []
    for k in range(0, 3 * BLOCK, BLOCK):
        base, f0 = b[RED + k], b[F0R + k]
        # A surface without reflection at normal incidence has none at its rim either (Lagarde and de Rousiers 2014).
        edge = least(f0 * FULL_RIM, 1) - f0
        more, more_metal = body * (1 + f0 * lost), metal * (1 + base * lost)
        b[FACE_R + k] = left * (more * f0 + more_metal * base)
        b[EDGE_R + k] = left * (more * edge + more_metal * most(1 - base, 0))
        share = body * left * most(1 - (1 + f0 * lost) * (f0 * lobe + edge * rim), 0)
        b[BASE_R + k] = base * share * (1 - through)
        shares.append(share)
        b[DR + k], b[SR + k] = 0, 0
    b[THROUGH] = through * (shares[0] + shares[1] + shares[2]) * (1 / 3)


@inner
def weigh(count, albedo, b):
    """Divide the light among a sample's layers, for any light: fill FACE_R to THROUGH, clear DR to SB.

    albedo: `Surrounding.albedo`.
    """
    is_coated = _any(count, COAT, b)
    _integrals(count, CX if is_coated else NX, COAT_ROUGH if is_coated else ROUGH, albedo, b)
    _take_coat(count, f4(1) if is_coated else f4(0), b)
    if is_coated:
        _integrals(count, NX, ROUGH, albedo, b)
    _share_out(count, b)


def _lobe(b, normal, rough):
    """The factors of one layer: the cosine towards a light, GGX times visibility times that cosine, Schlick's power.

    The light is a ball of angular radius WIDTH. The lobe is evaluated at the ball's point nearest to the mirrored ray, and
    divided by the factor by which the ball enlarges the lobe: 1 + pi / 2 q + q^2 for q = WIDTH / 2 alpha.
    """
    view, n, light = b.get(VX, VY, VZ), b.get(*normal), b.get(LX, LY, LZ)
    nv, nl = least(most(dot(n, view), 1e-3), 1), clamp(dot(n, light))
    a = least(most(b[rough], SMOOTHEST), 1)
    a *= a
    aa = a * a
    ray = tuple((nv + nv) * n[k] - view[k] for k in range(3))
    along = dot(ray, light)
    w = clamp(b[WIDTH])
    ww = w * w
    sine, cosine = w * (1 - ww * (1 / 6)), 1 - ww * 0.5 * (1 - ww * (1 / 12))
    off = tuple(ray[k] - along * light[k] for k in range(3))
    s = sine / root(dot(off, off) + 1e-20)
    is_within = along >= cosine
    h = tuple(view[k] + where(is_within, ray[k], light[k] * cosine + off[k] * s) for k in range(3))
    s = 1 / root(dot(h, h) + 1e-20)
    h = tuple(c * s for c in h)
    q = cross(n, h)
    apart = dot(q, q)
    d = apart + aa * (1 - apart)
    dimmed = aa / (aa + w * (a * (math.pi / 4) + w * 0.25))
    smith = nl * root(nv * nv * (1 - aa) + aa) + nv * root(nl * nl * (1 - aa) + aa)
    om = 1 - clamp(dot(view, h))
    power = om * om
    return nl, aa * dimmed * nl * (0.5 / math.pi) / (d * d * most(smith, 1e-6)), power * power * om


@lanewise
def _add_base(b):
    cosine, lobe, power = _lobe(b, (NX, NY, NZ), ROUGH)
    for k in range(0, 3 * BLOCK, BLOCK):
        light = b[IR + k] * b[SHARE]
        b[DR + k] = b[DR + k] + b[BASE_R + k] * cosine * (1 / math.pi) * light
        b[SR + k] = b[SR + k] + least((b[FACE_R + k] + b[EDGE_R + k] * power) * lobe * light, BRIGHTEST)


@lanewise
def _add_coat(b):
    _, lobe, power = _lobe(b, (CX, CY, CZ), COAT_ROUGH)
    shine = b[COAT] * (COAT_F0 + (1 - COAT_F0) * power) * lobe * b[SHARE]
    for k in range(0, 3 * BLOCK, BLOCK):
        b[SR + k] = b[SR + k] + least(shine * b[IR + k], BRIGHTEST)


@inner
def add_light(count, b):
    """Add one light, rows LX to WIDTH: its diffuse reflection to DR, DG, DB, its mirrored image to SR, SG, SB."""
    _add_base(count, b)
    if _any(count, COAT, b):
        _add_coat(count, b)


@lanewise
def _place(light, last, b):
    """T0, T1: octahedral coordinates of the directions T0, T1, T2 (any length); LEVEL: the map of roughness T6; WEIGHT: the
    fraction of the way from this map to the next at which T6 is. The matt map is level 0. last: the last level of roughness.
    """
    cosine, sine = light.one(3 * TURN), light.one(3 * TURN + 1)
    east, north, z = b.get(T0, T1, T2)
    x, y = cosine * east + sine * north, cosine * north - sine * east
    s = 1 / (size(x) + size(y) + size(z) + 1e-20)
    x, y = x * s, y * s
    u, v = 1 - size(y), 1 - size(x)
    is_down = z < 0
    b[T0] = where(is_down, where(x >= 0, u, -u), x)
    b[T1] = where(is_down, where(y >= 0, v, -v), y)
    rough = b[T6]
    is_shiny = rough >= 0
    lod = clamp(rough) * last
    level = least(lod, last - 1).whole().real()
    b[WEIGHT] = where(is_shiny, lod - level, 0)
    b[LEVEL] = where(is_shiny, level + 1, 0)


@lanewise
def _share_texels(b):
    """Replace FIRST to NEXT_UNDER, the first texel and the width of two maps, by the rows of the four texels, two by two,
    around T0, T1.

    T3 to T6 and A0 to A3: the weights of the texels in the two maps.
    """
    x, y, share = b[T0] + 1, b[T1] + 1, b[WEIGHT]
    for first, weight, part in ((FIRST, T3, 1 - share), (NEXT, A0, share)):
        start, width = b[first], b[first + BLOCK]
        u, v = x * (width * 0.5) + 0.5, y * (width * 0.5) + 0.5
        # NaN is taken as 0.
        column, row = (least(most(place, 0), width).whole().real() for place in (u, v))
        fx, fy = u - column, v - row
        place = start + row * (width + 2) + column
        b[first], b[first + BLOCK] = place, place + width + 2
        lower = fy * part
        upper = part - lower
        b[weight], b[weight + BLOCK] = upper - upper * fx, upper * fx
        b[weight + 2 * BLOCK], b[weight + 3 * BLOCK] = lower - lower * fx, lower * fx


@inner(fastmath=FAST)
def _read_texels(count, texels, b):
    """T3 to T6: weighted sums of all columns of the texels."""
    one = U(1)
    for i in range(U(count)):
        p, q = U(i4(b[U(FIRST) + i])), U(i4(b[U(UNDER) + i]))
        places, shares = (p, p + one, q, q + one), (b[U(T3) + i], b[U(T4) + i], b[U(T5) + i], b[U(T6) + i])
        if b[U(WEIGHT) + i] > f4(0):
            r, s = U(i4(b[U(NEXT) + i])), U(i4(b[U(NEXT_UNDER) + i]))
            others = b[U(A0) + i], b[U(A1) + i], b[U(A2) + i], b[U(A3) + i]
            _blend4(texels, (*places, r, r + one, s, s + one), (*shares, *others), b, U(T3) + i)
        else:
            _blend4(texels, places, shares, b, U(T3) + i)


@lanewise
def _light(light, b):
    """T3 to T5: radiance, from the map's radiance and the share T6 of it below the horizon."""
    share, bounce = b[T6], b[BOUNCE]
    down = where(b[LEVEL].equals(0), 1, clamp(-1.6 * b[T2]))
    down = down * down
    for k in range(3):
        scale, above, below, lamp = (light.one(3 * row + k) for row in (SCALE, ABOVE, BELOW, LAMPS))
        ground = below + lamp * down
        b[T3 + k * BLOCK] = most(b[T3 + k * BLOCK] * scale + (1 - share) * above + share * bounce * ground, 0)


@inner(fastmath=FAST)
def light_around(count, surrounding, b):
    """T3, T4, T5: radiance around the direction T0, T1, T2 for roughness T6 (-1 for a white matt surface facing that way).

    It is the sum of the map's radiance, the uniform light from above, and the ground's light as far as it reaches the sample.
    Lamps light only the ground close by, so a mirrored ray at a slight downward angle receives none of their light. LEVEL keeps
    its value: 0 if matt.
    """
    levels = surrounding.levels
    _place(count, surrounding.light, f4(levels.shape[0] - 1), b)
    for i in range(U(count)):
        _blend4(levels, (U(i4(b[U(LEVEL) + i])),), (f4(1),), b, U(FIRST) + i)
    _share_texels(count, b)
    _read_texels(count, surrounding.texels, b)
    _light(count, surrounding.light, b)


@lanewise
def _mirror(normal, rough, b):
    """T0, T1, T2: the middle of a layer's lobe; T6: its roughness; T7: the share that surface and occlusion do not block.

    normal: row of the normal's x; rough: row of the roughness.
    """
    view, facet = b.get(VX, VY, VZ), b.get(GX, GY, GZ)
    n = b[normal], b[normal, BLOCK], b[normal, 2 * BLOCK]
    nv, r = clamp(dot(n, view)), clamp(b[rough])
    ray = tuple((nv + nv) * n[k] - view[k] for k in range(3))
    # The shading normal may direct the ray into the surface; cf. Lagarde and de Rousiers 2014 for both factors.
    out = most(1 + least(dot(ray, facet), 0), 0)
    open_, smooth = b[OPEN], (1 - r) * (1 - r)
    b[T7] = clamp(open_ + smooth * open_ * (1 - open_) * (nv + nv - 1.1)) * out * out
    a = r * r * r * r
    b.put((T0, T1, T2), tuple(p + (q - p) * a for p, q in zip(ray, n, strict=True)))
    b[T6] = r


@lanewise
def _face(b):
    """T0 to T2 and T6 for the light that the matt layer receives."""
    b.put((T0, T1, T2), b.get(NX, NY, NZ))
    b[T6] = -1


@lanewise
def _look_through(b):
    """T0 to T2 and T6 for the light that passes through a surface towards the viewer."""
    b.put((T0, T1, T2), tuple(-v for v in b.get(VX, VY, VZ)))
    b[T6] = b[ROUGH]


@lanewise
def _look_along_bend(b):
    """T0 to T2 and T6 for the light that solid glass bends towards the viewer."""
    b.put((T0, T1, T2), b.get(BENT_X, BENT_Y, BENT_Z))
    b[T6] = b[ROUGH]


@lanewise
def _keep_bent(b):
    stains = b.get(STAIN_R, STAIN_G, STAIN_B)
    b.put((BENT_X, BENT_Y, BENT_Z), tuple(s * light * b[OPEN] for s, light in zip(stains, b.get(T3, T4, T5), strict=True)))


@lanewise
def _scatter(b):
    for k in range(0, 3 * BLOCK, BLOCK):
        b[DR + k] = b[DR + k] + b[BASE_R + k] * b[T3 + k] * b[OPEN]


@lanewise
def _scatter_bounced(b):
    """The equivalent of `_scatter` if GLOW includes the light of the sky, weighted by INSIDE and MAPPED."""
    for k in range(0, 3 * BLOCK, BLOCK):
        light = b[T3 + k] * b[OPEN] * (1 - most(b[INSIDE], b[MAPPED])) + b[GLOW_R + k]
        b[DR + k] = b[DR + k] + b[BASE_R + k] * light


@lanewise
def _shine(b):
    lobe, rim, out = b.get(LOBE, RIM, T7)
    for k in range(0, 3 * BLOCK, BLOCK):
        b[SR + k] = b[SR + k] + (b[FACE_R + k] * lobe + b[EDGE_R + k] * rim) * b[T3 + k] * out


@lanewise
def _shine_bounced(b):
    """The equivalent of `_shine` if light bounces: the probes' view is as blurred as in a mirror of roughness 0.5. The lobes of
    rougher surfaces quickly become similar to that of a matt surface that leans towards the mirrored ray, whose light is in
    LEAN.
    """
    lobe, rim, out, rough = b.get(LOBE, RIM, T7, ROUGH)
    wide, known = clamp((rough * rough - VIEWED) * (1 / (WIDE - VIEWED))), most(b[INSIDE], b[MAPPED])
    for k in range(0, 3 * BLOCK, BLOCK):
        light = b[T3 + k] * out
        light = light + (b[LEAN_R + k] - light * known) * wide  # LEAN is reduced by the share that is known
        b[SR + k] = b[SR + k] + (b[FACE_R + k] * lobe + b[EDGE_R + k] * rim) * light


@lanewise
def _shine_coat(b):
    shine = b[TAKEN] * b[T7]
    for k in range(0, 3 * BLOCK, BLOCK):
        b[SR + k] = b[SR + k] + shine * b[T3 + k]


MATT, MIRROR, COATING, BENDING, BEHIND = range(5)


@inner(fastmath=FAST)
def _look(count, layer, b):
    """T0 to T2 and T6 for the light that a layer receives."""
    if layer == MATT:
        _face(count, b)
    elif layer == BENDING:
        _look_along_bend(count, b)
    elif layer == BEHIND:
        _look_through(count, b)
    else:
        is_coat = layer == COATING
        _mirror(count, U(CX if is_coat else NX), U(COAT_ROUGH if is_coat else ROUGH), b)


@inner(fastmath=FAST)
def _take(count, layer, is_bounced, b):
    """Add the part of the light T3 to T5 that a layer sends to the viewer."""
    if layer == MATT and is_bounced:
        _scatter_bounced(count, b)
    elif layer == MATT:
        _scatter(count, b)
    elif layer == MIRROR and is_bounced:
        _shine_bounced(count, b)
    elif layer == MIRROR:
        _shine(count, b)
    elif layer == COATING:
        _shine_coat(count, b)
    elif layer == BENDING:
        _keep_bent(count, b)


@inner(fastmath=FAST)
def _see(count, surrounding, bounces, is_near, b):
    """T3 to T5: the light from the direction T0 to T2; with `is_near`, including the light of things."""
    if is_near:
        columns = U(bounces.grid[2])
        near_light(count, bounces.views, columns, U(bounces.grid[1]) * columns, b)
    light_around(count, surrounding, b)
    if is_near:
        add_near_light(count, b)


@inner(fastmath=FAST)
def ambient(count, surrounding, bounces, b):
    """Add the light of the surroundings to DR to SB; the block must be weighed before. Reads OPEN and BOUNCE and, if light
    bounces, the rows that `kernels_bounce.bounced` fills.

    Afterwards, T3 to T5 have the light behind a transmissive surface, and BENT_X to BENT_Z the light from the direction that
    they held. The rows of a light are overwritten.
    """
    has_coat, has_glass, is_bounced = _any(count, COAT, b), _any(count, THROUGH, b), bounces.grid[0] > 0
    is_bent = _any(count, BENT, b)
    # One loop around one call, so that the call is compiled once.
    for layer in range(BEHIND + 1):
        if (layer == COATING and not has_coat) or (layer == BENDING and not is_bent) or (layer == BEHIND and not has_glass):
            continue
        _look(count, layer, b)
        _see(count, surrounding, bounces, is_bounced and layer > 0, b)
        _take(count, layer, is_bounced, b)


@lanewise
def _keep_of_coat(b):
    """T3 to T5, reduced by the shares that the surface and its surroundings block."""
    for k in range(0, 3 * BLOCK, BLOCK):
        b[T3 + k] = b[T3 + k] * b[T7]


@inner(fastmath=FAST)
def light_on_coat(count, surrounding, bounces, b):
    """T3 to T5: the light that clear coats mirror, for a block that is ready for `ambient`."""
    _look(count, COATING, b)
    _see(count, surrounding, bounces, bounces.grid[0] > 0, b)
    _keep_of_coat(count, b)


@lanewise
def _compose(b):
    alpha, unlit, through = clamp(b[ALPHA]), b[UNLIT], b[THROUGH]
    lights = through > 0
    tints = b.get(RED, GREEN, BLUE)
    smooth = through * (1 - b[ROUGH] * b[ROUGH])
    tint = clamp(least(least(tints[0], tints[1]), tints[2]))
    clear = where(lights, most(smooth * tint, 0), 0)
    shown, bent = least(alpha * 8, 1), b[BENT]
    for c, base in enumerate(tints):
        k = c * BLOCK
        behind = where(lights, b[T3 + k] * b[OPEN], 0)
        excess = where(lights, smooth * alpha * (1 - unlit) * most(base - tint, 0), 0)
        b[T0 + k] = excess * (1 - bent)
        b[T3 + k] = behind
        body = b[DR + k] + most(through * base - clear, 0) * behind
        value = body * alpha + (b[SR + k] + b[ER + k]) * shown
        value = value + unlit * (base * alpha * UNEXPOSED - value)
        value = value + bent * (excess * (b[BENT_X + k] - behind) + clear * alpha * (1 - unlit) * b[BENT_X + k])
        b[RED + k] = least(most(value, 0), BRIGHTEST)
    b[T7] = clear
    b[ALPHA] = alpha * (1 - clear * (1 - bent) * (1 - unlit))


@inner
def compose(count, b):
    """Replace the base colour by the light that the sample sends to the viewer: RED, GREEN, BLUE premultiplied, ALPHA its
    opacity.

    Thin glass transmits the background by the least of its three tints. For the excess of the other two tints, T0 to T2, the
    light of the surroundings on the line of sight, T3 to T5, is used until `lay` replaces it by the known background. The
    rougher the glass, the more of its light comes from the surroundings; the share BENT comes from the direction into which
    solid glass refracts it. A mirrored image does not become transparent with the surface (glass made by alpha), unless the
    surface is almost clear. Call `compose` right after `ambient`.
    """
    _compose(count, b)


@inner(fastmath=FAST)
def lay(pixel, i, b):
    """Composite a premultiplied, composed sample over the current value of a pixel (4,); coloured glass tints
    its background.
    """
    under, behind = f4(1) - b[ALPHA + i], pixel[3]
    pixel[0] = max(pixel[0] * (under + b[T0 + i]) + b[RED + i] - behind * b[T0 + i] * b[T3 + i], f4(0))
    pixel[1] = max(pixel[1] * (under + b[T1 + i]) + b[GREEN + i] - behind * b[T1 + i] * b[T4 + i], f4(0))
    pixel[2] = max(pixel[2] * (under + b[T2 + i]) + b[BLUE + i] - behind * b[T2 + i] * b[T5 + i], f4(0))
    pixel[3] = behind * under + b[ALPHA + i]


@lanewise
def _add_matte(b):
    lambert = most(dot(b.get(NX, NY, NZ), b.get(LX, LY, LZ)), 0) * (1 / math.pi) * b[SHARE]
    for k in range(0, 3 * BLOCK, BLOCK):
        b[DR + k] = b[DR + k] + b[BASE_R + k] * lambert * b[IR + k]


@inner
def add_light_matte(count, b):
    """The equivalent of `add_light` for a surface that only scatters, such as plain ground; BASE_R, BASE_G, BASE_B are its
    colour.
    """
    _add_matte(count, b)


@lanewise
def _open_matte(up, b):
    for k in range(3):
        row = k * BLOCK
        b[DR + row] = b[DR + row] + b[BASE_R + row] * up.one(k) * b[OPEN]


@lanewise
def _open_matte_bounced(up, b):
    for k in range(3):
        row = k * BLOCK
        light = up.one(k) * b[OPEN] * (1 - b[INSIDE]) + b[GLOW_R + row]
        b[DR + row] = b[DR + row] + b[BASE_R + row] * light


@inner
def ambient_matte(count, surrounding, is_bounced, b):
    """The equivalent of `ambient` for level ground that only scatters."""
    if is_bounced:
        _open_matte_bounced(count, surrounding.up, b)
    else:
        _open_matte(count, surrounding.up, b)
