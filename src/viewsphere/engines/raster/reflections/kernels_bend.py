"""Solid glass: the source of the light that it refracts towards the viewer.

Behind the first surface on a line of sight, the refracted ray is followed through all solid glass, by Snell's law at each
surface, until it leaves the last one. So walls, lips and thick floors look as in a path tracer. The reflected part of a ray
that passes is not followed; the ray replaces it, too.
"""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from viewsphere.engines.raster.materials.kernels_material import L_BENDS, L_BLUE, L_GREEN, L_RED, L_TRANSMISSION
from viewsphere.engines.raster.reflections.kernels_trace import DEEP, nearest, triangle
from viewsphere.engines.raster.shading.kernels_block import (
    BENT,
    BENT_X,
    BENT_Y,
    BENT_Z,
    NX,
    NY,
    NZ,
    PIXEL,
    PX,
    PY,
    PZ,
    SIDE,
    STAIN_B,
    STAIN_G,
    STAIN_R,
    VX,
    VY,
    VZ,
)  # fmt: skip
from viewsphere.kernels.jit import inner

f4 = nb.float32
U = nb.uintp
FAR = np.float32(1e9)
MOST = 8  # surfaces that a ray hits before it counts as trapped
APART = np.float32(0.02)  # offset from a surface at which a ray continues, in pixels
STRAIGHT, ASTRAY = np.float32(0.995), np.float32(0.9)  # cosines between which bent light replaces that from behind


@inner
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inner
def _along(a, s, b, t):
    """The vector a s + b t."""
    return a[0] * s + b[0] * t, a[1] * s + b[1] * t, a[2] * s + b[2] * t


@inner
def _turned(d, n, ratio):
    """The ray that leaves a surface whose unit normal faces it, and whether it passes; if not, it is totally reflected. ratio:
    index of refraction before the surface over the index behind it.
    """
    cosine = min(-_dot(d, n), f4(1))
    squared = f4(1) - ratio * ratio * (f4(1) - cosine * cosine)
    if squared <= f4(0):
        return _along(d, f4(1), n, f4(2) * cosine), False
    return _along(d, ratio, n, ratio * cosine - f4(math.sqrt(squared))), True


@inner
def _normal(glass, found, o):
    """The normals at a point of a triangle: the flat normal, of any length, and the smooth unit normal on the same side."""
    corner, one, two = triangle(glass, found)
    normals, at = glass.normals[U(found)], (o[0] - corner[0], o[1] - corner[1], o[2] - corner[2])
    aa, ac, cc, qa, qc = _dot(one, one), _dot(one, two), _dot(two, two), _dot(at, one), _dot(at, two)
    scale = f4(1) / max(aa * cc - ac * ac, f4(1e-30))
    g, h = (cc * qa - ac * qc) * scale, (aa * qc - ac * qa) * scale
    f = f4(1) - g - h
    x = normals[U(0)] * f + normals[U(3)] * g + normals[U(6)] * h
    y = normals[U(1)] * f + normals[U(4)] * g + normals[U(7)] * h
    z = normals[U(2)] * f + normals[U(5)] * g + normals[U(8)] * h
    per = f4(1) / f4(math.sqrt(x * x + y * y + z * z + f4(1e-20)))
    flat = one[1] * two[2] - one[2] * two[1], one[2] * two[0] - one[0] * two[2], one[0] * two[1] - one[1] * two[0]
    return flat, (x * per, y * per, z * per)


@inner
def _follow(glass, looks, o, d, apart, stack):
    """The direction in which a ray within glass finally leaves it, the colour it takes on inside, and the share that is not
    scattered: 0 if the glass is not closed. A ray trapped in the glass is black.
    """
    red, green, blue, clear, is_within = f4(1), f4(1), f4(1), f4(1), True
    for _ in range(MOST):
        o = _along(o, f4(1), d, apart)
        found, t = nearest(glass, o, d, FAR, False, stack)
        if found < 0:
            return d, (red, green, blue), f4(0) if is_within else clear
        o = _along(o, f4(1), d, t)
        flat, n = _normal(glass, found, o)
        look = looks[U(glass.material[U(found)])]
        leaves = _dot(flat, d) > f4(0)
        if leaves:
            n = -n[0], -n[1], -n[2]
        if _dot(n, d) > f4(-1e-3):  # the smooth normal faces away: the ray grazes the surface
            n = _along(n, f4(1), d, -_dot(n, d) - f4(1e-3))
            per = f4(1) / f4(math.sqrt(_dot(n, n)))
            n = n[0] * per, n[1] * per, n[2] * per
        index = look[U(L_BENDS)]
        d, passes = _turned(d, n, index if leaves else f4(1) / index)
        if passes:
            is_within = not leaves
            red, green, blue = red * look[U(L_RED)], green * look[U(L_GREEN)], blue * look[U(L_BLUE)]
            clear *= look[U(L_TRANSMISSION)]
    return d, (f4(0), f4(0), f4(0)), clear


@inner(_nrt=True)
def bend(count, glass, looks, b, which):
    """Refract the light of gathered samples that show the outside of solid glass.

    BENT_X to BENT_Z are the direction of the bent light, STAIN_R to STAIN_B its colour after further surfaces. BENT is its
    share, 0 to 1, instead of the light from straight behind; it is 0 for other samples.
    """
    stack = np.empty((DEEP, 2), np.float32)
    for i in range(U(count)):
        index = looks[U(which[i]), U(L_BENDS)]
        b[U(BENT) + i] = f4(0)
        if index == f4(0) or b[U(SIDE) + i] < f4(0):
            continue
        n = b[U(NX) + i], b[U(NY) + i], b[U(NZ) + i]
        ray = -b[U(VX) + i], -b[U(VY) + i], -b[U(VZ) + i]
        inside, _ = _turned(ray, n, f4(1) / index)
        d, stain, clear = _follow(
            glass, looks, (b[U(PX) + i], b[U(PY) + i], b[U(PZ) + i]), inside, APART * b[U(PIXEL) + i], stack
        )
        b[U(BENT_X) + i], b[U(BENT_Y) + i], b[U(BENT_Z) + i] = d
        b[U(STAIN_R) + i], b[U(STAIN_G) + i], b[U(STAIN_B) + i] = stain
        share = min(max((STRAIGHT - _dot(d, ray)) / (STRAIGHT - ASTRAY), f4(0)), f4(1))
        b[U(BENT) + i] = clear * share * share * (f4(3) - f4(2) * share)
