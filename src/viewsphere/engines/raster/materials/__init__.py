"""Surfaces, their textures and mips, as kernels read them."""
