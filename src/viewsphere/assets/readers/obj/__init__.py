"""Wavefront OBJ and its material libraries."""
