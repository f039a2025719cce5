"""The share of a light that reaches a sample if a view's map shows blockers: a blocker search, then a filter of matching width.

The method is percentage-closer soft shadows (Fernando 2005). A texel blocks only if it is between the sample and some part of
the light, as in backprojection (Guennebaud et al. 2006). The filter is a window of the map's own texels, on a coarser level for
a wider penumbra, so that nothing is random. The light has the shape and size that are visible from the sample.

The edge that hides part of a lamp is often slanted. Seen from beneath a table's edge, the part of the table top near the lamp
would hide far more than the edge does. So for lights at a place, a plane is fitted to the blockers. On each side, the filter is
as wide as the light seen past that plane.
"""

# ruff: isort: skip_file
from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numba as nb
from llvmlite import ir
from numba.core import cgutils
from numba.extending import intrinsic

from viewsphere.engines.raster.shading.kernels_block import (
    BLOCK, IB, IG, IR, OPENX, OPENY, OPENZ, PROBES, T1, T2, T3, T4, T5, T6, T7, U0, U1, V0, V1,
)  # fmt: skip
from viewsphere.kernels.lanes import (
    LANES, REAL, WHOLE, Lanes, Rows, clamp, lanewise, least, load, most, root, size, spread, where,
)  # fmt: skip
from viewsphere.engines.raster.shadows.kernels_shadow import (
    BIAS_NEAR, COARSEST, DARKER, DEPTH_AT, FINE, GAP, MIDDLE, MORE, ROUND, SIDES, SIZE, SPAN_U, SPAN_V, TILT,
)  # fmt: skip
from viewsphere.kernels.lanes import FAST
from viewsphere.kernels.jit import inner

f4 = nb.float32
U = nb.uintp
# Rows while a view is evaluated. They reuse rows of irradiance and of probes, filled later, and of texture coordinates, read
# before.
U_, V_, Q_, DU, DV, NEAR, SOFT, RADIUS, STATE, FACING = T1, T2, T3, T4, T5, T6, T7, IR, IG, IB
LEFT, TOP, TEXEL, TALL, REACH = U0, V0, U1, V1, PROBES + BLOCK
MEAN, SUM, COUNT = OPENX, OPENY, OPENZ
# Between the search and the filter: how the blockers' distance grows per texel. The rows' other contents are not needed then.
SLOPE_U, SLOPE_V = SUM, RADIUS
NARROW, WIDE = 6.5, 9.0  # texels: half widths of a filter that reads all texels, and above which it skips some. Chosen by sight


def span(form: Rows, b: Rows) -> Lanes:
    """Upper bound of half the light's width as seen from samples, across or down, in texels per q."""
    u, v, middle = b[U_], b[V_], form.one(MIDDLE)
    return most(form.one(SPAN_U) + size(u - middle) * form.one(MORE), form.one(SPAN_V) + size(v - middle) * form.one(MORE))


def power(x: Lanes) -> Lanes:
    """The greatest power of two that is at most x > 0."""
    return Lanes(x.builder, x.builder.bitcast((x.bits() & 0x7F800000).value, x.value.type))


class _Disc:
    """A distant light, a disc that looks the same from everywhere: half its size in texels per q."""

    def __init__(self, form: Rows, b: Rows) -> None:
        self.half = most(form.one(SIDES), 1e-3)
        self.q, self.near, self.du, self.dv = b.get(Q_, NEAR, DU, DV)
        # The first search, while STATE is above 1, covers blockers at any distance.
        self.farthest = where(b[STATE] > 1, math.inf, b[REACH] / self.half)

    def meet(self, z: Lanes, x: Lanes, y: Lanes) -> tuple[Lanes, Lanes, Lanes]:
        """The result of `_Light.meet`, but with the squared distance of the place from the sample as its last number."""
        gap = most(self.q - z, 0)
        return (z < self.near + self.du * x + self.dv * y) & (gap <= self.farthest), gap, x * x + y * y


class _Light:
    """A light at a place, as seen from samples: half its sizes along two axes, in texels per q, the matrix from texels to these
    axes, and the ratio of its bounding box to the half sizes.
    """

    def __init__(self, form: Rows, b: Rows) -> None:
        u, v = b[U_] - form.one(MIDDLE), b[V_] - form.one(MIDDLE)
        self.is_round = form.one(ROUND)
        is_round = self.is_round > 0
        # A ball looks like an ellipse, which gets longer with the distance from the map's middle.
        tilt = form.one(TILT)
        longer = root(1 + (u * u + v * v) * tilt)
        less = tilt / (longer * (longer + 1))
        # Parts of a rectangle's sides that point along the map's axis are foreshortened.
        au, av, aq, bu, bv, bq = (form.one(SIDES + k) for k in range(6))
        au, av, bu, bv = au - u * aq, av - v * aq, bu - u * bq, bv - v * bq
        long_a, long_b = most(root(au * au + av * av), 1e-3), most(root(bu * bu + bv * bv), 1e-3)
        self.half_a, self.half_b = long_a, where(is_round, long_a, long_b)
        per_a, per_b = 1 / long_a, 1 / long_b
        au, av, bu, bv = au * per_a, av * per_a, bu * per_b, bv * per_b
        sine = au * bv - av * bu
        per = 1 / where(sine < 0, least(sine, -0.1), most(sine, 0.1))  # seen from within its own plane the rectangle is a line
        self.u_to_a, self.v_to_a = where(is_round, 1 - u * u * less, bv * per), where(is_round, -u * v * less, -bu * per)
        self.u_to_b, self.v_to_b = where(is_round, -u * v * less, -av * per), where(is_round, 1 - v * v * less, au * per)
        self.stretch = where(is_round, longer, most(size(au) + size(bu), size(av) + size(bv)))
        # Texels beyond one by which the light's border is softened along a foreshortened axis.
        self.thin_a = most(most(size(self.u_to_a), size(self.v_to_a)) - 1, 0) * 0.5
        self.thin_b = most(most(size(self.u_to_b), size(self.v_to_b)) - 1, 0) * 0.5

        self.q, self.near, self.du, self.dv = b.get(Q_, NEAR, DU, DV)
        # The first search, while STATE is above 1, covers blockers at any distance.
        self.farthest = where(b[STATE] > 1, math.inf, b[REACH] / most(self.half_a, self.half_b))

    def meet(self, z: Lanes, x: Lanes, y: Lanes) -> tuple[Lanes, Lanes, Lanes, Lanes]:
        """The values for a texel of depth z (q) at (x, y) from the sample.

        They are: whether the texel is in front of the sample's plane, but not so far that its penumbra is wider than REACH; its
        distance in front of the sample in q; and its offsets along the light's axes.
        """
        gap = most(self.q - z, 0)
        is_nearer = (z < self.near + self.du * x + self.dv * y) & (gap <= self.farthest)
        return is_nearer, gap, size(self.u_to_a * x + self.v_to_a * y), size(self.u_to_b * x + self.v_to_b * y)


class _Sample(Rows):
    """A block in which every lane reads the same sample."""

    def __getitem__(self, row: Any) -> Lanes:
        return spread(self.builder, self.builder.load(self.builder.gep(self.data, [self._at(row)])))


def _over_window(*rows: int, sums: int = 2) -> Any:
    """Make a kernel function from a function of a view's form and a sample; it is called with `(depth, at, stride, form, b,
    i)`.

    The decorated function returns two functions. One maps q and place (from the sample, in the map's texels) of texels to
    `sums` numbers. The other maps the sums of these numbers over the window of sample i (uintp) to the values of `rows`. The
    window begins at depth[at], and its rows are `stride` apart (uintp).
    """

    def decorate(function: Callable[[Rows, Rows], tuple[Callable[..., tuple[Lanes, ...]], ...]]) -> Any:
        @intrinsic
        def summed(typing, depth, at, stride, form, b, i):
            def code(context, builder, signature, arguments):
                texels, numbers, block = (
                    context.make_array(signature.args[k])(context, builder, arguments[k]).data for k in (0, 3, 4)
                )
                first, along, own = (arguments[k] for k in (1, 2, 5))
                sample = _Sample(builder, block, own, None)
                texel, tell = function(Rows(builder, numbers, own, None), sample)
                order = Lanes(builder, ir.Constant(ir.VectorType(REAL, LANES), [float(k) for k in range(LANES)]))
                step = sample[TEXEL]
                middle = where(step > 1, step * 0.5, 0) + 0.5
                left, top = sample[LEFT] * step + middle - sample[U_], sample[TOP] * step + middle - sample[V_]
                kept = [cgutils.alloca_once_value(builder, order.all(0).value) for _ in range(sums)]
                high = builder.fptoui(builder.load(builder.gep(block, [builder.add(own, own.type(TALL))])), own.type)
                wide = builder.select(builder.icmp_unsigned(">", high, high.type(8)), high.type(16), high.type(8))
                with cgutils.for_range(builder, high) as row:
                    y = top + spread(builder, builder.uitofp(row.index, REAL)) * step
                    start = builder.add(first, builder.mul(row.index, along))
                    with cgutils.for_range_slice(builder, wide.type(0), wide, wide.type(LANES)) as (part, _):
                        x = left + (order + spread(builder, builder.uitofp(part, REAL))) * step
                        found = texel(load(builder, texels, builder.add(start, part)), x, y)
                        for place, value in zip(kept, found, strict=True):
                            builder.store((Lanes(builder, builder.load(place)) + value).value, place)
                told = tell(*(spread(builder, _total(builder, builder.load(place))) for place in kept))
                for row, lanes in zip(rows, told, strict=True):
                    value = builder.extract_element(lanes.value, WHOLE(0))
                    builder.store(value, builder.gep(block, [builder.add(own, own.type(row))]))
                return context.get_dummy_value()

            return nb.void(depth, nb.uintp, nb.uintp, form, b, nb.uintp), code

        return summed

    return decorate


def _total(builder: Any, lanes: Any) -> Any:
    kind = ir.FunctionType(REAL, [REAL, lanes.type])
    function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.vector.reduce.fadd.v{LANES}f32")
    return builder.call(function, [REAL(-0.0), lanes], fastmath=tuple(sorted(FAST)))


def _as_they_are(*totals: Lanes) -> tuple[Lanes, ...]:
    return totals


@_over_window(COUNT, SUM)
def _block(form, b):
    """COUNT of texels that hide part of a distant light, weighted less at its rim, and the SUM of their distances in q."""
    disc, step = _Disc(form, b), b[TEXEL]
    soft, half_per = b[SOFT] + step, 0.5 / step

    def texel(z, x, y):
        is_hit, gap, squared = disc.meet(z, x, y)
        reach = disc.half * gap + soft
        hit = where(is_hit, clamp((reach - squared / reach) * half_per), 0)
        return hit, hit * gap

    return texel, _as_they_are


@_over_window(COUNT, SUM)
def _filter(form, b):
    """SUM of the weights of texels in a filter as wide as a distant light past blockers at MEAN; COUNT of texels that let light
    pass.

    A blocker far behind others that are nearer to the light hides more than its own penumbra indicates.
    """
    disc, soft, step = _Disc(form, b), b[SOFT], b[TEXEL]
    radius, per = most(disc.half * b[MEAN], soft), 1 / step
    # A disc's edge is one texel wide: near the rim (1 - d^2 / r^2) r / 2 is about r - d.
    rim, fall = radius * per * 0.5 + 0.5, 0.5 * per / radius
    deep, near = disc.half * 3, soft + step
    left = 1 - least(b[COUNT], 1)  # blockers appear and vanish gradually

    def texel(z, x, y):
        is_hit, gap, squared = disc.meet(z, x, y)
        weight, reach = clamp(rim - squared * fall), deep * gap + near
        return where(is_hit & (squared <= reach * reach), weight * left, weight), weight

    return texel, _as_they_are


@_over_window(COUNT, MEAN, SLOPE_U, SLOPE_V, sums=10)
def _block_aslant(form, b):
    """COUNT of texels that hide part of the light, weighted less at its rim, and the plane that best fits their distances in q.

    MEAN is the plane's distance at the sample's own texel; the slopes are 0 if no plane fits.
    """
    light, step = _Light(form, b), b[TEXEL]
    soft, per = b[SOFT] + step, 1 / step
    soft_a, soft_b = soft + light.thin_a * step, soft + light.thin_b * step

    def texel(z, x, y):
        is_hit, gap, a, b = light.meet(z, x, y)
        reach_a, reach_b = light.half_a * gap + soft_a, light.half_b * gap + soft_b
        disc = clamp((reach_a * reach_a - a * a - b * b) * 0.5 * per / reach_a)
        square = clamp((reach_a - a) * per) * clamp((reach_b - b) * per)
        hit = where(is_hit, square + (disc - square) * light.is_round, 0)
        far, right, down = hit * gap, hit * x, hit * y
        return hit, far, right, down, right * x, right * y, down * y, far * x, far * y, far * gap

    def tell(n, g, x, y, xx, xy, yy, gx, gy, gg):
        per = 1 / most(n, 1e-6)
        g, x, y = g * per, x * per, y * per
        gx, gy, gg, xy = gx * per - g * x, gy * per - g * y, gg * per - g * g, xy * per - x * y
        # Blockers only one texel wide have no slope.
        least_wide = step * step * 0.25
        xx, yy = xx * per - x * x + least_wide, yy * per - y * y + least_wide
        scale = 1 / most(xx * yy - xy * xy, 1e-12)
        u, v = (gx * yy - gy * xy) * scale, (gy * xx - gx * xy) * scale
        fit = clamp((u * gx + v * gy) / most(gg, 1e-12) * 5 - 3.5)  # 0 if less than 0.7 of the variance is explained
        change = (u * x + v * y) * fit
        fit = fit * where(change * 3 > g * 2, g * (2 / 3) / most(change, 1e-12), 1)
        return n, g - (u * x + v * y) * fit, u * fit, v * fit

    return texel, tell


@_over_window(COUNT, SUM)
def _filter_aslant(form, b):
    """The equivalent of `_filter` past a plane of blockers, and without the part of the light below the sample's own plane."""
    light, soft, step = _Light(form, b), b[SOFT], b[TEXEL]
    mean, slope_u, slope_v, per = b[MEAN], b[SLOPE_U], b[SLOPE_V], 1 / step
    soft_a, soft_b = light.thin_a + 0.5, light.thin_b + 0.5
    nearest, bias = soft / light.half_a, light.q - light.near
    first, left = most(mean, nearest), 1 - least(b[COUNT], 1)
    deep_a, deep_b = light.half_a * 3, light.half_b * 3
    near_a, near_b = soft + step + light.thin_a * step, soft + step + light.thin_b * step

    def texel(z, x, y):
        is_hit, gap, a, b = light.meet(z, x, y)
        past = most(mean + slope_u * x + slope_v * y, nearest)
        is_above = most(past - bias, past * 0.5) + light.du * x + light.dv * y > 0
        radius_a, radius_b = light.half_a * past * per, most(light.half_b * past, soft) * per
        disc = clamp((radius_a + soft_a + 0.5) * 0.5 - (a * a + b * b) * (0.5 * per * per) / radius_a)
        square = clamp(radius_a + soft_a - a * per) * clamp(radius_b + soft_b - b * per)
        # Weight of a texel: the nearer the plane is to the sample there, the more of the light one texel represents.
        denser = least(first / past, 2)
        weight = (square + (disc - square) * light.is_round) * denser * denser * denser
        weight = where(is_above, weight, 0)
        reach_a, reach_b = deep_a * gap + near_a, deep_b * gap + near_b
        passes = is_hit & (a * a + b * b * light.is_round <= reach_a * reach_a) & (b <= reach_b)
        return where(passes, weight * left, weight), weight

    return texel, _as_they_are


@lanewise
def _start(is_fine, b):
    """REACH: the width of the widest penumbra considered."""
    radius = b[RADIUS]
    wide = power(radius * (1.999999 / NARROW)) * NARROW
    b[REACH] = where(radius * is_fine > WIDE, wide, most(radius, 1e-3))
    b[STATE] = 2


@lanewise
def _place_windows(radius, wide_from, margin, side, b):
    """Place the window of texels within a radius: 8 x 8, or 16 x 16 above `wide_from`, or fewer rows. radius: its row."""
    radius = b[radius]
    is_wide = radius > wide_from
    step = power(radius / where(is_wide, NARROW, 2.25) * 1.999999)  # the smallest power that makes the window wide enough
    step = most(least(step, power(side / COARSEST)), 1)
    rows = least((radius / step + margin).whole().real() * 2 + 2, where(is_wide, 16, 8))
    wide, last = where(rows > 8, 16, 8), (side / step).whole().real()
    middle = where(step > 1, step * 0.5, 0) + 0.5
    for row, place, count in ((LEFT, b[U_], wide), (TOP, b[V_], rows)):
        first = ((place - middle) / step).whole().real() - count * 0.5 + 1
        b[row] = least(most(first, 0), last - count)
    b[TEXEL], b[TALL] = step, rows


@lanewise
def _tell_blocked(form, b):
    """MEAN distance of the blockers, and RADIUS of the penumbra of blockers at this distance."""
    mean = b[SUM] / most(b[COUNT], 1)
    b[MEAN], b[SUM] = mean, 0
    b[RADIUS] = most(_Disc(form, b).half * mean, b[SOFT])


@lanewise
def _tell_width(form, row, b):
    """Store the radius of the penumbra of blockers at MEAN in `row`."""
    light = _Light(form, b)
    b[row] = most(most(light.half_a, light.half_b) * b[MEAN], b[SOFT]) * light.stretch


@lanewise
def _tell_filtered(form, b):
    """STATE: the minimum share of light so far; REACH: halved for the next search, 0 if the filter was narrow."""
    whole, reach = b[SUM], b[REACH]
    hidden = where(whole > 0, 1 - b[COUNT] / most(whole, 1e-6), 0)
    # Narrow filters most often confuse lit places in front of a wall with this one; wide penumbrae are darkened only slightly.
    darker = 1 + (form.one(DARKER) - 1) * most(clamp(3 - b[RADIUS] / b[SOFT]), 0.15)
    b[STATE] = least(b[STATE], most(1 - hidden * darker, 0))
    b[REACH] = where(reach > WIDE, reach * 0.5, 0)


@inner
def _begin(grid, i, b):
    """Index in `depth` at which a sample's window begins, and the distance between rows of the window."""
    step, level = nb.int64(b[U(TEXEL) + i]), U(0)
    while step >> nb.int64(level) > 1:
        level += U(1)
    stride = (grid[SIZE] >> nb.int64(level)) + GAP
    return U(grid[U(DEPTH_AT) + level] + nb.int64(b[U(TOP) + i]) * stride + nb.int64(b[U(LEFT) + i])), U(stride)


@inner(fastmath=FAST)
def search(count, form, grid, depth, b):
    """STATE of samples on a view's map that may be in a penumbra: the share of the light that reaches them.

    form, grid: a view's rows of `Views`. RADIUS: the distance in texels within which there may be blockers.
    """
    side, fine, is_near = f4(grid[SIZE]), form[FINE], form[BIAS_NEAR] > f4(0)
    none = f4(0) if fine > f4(0) else f4(math.inf)
    _start(count, fine, b)
    left = 1
    while left > 0:
        left = 0
        _place_windows(count, U(REACH), none + f4(WIDE), f4(0.75), side, b)
        for i in range(U(count)):
            b[U(COUNT) + i], b[U(SUM) + i] = f4(0), f4(0)
            if b[U(REACH) + i] > f4(0):
                at, stride = _begin(grid, i, b)
                if is_near:
                    _block_aslant(depth, at, stride, form, b, i)
                else:
                    _block(depth, at, stride, form, b, i)
                left += 1 if b[U(REACH) + i] > f4(WIDE) else 0
        left = 0 if fine == f4(0) else left
        radius = U(TALL if is_near else RADIUS)
        if is_near:
            _tell_width(count, form, radius, b)
        else:
            _tell_blocked(count, form, b)
        _place_windows(count, radius, none + f4(2.5), f4(0.5), side, b)
        for i in range(U(count)):
            if b[U(COUNT) + i] > f4(0):
                at, stride = _begin(grid, i, b)
                if is_near:
                    _filter_aslant(depth, at, stride, form, b, i)
                else:
                    _filter(depth, at, stride, form, b, i)
        if is_near:
            _tell_width(count, form, U(RADIUS), b)
        _tell_filtered(count, form, b)
