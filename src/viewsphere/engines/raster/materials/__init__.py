"""Surfaces, their textures and mips, in the form that kernels read."""
