"""Pixels to bytes and back: PNG, TIFF, OpenEXR, NPZ, and what Pillow and imagecodecs write."""
