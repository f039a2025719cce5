"""Concrete slabs as a formula: the shade of a floor at any place, without a texture, filtered to the size of a pixel.

Value noise on a lattice that repeats (Lewis, *Algorithms for Solid Noise Synthesis*, 1989), of four wavelengths, and thin
joints. The shade depends only on the position, so that every renderer can show the same floor.
"""

from __future__ import annotations

from viewsphere.kernels.jit import njit
from viewsphere.kernels.lanes import FAST, Lanes, clamp, floor, lanewise, least, most, size
from viewsphere.rendering.ground.material import PERIOD

JOINT = 0.01
"""Width of a joint, in slabs."""

_OCTAVES = ((2, 0.10), (8, 0.08), (32, 0.10), (128, 0.16))  # lattice cells per slab, amplitude
_GAP = 0.4  # the share of light that a joint absorbs
_MEAN = 1 - 2 * _GAP * JOINT  # of the shade; joints cross in a negligible part
_MOST = 1e6  # slabs from the origin: farther away, the noise would be NaN


def shade(x: Lanes, y: Lanes, pixel: Lanes) -> Lanes:
    """The factor of the floor's colour, mean 1, at a place in slabs, averaged over `pixel` slabs across."""
    x, y = (most(least(v, _MOST), -_MOST) for v in (x, y))
    light = x.all(1 / _MEAN)
    for cells, amplitude in _OCTAVES:
        seen = clamp(1.6 - pixel * (1.2 * cells))
        light = light + seen * amplitude * _noise(x * cells, y * cells, PERIOD * cells - 1)
    width = least(most(pixel, JOINT), 0.5)
    dark = clamp(1 - size(x - floor(x + 0.5)) / width) + clamp(1 - size(y - floor(y + 0.5)) / width)
    return light * (1 - dark * (_GAP * JOINT) / width)


def _noise(x: Lanes, y: Lanes, mask: int) -> Lanes:
    """Noise between -1 and 1, smooth between lattice points; the lattice repeats after mask + 1 points."""
    left, top = floor(x), floor(y)
    across, down = (_smooth(v) for v in (x - left, y - top))
    columns, rows = ((i & mask, (i + 1) & mask) for i in (left.whole(), top.whole()))
    upper, lower = ((_value(columns[0], j), _value(columns[1], j)) for j in rows)
    first, second = (a + (b - a) * across for a, b in (upper, lower))
    return first + (second - first) * down


def _smooth(x: Lanes) -> Lanes:
    return x * x * (3 - 2 * x)


def _value(column: Lanes, row: Lanes) -> Lanes:
    """A pseudo-random number from -1 to 1 for each lattice point."""
    bits = (column * 0x2C1B3C6D) ^ (row * 0x297A2D39)
    return ((bits ^ (bits >> 15)) * 0x1B873593).real() * (1 / 2**31)


@lanewise
def _shades(x, y, pixel, out):
    out[0] = shade(x[0], y[0], pixel)


@njit(fastmath=FAST)
def shades(x, y, pixel, out):
    """Fill out (N,) float32 with `shade` at places x, y (N,) float32; N is a multiple of the lanes."""
    _shades(x.shape[0], x, y, pixel, out)
