"""How numba is used: jit, its cache, faster compilation. Nothing about pictures."""
