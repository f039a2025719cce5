"""Whole data sets: import, conversion, merge and repair."""
