"""Kernel compilation with numba: jit, its cache, faster compilation. This package has no code for pictures."""
