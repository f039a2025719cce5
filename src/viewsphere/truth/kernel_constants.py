"""Numbers shared by kernels and their callers; importing them compiles nothing and does not load numba."""

from __future__ import annotations

FOUR = 4
"""Number of pixels that kernels process together."""

NEARER = 1.0 + 2.0**-22
"""Factor by which 1/z of a surface must exceed that of the surface seen so far to replace it; surfaces closer to each other
count as coincident. Its excess over 1 is four times the rounding of the models' float32 coordinates, which split one plane into
two, and of float32 depth.
"""

STILL, RIGID, OTHER, GONE = 0, 1, 2, 3
"""Changes of a thing between two views; kernels leave pixels of OTHER things, which deform, unchanged."""
