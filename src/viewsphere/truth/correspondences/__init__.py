"""Correspondences between pictures: for each pixel, the place of its point in another picture."""
