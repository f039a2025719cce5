"""Blender as a program of its own: which interpreter has it, starting it, speaking to it."""
