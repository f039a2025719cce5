"""Blender as a program of its own: finding its interpreter, starting it, sending it requests."""
