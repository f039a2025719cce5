"""Weighted sums of a table's rows, all columns at once, written so that the compiler puts the numbers in vectors."""

from __future__ import annotations

from typing import Any

import numba as nb
from numba.core import cgutils
from numba.extending import intrinsic

from viewsphere.engines.raster.shading.kernels_block import BLOCK
from viewsphere.kernels.lanes import load, scatter, spread


def blend(columns: int) -> Any:
    """A function for kernels, `(table, rows, weights, b, at)`, for tables with this many columns.

    table: float32, any shape; rows and weights: tuples of equal length, of uintp and float32. The sum of weight * row goes to
    b[at], b[at + BLOCK] and so on, one column each.
    """

    @intrinsic
    def weighted(typing, table, rows, weights, b, at):
        def code(context, builder, signature, arguments):
            source, target = (context.make_array(signature.args[k])(context, builder, arguments[k]).data for k in (0, 3))
            places, shares = (cgutils.unpack_tuple(builder, arguments[k]) for k in (1, 2))
            terms = [
                load(builder, source, builder.mul(place, place.type(columns)), columns) * spread(builder, share, columns)
                for place, share in zip(places, shares, strict=True)
            ]
            scatter(target, arguments[4], {k: k * BLOCK for k in range(columns)}, sum(terms[1:], terms[0]))
            return context.get_dummy_value()

        return nb.void(table, rows, weights, b, nb.uintp), code

    return weighted
